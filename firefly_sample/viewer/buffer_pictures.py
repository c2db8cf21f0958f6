"""Buffers as pictures: arrays of a Frame in, display codes out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.srgb import linear_to_srgb

Pixels = NDArray[np.uint8]
Float32 = NDArray[np.float32]

DARKEST = 0.1
"""The grey of what is farthest, so that it is told from where nothing is."""
GOLDEN = 0.6180339887498949
HEAT = ((0, 0, 0), (40, 44, 160), (214, 58, 150), (255, 168, 60), (255, 255, 255))
"""From nothing to most, in equal steps of lightness: black, blue, magenta, orange, white."""


def buffers_of(look: str) -> tuple[str, ...]:
    """Those of `BUFFERS` that a look has; "classic" has no highlights, emission, shadows and particles."""
    missing = ("specular", "emission", "shadow_atlas", "particle_shadow_atlas") if look == "classic" else ()
    return tuple(name for name in BUFFERS if name not in missing)


def buffer_picture(
    output: str,
    image: NDArray[Any],
    *,
    classic: bool = False,
    exposure: tuple[float, float, float] = (1.0, 1.0, 1.0),
) -> tuple[Pixels, str]:
    """A picture of one output, and a few words on how to read it.

    Parameters
    ----------
    output : str
        One of `BUFFERS`, but the atlases: see `firefly_sample.viewer.atlas`.
    image : ndarray
        As a `Frame` has it.
    classic : bool
        The look "classic" has albedo, normals and light as display codes: they are shown as they are.
    exposure : tuple of 3 floats
        What light and emission are multiplied by, as they are in the picture.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
        Black where nothing was drawn.
    str
    """
    if classic and output in ("albedo", "normal"):
        return codes(image), "as stored"
    if classic and output == "light":
        return codes(image), "light on white surfaces, in display codes"
    if output in ("light", "emission"):
        image = image * np.array(exposure, dtype=np.float32)
    return _PICTURES[output](image)


def _srgb(linear: Float32) -> Pixels:
    # a table over square roots, as the G-buffer stores them, errs by less than half a code
    table = codes(linear_to_srgb((np.arange(4096) / 4095.0) ** 2))
    return table[(np.sqrt(linear) * np.float32(4095.0) + np.float32(0.5)).astype(np.intp)]


def _toned(radiance: Float32) -> Pixels:
    """Through the picture's tone curve, for it may be of any size; what is not a number is white."""
    return _srgb(np.fmin(-np.expm1(-radiance), np.float32(1.0)))


def _albedo(image: Float32) -> tuple[Pixels, str]:
    return _srgb(image), "base colour, unlit"


def _specular(image: Float32) -> tuple[Pixels, str]:
    return _srgb(image), "colour of highlights, unlit"


def _normal(image: Float32) -> tuple[Pixels, str]:
    drawn = image.any(axis=-1, keepdims=True)
    return codes(np.where(drawn, image * 0.5 + 0.5, 0.0)), "x, y, z from -1 to 1 as red, green, blue"


def _depth(image: Float32) -> tuple[Pixels, str]:
    """Equal ratios of distance are equal steps of grey: the eye, too, judges distances by ratio."""
    drawn = np.isfinite(image)
    # an orthographic lens may see behind its origin: that is as white as the nearest
    ahead = image[drawn & (image > 0)]
    near, far = (float(ahead.min()), float(ahead.max())) if ahead.size else (1.0, 1.0)
    share = np.log(np.clip(image, near, far) / near) / max(np.log(far / near), 1e-9)
    grey = np.where(drawn, 1.0 - (1.0 - DARKEST) * share, 0.0)
    note = f"{near:.4g} (white) to {far:.4g} units away (dark), logarithmic"
    return np.repeat(codes(grey)[..., None], 3, axis=-1), note


def _position(image: Float32) -> tuple[Pixels, str]:
    drawn = np.isfinite(image[..., 0])
    seen = image[drawn]
    span = float(np.ptp(seen, axis=0).max()) if seen.size else 0.0
    # a power of ten: colours repeat one to ten times in what is seen
    period = 10.0 ** np.floor(np.log10(span)) if span > 0 else 1.0
    seen = seen / np.float32(period)
    pixels = np.zeros(image.shape, dtype=np.uint8)
    # a floor at height 0, which is a rounding error below it here and there, is of one colour
    pixels[drawn] = codes(seen - np.floor(seen + np.float32(1e-4)))
    return pixels, f"x, y, z as red, green, blue, again every {period:g} units"


def _id(image: NDArray[np.int32]) -> tuple[Pixels, str]:
    """A colour for each id: hues a golden section apart never come close to a neighbour's."""
    k = np.arange(int(image.max(initial=-1)) + 2)
    hue = k * GOLDEN % 1.0
    saturation = 0.45 + 0.2 * (k // 3 % 3)
    value = 1.0 - 0.2 * (k % 3)
    # HSV to RGB in the closed form f(n) = v - v s max(0, min(q, 4 - q, 1)), q = (n + 6 h) mod 6
    q = (np.array([5.0, 3.0, 1.0]) + 6.0 * hue[:, None]) % 6.0
    fall = np.clip(np.minimum(q, 4.0 - q), 0.0, 1.0)
    colors = value[:, None] * (1.0 - saturation[:, None] * fall)
    colors[-1] = 0.0  # index -1, nothing, lands here
    return codes(colors)[image], "a colour for each thing"


def _emission(image: Float32) -> tuple[Pixels, str]:
    return _toned(image), "what surfaces give off, through 1 - exp(-x) and sRGB"


def _light(image: Float32) -> tuple[Pixels, str]:
    return _toned(image), "light on white surfaces, through 1 - exp(-x) and sRGB"


def _overdraw(image: NDArray[np.int32]) -> tuple[Pixels, str]:
    most = int(image.max(initial=0))
    if most == 0:
        return np.zeros((*image.shape, 3), dtype=np.uint8), "no light shades anything"
    places = np.linspace(0.0, 1.0, len(HEAT))
    counts = np.arange(most + 1) / most
    table = np.stack([np.interp(counts, places, channel) for channel in zip(*HEAT, strict=True)], axis=1)
    return codes(table / 255.0)[image], f"times shaded: black 0, blue, magenta, orange, white {most}"


def _volumes(image: Pixels) -> tuple[Pixels, str]:
    return image, "where each light shades, in flat colours that add up"


def _wireframe(image: Pixels) -> tuple[Pixels, str]:
    return image, "edges of the light volumes that can be seen"


def codes(values: NDArray[Any]) -> Pixels:
    """Display codes of values in 0..1; what lies outside is clipped."""
    return np.asarray(np.clip(values, 0.0, 1.0) * np.float32(255.0) + np.float32(0.5), dtype=np.uint8)


_PICTURES: dict[str, Callable[[NDArray[Any]], tuple[Pixels, str]]] = {
    "albedo": _albedo,
    "normal": _normal,
    "depth": _depth,
    "position_world": _position,
    "id": _id,
    "specular": _specular,
    "emission": _emission,
    "light": _light,
    "overdraw": _overdraw,
    "volumes": _volumes,
    "wireframe": _wireframe,
}

BUFFERS = (*_PICTURES, "shadow_atlas", "particle_shadow_atlas")
"""The outputs that the window shows, in its order."""
