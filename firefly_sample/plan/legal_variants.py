"""Every variant of every pass that a plan can hold: what a test compiles."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import product
from typing import Any, get_args

from firefly_sample.plan.lights.light_set import LightKind
from firefly_sample.plan.variants import (
    AmbientVariant,
    ColorPacking,
    DrawMethod,
    ForwardVariant,
    GeometryVariant,
    Highlights,
    InterpolationVariant,
    LightVariant,
    LightViewVariant,
    NormalPacking,
    ParticleLightVariant,
    ParticleVariant,
    PlainVariant,
    Position,
    RangeFalloff,
    ResolveVariant,
    ShadowVariant,
    Stored,
    UpsampleVariant,
    Variant,
    View,
)

_BOTH = (False, True)


_PACKINGS = tuple(product(get_args(NormalPacking)[:5], get_args(ColorPacking)))
_ORIGINAL = ("undecoded", "linear")
"""What the classic look has."""
_ONE_BY_ONE = ("sphere", "cone", "fullscreen")
"""Methods by which the classic look draws lights."""


_SURFACES = [
    (orthographic, textured, colored, cutout, double_sided, alpha)
    for orthographic, textured, colored, cutout, double_sided, alpha in product(_BOTH, repeat=6)
    if (colored and cutout) or not alpha
]
"""The last fields of the geometry pass's variants, and of the forward pass's."""


def _geometry() -> Iterator[Variant]:
    for albedo, normal, distance in product(_BOTH, repeat=3):
        # what a frame has beside the albedo for light, no frame has without it
        extras = product(_BOTH, repeat=3) if albedo else [(False, False, False)]
        places: tuple[Stored, ...] = ("none",) if distance else get_args(Stored)
        for extra, stored in product(extras, places):
            for normals, colors in product(get_args(NormalPacking), get_args(ColorPacking)):
                if (not normal and normals != "snorm16") or (not albedo and colors != "root10"):
                    continue  # nothing is packed
                if normals == "undecoded" and (any(extra) or (albedo and colors != "linear")):
                    continue
                interpolated = normal or distance or stored != "none"
                for ids, rest in product(product(_BOTH, repeat=2), _SURFACES):
                    targets = albedo, normal, distance, *extra, *ids, stored
                    for float64 in _BOTH if interpolated and ids[1] else (False,):
                        yield GeometryVariant(*targets, normals, colors, float64, *rest)  # type: ignore


def _interpolation() -> Iterator[Variant]:
    places: list[tuple[bool, Stored]] = [(False, "none"), (True, "none"), (False, "full"), (False, "half")]
    for normal, (distance, stored), flat in product(_BOTH, places, _BOTH):
        for normals in get_args(NormalPacking)[:5] if normal else ("snorm16",):
            if normal or distance or stored != "none":
                yield InterpolationVariant(normal, distance, stored, normals, orthographic=flat)


_TARGETS = ((True, False), (False, True), (True, True))
"""Radiance and light: at least one is written."""


def _ambient() -> Iterator[Variant]:
    for colors, (radiance, light) in product(get_args(ColorPacking), _TARGETS):
        for lit, own, emission in product(_BOTH, repeat=3):
            # emission is no light that falls on something, and an ambient colour is for ambient light
            if (lit or (emission and radiance)) and (lit or not own):
                yield AmbientVariant(lit, own, emission, colors, radiance, light)


def _lights(kind: LightKind, methods: tuple[DrawMethod, ...]) -> Iterator[Variant]:
    fades = kind != "directional"
    fading: list[tuple[Any, Any]] = [("ramp_squared", "karis")]
    if fades:
        fading += [("attenuation", range_falloff) for range_falloff in get_args(RangeFalloff)]
    for method, (falloff, range_falloff), orthographic, position in product(
        methods, fading, _BOTH, get_args(Position)
    ):
        clouds = _BOTH if kind != "point" else (False,)
        for taps, particle_shadow, highlights, clamp, half in product(
            (0, 1, 4, 16), clouds, get_args(Highlights), _BOTH, _BOTH
        ):
            if not fades and position != "distance" and not (taps or particle_shadow):
                continue  # without shadows, nobody asks where the surface is
            for radiance, light in [(highlights != "none", True)] if half else _TARGETS:
                if highlights != "none" and not radiance:
                    continue
                for normals, colors in _PACKINGS:
                    yield LightVariant(
                        method,
                        falloff,
                        range_falloff,
                        highlights,
                        clamp,
                        taps,  # type: ignore[arg-type]
                        position,
                        normals,
                        colors,
                        orthographic,
                        radiance,
                        light,
                        half,
                        particle_shadow,
                    )
        for radiance, light in _TARGETS:
            if method in _ONE_BY_ONE and (fades or position == "distance"):
                shared = {"falloff": falloff, "range_falloff": range_falloff, "orthographic": orthographic}
                normals, colors = _ORIGINAL
                yield LightVariant(
                    method,
                    position=position,
                    normals=normals,  # type: ignore[arg-type]
                    colors=colors,  # type: ignore[arg-type]
                    radiance=radiance,
                    light=light,
                    **shared,
                )


def _upsample() -> Iterator[Variant]:
    for position, (normals, colors), flat, (radiance, light), shine in product(
        get_args(Position), _PACKINGS, _BOTH, _TARGETS, _BOTH
    ):
        if radiance or not shine:
            yield UpsampleVariant(position, normals, colors, flat, radiance, light, shine)


_WAYS: list[tuple[Any, Any, Any]] = [
    ("directional", "ramp_squared", "karis"),
    *((kind, "ramp_squared", "karis") for kind in ("point", "spot")),
    *(
        (kind, "attenuation", range_falloff)
        for kind in ("point", "spot")
        for range_falloff in get_args(RangeFalloff)
    ),
]
"""Kinds of light, and how each may fade and end."""


def _forward() -> Iterator[Variant]:
    for surface in _SURFACES:
        for own, emission in product(_BOTH, repeat=2):
            # without a light there is nothing but these
            yield ForwardVariant("none", ambient=own, emission=emission, **_surface(surface))
        for (kind, falloff, range_falloff), highlights, clamp, taps, particle_shadow in product(
            _WAYS, get_args(Highlights), _BOTH, (0, 1, 4, 16), _BOTH
        ):
            if particle_shadow and kind == "point":
                continue
            lit = (kind, falloff, range_falloff, highlights, clamp, taps)
            shiny = highlights != "none"
            shared = {"particle_shadow": particle_shadow, **_surface(surface)}
            yield ForwardVariant(*lit, False, specular=shiny, **shared)
            for own, emission in product(_BOTH, repeat=2):
                yield ForwardVariant(*lit, True, own, shiny, emission, **shared)


def _surface(flags: tuple[bool, ...]) -> dict[str, Any]:
    names = ("orthographic", "textured", "vertex_color", "cutout", "double_sided", "vertex_alpha")
    return dict(zip(names, flags, strict=True))


def _particle_light() -> Iterator[Variant]:
    for flat in _BOTH:
        yield ParticleLightVariant("none", orthographic=flat)
        for (kind, falloff, range_falloff), taps, first in product(_WAYS, (0, 1, 4, 16), _BOTH):
            for particle_shadow, faded in product(_BOTH, repeat=2) if kind != "point" else [(False, False)]:
                yield ParticleLightVariant(
                    kind, falloff, range_falloff, taps, particle_shadow, faded, first, flat
                )


def _particles() -> Iterator[Variant]:
    for flat in _BOTH:
        yield ParticleVariant(False, orthographic=flat)
        for position in get_args(Position):
            for reverse in _BOTH if position == "depth" else (False,):
                for packed in _BOTH if flat and position in ("distance", "stored") else (False,):
                    yield ParticleVariant(True, position, flat, reverse, packed)


def _resolve() -> Iterator[Variant]:
    for radiance, masked, color, final, gradient, supersample in product(
        (True, False), (True, False), (True, False), (True, False), (True, False), (1, 2)
    ):
        if not (color or final):
            continue
        for classic, tone in ((False, "exponential"), (False, "none"), (True, "none")):
            for marked in _BOTH if masked and not classic else (False,):
                for flat, particles in product(
                    _BOTH if gradient else (False,), (False,) if classic else _BOTH
                ):
                    flags = (radiance, masked, color, final, gradient, flat, classic)
                    for packed in _BOTH if masked and not (marked or classic) else (False,):
                        own = (tone, supersample, marked, particles, packed)
                        yield ResolveVariant(*flags, *own)  # type: ignore[arg-type]


def _light_views(view: View) -> Iterator[Variant]:
    for flat in _BOTH:
        for method in get_args(DrawMethod)[:3]:
            yield LightViewVariant(view, method, flat)
        if view == "overdraw":
            for position in get_args(Position):
                yield LightViewVariant(view, "clustered", flat, position)


_PARTICLE_SHADOW_PASSES = (
    *("particle_shadow_slices", "particle_shadow_sums", "particle_shadow_blur_x", "particle_shadow_blur_y"),
)
"""One variant each: what differs between methods, formats and kernels are numbers."""

_LEGAL: dict[str, Callable[[], Iterable[Variant]]] = {
    "shadow_maps": lambda: (ShadowVariant(*alphas) for alphas in product(_BOTH, repeat=2)),
    **{name: lambda: [Variant()] for name in _PARTICLE_SHADOW_PASSES},
    "geometry": _geometry,
    "interpolation": _interpolation,
    "forward": _forward,
    "depth_copy": lambda: [Variant()],
    "half_depth": lambda: [Variant()],
    "ambient": _ambient,
    "directional_lights": lambda: _lights("directional", ("fullscreen", "loop")),
    "point_lights": lambda: _lights("point", ("sphere", "fullscreen", "loop", "clustered")),
    "spotlights": lambda: _lights("spot", get_args(DrawMethod)),
    "upsample": _upsample,
    "particle_light": _particle_light,
    "particles": _particles,
    "plain": lambda: (PlainVariant(orthographic) for orthographic in _BOTH),
    "overdraw": lambda: _light_views("overdraw"),
    "volumes": lambda: _light_views("volumes"),
    "wireframe": lambda: _light_views("wireframe"),
    "resolve": _resolve,
    "particle_shadow_texture": lambda: [Variant()],
}


def legal_variants(name: str) -> list[Variant]:
    """Every variant of a pass that a plan can hold."""
    return list(_LEGAL[name]())
