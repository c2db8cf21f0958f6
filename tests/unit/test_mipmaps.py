"""Mipmaps that are made fast are those of the plain formulas, to the last bit.

Whoever changes the formulas changes them here too, and counts up `firefly_sample.mipmaps.VERSION`.
"""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.mipmaps import mip_chain, texture_levels
from firefly_sample.srgb import srgb_to_linear


def plain_levels(pixels, cutoff, stored):
    """`texture_levels`, of whole images and with a sorted list of alphas."""
    values = pixels[::-1].astype(np.float32) / np.float32(255.0)
    if not stored:
        values[..., :3] = srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)[pixels[::-1, :, :3]]
    return [np.round(level * np.float32(65535.0)).astype(np.uint16) for level in plain_chain(values, cutoff)]


def plain_chain(current, cutoff):
    levels = [current]
    while max(current.shape[:2]) > 1:
        current = plain_half(current, cutoff is not None)
        level = current.copy()
        if cutoff is not None:
            level[..., 3] = plain_alpha(current[..., 3], np.mean(levels[0][..., 3] >= cutoff), cutoff)
        levels.append(level)
    return levels


def plain_half(pixels, weighted):
    if weighted:
        weight = pixels[..., 3:] + np.float32(1e-4)
        pixels = np.concatenate([pixels[..., :3] * weight, pixels[..., 3:]], axis=2)
    pixels = plain_rows(plain_rows(pixels).swapaxes(0, 1)).swapaxes(0, 1)
    if weighted:
        weight = pixels[..., 3:] + np.float32(1e-4)
        pixels = np.concatenate([pixels[..., :3] / weight, pixels[..., 3:]], axis=2)
    return pixels


def plain_rows(pixels):
    rows, half = len(pixels), len(pixels) // 2
    if rows == 1:
        return pixels
    if rows % 2 == 0:
        return np.float32(0.5) * (pixels[0::2] + pixels[1::2])
    before = ((half - np.arange(half)) / rows).astype(np.float32)[:, None, None]
    after = ((np.arange(half) + 1) / rows).astype(np.float32)[:, None, None]
    return before * pixels[0:-1:2] + np.float32(half / rows) * pixels[1::2] + after * pixels[2::2]


def plain_alpha(alpha, coverage, cutoff):
    passing = round(coverage * alpha.size)
    if passing == 0:
        return np.minimum(alpha, np.float32(cutoff * 0.5))
    ranked = np.sort(alpha, axis=None)
    threshold = ranked[-passing]
    first, end = np.searchsorted(ranked, threshold, "left"), np.searchsorted(ranked, threshold, "right")
    if end < alpha.size and alpha.size - first - passing > passing - (alpha.size - end):
        first, threshold = end, ranked[end]
    if threshold <= 0:
        return alpha
    pivot = 0.5 * (threshold + ranked[first - 1]) if first > 0 else threshold
    return np.clip(alpha * np.float32(cutoff / pivot), 0.0, 1.0)


def image(shape, alphas):
    rng = np.random.default_rng(shape)
    pixels = rng.integers(0, 256, (*shape, 4), dtype=np.uint8)
    pixels[..., 3] = rng.choice(np.array(alphas, dtype=np.uint8), shape)
    return pixels


SHAPES = [
    (1, 1),
    (1, 2),
    (2, 1),
    (2, 2),
    (3, 5),
    (5, 4),
    (7, 1),
    (100, 37),
    (514, 260),
    (256, 1024),
    (257, 512),
]
"""Odd sides, single rows, and more rows than are decoded at once."""


@pytest.mark.parametrize("cutoff", [None, 0.0, 0.3, 0.5, 1.0])
@pytest.mark.parametrize("alphas", [range(256), (0, 255), (255,)], ids=["soft", "hard", "opaque"])
def test_levels_are_those_of_the_plain_formulas(alphas, cutoff):
    for shape in SHAPES:
        pixels = image(shape, alphas)
        for stored in (False, True):
            levels, plain = texture_levels(pixels, cutoff, stored), plain_levels(pixels, cutoff, stored)
            assert [level.shape for level in levels] == [level.shape for level in plain]
            for level, expected in zip(levels, plain, strict=True):
                assert level.dtype == np.uint16
                assert np.array_equal(level, expected), (shape, level.shape, stored)


@pytest.mark.parametrize("cutoff", [None, 0.5])
def test_chains_of_floats_are_too_and_leave_what_they_are_given(cutoff):
    for shape in SHAPES:
        pixels = np.random.default_rng(0).random((*shape, 4), dtype=np.float32)
        before = pixels.copy()
        for level, expected in zip(mip_chain(pixels, cutoff), plain_chain(pixels, cutoff), strict=True):
            assert np.array_equal(level, expected), (shape, level.shape)
        assert np.array_equal(pixels, before)
