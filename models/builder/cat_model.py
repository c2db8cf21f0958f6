"""The cat as a model: its shape simplified, laid out and painted."""

from __future__ import annotations

import numpy as np

from builder.canvas import opaque, spread
from builder.cat import EAR, FRAME, body, cat, ears, head, tail, to_head
from builder.cat_fur import coat
from builder.charts import View, lay_out, samples
from builder.decimate import decimate
from builder.noise import smooth
from builder.sculpt import gradient, mirrored, skin
from builder.surface import Surface

TRIANGLES = 1100
_BODY, _TAIL, _HEAD, _EARS = 0, 1, 5, 6


def sitting_cat(size=512):
    """(surface, texture)."""
    vertices, triangles = skin(cat, (-0.34, -0.44, -0.03), (0.42, 0.42, 1.03), 0.014)
    vertices, triangles = decimate(vertices, triangles, TRIANGLES, _importance(vertices))
    vertices[:, 2] = np.maximum(vertices[:, 2], 0.0)
    normals = gradient(cat, vertices, 0.008)
    parts = _parts(vertices[triangles].mean(axis=1))
    corners, texcoords, faces = lay_out(vertices, triangles, parts, _views())
    surface = Surface()
    tall = vertices[:, 2].max()
    surface.add(vertices[corners] / tall, normals[corners], texcoords, faces)
    return surface, _paint(vertices[corners], normals[corners], texcoords, faces, size)


def _importance(p):
    """How much an error counts: most in the face and at the tips of the ears, least where the cat sits."""
    q = to_head(p)
    face = smooth(0.10, -0.02, q[:, 1]) * smooth(0.03, -0.01, head(p))
    above = smooth(0.55, 0.62, p[:, 2]) * smooth(0.04, 0.0, head(p))
    tips = smooth(0.23, 0.26, q[:, 2])
    return (0.4 + 0.6 * smooth(0.0, 0.03, p[:, 2])) * (1.0 + 2.0 * above + 7.0 * face + 7.0 * tips)


def _parts(p):
    """Body 0, quarters of the tail 1 to 4, head 5, ears 6."""
    along, place = tail(p)
    shapes = np.stack([body(p), along, head(p), ears(mirrored(to_head(p)))])
    part = np.array([_BODY, _TAIL, _HEAD, _EARS])[shapes.argmin(axis=0)]
    return part + np.where(part == _TAIL, np.clip((place * 4.0).astype(int), 0, 3), 0)


def _views():
    """The face as large as it can be, what nobody sees small."""
    x, y, z = np.eye(3)
    right, back, up = FRAME
    views = [
        View(_BODY, -y + 0.15 * z),
        View(_BODY, y + 0.4 * z),
        View(_BODY, x),
        View(_BODY, -x),
        View(_BODY, -z, y, 0.3),
        View(_HEAD, -back, up, 1.9, 0.25),
        View(_HEAD, back + 0.5 * up, up),
        View(_HEAD, right, up),
        View(_HEAD, -right, up),
        View(_HEAD, -up, back, 0.8),
    ]
    for quarter, out in enumerate((x * 0.5 + y, x, x - 0.6 * y, x * 0.3 - y)):
        for direction in (out + 0.9 * z, -out + 0.9 * z):
            views.append(View(_TAIL + quarter, direction, z, 0.9))
        views.append(View(_TAIL + quarter, -z, y, 0.3))
    for side in (1.0, -1.0):
        front = side * EAR[2][0] * FRAME[0] + EAR[2][1] * FRAME[1] + EAR[2][2] * FRAME[2]
        views += [View(_EARS, front, z, 1.2), View(_EARS, -front, z, 0.9)]
    return views


def _paint(vertices, normals, texcoords, faces, size, factor=2):
    row, column, owner, shares = samples(texcoords, faces, size * factor)
    corners = faces[owner]
    p = (vertices[corners] * shares[..., None]).sum(axis=1)
    n = (normals[corners] * shares[..., None]).sum(axis=1)
    n = n / np.linalg.norm(n, axis=1, keepdims=True)
    color = np.zeros((size * factor, size * factor, 3))
    alpha = np.zeros((size * factor, size * factor))
    light = (_open(vertices, normals)[corners] * shares).sum(axis=1)
    color[row, column] = coat(p, n) * light[:, None]
    alpha[row, column] = 1.0
    shape = (size, factor, size, factor)
    return opaque(spread(color.reshape(*shape, 3).mean(axis=(1, 3)), alpha.reshape(shape).mean(axis=(1, 3))))


def _open(p, n):
    """How open the sky is above each vertex, 0 to 1: near surfaces in front of it take light away."""
    hidden = np.zeros(len(p))
    for reach in (0.03, 0.06, 0.12, 0.2):
        clear = np.minimum(cat(p + n * reach), (p + n * reach)[:, 2] + 0.04)
        hidden += np.clip(reach - clear, 0.0, reach) / reach * 0.25
    return 1.0 - 0.75 * hidden
