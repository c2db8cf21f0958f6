"""The G-buffer as pictures: arrays of a Frame in, display codes out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.reference.color import linear_to_srgb

__all__ = ["BUFFERS", "buffer_note", "buffer_picture"]

Pixels = NDArray[np.uint8]

DARKEST = 0.1
"""The grey of what is farthest, so that it is told from where nothing is."""
GOLDEN = 0.6180339887498949


def buffer_picture(output: str, image: NDArray[Any], classic: bool = False) -> Pixels:
    """A picture of one output, shape (height, width, 3), black where nothing was drawn.

    Parameters
    ----------
    output : str
        A key of `BUFFERS`.
    image : ndarray
        As a `Frame` has it.
    classic : bool
        The look "classic" stores albedo and normals as display codes: they are shown as they are.
    """
    if classic and output in ("albedo", "normal"):
        return _codes(image)
    return _PICTURES[output](image)


def buffer_note(output: str, image: NDArray[Any]) -> str:
    """How to read that picture, in a few words."""
    if output == "depth":
        near, far = _extent(image)
        return f"{near:.4g} (white) to {far:.4g} units away (dark), logarithmic"
    if output == "position_world":
        return f"x, y, z as red, green, blue, again every {_period(image):g} units"
    return BUFFERS[output]


def _albedo(image: NDArray[Any]) -> Pixels:
    return _codes(linear_to_srgb(image))


def _normal(image: NDArray[Any]) -> Pixels:
    drawn = image.any(axis=-1, keepdims=True)
    return _codes(np.where(drawn, image * 0.5 + 0.5, 0.0))


def _depth(image: NDArray[Any]) -> Pixels:
    """Equal ratios of distance are equal steps of grey: the eye, too, judges distances by ratio."""
    near, far = _extent(image)
    drawn = np.isfinite(image)
    # an orthographic lens may see behind its origin: that is as white as the nearest
    ratio = np.log(np.clip(np.where(drawn, image, near), near, far) / near) / max(np.log(far / near), 1e-9)
    grey = np.where(drawn, 1.0 - (1.0 - DARKEST) * ratio, 0.0)
    return _codes(np.repeat(grey[..., None], 3, axis=-1))


def _position(image: NDArray[Any]) -> Pixels:
    return _codes(np.nan_to_num(image / _period(image) % 1.0, nan=0.0))


def _id(image: NDArray[Any]) -> Pixels:
    """A colour for each id: hues a golden section apart never come close to a neighbour's."""
    k = np.arange(int(image.max(initial=-1)) + 2)
    hue = k * GOLDEN % 1.0
    saturation = 0.45 + 0.2 * (k // 3 % 3)
    value = 1.0 - 0.2 * (k % 3)
    # HSV to RGB in the closed form f(n) = v - v s max(0, min(q, 4 - q, 1)), q = (n + 6 h) mod 6
    q = (np.array([5.0, 3.0, 1.0]) + 6.0 * hue[:, None]) % 6.0
    fall = np.clip(np.minimum(q, 4.0 - q), 0.0, 1.0)
    colors = value[:, None] * (1.0 - saturation[:, None] * fall)
    colors[-1] = 0.0  # where index -1, nothing, lands
    return np.asarray(_codes(colors)[image])


def _extent(image: NDArray[Any]) -> tuple[float, float]:
    """The nearest and the farthest distance that is seen and above 0."""
    seen = image[np.isfinite(image) & (image > 0)]
    return (float(seen.min()), float(seen.max())) if seen.size else (1.0, 1.0)


def _period(image: NDArray[Any]) -> float:
    """A power of ten of units after which colours repeat: one to ten times in what is seen."""
    seen = image[np.isfinite(image).all(axis=-1)]
    span = float(np.ptp(seen, axis=0).max()) if seen.size else 0.0
    return float(10.0 ** np.floor(np.log10(span))) if span > 0 else 1.0


def _codes(values: NDArray[Any]) -> Pixels:
    return np.asarray(np.clip(values, 0.0, 1.0) * 255.0 + 0.5, dtype=np.uint8)


BUFFERS = {
    "albedo": "base colour, unlit",
    "normal": "x, y, z from -1 to 1 as red, green, blue",
    "depth": "distance along the view axis",
    "position_world": "x, y, z as red, green, blue",
    "id": "a colour for each thing",
}
"""The outputs that the window shows, in its order, and what they are."""

_PICTURES: dict[str, Callable[[NDArray[Any]], Pixels]] = {
    "albedo": _albedo,
    "normal": _normal,
    "depth": _depth,
    "position_world": _position,
    "id": _id,
}
