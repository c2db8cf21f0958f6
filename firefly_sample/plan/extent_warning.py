"""What a plan has to say of scenes that are too small, too large or too wide for float32."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.batches import Visible, VisiblePart
from firefly_sample.plan.light_set import LightSet
from firefly_sample.plan.view import View
from firefly_sample.scene.lens_constants import LensConstants

__all__ = ["extent_warnings", "wide_geoms"]

Float64 = NDArray[np.float64]

SMALLEST, LARGEST = 1e-15, 1e18
"""Scene units: the size of what is in view between which squares of distances are float32 numbers with all of
their digits. What lies nearer to a light than a tenth of the smallest size is still right to 1e-6."""
ENDLESS = 1e37
"""Scene units: places beyond are no longer drawn, for want of room for a product."""
WIDEST = 5e4
"""Half widths of the view: triangles that reach as far aside keep all of their pixels, and of four times as
far one in forty loses some. A rasterizer clips triangles to the view in float32, which leaves an edge where
it belongs to 6e-8 of its length."""
DEPTHS = 1e-37
"""The least depth that a reversed depth buffer of float32 holds: near over distance."""


def extent_warnings(
    seen: Visible, sets: Sequence[LightSet], view: View, wide: Sequence[str]
) -> Iterator[str]:
    """One line each for what float32 does not hold.

    Parameters
    ----------
    sets : sequence of LightSet
        The lights in view.
    wide : sequence of str
        What `wide_geoms` found.
    """
    extents = {part.group.geom.name: _extent(part) for part in seen.parts}
    name = max(extents, key=lambda key: extents[key], default="")
    extent = extents.get(name, 0.0)
    placed = [lights for lights in sets if lights.kind != "directional" and len(lights)]
    if extent > ENDLESS:
        yield (
            f"geom {name!r} reaches {extent:.1g} units from the eye, and float32 holds places up to "
            f"{ENDLESS:g}: parts of it are not drawn; give the scene a larger unit"
        )
    elif extent > LARGEST and any(lights.reaches.max() > LARGEST for lights in placed):
        yield (
            f"geom {name!r} reaches {extent:.1g} units from the eye, and float32 holds squares of distances "
            f"up to {LARGEST:g}: lights without end leave it dark there; give the scene a larger unit"
        )
    elif 0.0 < extent < SMALLEST and placed:
        yield (
            f"all that is in view lies within {extent:.1g} units of the eye, and float32 holds squares of "
            f"distances down to {SMALLEST:g} with all their digits: light on it is wrong; give the scene a "
            "smaller unit"
        )
    if view.reverse and view.lens.perspective and 0.0 < view.near < DEPTHS * min(seen.farthest, view.far):
        yield (
            f"the near plane, {view.near:g}, is less than {DEPTHS:g} of the farthest distance in view, "
            f"{seen.farthest:.1g}: what is far away hides nothing; move the near plane out"
        )
    if wide:
        yield (
            f"geoms {', '.join(map(repr, wide))} have triangles that reach more than {WIDEST:g} half widths "
            "of the view aside, which lose pixels when they are clipped to it: cut them into smaller ones"
        )


def wide_geoms(seen: Visible, planes: Float64, lens: LensConstants, near: float) -> tuple[str, ...]:
    """Names of the Geoms in view with triangles that are too wide for a rasterizer.

    Parameters
    ----------
    planes : ndarray of float64, shape (p, 4)
        Of the view, as `Lens.frustum_planes` gives them.
    lens : LensConstants
    near : float
        The near plane: what lies before it is cut off first, however wide it is.
    """
    return tuple(
        dict.fromkeys(part.group.geom.name for part in seen.parts if _is_wide(part, planes, lens, near))
    )


def _extent(part: VisiblePart) -> float:
    low, high = part.box
    return float(np.maximum(np.abs(low), np.abs(high)).max())


def _is_wide(part: VisiblePart, planes: Float64, lens: LensConstants, near: float) -> bool:
    low, high = part.box
    side = np.maximum(np.abs(low), np.abs(high))[[0, 2]] * (lens.a, lens.c)
    if side.max() <= WIDEST * (max(near, float(low[1])) if lens.perspective else 1.0):
        return False  # nearly always: the rest looks at every vertex
    geom = part.group.geom
    for matrix in part.model_to_view:
        places = geom.vertices @ matrix[:3, :3] + matrix[3, :3]
        ahead = places[:, 1] if lens.perspective else np.ones(len(places))
        aside = np.abs(places[:, [0, 2]] * (lens.a, lens.c)).max(axis=1)
        wide = (aside > WIDEST * ahead) & (ahead >= (near if lens.perspective else 0.0))
        triangles = geom.triangles[wide[geom.triangles].any(axis=1)]
        outside = places @ planes[:, :3].T + planes[:, 3] < 0.0
        if len(triangles) and not outside[triangles].all(axis=1).any(axis=1).all():
            return True
    return False
