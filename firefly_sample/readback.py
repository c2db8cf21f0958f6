"""From the bytes of a plan's targets to the images of a Frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.frame import OUTPUTS, Image
from firefly_sample.lab.reference.gbuffer import (
    decode_albedo,
    decode_normal,
    decode_shininess,
    unpack_ten_bits,
)
from firefly_sample.lab.reference.one_light import GBuffer
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.plan.targets import FORMATS, stored_dtype, stored_fractions
from firefly_sample.planar import copy_channels, empty_planar, planar
from firefly_sample.srgb import srgb_to_linear

Float64 = NDArray[np.float64]
Read = Callable[[str], bytes]

_WITHOUT_STEEP = 0x7FFFFFFF
"""Mask of a triangle's number without its mark: see ``shaders/include/steep.glsl``."""
_INVALID = {"depth": np.inf, "position": np.nan, "position_world": np.nan, "id": -1, "visibility": -1}
"""Where nothing was drawn; 0 in the others."""
_OCTAHEDRAL = {"snorm16": (1.0, 0.0), "unorm16": (2.0, 1.0), "unorm8": (255.0 / 127.0, 1.0)}
"""From stored fractions to -1..1."""
_OWN_SIZE = ("shadow_atlas", "particle_shadow_atlas")
_BAND = 1 << 16
"""Pixels that are decoded at a time: their float64 stay in a processor's cache."""
_WIDEST = 16
"""Bytes of a texel of the widest format."""


def read_images(plan: FramePlan, read: Read) -> dict[str, Image]:
    """The outputs of a plan, first row on top.

    Parameters
    ----------
    read : callable
        ``read(target)`` gives that target's bytes, first row at the bottom.
    """
    read = cache(read)
    return {name: _read_image(plan, read, name) for name in plan.outputs}


