"""A picture of how two images differ: expected, actual and difference side by side."""

from __future__ import annotations

import io
import math

import numpy as np
from numpy.typing import NDArray

from firefly_sample.capture.checking.comparing import Difference, absolute_difference
from firefly_sample.capture.datasets.masks import known_info
from firefly_sample.frame import Image

Picture = NDArray[np.uint8]
_NARROWEST = 320
"""Images are enlarged until they have about this width, so that single pixels can be seen."""
_GAP, _LINE = 8, 16
_UNDEFINED = (24, 24, 72)
"""The colour of NaN and infinity: where nothing was drawn."""
_ONE_SIDED = (255, 0, 255)
"""The colour, in the difference, of values that are finite in only one image."""
_FAINTEST = 56
"""Each pixel over the limit is at least this bright in the difference, so that it can be seen."""
_BOX = (255, 220, 0)


def difference_picture(
    output: str, expected: Image, actual: Image, difference: Difference, captions: tuple[str, str]
) -> bytes:
    """Return a PNG file: the expected image, the actual one, and their difference, amplified.

    The brightest pixel of the difference is the largest one, and its caption says by how much it is
    amplified. Pixels over the limit are dark grey at least; a yellow box is drawn around them if they lie
    close together. Float images are shown from their least to their largest value, integers by a colour for
    each.

    Parameters
    ----------
    output : str
    expected, actual : ndarray
        Images of the same shape.
    difference : Difference
    captions : (str, str)
        Lines above the first two images.
    """
    import PIL.Image
    from PIL import ImageDraw

    amplified, about = _amplified(output, expected, actual, difference)
    panels = [*_shown(output, expected, actual), amplified]
    height, width = panels[0].shape[:2]
    times = max(1, round(_NARROWEST / width))
    pitch = width * times + _GAP
    top = 2 * _LINE + _GAP
    sheet = PIL.Image.new("RGB", (3 * pitch + _GAP, height * times + top + _GAP), (48, 48, 48))
    draw = ImageDraw.Draw(sheet)
    titles = (("expected", captions[0]), ("actual", captions[1]), about)
    for place, (panel, lines) in enumerate(zip(panels, titles, strict=True)):
        left = _GAP + place * pitch
        picture = PIL.Image.fromarray(panel)
        sheet.paste(
            picture.resize((width * times, height * times), PIL.Image.Resampling.NEAREST), (left, top)
        )
        for row, line in enumerate(lines):
            draw.text((left, 4 + row * _LINE), _fitting(draw, line, width * times), (255, 255, 255))
    box = _small_box(difference)
    if box is not None:
        x0, y0, x1, y1 = (part * times for part in box)
        left = _GAP + 2 * pitch
        draw.rectangle((left + x0 - 3, top + y0 - 3, left + x1 + 2, top + y1 + 2), outline=_BOX)
    file = io.BytesIO()
    sheet.save(file, format="PNG")
    return file.getvalue()


def _fitting(draw: object, text: str, width: int) -> str:
    """Return a line, without its beginning if it is too long: of a path, the end says more."""
    length = draw.textlength  # type: ignore[attr-defined]
    if length(text) <= width:
        return text
    while text and length(f"...{text}") > width:
        text = text[1:]
    return f"...{text}"


def _small_box(difference: Difference) -> tuple[int, int, int, int] | None:
    """Return left, top, right and bottom of the pixels over the limit; None if they take up much room."""
    rows, columns = (np.flatnonzero(difference.over.any(axis=axis)) for axis in (1, 0))
    if not rows.size:
        return None
    box = (int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1)
    area = (box[2] - box[0]) * (box[3] - box[1])
    return box if area <= difference.of / 16 else None


