"""A pass's variant: a frozen dataclass that becomes shader defines, always 0 or 1 (or a small number).

Every field is a define of the same name in capitals. `legal_variants` lists a pass's whole set,
which a test compiles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields
from itertools import product
from typing import Any, Literal, get_args

__all__ = [
    "PASS_ORDER",
    "AmbientVariant",
    "DrawMethod",
    "GeometryVariant",
    "LightVariant",
    "LightViewVariant",
    "PlainVariant",
    "ResolveVariant",
    "ShadowVariant",
    "Variant",
    "defines",
    "legal_variants",
]

DrawMethod = Literal["sphere", "cone", "fullscreen", "loop"]
Highlights = Literal["none", "phong", "blinn_phong"]
Fading = Literal["ramp_squared", "attenuation"]
Ending = Literal["karis", "gltf"]
View = Literal["overdraw", "volumes", "wireframe"]


@dataclass(frozen=True)
class Variant:
    """The base of all variants; a pass without choices uses it as it is."""


@dataclass(frozen=True)
class GeometryVariant(Variant):
    """How the G-buffer is written; the first eight fields say which targets there are."""

    albedo: bool = True
    normal: bool = True
    distance: bool = True
    ambient: bool = False
    specular: bool = False
    emission: bool = False
    id: bool = False
    visibility: bool = False
    classic: bool = False
    snorm: bool = True
    orthographic: bool = False
    textured: bool = False
    vertex_color: bool = False
    cutout: bool = False
    double_sided: bool = False


@dataclass(frozen=True)
class ShadowVariant(Variant):
    """What a shadow map's casters are: with a texture whose alpha cuts out, or opaque."""

    cutout: bool = False


@dataclass(frozen=True)
class AmbientVariant(Variant):
    """What there is from the first: ambient light, with colours of its own, and emission.

    Classic adds stored (display) values. `radiance` and `light` are the targets.
    """

    lit: bool = True
    own: bool = False
    emission: bool = False
    classic: bool = False
    radiance: bool = True
    light: bool = False


@dataclass(frozen=True)
class LightVariant(Variant):
    """How lights find their pixels, where a pixel's position comes from, and what light does there.

    `taps` is 0 for lights without shadow maps. `radiance` and `light` are the targets.
    """

    method: DrawMethod = "sphere"
    falloff: Fading = "ramp_squared"
    window: Ending = "karis"
    highlights: Highlights = "none"
    clamp_light: bool = False
    taps: Literal[0, 1, 4, 16] = 0
    from_depth: bool = False
    classic: bool = False
    snorm: bool = True
    orthographic: bool = False
    radiance: bool = True
    light: bool = False


@dataclass(frozen=True)
class PlainVariant(Variant):
    """Soft dots."""

    orthographic: bool = False


@dataclass(frozen=True)
class LightViewVariant(Variant):
    """What is drawn in place of light: how often a pixel is shaded, or the volumes themselves."""

    view: View = "overdraw"
    method: DrawMethod = "sphere"
    orthographic: bool = False


@dataclass(frozen=True)
class ResolveVariant(Variant):
    """What the last pass reads and writes."""

    radiance: bool = True
    masked: bool = True
    color: bool = True
    final_radiance: bool = False
    gradient: bool = False
    orthographic: bool = False
    classic: bool = False
    tone: Literal["exponential", "none"] = "exponential"
    supersample: Literal[1, 2] = 1


_NUMBERS = {
    **{name: number for number, name in enumerate(get_args(DrawMethod))},
    **{name: number for number, name in enumerate(get_args(Highlights))},
    **{name: number for number, name in enumerate(get_args(Fading))},
    **{name: number for number, name in enumerate(get_args(Ending))},
    **{name: number for number, name in enumerate(get_args(View))},
    "exponential": 1,
}


def defines(variant: Variant) -> dict[str, int]:
    """The defines of a variant: names in capitals, booleans as 0 or 1, choices as their number."""
    result = {}
    for field in fields(variant):
        value = getattr(variant, field.name)
        result[field.name.upper()] = _NUMBERS[value] if isinstance(value, str) else int(value)
    return result


_BOTH = (False, True)


