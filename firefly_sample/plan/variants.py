"""A pass's variant: a frozen dataclass that becomes shader defines, always 0 or 1 (or a small number).

Every field is a define of the same name in capitals. `firefly_sample.plan.legal_variants` lists a pass's
whole set, which a test compiles.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, get_args

PASS_ORDER = (
    "shadow_maps",
    "particle_shadow_slices",
    "particle_shadow_sums",
    "particle_shadow_blur_x",
    "particle_shadow_blur_y",
    "geometry",
    "interpolation",
    "forward",
    "depth_copy",
    "half_depth",
    "ambient",
    "directional_lights",
    "point_lights",
    "spotlights",
    "upsample",
    "particle_light",
    "particles",
    "plain",
    "overdraw",
    "volumes",
    "wireframe",
    "resolve",
    "particle_shadow_texture",
)
"""Every pass there is, in drawing order."""

DrawMethod = Literal["sphere", "cone", "fullscreen", "loop", "clustered"]
Highlights = Literal["none", "phong", "blinn_phong"]
Fading = Literal["ramp_squared", "attenuation"]
RangeFalloff = Literal["karis", "gltf"]
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
    these are packed. `float64` marks what the interpolation pass is to find again. `vertex_alpha` says that
    alpha of vertex colours cuts out.
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
    vertex_alpha: bool = False


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
    """Variant of a shadow map's casters: what alpha cuts them out, a texture's, vertex colours' or both's."""

    textured: bool = False
    vertex_alpha: bool = False


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

    `taps` is 0 for lights without shadow maps; `particle_shadow` is for light that particles take some of. `radiance`
    and `light` are the targets; with `half`, light of every second pixel, the first is of highlights alone.
    """

    method: DrawMethod = "sphere"
    falloff: Fading = "ramp_squared"
    range_falloff: RangeFalloff = "karis"
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
    particle_shadow: bool = False


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
    range_falloff: RangeFalloff = "karis"
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
    vertex_alpha: bool = False
    particle_shadow: bool = False
    method: Literal["loop"] = "loop"
    id: Literal[False] = False
    visibility: Literal[False] = False
    float64: Literal[False] = False


@dataclass(frozen=True)
class ParticleLightVariant(Variant):
    """All lights of one kind on all particles; fields as of `ForwardVariant`.

    `first` is the draw that brings ambient light. `faded` is for the light that fades on particles alone.
    """

    kind: Kind = "point"
    falloff: Fading = "ramp_squared"
    range_falloff: RangeFalloff = "karis"
    taps: Literal[0, 1, 4, 16] = 0
    particle_shadow: bool = False
    faded: bool = False
    first: bool = True
    orthographic: bool = False
    method: Literal["loop"] = "loop"


@dataclass(frozen=True)
class ParticleVariant(Variant):
    """Particles and the dots among them; `surfaces` says whether there are any to end at softly.

    `reverse` is of a depth buffer that tells where they are: it is 0 where there is none, else 1. `packed` is
    of colours that tell: whole numbers.
    """

    surfaces: bool = True
    position: Position = "distance"
    orthographic: bool = False
    reverse: bool = False
    packed: bool = False


@dataclass(frozen=True)
class PlainVariant(Variant):
    """Soft dots."""

    orthographic: bool = False


@dataclass(frozen=True)
class LightViewVariant(Variant):
    """What is drawn in place of light: how often a pixel is shaded, or the volumes themselves.

    `position` is where the distance that a cell is found by comes from.
    """

    view: View = "overdraw"
    method: DrawMethod = "sphere"
    orthographic: bool = False
    position: Position = "distance"


@dataclass(frozen=True)
class ResolveVariant(Variant):
    """What the last pass reads and writes; `marked` says that a target of its own tells what is covered.

    Without that colours tell, which are whole numbers where they are `packed`.
    """

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
    particles: bool = False
    packed: bool = False


_NUMBERS = {
    name: number
    for choices in (
        *(DrawMethod, Highlights, Fading, RangeFalloff, View),
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
