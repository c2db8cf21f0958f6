"""A whole frame in float64: what the passes on the GPU are measured against.

It starts from which triangle each pixel sees. From there on everything comes from the plan's own numbers:
there is no G-buffer, whose packing would round, and no light particle_shadow; every light meets every pixel, shadows
are cast by rays, and sRGB is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import SettingsError
from firefly_sample.lab.reference.chunks import Progress
from firefly_sample.lab.reference.color import tone_curve
from firefly_sample.lab.reference.one_light import OneLight, Shadows
from firefly_sample.lab.reference.particle_shadow import exact_taken, light_left
from firefly_sample.lab.reference.particles import add_particles, particle_light
from firefly_sample.lab.reference.rays import pixel_rays
from firefly_sample.lab.reference.shade import shade_lights
from firefly_sample.lab.reference.sprites import add_sprites
from firefly_sample.lab.reference.surfaces import Surfaces, see_surfaces
from firefly_sample.plan.frame_plan import Background, FramePlan
from firefly_sample.plan.view import View
from firefly_sample.settings import Settings
from firefly_sample.srgb import linear_to_srgb

if TYPE_CHECKING:
    from firefly_sample.lab.reference.shadow_rays import ShadowRays

Float64 = NDArray[np.float64]

VERSION = 2
"""Raised with every change of what this package computes: what was kept of an older one is then not used."""


@dataclass(frozen=True, eq=False)
class ReferenceFrame:
    """A picture and what it is made of, shapes (height, width, ...), the first row on top.

    Attributes
    ----------
    radiance : ndarray of float64, shape (..., 3)
        Linear, before exposure and tone curve, with background and dots.
    light : ndarray of float64, shape (..., 3)
        What white surfaces without highlights would show; 0 where there is none.
    display : ndarray of float64, shape (..., 3)
        0 to 1: after exposure and tone curve, still linear, not rounded to codes.
    color : ndarray of uint8, shape (..., 3)
        sRGB codes.
    position : ndarray of float64, shape (..., 3)
        Of the surfaces, view space; NaN where there is none.
    """

    radiance: Float64
    light: Float64
    display: Float64
    color: NDArray[np.uint8]
    position: Float64


def reference_settings(settings: Settings) -> Settings:
    """The same settings with no light cut off and one sample a pixel: what a reference's plan is built with.

    Raises
    ------
    SettingsError
        If the look is "classic", whose frames are display codes: see `firefly_sample.lab.reference.classic`.
    """
    _check_look(settings)
    return settings.with_changes(cutoff_budget=0.0, cutoff_threshold=None, supersample=1)


def render_reference(
    plan: FramePlan,
    visibility: NDArray[np.int32],
    *,
    albedo: Float64 | None = None,
    ambient_albedo: Float64 | None = None,
    shadows: bool = True,
    threads: int | None = None,
    progress: Progress | None = None,
) -> ReferenceFrame:
    """A plan's frame in float64.

    Parameters
    ----------
    plan : FramePlan
        Made with `reference_settings`, or else lights end where its settings cut them off.
    visibility : ndarray of int32, shape (height, width, 2)
        The output "visibility" of the same plan, or `firefly_sample.lab.reference.raycast.cast_visibility`.
    albedo, ambient_albedo : ndarray, shape (height, width, 3), optional
        Linear reflectances as a GPU sampled them; sampled in float64 when absent.
    shadows : bool
        Cast shadows by rays, for lights that have shadow maps.
    threads, progress : optional
        As `firefly_sample.lab.reference.chunks.run_all` takes them; progress tells of the shading.

    Raises
    ------
    SettingsError
        If the plan's look is "classic", or it has several samples a pixel.
    OutputError
        If a shape is wrong, or the plan has no such triangle.
    MissingPackageError
        If there are shadows and embreex is not installed.
    """
    _check_look(plan.settings)
    if plan.settings.supersample != 1:
        raise SettingsError(
            f"a reference has one sample a pixel: set 'supersample' to 1, not {plan.settings.supersample}"
        )
    surfaces = see_surfaces(plan, visibility, albedo=albedo, ambient_albedo=ambient_albedo, threads=threads)
    rays = _shadow_rays(plan) if shadows else None
    lookup = _shadows(plan, surfaces, rays)
    radiance, light = shade_lights(
        surfaces.gbuffer, plan.lights, plan.settings, lookup, threads=threads, progress=progress
    )
    covered = surfaces.covered[..., None]
    light = np.where(covered, light + plan.ambient, 0.0)
    radiance = radiance + surfaces.ambient_albedo * plan.ambient + surfaces.emission
    radiance = np.where(covered, radiance, background(plan.background, plan.view))
    distance = np.where(surfaces.covered, surfaces.gbuffer.position[..., 1], np.inf)
    if len(plan.particles):
        add_particles(radiance, plan, distance, particle_light(plan, rays.lit if rays is not None else None))
    else:
        add_sprites(radiance, plan.sprites, plan.view, distance)
    return finished(plan, radiance, light, surfaces.gbuffer.position)


def finished(plan: FramePlan, radiance: Float64, light: Float64, position: Float64) -> ReferenceFrame:
    """A frame from its radiance: the plan's exposure and tone curve, and sRGB rounded to the nearest code."""
    display = tone_curve(radiance * plan.exposure, plan.settings.tone_curve)
    color = np.rint(linear_to_srgb(display) * 255.0).astype(np.uint8)
    return ReferenceFrame(radiance, light, display, color, position)


def background(colors: Background, view: View) -> Float64:
    """What is seen where nothing is drawn, shape (height, width, 3); float64 twin of ``resolve.frag``."""
    width, height = view.size
    up = view.world_to_view[2, :3]
    elevation = np.maximum(-pixel_rays(view).to_eye() @ up, 0.0).reshape(height, width, 1)
    horizon, zenith = np.array(colors.horizon), np.array(colors.zenith)
    return np.asarray(horizon + np.sqrt(elevation) * (zenith - horizon))


def _shadow_rays(plan: FramePlan) -> ShadowRays | None:
    if not any(lights.shadowed for lights in plan.lights):
        return None
    from firefly_sample.lab.reference.shadow_rays import ShadowRays

    return ShadowRays(plan)


def _shadows(plan: FramePlan, surfaces: Surfaces, rays: ShadowRays | None) -> Shadows | None:
    """What surfaces, by rays, and particles leave of lights."""
    position = surfaces.gbuffer.position.reshape(-1, 3)
    clouded = plan.particle_shadow is not None and any(lights.particle_shadowed for lights in plan.lights)
    if rays is None and not clouded:
        return None
    left = particle_shadowed(plan, position) if clouded else None

    def share(one: OneLight, pixels: NDArray[np.intp], _: Float64) -> Float64:
        lit = np.ones(len(pixels))
        if one.lights.shadowed and rays is not None:
            lit = rays.lit(position[pixels], one)
        return lit * left[pixels].T if one.lights.particle_shadowed and left is not None else lit

    return share


def particle_shadowed(plan: FramePlan, position: Float64) -> Float64:
    """What particles leave of their light at points in view space, shape (n, 3)."""
    particle_shadow = plan.particle_shadow
    assert particle_shadow is not None
    world = position @ plan.view.view_to_world[:3, :3] + plan.view.view_to_world[3, :3]
    return light_left(particle_shadow, exact_taken(particle_shadow, particle_shadow.view.place(world)))


def _check_look(settings: Settings) -> None:
    if settings.look != "correct":
        raise SettingsError(
            f"there is no reference for look {settings.look!r} in linear radiance: choose look 'correct', or "
            "leave 'look' out"
        )
