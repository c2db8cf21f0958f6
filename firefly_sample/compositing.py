"""Draw the output color_alpha over a background, as `color` would show it there."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import OutputError, did_you_mean
from firefly_sample.srgb import linear_to_srgb, srgb_to_linear

Float64 = NDArray[np.float64]

TONES = ("exponential", "none")
WHITE = 254.5
"""The code from which on a picture is white; no radiance belongs to the code 255 of the exponential curve."""


def composite(color_alpha: ArrayLike, background: ArrayLike, tone: str = "exponential") -> NDArray[np.uint8]:
    """Return a picture of sRGB codes, uint8, shape (..., 3): `color_alpha` over a background.

    Light is added before the tone curve: radiance = foreground * alpha + background * (1 - alpha). With the
    tone curve "none" that is the usual "over" in linear light. Where alpha is 0 or 255, the codes are those
    of the background or of the foreground.

    Parameters
    ----------
    color_alpha : array_like of uint8, shape (..., 4)
        The output of that name.
    background : array_like, shape (..., 3) or (3,)
        sRGB codes if it is of whole numbers, 0 to 255; otherwise linear radiance times the exposure, 0 or
        more, which may be brighter than white.
    tone : {"exponential", "none"}
        The setting `tone` with which `color_alpha` was made.

    Raises
    ------
    OutputError
        If a shape, a value or the tone curve is none of these.
    """
    if tone not in TONES:
        raise OutputError(
            f"there is no tone curve {tone!r}{did_you_mean(tone, TONES)}: choose from {', '.join(TONES)}"
        )
    image, behind = np.asarray(color_alpha), np.asarray(background)
    if image.dtype != np.uint8 or image.shape[-1:] != (4,):
        raise OutputError(f"color_alpha must be uint8 of shape (..., 4), got {image.dtype} {image.shape}")
    if behind.dtype.kind not in "uif" or behind.shape not in ((3,), (*image.shape[:-1], 3)):
        raise OutputError(
            f"a background must be one colour of 3 numbers, or of shape {(*image.shape[:-1], 3)}, "
            f"got {behind.dtype} {behind.shape}"
        )
    coded = behind.dtype.kind in "ui"
    largest = 255 if coded else np.inf
    if not ((behind >= 0) & (behind <= largest)).all():
        raise OutputError("a background must be sRGB codes of 0 to 255, or radiance of 0 or more")
    light = _radiance(behind, tone) if coded else behind.astype(np.float64)
    alpha = image[..., 3:]
    share = alpha / 255.0
    with np.errstate(invalid="ignore"):  # infinity times 0, where the foreground is opaque
        mixed = _codes(_radiance(image[..., :3], tone) * share + light * (1.0 - share), tone)
    under = behind.astype(np.uint8) if coded else _codes(light, tone)
    return np.asarray(np.where(alpha == 255, image[..., :3], np.where(alpha == 0, under, mixed)))


def _radiance(codes: NDArray[np.generic], tone: str) -> Float64:
    """Return the exposed radiance that a tone curve shows as these codes."""
    if tone == "none":
        return srgb_to_linear(codes.astype(np.float64) / 255.0)
    return np.asarray(-np.log1p(-srgb_to_linear(np.minimum(codes.astype(np.float64), WHITE) / 255.0)))


def _codes(radiance: Float64, tone: str) -> NDArray[np.uint8]:
    """Return the codes of exposed radiance."""
    shown = -np.expm1(-radiance) if tone == "exponential" else radiance
    return np.asarray(np.rint(linear_to_srgb(np.nan_to_num(shown)) * 255.0).astype(np.uint8))