def _amplified(
    output: str, expected: Image, actual: Image, difference: Difference
) -> tuple[Picture, tuple[str, str]]:
    """Return the difference as a picture, and two lines about it."""
    share = f"{difference.pixels:,} of {difference.of:,} pixels ({share_text(difference)})"
    if known_info(output).dtype == "int32":
        white = np.where(difference.over[..., None], 255, 0) * np.ones(3)
        return white.astype(np.uint8), ("difference: pixels that are not equal", share)
    away = absolute_difference(expected, actual)
    one_sided = ~np.isfinite(away)
    away[one_sided] = 0.0
    largest = float(away.max(initial=0.0))
    if away.ndim == 2:
        away = np.repeat(away[..., None], 3, axis=2)
    elif away.shape[2] != 3:  # a difference of alpha alone must be seen too
        away = np.repeat(away.max(axis=2, keepdims=True), 3, axis=2)
    picture = np.round(away * (255.0 / largest if largest else 0.0)).astype(np.uint8)
    picture[difference.over] = np.maximum(picture[difference.over], _FAINTEST)
    picture[one_sided.any(axis=2) if one_sided.ndim == 3 else one_sided] = _ONE_SIDED
    if known_info(output).dtype == "uint8":
        title = f"difference x{255.0 / largest:.3g}" if largest else "difference"
        return picture, (f"{title}, largest {largest:g} codes", share)
    one_only = ", magenta is in one image only" if one_sided.any() else ""
    return picture, (f"difference: white is {largest:.3g}{one_only}", share)


def share_text(difference: Difference) -> str:
    """Return the share of pixels over the limit, for example "12 %" or "0.021 %"."""
    share = 100.0 * difference.pixels / max(difference.of, 1)
    return f"{share:.0f} %" if share >= 9.95 else f"{share:.2g} %"


def _shown(output: str, expected: Image, actual: Image) -> tuple[Picture, Picture]:
    """Return two images as pictures, by the same scale."""
    info = known_info(output)
    if info.dtype == "uint8":
        return _opaque(expected), _opaque(actual)
    if info.dtype == "int32":
        return _in_colors(expected), _in_colors(actual)
    both = np.stack([expected, actual]).astype(np.float64)
    both[~np.isfinite(both)] = np.nan
    if both.ndim == 3:
        both = both[..., None]
    undefined = np.isnan(both).any(axis=-1)
    low, high = _range(info.unit, both)
    span = np.where(high > low, high - low, 1.0)
    unit = np.clip((np.nan_to_num(both) - low) / span, 0.0, 1.0)
    if info.unit.startswith("linear"):
        unit **= 1.0 / 2.2
    pictures = np.round(255.0 * np.broadcast_to(unit, (*unit.shape[:3], 3))).astype(np.uint8)
    pictures[undefined] = _UNDEFINED
    return pictures[0], pictures[1]


def _range(unit: str, both: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what is shown as black and as white: one number for each channel."""
    channels = both.shape[-1]
    if unit == "unit vector":
        return np.full(channels, -1.0), np.full(channels, 1.0)
    values = both.reshape(-1, channels)
    values = values[~np.isnan(values).any(axis=1)]
    if not values.size:
        return np.zeros(channels), np.ones(channels)
    if unit.startswith("linear"):  # colours: all channels from 0, without the brightest highlights
        return np.zeros(channels), np.full(channels, np.percentile(values, 99.9))
    return values.min(axis=0), values.max(axis=0)


def _opaque(image: Image) -> Picture:
    """Return a picture; one with alpha over grey squares."""
    if image.ndim == 2 or image.shape[2] == 3:
        picture = image.astype(np.uint8)
        return np.repeat(picture[..., None], 3, axis=2) if image.ndim == 2 else picture
    rows, columns = np.indices(image.shape[:2]) // 8
    squares = np.where((rows + columns) % 2, 96.0, 160.0)[..., None]
    alpha = image[..., 3:] / 255.0
    return np.round(image[..., :3] * alpha + squares * (1.0 - alpha)).astype(np.uint8)


def _in_colors(image: Image) -> Picture:
    """Return whole numbers as colours that tell neighbours apart; those below 0 are `_UNDEFINED`."""
    numbers = image if image.ndim == 3 else image[..., None]
    mixed = np.zeros(image.shape[:2])
    for channel in range(numbers.shape[2]):
        # multiples of the golden ratio lie far apart on the circle of hues
        mixed += (numbers[..., channel] + 1) * (0.6180339887 if channel == 0 else math.sqrt(2.0))
    hue = 6.0 * (mixed % 1.0)
    wave = np.stack([np.abs(hue - 3.0) - 1.0, 2.0 - np.abs(hue - 2.0), 2.0 - np.abs(hue - 4.0)], axis=-1)
    picture = np.round(64.0 + 191.0 * np.clip(wave, 0.0, 1.0)).astype(np.uint8)
    picture[(numbers < 0).any(axis=2)] = _UNDEFINED
    return picture
