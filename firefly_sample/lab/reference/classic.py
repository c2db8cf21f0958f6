"""Compute in float64 what Panda3D's sample "fireflies" shows: the reference of the look "classic".

Written from what the sample computes, not from our shaders, and held against Panda3D's renderer. With a
surface's unit normal (x, y, z) in view axes (x right, y forward, z up), the sample

1. stores it in OpenGL's view axes (x right, y up, z to the viewer), as n/2 + 1/2 in 8 bits:
   (x, z, -y)/2 + 1/2;
2. multiplies that, never decoded, with the unit vector to the light in view axes;
3. multiplies by (1 - d/R)^2, the light's colour and the stored base colour, none of them linear;
4. adds each light by itself into 8 bits: its share is cut to 0..1 and rounded to a code.

What the sample does not have is added by the same rules: other kinds of light, which fade as they do in the
look "correct", ambient light, and the background, which is encoded for the display.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import SettingsError
from firefly_sample.lab.reference.frame import background
from firefly_sample.lab.reference.shade import each_light
from firefly_sample.lab.reference.sprites import light_of_sprite
from firefly_sample.lab.reference.surfaces import Surfaces, see_surfaces
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.srgb import linear_to_srgb

Float64 = NDArray[np.float64]


def render_classic(
    plan: FramePlan,
    visibility: NDArray[np.int32],
    *,
    albedo: Float64 | None = None,
    threads: int | None = None,
) -> NDArray[np.uint8]:
    """Return a plan's picture in the look "classic".

    Parameters
    ----------
    plan : FramePlan
        Of that look.
    visibility, albedo, threads
        As `firefly_sample.lab.reference.frame.render_reference` takes them; the albedo as stored, 0 to 1.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        Display codes, the first row on top.

    Raises
    ------
    SettingsError
        If the plan has another look, or several samples a pixel.
    OutputError
        If a shape is wrong, or the plan has no such triangle.
    """
    if plan.settings.look != "classic" or plan.settings.supersample != 1:
        raise SettingsError("this reference is for look 'classic' with 'supersample' 1")
    surfaces = see_surfaces(plan, visibility, albedo=albedo, threads=threads)
    covered = surfaces.covered
    codes = np.zeros((*covered.shape, 3))
    codes[covered] = _lit_codes(plan, surfaces)
    distance = np.where(covered, surfaces.gbuffer.position[..., 1], np.inf)
    for index in range(len(plan.sprites)):
        dot = light_of_sprite(plan.sprites, index, plan.view, distance)
        if dot is not None:
            codes[dot[0]] += _to_codes(dot[1])
    display = np.minimum(codes, 255.0) / 255.0
    display += np.where(covered[..., None], 0.0, linear_to_srgb(background(plan.background, plan.view)))
    return _to_codes(display).astype(np.uint8)


def _lit_codes(plan: FramePlan, surfaces: Surfaces) -> Float64:
    """Return the sum of all lights' codes on the covered pixels, shape (n, 3); above 255, it is cut off."""
    gbuffer, covered = surfaces.gbuffer, surfaces.covered
    place = gbuffer.position[covered]
    base = _to_codes(gbuffer.albedo[covered]) / 255.0
    x, y, z = gbuffer.normal[covered].T
    opengl = np.stack([x, z, -y], axis=1)
    stored = _to_codes(0.5 * opengl + 0.5) / 255.0
    codes = _to_codes(base * plan.ambient)
    for pixels, arriving in _arriving(plan, place, stored):
        codes[pixels] += _to_codes(base[pixels] * arriving)
    return codes


def _arriving(plan: FramePlan, place: Float64, stored: Float64) -> Iterator[tuple[NDArray[np.intp], Float64]]:
    """Yield for each light the positions (n, 3) that it reaches, and how much of which colours arrives."""
    for one in each_light(plan.lights):
        pixels = np.flatnonzero(one.in_reach(place))
        to_light, distance = one.ways(place[pixels])
        strength = one.strength(to_light.T, distance, plan.settings)
        facing = np.einsum("ij,ij->i", to_light, stored[pixels])
        yield pixels, (facing * strength)[:, None] * one.lights.colors[one.row]


def _to_codes(values: Float64) -> Float64:
    """Round values to the codes, 0 to 255, that a target of 8 bits keeps."""
    return np.asarray(np.rint(np.clip(values, 0.0, 1.0) * 255.0))
