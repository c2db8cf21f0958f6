"""Whole frames in float64, against which the frames of the GPU are measured.

`render_reference` starts from which triangle each pixel sees. From there on everything comes from the plan's
own numbers: there is no G-buffer, whose packing would round, and there are no light volumes; every light is
evaluated at every pixel, shadows are cast by rays, and sRGB is exact. Rays alone find the blended surfaces.

`render_classic` is the reference of the look "classic": it computes what Panda3D's sample "fireflies" shows.
It is written from what the sample computes, not from our shaders, and tested against Panda3D's renderer. With
a surface's unit normal (x, y, z) in view axes (x right, y forward, z up), the sample

1. stores it in OpenGL's view axes (x right, y up, z to the viewer), as n/2 + 1/2 in 8 bits:
   (x, z, -y)/2 + 1/2;
2. multiplies that, never decoded, with the unit vector to the light in view axes;
3. multiplies by (1 - d/R)^2, the light's colour and the stored base colour, none of them linear;
4. adds each light by itself into 8 bits: the light is clipped to 0..1 and rounded to a code.

Other kinds of light (which fade as they do in the look "correct"), ambient light and the background (encoded
for the display) are added by the same rules; the sample does not have them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import SceneError, SettingsError
from firefly_sample.lab.reference.chunks import Progress
from firefly_sample.lab.reference.layer_rays import cast_layers, surface_distance
from firefly_sample.lab.reference.layers import add_layers, add_layers_as_codes, shade_layers
from firefly_sample.lab.reference.particles import (
    add_particles,
    exact_sums,
    particle_light,
    sprite_radiance,
    transmittance,
)
from firefly_sample.lab.reference.rays import pixel_rays
from firefly_sample.lab.reference.shade import OneLight, Shadows, each_light, shade_apart
from firefly_sample.lab.reference.shading import power_encoded, tone_curve
from firefly_sample.lab.reference.shadow import ShadowRays
from firefly_sample.lab.reference.surfaces import Surfaces, see_surfaces
from firefly_sample.plan.frame_plan import Background, FramePlan
from firefly_sample.plan.view import View
from firefly_sample.settings import Settings
from firefly_sample.srgb import linear_to_srgb

Float64 = NDArray[np.float64]

VERSION = 4
"""Raise it with every change of the numbers that are computed here: older cached frames are then unused."""


@dataclass(frozen=True, eq=False)
class ReferenceFrame:
    """A picture and its parts, shapes (height, width, 3), the first row on top.

    Attributes
    ----------
    radiance : ndarray of float64
        Linear, before exposure and tone curve, with background, blended surfaces, particles and dots. In the
        look "flat", the display values of base colours; in the look "panda3d", display values.
    light : ndarray of float64
        The radiance of white surfaces without highlights, opaque ones alone; 0 where there is none.
    display : ndarray of float64
        0 to 1: after exposure and tone curve, linear, not rounded to codes.
    color : ndarray of uint8
        Codes of the display.
    position : ndarray of float64
        Of the opaque surfaces, view space; NaN where there is none.
    """

    radiance: Float64
    light: Float64
    display: Float64
    color: NDArray[np.uint8]
    position: Float64


def reference_settings(settings: Settings) -> Settings:
    """Return the settings to plan a reference with: no light is cut off, and there is one sample per pixel.

    They ask for no order of blended surfaces, since the reference finds its own. Raise a SettingsError if the
    look is "classic", whose frames are display codes: see `render_classic`.
    """
    _check_look(settings)
    return settings.with_changes(
        cutoff_budget=0.0, cutoff_threshold=None, supersample=1, transparency="exact"
    )


def render_reference(
    plan: FramePlan,
    visibility: NDArray[np.int32],
    *,
    albedo: Float64 | None = None,
    ambient_albedo: Float64 | None = None,
    emission: Float64 | None = None,
    metallic_roughness: Float64 | None = None,
    normal: Float64 | None = None,
    tint: Float64 | None = None,
    shadows: bool = True,
    threads: int | None = None,
    progress: Progress | None = None,
) -> ReferenceFrame:
    """Render a plan in float64.

    Parameters
    ----------
    plan : FramePlan
        Planned with `reference_settings`; otherwise its settings may cut lights off.
    visibility : ndarray of int32, shape (height, width, 2)
        The output "visibility" of the same plan, or `firefly_sample.lab.reference.raycast.cast_visibility`.
    albedo, ambient_albedo : ndarray, shape (height, width, 3), optional
        Linear reflectances as a GPU sampled them; sampled in float64 when absent.
    emission, normal : ndarray, shape (height, width, 3), optional
        Linear emission, and normals in view space, as a GPU sampled them from textures; sampled in float64
        when absent.
    metallic_roughness : ndarray, shape (height, width, 2), optional
        The same of metallic and roughness.
    tint : ndarray, shape (height, width, 3), optional
        The same of textures times colour scales, in the look "panda3d".
    shadows : bool
        Whether lights that have shadow maps cast shadows, by rays.
    threads, progress : optional
        As `firefly_sample.lab.reference.chunks.run_all` takes them; `progress` is called during shading.

    Raises
    ------
    SettingsError
        If the plan's look is "classic", or it has several samples per pixel.
    SceneError
        If lines or points are in view.
    OutputError
        If a shape is wrong, or the plan has no such triangle.
    MissingPackageError
        If there are shadows and embreex is not installed.
    """
    _check_look(plan.settings)
    marks = dict.fromkeys(batch.geom.name for batch in plan.batches if batch.geom.mode != "triangles")
    if marks:
        raise SceneError(f"a reference has triangles alone: hide the lines and points {', '.join(marks)}")
    if plan.settings.supersample != 1:
        raise SettingsError(
            f"a reference has one sample per pixel: set 'supersample' to 1, not {plan.settings.supersample}"
        )
    surfaces = see_surfaces(
        plan,
        visibility,
        albedo=albedo,
        ambient_albedo=ambient_albedo,
        emission=emission,
        metallic_roughness=metallic_roughness,
        normal=normal,
        tint=tint,
        threads=threads,
    )
    rays = ShadowRays(plan) if shadows and any(lights.shadowed for lights in plan.lights) else None
    lookup = _shadows(plan, surfaces.gbuffer.position.reshape(-1, 3), rays)
    matt, gloss, light = shade_apart(
        surfaces.gbuffer, plan.lights, plan.settings, lookup, threads=threads, progress=progress
    )
    covered = surfaces.covered[..., None]
    light = np.where(covered, light + plan.ambient, 0.0)
    look = plan.settings.look
    radiance = surfaces.radiance(matt, gloss, plan.ambient, look)
    radiance = np.where(covered, radiance, background(plan.background, plan.view))
    if look == "panda3d":
        radiance = np.clip(radiance, 0.0, 1.0)
    distance = np.where(surfaces.covered, surfaces.gbuffer.position[..., 1], np.inf)
    own_light = particle_light(plan, rays.lit if rays is not None else None)
    if plan.blended is not None:
        layers = cast_layers(plan, surface_distance(plan, visibility, pixel_rays(plan.view)))
        shown = shade_layers(plan, layers, lambda places: _shadows(plan, places, rays), threads=threads)
        add = add_layers_as_codes if look == "pyrender" else add_layers
        add(radiance, plan, distance, layers, shown, own_light)
    else:
        add_particles(radiance, plan, distance, own_light)
    return finished(plan, radiance, light, surfaces.gbuffer.position)


def finished(plan: FramePlan, radiance: Float64, light: Float64, position: Float64) -> ReferenceFrame:
    """Return a frame made from its radiance: exposure, tone curve, codes rounded to the nearest."""
    look = plan.settings.look
    codes = look in ("flat", "panda3d")
    display = tone_curve(radiance * (1.0 if codes else plan.exposure), plan.settings.tone_curve)
    encode = power_encoded if look == "pyrender" else linear_to_srgb
    shown = display if codes else encode(display)
    color = np.rint(shown * 255.0).astype(np.uint8)
    return ReferenceFrame(radiance, light, display, color, position)


def background(colors: Background, view: View) -> Float64:
    """Return the background, shape (height, width, 3); float64 twin of ``resolve.frag``."""
    width, height = view.size
    up = view.world_to_view[2, :3]
    elevation = np.maximum(-pixel_rays(view).to_eye() @ up, 0.0).reshape(height, width, 1)
    horizon, zenith = np.array(colors.horizon), np.array(colors.zenith)
    return np.asarray(horizon + np.sqrt(elevation) * (zenith - horizon))


def _shadows(plan: FramePlan, position: Float64, rays: ShadowRays | None) -> Shadows | None:
    """Return a lookup of the lit share of pixels at positions (n, 3) in view space.

    Surfaces cast shadows by rays, and particles by their exact sums.
    """
    shadow, left = plan.particle_shadow, None
    if shadow is not None and any(lights.particle_shadowed for lights in plan.lights):
        world = position @ plan.view.view_to_world[:3, :3] + plan.view.view_to_world[3, :3]
        left = transmittance(shadow, exact_sums(shadow, shadow.view.to_slices(world)))
    if rays is None and left is None:
        return None

    def share(one: OneLight, pixels: NDArray[np.intp], _: Float64) -> Float64:
        lit = np.ones(len(pixels))
        if one.lights.shadowed and rays is not None:
            lit = rays.lit(position[pixels], one)
        return lit * left[pixels].T if one.lights.particle_shadowed and left is not None else lit

    return share


def _check_look(settings: Settings) -> None:
    if settings.look == "classic":
        raise SettingsError(
            f"there is no reference for look {settings.look!r} in linear radiance: choose look 'correct', or "
            "leave 'look' out"
        )


# --- The look "classic" ---


def render_classic(
    plan: FramePlan,
    visibility: NDArray[np.int32],
    *,
    albedo: Float64 | None = None,
    threads: int | None = None,
) -> NDArray[np.uint8]:
    """Return a plan in the look "classic" in float64: display codes (height, width, 3), first row on top.

    The arguments and errors are those of `render_reference`; the albedo is as stored, 0 to 1.
    """
    if plan.settings.look != "classic" or plan.settings.supersample != 1:
        raise SettingsError(
            "render_classic needs a plan with look 'classic' and 'supersample' 1; got "
            f"{plan.settings.look!r} and {plan.settings.supersample}"
        )
    surfaces = see_surfaces(plan, visibility, albedo=albedo, threads=threads)
    covered = surfaces.covered
    codes = np.zeros((*covered.shape, 3))
    codes[covered] = _lit_codes(plan, surfaces)
    distance = np.where(covered, surfaces.gbuffer.position[..., 1], np.inf)
    for index in range(len(plan.sprites)):
        dot = sprite_radiance(plan.sprites, index, plan.view, distance)
        if dot is not None:
            codes[dot[0]] += _to_codes(dot[1])
    display = np.minimum(codes, 255.0) / 255.0
    display += np.where(covered[..., None], 0.0, linear_to_srgb(background(plan.background, plan.view)))
    return _to_codes(display).astype(np.uint8)


def _lit_codes(plan: FramePlan, surfaces: Surfaces) -> Float64:
    """Return the sum of all lights' codes on the covered pixels, shape (n, 3), not yet clipped at 255."""
    gbuffer, covered = surfaces.gbuffer, surfaces.covered
    position = gbuffer.position[covered]
    base = _to_codes(gbuffer.albedo[covered]) / 255.0
    x, y, z = gbuffer.normal[covered].T
    opengl = np.stack([x, z, -y], axis=1)
    stored = _to_codes(0.5 * opengl + 0.5) / 255.0
    codes = _to_codes(base * plan.ambient)
    for one in each_light(plan.lights):
        pixels = np.flatnonzero(one.in_reach(position))
        to_light, distance = one.directions(position[pixels])
        strength = one.strength(to_light.T, distance, plan.settings)
        facing = np.einsum("ij,ij->i", to_light, stored[pixels])
        arriving = (facing * strength)[:, None] * one.lights.colors[one.row]
        codes[pixels] += _to_codes(base[pixels] * arriving)
    return codes


def _to_codes(values: Float64) -> Float64:
    """Round values to the codes, 0 to 255, of an 8-bit target."""
    return np.asarray(np.rint(np.clip(values, 0.0, 1.0) * 255.0))
