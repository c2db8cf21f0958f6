"""The radiance of metallic-roughness surfaces in float64: by glTF 2.0 (appendix B), or by pyrender's terms.

Each name in `PYRENDER` exchanges one term of glTF's formula for that of pyrender's shader, mesh.frag. The
module is written from the text of the specification and that shader; it uses nothing of the renderer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

PYRENDER = {
    "diffuse": "dielectrics reflect diffusely by 0.96 of their base colour",
    "visibility": "separable Schlick-Smith with k = (r + 1)^2 / 8 in place of Smith's for GGX",
    "floors": "NL and NV are 0.001 at least, and 0.001 is added to 4 NL NV",
    "roughness": "roughness is 0.04 at least",
    "emission": "the emissive factor is squared",
    "occlusion": "occlusion darkens all light but emission, and not only ambient light",
    "tint": "vertex colours multiply what is seen, and not the base colour",
    "range": "light goes on beyond its range",
    "eye": "rays of an orthographic camera meet in its position",
    "display": "codes are radiance to the power 1/2.2, and not sRGB",
}
GLTF: frozenset[str] = frozenset()


@dataclass
class Surface:
    """The surfaces in n pixels, in view space or another rigid one: arrays of shape (n, 3) or (n,)."""

    position: np.ndarray
    normal: np.ndarray
    to_eye: np.ndarray
    """From the surface to the eye, unit; for parallel rays, against them."""
    base: np.ndarray
    metallic: np.ndarray
    roughness: np.ndarray
    emission: np.ndarray
    tint: np.ndarray
    occlusion: np.ndarray


@dataclass(frozen=True)
class Lamp:
    """A light of KHR_lights_punctual, in the surfaces' space; one without a position is directional."""

    intensity: np.ndarray
    """Colour times intensity: candela, or lux of a directional one."""
    position: np.ndarray | None = None
    direction: np.ndarray | None = None
    """The direction in which it shines, a unit vector; None for a point light."""
    cone: tuple[float, float] | None = None
    """Inner and outer half-angle of a spotlight, radians."""
    end: float = math.inf


@dataclass
class Lighting:
    lamps: list[Lamp] = field(default_factory=list)
    ambient: np.ndarray = field(default_factory=lambda: np.zeros(3))
    """Times base colour and occlusion: glTF has none, this is pyrender's."""


def codes(surface: Surface, lighting: Lighting, terms=GLTF) -> np.ndarray:
    """Display codes 0 to 255, shape (n, 3), rounded as in an image of bytes."""
    linear = np.clip(radiance(surface, lighting, terms), 0.0, None)
    if "display" in terms:
        shown = linear ** (1.0 / 2.2)
    else:
        shown = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)
    return np.round(255.0 * np.clip(shown, 0.0, 1.0))


def radiance(surface: Surface, lighting: Lighting, terms=GLTF) -> np.ndarray:
    """Linear radiance towards the eye, shape (n, 3)."""
    tinted_at_last = "tint" in terms
    base = surface.base if tinted_at_last else surface.base * surface.tint
    reflected = sum((_reflected(surface, base, lamp, terms) for lamp in lighting.lamps), np.zeros_like(base))
    occlusion = surface.occlusion[:, None]
    ambient = base * lighting.ambient
    reflected = (reflected + ambient) * occlusion if "occlusion" in terms else reflected + ambient * occlusion
    emission = surface.emission**2 if "emission" in terms else surface.emission
    return (reflected + emission) * (surface.tint if tinted_at_last else 1.0)


def _reflected(surface: Surface, base: np.ndarray, lamp: Lamp, terms) -> np.ndarray:
    """Return the share of a light that a surface reflects, shape (n, 3)."""
    to_light, irradiance = _arriving(surface.position, lamp, terms)
    floors = "floors" in terms
    normal, to_eye = surface.normal, surface.to_eye
    half = _unit(to_light + to_eye)
    nl_signed, nh_signed = _dot(normal, to_light), _dot(normal, half)
    least = 0.001 if floors else 0.0
    nl, nv = np.clip(nl_signed, least, 1.0), np.clip(np.abs(_dot(normal, to_eye)), least, 1.0)
    nh, vh = np.clip(nh_signed, 0.0, 1.0), np.clip(_dot(to_eye, half), 0.0, 1.0)
    roughness = np.maximum(surface.roughness, 0.04) if "roughness" in terms else surface.roughness

    metallic = surface.metallic[:, None]
    f0 = 0.04 * (1.0 - metallic) + base * metallic
    fresnel = f0 + (1.0 - f0) * ((1.0 - vh) ** 5)[:, None]
    diffuse = base * (1.0 - metallic) * (0.96 if "diffuse" in terms else 1.0)
    distribution = _ggx(nh, roughness) * (floors | (nh_signed > 0.0))
    visibility = (_schlick_smith if "visibility" in terms else _smith_ggx)(nl, nv, roughness)
    if floors:
        visibility = visibility * 4.0 * nl * nv / (4.0 * nl * nv + 0.001)
    brdf = (1.0 - fresnel) * diffuse / math.pi + fresnel * (distribution * visibility)[:, None]
    return irradiance * nl[:, None] * brdf


def _arriving(position: np.ndarray, lamp: Lamp, terms) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors to a light, shape (n, 3), and its irradiance of surfaces that face it, shape (n, 3)."""
    if lamp.position is None:
        shape = position.shape
        return np.broadcast_to(-lamp.direction, shape), np.broadcast_to(lamp.intensity, shape)
    way = lamp.position - position
    distance = np.linalg.norm(way, axis=-1)
    to_light = way / distance[:, None]
    fade = 1.0 / distance**2
    if lamp.cone is not None:
        inner, outer = np.cos(lamp.cone)
        scale = 1.0 / max(0.001, inner - outer)
        cosine = np.clip(_dot(lamp.direction, -to_light), 0.0, 1.0)
        fade = fade * np.clip(cosine * scale - outer * scale, 0.0, 1.0) ** 2
    if "range" not in terms and lamp.end < math.inf:
        fade = fade * np.clip(1.0 - (distance / lamp.end) ** 4, 0.0, 1.0)
    return to_light, lamp.intensity * fade[:, None]


def _ggx(nh: np.ndarray, roughness: np.ndarray) -> np.ndarray:
    """Trowbridge-Reitz with alpha = roughness^2."""
    square = roughness**4
    return square / (math.pi * (nh**2 * (square - 1.0) + 1.0) ** 2)


def _smith_ggx(nl: np.ndarray, nv: np.ndarray, roughness: np.ndarray) -> np.ndarray:
    """glTF's G / (4 NL NV)."""
    square = roughness**4
    to_light, to_eye = (cosine + np.sqrt(square + (1.0 - square) * cosine**2) for cosine in (nl, nv))
    return 1.0 / (to_light * to_eye)


def _schlick_smith(nl: np.ndarray, nv: np.ndarray, roughness: np.ndarray) -> np.ndarray:
    """pyrender's G / (4 NL NV)."""
    k = (roughness + 1.0) ** 2 / 8.0
    return 0.25 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k))


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a * b).sum(axis=-1)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
