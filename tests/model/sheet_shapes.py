"""Shapes and pictures of the contact sheet's files, in glTF's axes: Y up."""

from __future__ import annotations

import io
import math

import numpy as np
from PIL import Image, ImageDraw

TEAL, CORAL, GOLD, INK = (0.05, 0.30, 0.33), (0.72, 0.16, 0.10), (0.78, 0.42, 0.07), (0.03, 0.04, 0.08)
"""Linear colours."""


def grid(rows, columns, place):
    """Points, texture coordinates and triangles of `place(u, v)` for u, v in 0..1, v from the top."""
    u, v = np.meshgrid(np.linspace(0.0, 1.0, columns + 1), np.linspace(0.0, 1.0, rows + 1))
    points = np.stack(np.broadcast_arrays(*place(u, v)), axis=-1).reshape(-1, 3)
    k = np.arange(rows * (columns + 1)).reshape(rows, -1)[:, :-1].reshape(-1)
    below = k + columns + 1
    triangles = np.concatenate([np.stack([k, below, below + 1], 1), np.stack([k, below + 1, k + 1], 1)])
    return points, np.stack([u, v], axis=-1).reshape(-1, 2), triangles


def card(width=2.0, height=1.5):
    """An upright rectangle that faces +Z, with normals."""
    points, texcoords, triangles = grid(1, 1, lambda u, v: ((u - 0.5) * width, (0.5 - v) * height, 0.0 * u))
    return points, np.tile((0.0, 0.0, 1.0), (4, 1)), texcoords, triangles


def ball(radius=1.0, rings=16, sides=28):
    """A ball with normals."""

    def place(u, v):
        polar, angle = v * math.pi, u * 2.0 * math.pi
        return -np.sin(polar) * np.cos(angle), np.cos(polar), np.sin(polar) * np.sin(angle)

    points, texcoords, triangles = grid(rings, sides, place)
    return radius * points, points, texcoords, triangles


def ring(radius=0.75, tube=0.32, rings=20, sides=36):
    """A ring that lies flat, with normals."""

    def place(u, v):
        a, b = u * 2.0 * math.pi, -v * 2.0 * math.pi
        away = radius + tube * np.cos(b)
        return away * np.cos(a), tube * np.sin(b), -away * np.sin(a)

    points, texcoords, triangles = grid(rings, sides, place)
    angle = texcoords[:, 0] * 2.0 * math.pi
    middle = radius * np.stack([np.cos(angle), 0.0 * angle, -np.sin(angle)], axis=1)
    return points, (points - middle) / tube, texcoords, triangles


def cube(size=1.4):
    """A box of 24 vertices, with normals."""
    points, normals, texcoords, triangles = [], [], [], []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            out, right = np.zeros(3), np.zeros(3)
            out[axis], right[(axis + 1) % 3] = sign, 1.0
            up = np.cross(out, right)
            start = len(points)
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                points.append(0.5 * size * (out + a * right + b * up))
                normals.append(out)
                texcoords.append((0.5 + 0.5 * a, 0.5 - 0.5 * b))
            triangles += [(start, start + 1, start + 2), (start, start + 2, start + 3)]
    return np.array(points), np.array(normals), np.array(texcoords), np.array(triangles)


def house():
    """A small shape without symmetry, which shows when it is mirrored: a wall, a roof, a chimney."""
    parts = [
        (cube(1.0)[0] * (1.2, 0.8, 0.9), cube(1.0)[1], cube(1.0)[3]),
        (cube(1.0)[0] * (0.22, 0.7, 0.22) + (0.33, 0.75, 0.0), cube(1.0)[1], cube(1.0)[3]),
    ]
    points = np.concatenate([part[0] for part in parts])
    normals = np.concatenate([part[1] for part in parts])
    triangles = np.concatenate([parts[0][2], parts[1][2] + 24])
    return points, normals, triangles


def smooth_normals(points, triangles):
    """Normals of a closed surface; vertices at one place share theirs."""
    _, place = np.unique(np.round(points, 6), axis=0, return_inverse=True)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    face = np.cross(b - a, c - a)
    total = np.zeros((place.max() + 1, 3))
    for k in range(3):
        np.add.at(total, place.reshape(-1)[triangles[:, k]], face)
    total /= np.linalg.norm(total, axis=1, keepdims=True)
    return total[place.reshape(-1)]


def picture(mode="RGB", size=64):
    """An image that shows which way is up and right: an F in a frame, with a mark in one corner."""
    image = Image.new("RGBA", (size, size), (26, 128, 138, 255))
    draw = ImageDraw.Draw(image)
    s = size / 64.0

    def box(x0, y0, x1, y1, tone):
        draw.rectangle([x0 * s, y0 * s, x1 * s - 1, y1 * s - 1], fill=tone)

    pale, red, gold = (244, 238, 220, 255), (214, 86, 62, 255), (240, 178, 58, 255)
    box(0, 0, 64, 4, pale)
    box(0, 60, 64, 64, pale)
    box(0, 0, 4, 64, pale)
    box(60, 0, 64, 64, pale)
    box(20, 12, 28, 54, gold)
    box(28, 12, 46, 20, gold)
    box(28, 28, 40, 36, gold)
    box(48, 44, 56, 52, red)
    return image.convert(mode)


def leaf(size=96):
    """An image with soft alpha: a leaf whose coverage falls off over its whole width."""
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size * 2.0 - 1.0
    half = 0.72 * np.sqrt(np.clip(1.0 - (y * 1.02) ** 2, 0.0, 1.0)) * (1.0 - 0.25 * y)
    alpha = np.clip(1.15 - np.abs(x) / np.maximum(half, 1e-3), 0.0, 1.0)
    rib = np.abs(x) < 0.03
    veins = np.abs(((y + 0.9 * np.abs(x)) * 5.0) % 1.0 - 0.5) > 0.44
    tone = np.where((rib | veins)[..., None], (150, 196, 92), (58, 132, 58))
    pixels = np.concatenate([tone, np.round(alpha * 255.0)[..., None]], axis=2)
    return Image.fromarray(pixels.astype(np.uint8))


def encoded(image, kind="PNG", **options):
    """The bytes of an image file."""
    stream = io.BytesIO()
    image.save(stream, format=kind, **options)
    return stream.getvalue()
