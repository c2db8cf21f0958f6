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
    "ColorPacking",
    "DrawMethod",
    "ForwardVariant",
    "GeometryVariant",
    "InterpolationVariant",
    "LightVariant",
    "LightViewVariant",
    "NormalPacking",
    "PlainVariant",
    "Position",
    "ResolveVariant",
    "ShadowVariant",
    "Stored",
    "UpsampleVariant",
    "Variant",
    "defines",
    "legal_variants",
]

DrawMethod = Literal["sphere", "cone", "fullscreen", "loop"]
Highlights = Literal["none", "phong", "blinn_phong"]
Fading = Literal["ramp_squared", "attenuation"]
Ending = Literal["karis", "gltf"]
Position = Literal["distance", "depth", "matrix", "stored"]
NormalPacking = Literal["snorm16", "unorm16", "unorm8", "shifted", "plain", "undecoded"]
ColorPacking = Literal["linear", "root", "root10"]
Stored = Literal["none", "full", "half"]
Kind = Literal["none", "directional", "point", "spot"]
View = Literal["overdraw", "volumes", "wireframe"]


@dataclass(frozen=True)
class Variant:
    """The base of all variants; a pass without choices uses it as it is."""


@dataclass(frozen=True)
class GeometryVariant(Variant):
    """How the G-buffer is written; the first eight fields say which targets there are, with `stored`.

    `stored` is the target of whole positions: none, float32, or half floats. `normals` and `colors` are how
    these are packed. `float64` marks what the interpolation pass is to find again.
    """

    albedo: bool = True
    normal: bool = True
    distance: bool = True
    ambient: bool = False
    specular: bool = False
    emission: bool = False
    id: bool = False
    visibility: bool = False
    stored: Stored = "none"
    normals: NormalPacking = "snorm16"
    colors: ColorPacking = "root10"
    float64: bool = False
    orthographic: bool = False
    textured: bool = False
    vertex_color: bool = False
    cutout: bool = False
    double_sided: bool = False


@dataclass(frozen=True)
class InterpolationVariant(Variant):
    """Which targets of the geometry pass are written again, and how: fields as there."""

    normal: bool = True
    distance: bool = True
    stored: Stored = "none"
    normals: NormalPacking = "snorm16"
    colors: Literal["linear"] = "linear"
    orthographic: bool = False


@dataclass(frozen=True)
class ShadowVariant(Variant):
    """What a shadow map's casters are: with a texture whose alpha cuts out, or opaque."""

    cutout: bool = False


@dataclass(frozen=True)
class AmbientVariant(Variant):
    """What there is from the first: ambient light, with colours of its own, and emission.

    `colors` is how surfaces' colours are packed. `radiance` and `light` are the targets.
    """

    lit: bool = True
    own: bool = False
    emission: bool = False
    colors: ColorPacking = "root10"
    radiance: bool = True
    light: bool = False


@dataclass(frozen=True)
class LightVariant(Variant):
    """How lights find their pixels, where a pixel's position comes from, and what light does there.

    `taps` is 0 for lights without shadow maps. `radiance` and `light` are the targets; with `half`, light of
    every second pixel, the first is of highlights alone.
    """

    method: DrawMethod = "sphere"
    falloff: Fading = "ramp_squared"
    window: Ending = "karis"
    highlights: Highlights = "none"
    clamp_light: bool = False
    taps: Literal[0, 1, 4, 16] = 0
    position: Position = "distance"
    normals: NormalPacking = "snorm16"
    colors: ColorPacking = "root10"
    orthographic: bool = False
    radiance: bool = True
    light: bool = False
    half: bool = False


@dataclass(frozen=True)
class UpsampleVariant(Variant):
    """What light of half the resolution is spread to: `radiance` and `light` are the targets.

    `shine` says whether there are highlights; `highlights`, of surfaces, is never needed.
    """

    position: Position = "distance"
    normals: NormalPacking = "snorm16"
    colors: ColorPacking = "root10"
    orthographic: bool = False
    radiance: bool = True
    light: bool = False
    shine: bool = False
    highlights: Literal["none"] = "none"
    half: Literal[False] = False


@dataclass(frozen=True)
class ForwardVariant(Variant):
    """Surfaces as the geometry pass has them, shaded at once by all lights of one kind.

    `first` is the draw that also brings ambient light, emission and the mark of what is covered.
    """

    kind: Kind = "point"
    falloff: Fading = "ramp_squared"
    window: Ending = "karis"
    highlights: Highlights = "none"
    clamp_light: bool = False
    taps: Literal[0, 1, 4, 16] = 0
    first: bool = True
    ambient: bool = False
    specular: bool = False
    emission: bool = False
    orthographic: bool = False
    textured: bool = False
    vertex_color: bool = False
    cutout: bool = False
    double_sided: bool = False
    method: Literal["loop"] = "loop"
    id: Literal[False] = False
    visibility: Literal[False] = False
    float64: Literal[False] = False


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
    """What the last pass reads and writes; `marked` says that a target of its own tells what is covered."""

    radiance: bool = True
    masked: bool = True
    color: bool = True
    final_radiance: bool = False
    gradient: bool = False
    orthographic: bool = False
    classic: bool = False
    tone: Literal["exponential", "none"] = "exponential"
    supersample: Literal[1, 2] = 1
    marked: bool = False


