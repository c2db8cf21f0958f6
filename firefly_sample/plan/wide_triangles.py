"""Find triangles that are so wide that a rasterizer loses pixels when it clips them to a view."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.lens_constants import LensConstants

Float64 = NDArray[np.float64]

WIDEST = 5e4
"""Half widths of the view: triangles that reach as far aside keep all of their pixels, and of four times as
far one in forty loses some. A rasterizer clips triangles to the view in float32, which leaves an edge where
it belongs to 6e-8 of its length."""
WIDEST_CASTER = 1e6
"""Half widths of a shadow map's view: casters that reach 1e7 aside still fill every texel of it, and of 3e7
and more some let light through."""


def casts_too_wide(geom: Geom, model_to_light: Float64, planes: Float64, lens: Lens) -> bool:
    """Return whether an instance of a Geom is too wide to cast a shadow into all of a shadow map.

    Parameters
    ----------
    geom : Geom
    model_to_light : ndarray of float64, shape (n, 4, 4)
        To the light's view space, for row vectors.
    planes : ndarray of float64, shape (p, 4)
        Of the map's view.
    lens : Lens
        The map's.
    """
    constants, near = lens.constants(), lens.get_near()
    low, high = geom.bounds
    middles = 0.5 * (low + high) @ model_to_light[:, :3, :3] + model_to_light[:, 3, :3]
    halves = 0.5 * (high - low) @ np.abs(model_to_light[:, :3, :3])
    reach = (np.abs(middles) + halves)[:, [0, 2]].max(axis=1)
    ahead = np.maximum(near, middles[:, 1] - halves[:, 1]) if constants.perspective else 1.0
    suspects = reach * max(constants.a, constants.c) > WIDEST_CASTER * ahead
    if not suspects.any():  # nearly always: the rest looks at every vertex
        return False
    return has_wide(geom, model_to_light[suspects], planes, constants, near, WIDEST_CASTER)


def has_wide(
    geom: Geom, model_to_view: Float64, planes: Float64, lens: LensConstants, near: float, widest: float
) -> bool:
    """Return whether a triangle in view has a corner farther aside than so many half widths of the view."""
    for matrix in model_to_view:
        places = geom.vertices @ matrix[:3, :3] + matrix[3, :3]
        ahead = places[:, 1] if lens.perspective else np.ones(len(places))
        aside = np.abs(places[:, [0, 2]] * (lens.a, lens.c)).max(axis=1)
        wide = (aside > widest * ahead) & (ahead >= (near if lens.perspective else 0.0))
        triangles = geom.triangles[wide[geom.triangles].any(axis=1)]
        outside = places @ planes[:, :3].T + planes[:, 3] < 0.0
        if len(triangles) and not outside[triangles].all(axis=1).any(axis=1).all():
            return True
    return False
