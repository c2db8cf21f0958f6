"""From the bytes of a plan's targets to the images of a Frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.frame import OUTPUTS, Image
from firefly_sample.packing import (
    decode_albedo,
    decode_metallic_roughness,
    decode_normals,
    decode_shininess,
    decode_viewer,
    unpack_ten_bits,
)
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.plan.targets import FORMATS, Target, mask_target, stored_dtype, stored_fractions
from firefly_sample.planar import copy_channels, empty_planar, planar
from firefly_sample.srgb import srgb_to_linear

Float64 = NDArray[np.float64]
Read = Callable[[str], bytes]

_WITHOUT_STEEP = 0x7FFFFFFF
"""Mask of a triangle's number without its mark: see ``shaders/include/steep.glsl``."""
_INVALID = {"depth": np.inf, "position": np.nan, "position_world": np.nan, "id": -1, "visibility": -1}
"""Values where nothing was drawn; 0 in the others."""
_OWN_SIZE = ("shadow_atlas", "particle_shadow_atlas")
_BAND = 1 << 16
"""Pixels that are decoded at a time: their float64 stay in a processor's cache."""


@dataclass(frozen=True, eq=False)
class GBuffer:
    """The surface at each pixel, float64; shapes (..., 3), and (...) of the last three.

    `position` is in view space, NaN where nothing was drawn; `normal` and `to_eye` are unit vectors in view
    space; `albedo` and `specular` are linear. Where `metallic` is not below 0 the surface is a
    metallic-roughness one, and `albedo` its base colour; elsewhere `metallic` is -1 and `roughness` 1.
    """

    position: Float64
    normal: Float64
    to_eye: Float64
    albedo: Float64
    specular: Float64
    shininess: Float64
    metallic: Float64
    roughness: Float64


def read_images(plan: FramePlan, read: Read) -> dict[str, Image]:
    """Return the outputs of a plan, first row on top; `read` returns a target's bytes, last row first."""
    read = cache(read)
    return {name: _read_image(plan, read, name) for name in plan.outputs}


def _read_image(plan: FramePlan, read: Read, name: str) -> Image:
    """Return one output in C order, decoded a band of rows at a time."""
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
    """Return the width and height of an output; 0x0 of an atlas that is not there."""
    if name in _OWN_SIZE:
        return plan.target_size(name) if plan.target(name) is not None else (0, 0)
    return plan.view.size if OUTPUTS[name].sampled else plan.size


def targets_read(plan: FramePlan) -> tuple[str, ...]:
    """Return the targets that `read_images` asks for."""
    return tuple(dict.fromkeys(name for output in plan.outputs for name in plan.sources[output]))


