"""From the bytes of a plan's targets to the images of a Frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.frame import OUTPUTS, Image
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.reference.gbuffer import decode_albedo, decode_normal

__all__ = ["Surface", "read_images"]

Float64 = NDArray[np.float64]
Read = Callable[[str], bytes]

_INVALID = {"albedo": 0.0, "normal": 0.0, "normal_world": 0.0, "depth": np.inf, "id": -1}


def read_images(plan: FramePlan, read: Read) -> dict[str, Image]:
    """The outputs of a plan, first row on top.

    Parameters
    ----------
    read : callable
        ``read(target)`` gives that target's bytes, first row at the bottom.
    """
    surface = Surface(plan, read)
    images: dict[str, Image] = {}
    for name in plan.outputs:
        if name == "color":
            images[name] = np.ascontiguousarray(surface.raw("color", np.uint8, 4)[..., :3])
        elif name == "radiance":
            images[name] = np.ascontiguousarray(surface.raw("final_radiance", np.float32, 4)[..., :3])
        else:
            images[name] = np.ascontiguousarray(surface.image(name).astype(OUTPUTS[name].dtype))
    return images


class Surface:
    """The G-buffer of one plan, decoded in float64 as far as it is asked for."""

    def __init__(self, plan: FramePlan, read: Read) -> None:
        self._plan = plan
        self._read = read
        self._kept: dict[str, NDArray[Any]] = {}

    def raw(self, target: str, dtype: Any, channels: int) -> NDArray[Any]:
        """A target's values, shape (height, width[, channels]), first row on top."""
        size = self._plan.view.size if target not in ("color", "final_radiance") else self._plan.size
        if target not in self._kept:
            values = np.frombuffer(self._read(target), dtype=dtype).reshape(size[1], size[0], -1)
            self._kept[target] = values[::-1]
        values = self._kept[target][..., :channels]
        return values[..., 0] if channels == 1 else values

    def image(self, name: str) -> NDArray[Any]:
        """One of the outputs that come from the G-buffer, float64 (int64 for "id")."""
        if not self._plan.batches:
            return self._nothing(name)
        if name == "albedo":
            return self.albedo()
        if name == "id":
            return self.raw("id", np.uint32, 1).astype(np.int64) - 1
        if name == "depth":
            return self.distance()
        if name in ("normal", "normal_world"):
            return self._to_world(self.normal(), name.endswith("world"), point=False)
        return self._to_world(self.position(), name.endswith("world"), point=True)

    def _nothing(self, name: str) -> NDArray[Any]:
        width, height = self._plan.view.size
        channels = OUTPUTS[name].channels
        shape = (height, width) if channels == 1 else (height, width, channels)
        return np.full(shape, _INVALID.get(name, np.nan))

    def _to_world(self, values: Float64, world: bool, point: bool) -> Float64:
        if not world:
            return values
        matrix = self._plan.view.view_to_world
        turned = values @ matrix[:3, :3]
        return turned + matrix[3, :3] if point else turned

    def albedo(self) -> Float64:
        """Linear reflectance; in the classic look, as stored."""
        stored = self.raw("albedo", np.uint8, 4)[..., :3] / 255.0
        return np.asarray(stored) if self._plan.settings.look == "classic" else decode_albedo(stored)

    def normal(self) -> Float64:
        """Unit normals in view space, 0 where nothing was drawn; classic ones as stored, not decoded."""
        target = self._plan.target("normal")
        assert target is not None
        if target.format == "rgba8":
            return np.asarray(self.raw("normal", np.uint8, 4)[..., :3] / 255.0)
        if target.format == "rg16_snorm":
            encoded = np.maximum(self.raw("normal", np.int16, 2) / 32767.0, -1.0)
        else:
            encoded = self.raw("normal", np.uint16, 2) / 65535.0 * 2.0 - 1.0
        return np.where(self.covered()[..., None], decode_normal(encoded), 0.0)

    def covered(self) -> NDArray[np.bool_]:
        """Where something was drawn."""
        if self._plan.target("albedo") is not None:
            return np.asarray(self.raw("albedo", np.uint8, 4)[..., 3] > 0)
        return np.asarray(self.raw("distance", np.float32, 1) != 0)

    def distance(self) -> Float64:
        """Distance along the view axis, infinity where nothing was drawn."""
        if self._plan.target("distance") is not None:
            y = self.raw("distance", np.float32, 1).astype(np.float64)
        else:
            y = self._plan.view.lens.distance_from_depth(self.raw("depth", np.float32, 1))
        return np.where(self.covered(), y, np.inf)

    def position(self) -> Float64:
        """View-space positions through the pixels' centres, NaN where nothing was drawn."""
        if not self._plan.batches:
            return self._nothing("position")
        width, height = self._plan.view.size
        ndc_x = (np.arange(width) + 0.5) / (width / 2) - 1.0
        ndc_y = 1.0 - (np.arange(height) + 0.5) / (height / 2)
        y = self.distance()
        known = np.isfinite(y)
        place = self._plan.view.lens.view_from_distance(ndc_x[None], ndc_y[:, None], np.where(known, y, 1.0))
        return np.where(known[..., None], place, np.nan)