def _geometry() -> Iterator[Variant]:
    for albedo, normal, distance, id_target in product(_BOTH, repeat=4):
        # what a frame has beside the albedo for light, no frame has without it
        extras = product(_BOTH, repeat=3) if albedo else [(False, False, False)]
        for classic, extra in [(False, extra) for extra in extras] + [(True, (False, False, False))]:
            for snorm in _BOTH if normal and not classic else (True,):
                for rest in product(_BOTH, repeat=5):
                    for visibility in _BOTH:
                        targets = albedo, normal, distance, *extra, id_target, visibility
                        yield GeometryVariant(*targets, classic, snorm, *rest)  # type: ignore[call-arg]


_TARGETS = ((True, False), (False, True), (True, True))
"""Radiance and light: at least one is written."""


def _ambient() -> Iterator[Variant]:
    for radiance, light in _TARGETS:
        yield AmbientVariant(classic=True, radiance=radiance, light=light)
        for lit, own, emission in product(_BOTH, repeat=3):
            # emission is no light that falls on something, and an ambient colour is for ambient light
            if (lit or (emission and radiance)) and (lit or not own):
                yield AmbientVariant(lit, own, emission, False, radiance, light)


def _lights(methods: tuple[DrawMethod, ...], fades: bool) -> Iterator[Variant]:
    fading: list[tuple[Any, Any]] = [("ramp_squared", "karis")]
    if fades:
        fading += [("attenuation", window) for window in get_args(Ending)]
    correct = list(product(get_args(Highlights), _BOTH, (0, 1, 4, 16), (True, False)))
    for method, (falloff, window), (radiance, light), orthographic, from_depth in product(
        methods, fading, _TARGETS, _BOTH, _BOTH
    ):
        for classic, (highlights, clamp, taps, snorm) in [
            *((False, chosen) for chosen in correct),
            (True, ("none", False, 0, True)),
        ]:
            if not fades and from_depth and not taps:
                continue  # without shadows, nobody asks where the surface is
            if highlights != "none" and not radiance:
                continue
            yield LightVariant(
                method,
                falloff,
                window,
                highlights,
                clamp,
                taps,  # type: ignore[arg-type]
                from_depth,
                classic,
                snorm,
                orthographic,
                radiance,
                light,
            )


def _resolve() -> Iterator[Variant]:
    for radiance, masked, color, final, gradient, supersample in product(
        (True, False), (True, False), (True, False), (True, False), (True, False), (1, 2)
    ):
        if not (color or final):
            continue
        for classic, tone in ((False, "exponential"), (False, "none"), (True, "none")):
            flags = (radiance, masked, color, final, gradient)
            yield ResolveVariant(*flags, False, classic, tone, supersample)  # type: ignore[arg-type]
            if gradient:
                yield ResolveVariant(*flags, True, classic, tone, supersample)  # type: ignore[arg-type]


def _light_views(view: View) -> list[Variant]:
    return [LightViewVariant(view, method, flat) for method in get_args(DrawMethod)[:3] for flat in _BOTH]


_LEGAL: dict[str, Callable[[], Iterable[Variant]]] = {
    "shadow_maps": lambda: (ShadowVariant(cutout) for cutout in _BOTH),
    "geometry": _geometry,
    "depth_copy": lambda: [Variant()],
    "ambient": _ambient,
    "directional_lights": lambda: _lights(("fullscreen", "loop"), fades=False),
    "point_lights": lambda: _lights(("sphere", "fullscreen", "loop"), fades=True),
    "spotlights": lambda: _lights(("sphere", "cone", "fullscreen", "loop"), fades=True),
    "plain": lambda: (PlainVariant(orthographic) for orthographic in _BOTH),
    "overdraw": lambda: _light_views("overdraw"),
    "volumes": lambda: _light_views("volumes"),
    "wireframe": lambda: _light_views("wireframe"),
    "resolve": _resolve,
}

PASS_ORDER = tuple(_LEGAL)
"""Every pass there is, in drawing order."""


def legal_variants(name: str) -> list[Variant]:
    """Every variant of a pass that a plan can hold."""
    return list(_LEGAL[name]())