class Surface:
    """The G-buffer of one plan, decoded in float64 as far as it is asked for.

    `read` is as for `read_images`; `rows` are those of every image that are decoded, counted from the top.
    """

    def __init__(self, plan: FramePlan, read: Read, rows: slice = slice(None)) -> None:
        self._plan = plan
        self._read = cache(read)
        self._rows = rows

    def raw(self, target: str, dtype: Any, channels: int) -> NDArray[Any]:
        """Return a target's values, shape (height, width[, channels]), first row on top."""
        width, height = self._plan.target_size(target)
        values = np.frombuffer(self._read(target), dtype=dtype).reshape(height, width, -1)[::-1][self._rows]
        return values[..., 0] if channels == 1 else values[..., :channels]

    def image(self, name: str) -> NDArray[Any]:
        """Return one of the plan's outputs, float64 where it is computed from what is stored."""
        return _DECODERS[name](self) if self._plan.sources[name] else self._nothing(name)

    def _nothing(self, name: str) -> NDArray[Any]:
        width, height = _image_size(self._plan, name)
        channels = OUTPUTS[name].channels
        shape = (height, width) if channels == 1 else (height, width, channels)
        return np.broadcast_to(_INVALID.get(name, 0.0), shape)[self._rows]

    def _to_world(self, values: Float64, point: bool) -> Float64:
        matrix = self._plan.view.view_to_world
        x, y, z = np.moveaxis(values, -1, 0)
        turned = empty_planar(values.shape[:-1], 3)
        for axis in range(3):
            # sums, for the last digit of a matrix product depends on the processor
            moved = matrix[3, axis] if point else 0.0
            turned[..., axis] = x * matrix[0, axis] + y * matrix[1, axis] + z * matrix[2, axis] + moved
        return turned

    def _target(self, name: str) -> Target:
        made = self._plan.target(name)
        assert made is not None
        return made

    def _floats(self, target: str, channels: int) -> Float64:
        """Return the values that shaders read: normalised codes as fractions, sRGB codes decoded."""
        form = FORMATS[self._target(target).format]
        stored = self.raw(target, stored_dtype(form), channels)
        fractions = stored_fractions(form, stored if channels == 1 else planar(stored))
        if form.srgb:
            fractions[..., :3] = srgb_to_linear(fractions[..., :3])
        return fractions

    def _colors(self, target: str) -> Float64:
        encoding = self._target(target).encoding
        if encoding == "sqrt10":
            return decode_albedo(unpack_ten_bits(self.raw(target, np.uint32, 1)))
        stored = self._floats(target, 4)[..., :3]
        return stored if encoding == "linear" else decode_albedo(stored)

    def particle_shadow_sums(self) -> Float64:
        """Return the slices of the particle shadows, three colours that may be the same."""
        channels = min(FORMATS[self._target("particle_shadow_atlas").format].components, 3)
        values = self._floats("particle_shadow_atlas", channels)
        return np.broadcast_to(values[..., None], (*values.shape, 3)) if channels == 1 else values

    def light(self) -> NDArray[Any]:
        """Return the radiance of white surfaces without highlights, 0 where nothing was drawn."""
        return self._where_covered(planar(self.raw("light", np.float32, 3)), 0.0)

    def triangles(self) -> NDArray[Any]:
        """Return the instance and the triangle at each pixel, -1 where nothing was drawn."""
        stored = planar(self.raw("visibility", np.int32, 2)) & _WITHOUT_STEEP
        return np.where(stored[..., :1] == 0, -1, stored - (1, 0))

    def albedo(self) -> Float64:
        """Return the linear reflectance; in the classic look, as stored."""
        return self._colors("albedo")

    def ambient_albedo(self) -> Float64:
        """Return the linear reflectance of ambient light, which is the albedo for most scenes."""
        return self._colors("albedo" if self._plan.target("ambient_albedo") is None else "ambient_albedo")

    def shown_albedo(self) -> Float64:
        """Return the linear reflectance with all that multiplies it."""
        return np.minimum(self.albedo() * self.tint(), 1.0) if self.has_modulation() else self.albedo()

    def has_modulation(self) -> bool:
        """Return whether textures and colour scales are kept apart from base colours."""
        return self._plan.settings.look == "panda3d" and self._plan.target("tint") is not None

    def tint(self) -> Float64:
        """Return the colours that multiply all reflected light, or what is shown of it: mostly ones.

        The first are those of the look "pyrender", the second of the look "panda3d".
        """
        if self._plan.target("tint") is None:
            return self._where_covered(np.ones((*self.covered().shape, 3)), 0.0)
        return self._colors("tint")

    def highlights(self) -> Float64:
        """Return the linear reflectance of highlights, 0 without any."""
        if self._plan.target("specular") is None:
            return self._nothing("specular")
        return decode_albedo(self._floats("specular", 3))

    def shininess(self) -> Float64:
        """Return the exponents of highlights, 0 without any."""
        if self._plan.target("specular") is None:
            return self._nothing("shininess")
        stored = self._floats("specular", 4)[..., 3]
        if self._target("specular").encoding == "local":
            stored = decode_viewer(stored)[0]
        return decode_shininess(stored)

    def _local_viewer(self) -> NDArray[np.bool_]:
        """Return where highlights see the eye where it is, in the look "panda3d"."""
        target = self._plan.target("specular")
        if target is None or target.encoding != "local":
            return np.zeros(self.covered().shape, dtype=bool)
        return decode_viewer(self._floats("specular", 4)[..., 3])[1]

    def metallic(self) -> Float64:
        """Return the shares of metal, -1 where the surface is not a metallic-roughness one."""
        return self._metallic_roughness()[0]

    def roughness(self) -> Float64:
        """Return the roughness of metallic-roughness surfaces, 1 elsewhere."""
        return self._metallic_roughness()[1]

    def _metallic_roughness(self) -> tuple[Float64, Float64]:
        if self._plan.target("metallic_roughness") is None:
            shape = self._nothing("metallic").shape
            return np.full(shape, -1.0), np.ones(shape)
        return decode_metallic_roughness(self._floats("metallic_roughness", 2))

    def _of_metals(self, values: Float64) -> Float64:
        """Return values of metallic-roughness surfaces, 0 elsewhere."""
        return np.where(self.metallic() >= 0.0, values, 0.0)

    def normal(self) -> Float64:
        """Return unit normals in view space, 0 where nothing was drawn; classic ones as stored."""
        classic = self._target("normal").encoding == "classic"
        return self._floats("normal", 3) if classic else self.unit_normal()

    def unit_normal(self) -> Float64:
        """Return unit normals in view space, 0 where nothing was drawn."""
        target = self._target("normal")
        stored = self._floats("normal", min(FORMATS[target.format].components, 3))
        return self._where_covered(decode_normals(stored, target.encoding), 0.0)

    def _where_covered(self, values: NDArray[Any], invalid: float) -> NDArray[Any]:
        return np.where(self.covered()[..., None], values, invalid)

    def covered(self) -> NDArray[np.bool_]:
        """Return whether something was drawn at each pixel."""
        names = [target.name for target in self._plan.targets]
        if "coverage" in names:
            stored = self.raw("coverage", np.uint8, 1)
        elif mask_target(names, self._plan.view.lens.perspective) == "distance":
            stored = self.raw("distance", np.float32, 1)
        elif self._target("albedo").encoding == "sqrt10":
            stored = self.raw("albedo", np.uint32, 1)
        else:
            stored = self._floats("albedo", 4)[..., 3]
        return np.asarray(stored != 0)

    def distance(self) -> Float64:
        """Return distances along the view axis, infinity where nothing was drawn."""
        if self._plan.target("distance") is not None:
            y = self.raw("distance", np.float32, 1).astype(np.float64)
        elif self._plan.target("position") is not None:
            y = self._floats("position", 3)[..., 1]
        else:
            y = self._plan.view.lens.distance_from_depth(self.raw("depth", np.float32, 1))
        return np.where(self.covered(), y, np.inf)

    def stored_distance(self) -> NDArray[Any]:
        """Return `distance`, as float32 if it is stored so."""
        if self._plan.target("distance") is None:
            return self.distance()
        return np.where(self.covered(), self.raw("distance", np.float32, 1), np.float32(np.inf))

    def position(self) -> Float64:
        """Return view-space positions through the pixels' centres, NaN where nothing was drawn."""
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
        """Return unit vectors from each pixel's surface to the eye, view space.

        In the look "pyrender", the eye of an orthographic camera is in its position for metallic-roughness
        surfaces. In the look "panda3d", it is there for Phong materials that see it where it is, and for
        others infinitely far behind the camera.
        """
        lens, look = self._plan.view.lens, self._plan.settings.look
        ray = lens.view_from_distance(*self._ndc(), 1.0)
        parallel = np.broadcast_to((0.0, -1.0, 0.0), ray.shape)
        if lens.perspective:
            own = np.asarray(-ray / np.linalg.norm(ray, axis=-1, keepdims=True))
            if look != "panda3d":
                return own
            seen = self._local_viewer() | (self.metallic() >= 0.0)
            return np.where(seen[..., None], own, parallel)
        meets = {"pyrender": lambda: self.metallic() >= 0.0, "panda3d": self._local_viewer}.get(look)
        if meets is None:
            return parallel
        place = self.position()
        meeting = -place / np.linalg.norm(place, axis=-1, keepdims=True)
        return np.where(meets()[..., None], meeting, parallel)

    def gbuffer(self) -> GBuffer:
        """Return all of it, as the float64 reference takes it."""
        metallic, roughness = self._metallic_roughness()
        return GBuffer(
            position=self.position(),
            normal=self.unit_normal(),
            to_eye=self.to_eye(),
            albedo=self.albedo(),
            specular=np.asarray(self.highlights(), dtype=np.float64),
            shininess=np.asarray(self.shininess(), dtype=np.float64),
            metallic=metallic,
            roughness=roughness,
        )