_NUMBERS = {
    name: number
    for choices in (
        *(DrawMethod, Highlights, Fading, Ending, View),
        *(Position, NormalPacking, ColorPacking, Stored, Kind),
    )
    for number, name in enumerate(get_args(choices))
} | {"exponential": 1}


def defines(variant: Variant) -> dict[str, int]:
    """The defines of a variant: names in capitals, booleans as 0 or 1, choices as their number."""
    result = {}
    for field in fields(variant):
        value = getattr(variant, field.name)
        result[field.name.upper()] = _NUMBERS[value] if isinstance(value, str) else int(value)
    return result


_BOTH = (False, True)


_PACKINGS = tuple(product(get_args(NormalPacking)[:5], get_args(ColorPacking)))
_ORIGINAL = ("undecoded", "linear")
"""What the classic look has."""


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
                for ids, rest in product(product(_BOTH, repeat=2), product(_BOTH, repeat=5)):
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


def _lights(methods: tuple[DrawMethod, ...], fades: bool) -> Iterator[Variant]:
    fading: list[tuple[Any, Any]] = [("ramp_squared", "karis")]
    if fades:
        fading += [("attenuation", window) for window in get_args(Ending)]
    for method, (falloff, window), orthographic, position in product(
        methods, fading, _BOTH, get_args(Position)
    ):
        for taps, highlights, clamp, half in product((0, 1, 4, 16), get_args(Highlights), _BOTH, _BOTH):
            if not fades and position != "distance" and not taps:
                continue  # without shadows, nobody asks where the surface is
            for radiance, light in [(highlights != "none", True)] if half else _TARGETS:
                if highlights != "none" and not radiance:
                    continue
                for normals, colors in _PACKINGS:
                    yield LightVariant(
                        method,
                        falloff,
                        window,
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
                    )
        for radiance, light in _TARGETS:
            if fades or position == "distance":
                shared = {"falloff": falloff, "window": window, "orthographic": orthographic}
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


def _forward() -> Iterator[Variant]:
    ways: list[tuple[Any, Any, Any]] = [
        ("directional", "ramp_squared", "karis"),
        *((kind, "ramp_squared", "karis") for kind in ("point", "spot")),
        *((kind, "attenuation", window) for kind in ("point", "spot") for window in get_args(Ending)),
    ]
    for surface in product(_BOTH, repeat=5):
        for own, emission in product(_BOTH, repeat=2):
            # without a light there is nothing but these
            yield ForwardVariant("none", ambient=own, emission=emission, **_surface(surface))
        for (kind, falloff, window), highlights, clamp, taps in product(
            ways, get_args(Highlights), _BOTH, (0, 1, 4, 16)
        ):
            lit = (kind, falloff, window, highlights, clamp, taps)
            shiny = highlights != "none"
            yield ForwardVariant(*lit, False, specular=shiny, **_surface(surface))
            for own, emission in product(_BOTH, repeat=2):
                yield ForwardVariant(*lit, True, own, shiny, emission, **_surface(surface))


def _surface(flags: tuple[bool, ...]) -> dict[str, Any]:
    names = ("orthographic", "textured", "vertex_color", "cutout", "double_sided")
    return dict(zip(names, flags, strict=True))


def _resolve() -> Iterator[Variant]:
    for radiance, masked, color, final, gradient, supersample in product(
        (True, False), (True, False), (True, False), (True, False), (True, False), (1, 2)
    ):
        if not (color or final):
            continue
        for classic, tone in ((False, "exponential"), (False, "none"), (True, "none")):
            for marked in _BOTH if masked and not classic else (False,):
                for flat in _BOTH if gradient else (False,):
                    flags = (radiance, masked, color, final, gradient, flat, classic)
                    yield ResolveVariant(*flags, tone, supersample, marked)  # type: ignore[arg-type]


def _light_views(view: View) -> list[Variant]:
    return [LightViewVariant(view, method, flat) for method in get_args(DrawMethod)[:3] for flat in _BOTH]


_LEGAL: dict[str, Callable[[], Iterable[Variant]]] = {
    "shadow_maps": lambda: (ShadowVariant(cutout) for cutout in _BOTH),
    "geometry": _geometry,
    "interpolation": _interpolation,
    "forward": _forward,
    "depth_copy": lambda: [Variant()],
    "half_depth": lambda: [Variant()],
    "ambient": _ambient,
    "directional_lights": lambda: _lights(("fullscreen", "loop"), fades=False),
    "point_lights": lambda: _lights(("sphere", "fullscreen", "loop"), fades=True),
    "spotlights": lambda: _lights(("sphere", "cone", "fullscreen", "loop"), fades=True),
    "upsample": _upsample,
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
