"""Images of every output with the values that formats lose first."""

from __future__ import annotations

import numpy as np

from firefly_sample.frame import OUTPUTS

FLOATS = (
    *(np.nan, np.inf, -np.inf, 0.0, -0.0, 1.0, -1.0),
    *(1e-45, -1e-45, 1.1754942e-38, 3.4028235e38, -3.4028235e38),
    *(65504.0, 65519.0, 65520.0, 65.535, 65.536, 1 / 3),
)
INTEGERS = (-1, 0, 1, 254, 255, 256, 65534, 65535, 65536, 2**24 + 1, 2**31 - 1)


def image_of(output, size=(24, 16), seed=0):
    """An image with the extreme values of its dtype first and random bits after them."""
    info = OUTPUTS[output]
    shape = (size[1], size[0]) if info.channels == 1 else (size[1], size[0], info.channels)
    random = np.random.default_rng(seed)
    if info.dtype == "uint8":
        image = random.integers(0, 256, shape, np.uint8)
        image[0, :6, -1] = 0  # with color_alpha: colours that nobody sees
    elif info.dtype == "int32":
        image = random.integers(-1, 2**31, shape, np.int32)
        image.reshape(-1)[: len(INTEGERS)] = INTEGERS
        image = image.clip(-1 if info.invalid == "-1" else 0, None)
    else:
        image = random.integers(0, 2**32, shape, np.uint32).view(np.float32)  # NaNs of all kinds too
        image.reshape(-1)[: len(FLOATS)] = FLOATS
    return image


def assert_same_bits(got, wanted):
    assert (got.dtype, got.shape) == (wanted.dtype, wanted.shape)
    assert got.tobytes() == wanted.tobytes()


def smooth_picture(size=(64, 48), channels=3):
    """A picture as renderers make them: gradients, an edge, and a little noise."""
    width, height = size
    x, y = np.meshgrid(np.linspace(0, 1, width), np.linspace(0, 1, height))
    planes = [200 * x, 90 + 120 * y, 220 - 150 * x * y, 255 * (x > 0.3)][:channels]
    picture = np.stack(planes, axis=-1)
    picture[(x - 0.5) ** 2 + (y - 0.5) ** 2 < 0.05, :3] *= 0.4
    picture[..., :3] += np.random.default_rng(1).normal(0, 1, picture[..., :3].shape)
    return np.rint(picture).clip(0, 255).astype(np.uint8)


def psnr(got, wanted):
    """The ratio of the largest code to the error, in decibels."""
    error = got.astype(np.float64) - wanted.astype(np.float64)
    return 10 * np.log10(255**2 / np.mean(error**2))
