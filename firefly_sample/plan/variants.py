"""A pass's variant: a frozen dataclass that becomes shader defines, always 0 or 1 (or a small number).

Every field is a define of the same name in capitals. `LEGAL` lists each pass's whole set, which a test
compiles.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import product
from typing import Literal

__all__ = [
    "LEGAL",
    "AmbientVariant",
    "GeometryVariant",
    "PlainVariant",
    "PointLightsVariant",
    "ResolveVariant",
    "Variant",
    "defines",
]


@dataclass(frozen=True)
class Variant:
    """The base of all variants; a pass without choices uses it as it is."""


@dataclass(frozen=True)
class GeometryVariant(Variant):
    """How the G-buffer is written; the first five fields say which targets there are."""

    albedo: bool = True
    normal: bool = True
    distance: bool = True
    id: bool = False
    classic: bool = False
    snorm: bool = True
    orthographic: bool = False
    textured: bool = False
    vertex_color: bool = False
    cutout: bool = False
    double_sided: bool = False


@dataclass(frozen=True)
class AmbientVariant(Variant):
    """Classic adds stored (display) values."""

    classic: bool = False


@dataclass(frozen=True)
class PointLightsVariant(Variant):
    """How lights find their pixels, and where a pixel's position comes from."""

    method: Literal["volumes", "fullscreen", "loop"] = "volumes"
    from_depth: bool = False
    classic: bool = False
    snorm: bool = True
    orthographic: bool = False
    falloff: Literal["ramp_squared"] = "ramp_squared"


@dataclass(frozen=True)
class PlainVariant(Variant):
    """Soft dots."""

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


_NUMBERS = {"ramp_squared": 0, "volumes": 0, "fullscreen": 1, "loop": 2, "none": 0, "exponential": 1}


def defines(variant: Variant) -> dict[str, int]:
    """The defines of a variant: names in capitals, booleans as 0 or 1, choices as their number."""
    result = {}
    for field in fields(variant):
        value = getattr(variant, field.name)
        result[field.name.upper()] = _NUMBERS[value] if isinstance(value, str) else int(value)
    return result


def _geometry() -> list[Variant]:
    return [GeometryVariant(*flags) for flags in product((True, False), repeat=len(fields(GeometryVariant)))]


def _resolve() -> list[Variant]:
    result: list[Variant] = []
    for radiance, masked, color, final, gradient, supersample in product(
        (True, False), (True, False), (True, False), (True, False), (True, False), (1, 2)
    ):
        if not (color or final):
            continue
        for classic, tone in ((False, "exponential"), (False, "none"), (True, "none")):
            flags = (radiance, masked, color, final, gradient)
            result.append(ResolveVariant(*flags, False, classic, tone, supersample))  # type: ignore[arg-type]
            if gradient:
                result.append(ResolveVariant(*flags, True, classic, tone, supersample))  # type: ignore[arg-type]
    return result


LEGAL: dict[str, list[Variant]] = {
    "geometry": _geometry(),
    "depth_copy": [Variant()],
    "ambient": [AmbientVariant(classic) for classic in (False, True)],
    "point_lights": [
        PointLightsVariant(method, *flags)  # type: ignore[arg-type]
        for method in ("volumes", "fullscreen", "loop")
        for flags in product((True, False), repeat=4)
    ],
    "plain": [PlainVariant(orthographic) for orthographic in (False, True)],
    "resolve": _resolve(),
}
"""Every variant that a plan can hold, by pass. The order of the passes is the drawing order."""