def _stored(target: str, dtype: type, channels: int = 3) -> Callable[[Surface], NDArray[Any]]:
    return lambda surface: surface.raw(target, dtype, channels)


_DECODERS: dict[str, Callable[[Surface], NDArray[Any]]] = {
    "color": _stored("color", np.uint8),
    "color_alpha": _stored("color_alpha", np.uint8, 4),
    "radiance": _stored("final_radiance", np.float32),
    "albedo": Surface.shown_albedo,
    "normal": Surface.normal,
    "normal_world": lambda surface: surface._to_world(surface.unit_normal(), point=False),
    "depth": Surface.stored_distance,
    "position": Surface.position,
    "position_world": lambda surface: surface._to_world(surface.position(), point=True),
    "id": lambda surface: surface.raw("id", np.int32, 1) - 1,
    "visibility": Surface.triangles,
    "specular": Surface.highlights,
    "shininess": Surface.shininess,
    "metallic": lambda surface: surface._of_metals(surface.metallic()),
    "roughness": lambda surface: surface._of_metals(surface.roughness()),
    "emission": _stored("emission", np.float32),
    "light": Surface.light,
    "overdraw": _stored("overdraw", np.float32, 1),
    "volumes": _stored("volumes", np.uint8),
    "wireframe": _stored("wireframe", np.uint8),
    "shadow_atlas": _stored("shadow_atlas", np.float32, 1),
    "particle_shadow_atlas": Surface.particle_shadow_sums,
}
"""The function that decodes each output from the targets that `FramePlan.sources` names."""