def _read_image(plan: FramePlan, read: Read, name: str) -> Image:
    """One output in C order, a band of rows at a time."""
    width, height = _image_size(plan, name)
    info = OUTPUTS[name]
    image: Image = np.empty((height, width, info.channels), info.dtype)
    step = max(_BAND // max(width, 1), 1)
    for top in range(0, height, step):
        rows = slice(top, top + step)
        band = Surface(plan, read, rows).image(name)
        copy_channels(band if info.channels > 1 else band[..., None], image[rows])
    return image if info.channels > 1 else image[..., 0]


def _image_size(plan: FramePlan, name: str) -> tuple[int, int]:
    """Width and height of an output; 0x0 of an atlas that is not there."""
    if name in _OWN_SIZE:
        return plan.target_size(name) if plan.target(name) is not None else (0, 0)
    return plan.view.size if OUTPUTS[name].sampled else plan.size


def targets_read(plan: FramePlan) -> tuple[str, ...]:
    """The targets that `read_images` asks for, whatever is in them: found by reading a pixel of zeros."""
    names: list[str] = []

    def read(name: str) -> bytes:
        names.append(name)
        return bytes(_WIDEST)

    pixel = replace(
        plan,
        size=(1, 1),
        view=replace(plan.view, size=(1, 1)),
        targets=tuple(replace(target, size=None) for target in plan.targets),
    )
    read_images(pixel, read)
    return tuple(names)


class Surface:
    """The G-buffer of one plan, decoded in float64 as far as it is asked for.

    Parameters
    ----------
    read : callable
        As `read_images` takes it.
    rows : slice
        Which rows of every image, counted from the top.
    """

    def __init__(self, plan: FramePlan, read: Read, rows: slice = slice(None)) -> None:
        self._plan = plan
        self._read = cache(read)
        self._rows = rows

    def raw(self, target: str, dtype: Any, channels: int) -> NDArray[Any]:
        """A target's values, shape (height, width[, channels]), first row on top."""
        width, height = self._plan.target_size(target)
        values = np.frombuffer(self._read(target), dtype=dtype).reshape(height, width, -1)[::-1][self._rows]
        return values[..., 0] if channels == 1 else values[..., :channels]

    def image(self, name: str) -> NDArray[Any]:
        """One of `firefly_sample.frame.OUTPUTS`, float64 where it is computed from what is stored."""
        if name in ("color", "volumes", "wireframe"):
            return self._stored(name, name, np.uint8)
        if name == "radiance":
            return self._stored(name, "final_radiance", np.float32)
        if name == "shadow_atlas":
            return self._stored(name, name, np.float32)
        if name == "particle_shadow_atlas":
            return self._volume()
        if not self._plan.batches:
            return self._nothing(name)
        if name == "overdraw":
            return self._stored(name, name, np.float32)
        if name == "light" and self._plan.target(name) is not None:
            return self._where_covered(planar(self._stored(name, name, np.float32)), 0.0)
        if name == "albedo":
            return self.albedo()
        if name == "specular":
            return self._highlights()
        if name == "shininess":
            return self._shininess()
        if name in ("light", "emission"):
            return self._stored(name, name, np.float32)
        if name == "id":
            return self.raw("id", np.int32, 1) - 1
        if name == "visibility":
            stored = planar(self.raw("visibility", np.int32, 2)) & _WITHOUT_STEEP
            return np.where(stored[..., :1] == 0, -1, stored - (1, 0))
        if name == "depth":
            return self.distance()
        if name == "normal":
            return self.normal()
        if name == "normal_world":
            return self._to_world(self.unit_normal(), True, point=False)
        return self._to_world(self.position(), name.endswith("world"), point=True)

    def _stored(self, name: str, target: str, dtype: Any) -> NDArray[Any]:
        """A target as it is, which the frame may do without."""
        if self._plan.target(target) is None:
            return self._nothing(name)
        return self.raw(target, dtype, OUTPUTS[name].channels)

    def _volume(self) -> NDArray[Any]:
        """The slices of the shadow of particles, three colours that may be the same."""
        target = self._plan.target("particle_shadow_atlas")
        if target is None:
            return self._nothing("particle_shadow_atlas")
        channels = min(FORMATS[target.format].components, 3)
        values = self._floats("particle_shadow_atlas", channels)
        return np.broadcast_to(values[..., None], (*values.shape, 3)) if channels == 1 else values

    def _nothing(self, name: str) -> NDArray[Any]:
        width, height = _image_size(self._plan, name)
        channels = OUTPUTS[name].channels
        shape = (height, width) if channels == 1 else (height, width, channels)
        return np.broadcast_to(_INVALID.get(name, 0.0), shape)[self._rows]

    def _to_world(self, values: Float64, world: bool, point: bool) -> Float64:
        if not world:
            return values
        matrix = self._plan.view.view_to_world
        x, y, z = (values[..., axis] for axis in range(3))
        turned = empty_planar(values.shape[:-1], 3)
        for axis in range(3):
            # sums, for the last digit of a matrix product depends on the processor
            moved = matrix[3, axis] if point else 0.0
            turned[..., axis] = x * matrix[0, axis] + y * matrix[1, axis] + z * matrix[2, axis] + moved
        return turned

    def _floats(self, target: str, channels: int) -> Float64:
        """What shaders read of a target, in float64: normalised codes as fractions, sRGB codes decoded."""
        made = self._plan.target(target)
        assert made is not None
        form = FORMATS[made.format]
        stored = self.raw(target, stored_dtype(form), channels)
        fractions = stored_fractions(form, stored if channels == 1 else planar(stored))
        if form.srgb:
            fractions[..., :3] = srgb_to_linear(fractions[..., :3])
        return fractions

    def _colors(self, target: str) -> Float64:
        made = self._plan.target(target)
        assert made is not None
        if made.packing == "root10":
            return decode_albedo(unpack_ten_bits(self.raw(target, np.uint32, 1)))
        stored = self._floats(target, 4)[..., :3]
        return stored if made.packing == "linear" else decode_albedo(stored)

    def albedo(self) -> Float64:
        """Linear reflectance; in the classic look, as stored."""
        return self._colors("albedo")

    def ambient_albedo(self) -> Float64:
        """Linear reflectance of ambient light: the albedo, unless a material in view has its own."""
        if self._plan.target("ambient_albedo") is None:
            return self.albedo()
        return self._colors("ambient_albedo")

    def specular(self) -> Float64:
        """Linear reflectance of highlights, and shininess, shape (height, width, 4); 0 without any."""
        both = empty_planar(self._highlights().shape[:-1], 4)
        both[..., :3], both[..., 3] = self._highlights(), self._shininess()
        return both

    def _highlights(self) -> Float64:
        if self._plan.target("specular") is None:
            return self._nothing("specular")
        return decode_albedo(self._floats("specular", 3))

    def _shininess(self) -> Float64:
        if self._plan.target("specular") is None:
            return self._nothing("shininess")
        return decode_shininess(self._floats("specular", 4)[..., 3])

    def normal(self) -> Float64:
        """Unit normals in view space, 0 where nothing was drawn; classic ones as stored, not decoded."""
        target = self._plan.target("normal")
        assert target is not None
        return self._floats("normal", 3) if target.packing == "undecoded" else self.unit_normal()

    def unit_normal(self) -> Float64:
        """Unit normals in view space, 0 where nothing was drawn."""
        target = self._plan.target("normal")
        assert target is not None
        stored = self._floats("normal", 2 if target.packing in _OCTAHEDRAL else 3)
        if target.packing in _OCTAHEDRAL:
            scale, offset = _OCTAHEDRAL[target.packing]
            unit = decode_normal(stored * scale - offset)
        else:
            long = stored if target.packing == "plain" else stored * 2.0 - 1.0
            if target.packing == "undecoded":  # in OpenGL's view axes: shaders/include/gbuffer.glsl
                long = long[..., (0, 2, 1)] * (1.0, -1.0, 1.0)
            unit = long / np.maximum(np.linalg.norm(long, axis=-1, keepdims=True), 1e-30)
        return self._where_covered(unit, 0.0)

    def _where_covered(self, values: NDArray[Any], invalid: float) -> NDArray[Any]:
        return np.where(self.covered()[..., None], values, invalid)

    def covered(self) -> NDArray[np.bool_]:
        """Where something was drawn."""
        if self._plan.target("coverage") is not None:
            return np.asarray(self.raw("coverage", np.uint8, 1) > 0)
        albedo = self._plan.target("albedo")
        if albedo is not None and albedo.packing == "root10":
            return np.asarray(self.raw("albedo", np.uint32, 1) != 0)
        if albedo is not None:
            return np.asarray(self._floats("albedo", 4)[..., 3] > 0)
        return np.asarray(self.raw("distance", np.float32, 1) != 0)

    def distance(self) -> Float64:
        """Distance along the view axis, infinity where nothing was drawn."""
        if self._plan.target("distance") is not None:
            y = self.raw("distance", np.float32, 1).astype(np.float64)
        elif self._plan.target("position") is not None:
            y = self._floats("position", 3)[..., 1]
        else:
            y = self._plan.view.lens.distance_from_depth(self.raw("depth", np.float32, 1))
        return np.where(self.covered(), y, np.inf)

    def position(self) -> Float64:
        """View-space positions through the pixels' centres, NaN where nothing was drawn."""
        if not self._plan.batches:
            return self._nothing("position")
        if self._plan.target("position") is not None:
            return self._where_covered(self._floats("position", 3), np.nan)
        y = self.distance()
        known = np.isfinite(y)
        place = self._plan.view.lens.view_from_distance(*self._ndc(), np.where(known, y, 1.0))
        return np.where(known[..., None], place, np.nan)

    def _ndc(self) -> tuple[Float64, Float64]:
        """Return the NDC of the pixels' centres: x of each column, (1, width), y of each row, (height, 1)."""
        width, height = self._plan.view.size
        ndc_x = (np.arange(width) + 0.5) / (width / 2) - 1.0
        ndc_y = 1.0 - (np.arange(height) + 0.5) / (height / 2)
        return np.asarray(ndc_x[None]), np.asarray(ndc_y[self._rows, None])

    def to_eye(self) -> Float64:
        """Unit vectors from each pixel's surface to the eye, view space."""
        lens = self._plan.view.lens
        ray = lens.view_from_distance(*self._ndc(), 1.0)
        if not lens.perspective:
            return np.broadcast_to((0.0, -1.0, 0.0), ray.shape)
        return np.asarray(-ray / np.linalg.norm(ray, axis=-1, keepdims=True))

    def gbuffer(self) -> GBuffer:
        """All of it, as the float64 reference takes it."""
        specular = self.specular()
        return GBuffer(
            position=self.position(),
            normal=self.unit_normal(),
            to_eye=self.to_eye(),
            albedo=self.albedo(),
            specular=specular[..., :3],
            shininess=specular[..., 3],
        )
