"""A picture that leaves, needles and blades are drawn into: linear colour and coverage."""

from __future__ import annotations

import math

import numpy as np

from builder.noise import smooth
from builder.rounding import rounded


class Canvas:
    """Linear colour (h, w, 3) under coverage (h, w); x to the right, y up, both in 0..1."""

    def __init__(self, width, height, base=(0.1, 0.15, 0.05)):
        self.width, self.height = width, height
        self.color = np.broadcast_to(np.asarray(base, float), (height, width, 3)).copy()
        self.alpha = np.zeros((height, width))

    def window(self, x, y, radius):
        """Slices and pixel-centre coordinates around (x, y), None when they miss the picture."""
        x0 = max(int((x - radius) * self.width), 0)
        x1 = min(int((x + radius) * self.width) + 2, self.width)
        top = max(int((1.0 - y - radius * self.width / self.height) * self.height), 0)
        end = min(int((1.0 - y + radius * self.width / self.height) * self.height) + 2, self.height)
        if x0 >= x1 or top >= end:
            return None
        px = (np.arange(x0, x1) + 0.5) / self.width
        py = (self.height - np.arange(top, end) - 0.5) / self.width
        return (slice(top, end), slice(x0, x1)), px[None, :], py[:, None]

    def paint(self, where, color, cover):
        """Put `color` over what is there."""
        c = cover[..., None]
        self.color[where] = self.color[where] * (1.0 - c) + np.asarray(color) * c
        self.alpha[where] = np.maximum(self.alpha[where], cover)

    def leaf(self, x, y, angle, length, outline, color, vein=0.35, light=(-0.5, 0.85)):
        """A leaf from (x, y) towards `angle` (radians from +x); y counts in widths of the picture.

        `outline(s)` is its half width as a fraction of its length, for s in 0..1 along the midrib. One
        half is lighter than the other, as if folded, and side veins are hinted.
        """
        found = self.window(
            x + 0.5 * length * math.cos(angle),
            (y + 0.5 * length * math.sin(angle)) * self.width / self.height,
            0.62 * length,
        )
        if found is None:
            return
        where, px, py = found
        c, s = math.cos(angle), math.sin(angle)
        along = ((px - x) * c + (py - y) * s) / length
        across = (-(px - x) * s + (py - y) * c) / length
        half = outline(np.clip(along, 0.0, 1.0))
        inside = (half - np.abs(across)) * length * self.width
        inside = np.where((along > 0.0) & (along < 1.0), inside, -1.0)
        cover = np.clip(inside + 0.5, 0.0, 1.0)
        if not cover.any():
            return
        fold = np.sign(across) * (-s * light[0] + c * light[1])
        shade = 1.0 + 0.16 * fold + 0.12 * (along - 0.4)
        ribs = np.abs(((along * 7.0 - np.abs(across) * 5.0) % 1.0) - 0.5)
        shade = shade * (1.0 - 0.10 * smooth(0.36, 0.5, ribs))
        rib = vein * smooth(0.035, 0.008, np.abs(across)) * smooth(1.0, 0.6, along)
        edge = 0.78 + 0.22 * smooth(0.0, 0.07, half - np.abs(across))
        tint = np.asarray(color) * (shade * edge)[..., None]
        tint = tint + (np.asarray(color) * 1.5 + 0.02 - tint) * rib[..., None]
        self.paint(where, np.clip(tint, 0.0, 1.0), cover)

    def twig(self, points, widths, color):
        """A line along `points` with half widths that are interpolated; y counts in picture widths."""
        for a, b, wa, wb in zip(points[:-1], points[1:], widths[:-1], widths[1:], strict=True):
            centre = ((a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0 * self.width / self.height)
            reach = math.hypot(b[0] - a[0], b[1] - a[1])
            found = self.window(*centre, 0.5 * reach + 2.0 * max(wa, wb) + 2.0 / self.width)
            if found is None:
                continue
            where, px, py = found
            dx, dy = b[0] - a[0], b[1] - a[1]
            t = np.clip(((px - a[0]) * dx + (py - a[1]) * dy) / max(dx * dx + dy * dy, 1e-12), 0.0, 1.0)
            distance = np.hypot(px - a[0] - t * dx, py - a[1] - t * dy)
            half = np.maximum(wa + (wb - wa) * t, 0.6 / self.width)
            cover = np.clip((half - distance) * self.width + 0.5, 0.0, 1.0)
            round_ = 0.75 + 0.35 * np.sqrt(np.clip(1.0 - (distance / half) ** 2, 0.0, 1.0))
            self.paint(where, np.asarray(color) * round_[..., None], cover)

    def pixels(self, factor=2):
        """uint8 RGBA, reduced by `factor`; colour flows out under the transparent parts for mipmaps."""
        h, w = self.height // factor, self.width // factor
        alpha = self.alpha.reshape(h, factor, w, factor).mean((1, 3))
        weighted = (self.color * self.alpha[..., None]).reshape(h, factor, w, factor, 3).mean((1, 3))
        color = spread(weighted, alpha)
        return np.concatenate([to_srgb(color), rounded(alpha[..., None] * 255.0)], axis=2).astype(np.uint8)


def spread(weighted, alpha):
    """Colour divided by coverage, with holes filled from ever coarser averages (push and pull)."""
    levels = [(weighted, alpha)]
    while min(levels[-1][1].shape) > 1 and all(n % 2 == 0 for n in levels[-1][1].shape):
        c, a = levels[-1]
        h, w = a.shape
        levels.append(
            (c.reshape(h // 2, 2, w // 2, 2, 3).mean((1, 3)), a.reshape(h // 2, 2, w // 2, 2).mean((1, 3)))
        )
    c, a = levels[-1]
    filled = c / np.maximum(a, 1e-6)[..., None]
    for c, a in reversed(levels[:-1]):
        coarse = filled.repeat(2, 0).repeat(2, 1)
        sure = np.clip(a * 4.0, 0.0, 1.0)[..., None]
        filled = coarse * (1.0 - sure) + c / np.maximum(a, 1e-6)[..., None] * sure
    return filled


def to_srgb(linear):
    """sRGB codes 0..255, rounded, as floats, from linear 0..1."""
    c = np.clip(linear, 0.0, 1.0)
    encoded = np.where(c <= 0.0031308, 12.92 * c, 1.055 * np.maximum(c, 1e-9) ** (1.0 / 2.4) - 0.055)
    return rounded(encoded * 255.0)


def opaque(linear):
    """uint8 RGB from linear colour."""
    return to_srgb(linear).astype(np.uint8)
