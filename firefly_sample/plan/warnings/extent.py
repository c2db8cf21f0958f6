"""Warn of scenes that are too small, too large or too wide for float32."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.frustum import WIDEST, WIDEST_CASTER, has_wide
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.view import View
from firefly_sample.plan.visible import Visible, VisiblePart
from firefly_sample.scene.lens_constants import LensConstants

Float64 = NDArray[np.float64]

SMALLEST, LARGEST = 1e-15, 1e18
"""Scene units: for geometry in view of a size between these, float32 holds squares of distances with enough
digits, down to a tenth of the smallest size."""
ENDLESS = 1e37
"""Scene units: positions beyond are not drawn, because float32 has no room for a product."""
DEPTHS = 1e-37
"""The least depth, near over distance, that a reversed depth buffer of float32 holds."""


class Extent(NamedTuple):
    """The size of the geometry in view.

    Attributes
    ----------
    name : str
        Of the Geom that reaches farthest from the eye; empty if none is in view or all are of ordinary size.
    size : float
        Its largest coordinate in view space; 0 if none is in view, a bound if all are of ordinary size.
    wide : tuple of str
        Names of the Geoms that have triangles too wide for a rasterizer.
    """

    name: str
    size: float
    wide: tuple[str, ...]

    @classmethod
    def of(cls, seen: Visible, planes: Float64, lens: LensConstants, near: float) -> Extent:
        """Return the extent of the geometry in view.

        Parameters
        ----------
        planes : ndarray of float64, shape (p, 4)
            Of the view, as `Lens.frustum_planes` gives them.
        lens : LensConstants
        near : float
            The near plane: geometry before it is clipped first, however wide it is.
        """
        if _is_ordinary(seen, lens, near):  # nearly always: boxes take longer than spheres
            return cls("", float((np.abs(seen.centers).max(axis=1) + seen.radii).max()), ())
        size, name = max(((_size(part), part.group.geom.name) for part in seen.parts), default=(0.0, ""))
        wide = [part.group.geom.name for part in seen.parts if _is_wide(part, planes, lens, near)]
        return cls(name, size, tuple(dict.fromkeys(wide)))


def extent_warnings(
    extent: Extent,
    sets: Sequence[LightSet],
    view: View,
    farthest: float,
    casters: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> Iterator[str]:
    """Yield a line for each quantity that float32 does not hold.

    Parameters
    ----------
    extent : Extent
    sets : sequence of LightSet
        The lights in view.
    view : View
    farthest : float
        Of all geometry in view, along the view axis.
    casters : mapping of str to sequence of str
        Names of Geoms that are too wide for a shadow map (`has_wide_caster`), by their light's name.
    """
    name, size, wide = extent
    placed = [lights for lights in sets if lights.kind != "directional" and len(lights)]
    if size > ENDLESS:
        yield (
            f"geom {name!r} reaches {size:.1g} units from the eye, and float32 holds positions up to "
            f"{ENDLESS:g}: parts of it are not drawn; scale the scene down"
        )
    elif size > LARGEST and any(lights.reaches.max() > LARGEST for lights in placed):
        yield (
            f"geom {name!r} reaches {size:.1g} units from the eye, and float32 holds squares of distances "
            f"up to {LARGEST:g}: lights without a max distance do not light it there; scale the scene down"
        )
    elif 0.0 < size < SMALLEST and placed:
        yield (
            f"all geometry in view lies within {size:.1g} units of the eye, and float32 holds squares of "
            f"distances accurately down to {SMALLEST:g}: light on it is wrong; scale the scene up"
        )
    if view.reverse and view.lens.perspective and view.near < DEPTHS * min(farthest, view.far):
        yield (
            f"the near plane, {view.near:g}, is less than {DEPTHS:g} of the farthest distance in view, "
            f"{farthest:.1g}: distant surfaces hide nothing behind them; move the near plane out"
        )
    if wide:
        yield (
            f"geoms {', '.join(map(repr, wide))} have triangles that reach more than {WIDEST:g} half widths "
            "of the view to a side, which lose pixels when they are clipped to it: cut them into smaller ones"
        )
    for light, names in casters.items():
        yield (
            f"light {light!r}: geoms {', '.join(map(repr, names))} have triangles that reach more than "
            f"{WIDEST_CASTER:g} half widths of its shadow map's view to a side, so that light may shine "
            "through them: cut them into smaller ones"
        )


def _is_ordinary(seen: Visible, lens: LensConstants, near: float) -> bool:
    """Return whether the bounding spheres of all geometry in view are within all bounds."""
    if not len(seen.radii):
        return False
    middle = np.abs(seen.centers).max(axis=1)
    reach = middle + seen.radii
    ahead = np.maximum(near, seen.centers[:, 1] - seen.radii) if lens.perspective else 1.0
    wide = reach * max(lens.a, lens.c) > WIDEST * ahead
    return bool(middle.max() >= SMALLEST and reach.max() <= LARGEST and not wide.any())


def _size(part: VisiblePart) -> float:
    low, high = part.box
    return float(np.maximum(np.abs(low), np.abs(high)).max())


def _is_wide(part: VisiblePart, planes: Float64, lens: LensConstants, near: float) -> bool:
    low, high = part.box
    side = np.maximum(np.abs(low), np.abs(high))[[0, 2]] * (lens.a, lens.c)
    if side.max() <= WIDEST * (max(near, float(low[1])) if lens.perspective else 1.0):
        return False  # nearly always: the rest looks at every vertex
    return has_wide(part.group.geom, part.model_to_view, planes, lens, near, WIDEST)
