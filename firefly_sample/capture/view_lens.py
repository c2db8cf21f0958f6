"""The lenses of views: what a file says of them, as far as it does, and how a lens is made of that."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from firefly_sample.errors import LensError
from firefly_sample.scene.intrinsics import KEYS, Intrinsics
from firefly_sample.scene.lens import PerspectiveLens, lens_from_intrinsics
from firefly_sample.scene.lens_base import Lens

ANGLE = "camera_angle_x"
"""Horizontal field of view in radians, NeRF's name: a lens with square pixels for pictures of any shape."""
LENS_KEYS = (*KEYS, ANGLE)
_PLANES = ("near", "far")
_ANY_PLANES = (1.0, 2.0)


@dataclass(frozen=True)
class ViewLens:
    """The lens of a view: intrinsics or an angle, and where it is clipped.

    Attributes
    ----------
    intrinsics : Intrinsics or None
        Its near and far mean nothing if `planes` is None.
    angle : float or None
        Horizontal field of view in radians, if there are no intrinsics.
    planes : (float, float) or None
        Near and far; those of the scene's own lens if None.
    """

    intrinsics: Intrinsics | None
    angle: float | None = None
    planes: tuple[float, float] | None = None

    def make(self, own: Lens) -> Lens:
        """Return the lens; `own` is the scene's. LensError if its near and far do not suit this one."""
        own = own.near_first()
        near, far = self.planes or (own.get_near(), own.get_far())
        if self.intrinsics is None:
            assert self.angle is not None
            return PerspectiveLens(fov=math.degrees(self.angle), near=near, far=far)
        return lens_from_intrinsics(replace(self.intrinsics, near=near, far=far))

    def fits(self, size: tuple[int, int]) -> bool:
        """Return whether pictures of a size have its shape, to whole pixels."""
        if self.intrinsics is None:
            return True
        width, height = self.intrinsics.size
        return 2 * min(abs(size[0] * height - size[1] * width) / each for each in (width, height)) <= 1.0

    def as_json(self) -> dict[str, Any]:
        """Return the lens as `lens_of` takes it."""
        near, far = self.planes or (None, None)
        planes = {} if near is None else {"near": near, "far": None if far == math.inf else far}
        if self.intrinsics is None:
            return {ANGLE: self.angle, **planes}
        intrinsics = self.intrinsics.as_dict()
        return {name: value for name, value in intrinsics.items() if name not in _PLANES} | planes


def lens_of(given: Mapping[str, Any]) -> ViewLens | None:
    """Return the lens of a camera object in a file; None if it says nothing of one.

    It has the keys of `Intrinsics.as_dict` or ``camera_angle_x``. Without "projection" it is perspective;
    "near" and "far" may be absent together. Other keys are ignored. LensError if a number is wrong or lacks.
    """
    values = {name: given[name] for name in LENS_KEYS if name in given}
    if not values:
        return None
    known = [name for name in _PLANES if name in values]
    if len(known) == 1:
        other = _PLANES[known == ["near"]]
        raise LensError(f"{known[0]!r} without {other!r}: give both, or neither to use the scene's own")
    if ANGLE in values:
        return _of_angle(values)
    unknown = {} if known else dict(zip(_PLANES, _ANY_PLANES, strict=True))
    read = Intrinsics.from_dict({"projection": "perspective", **values, **unknown})
    return ViewLens(read, planes=(read.near, read.far) if known else None)


def _of_angle(values: Mapping[str, Any]) -> ViewLens:
    others = [name for name in values if name not in (ANGLE, *_PLANES)]
    if others:
        raise LensError(f"{ANGLE!r} and {others[0]!r} each describe the lens: give one of them")
    angle = values[ANGLE]
    if isinstance(angle, bool) or not isinstance(angle, int | float) or not 0.0 < angle < math.pi:
        raise LensError(f"{ANGLE!r} must be an angle between 0 and pi radians, got {angle!r}")
    planes = None
    if "near" in values:
        far = math.inf if values["far"] is None else values["far"]
        lens = PerspectiveLens(near=values["near"], far=far)
        planes = lens.get_near(), lens.get_far()
    return ViewLens(None, float(angle), planes)
