"""Lays a mesh out flat: charts seen from one direction each, packed into a square, and their samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

GRID = 128
"""Charts are packed on a grid of this many cells a side."""


@dataclass(frozen=True)
class View:
    """A direction from which part of a mesh is laid out.

    Attributes
    ----------
    part : int
        Which triangles it may take.
    direction, up : tuple of 3 floats
        From the surface towards the viewer, and what is up in the picture.
    scale : float
        Size in the picture, relative to other charts.
    bias : float
        Above 0: it also takes triangles that another view sees a little better.
    """

    part: int
    direction: tuple
    up: tuple = (0.0, 0.0, 1.0)
    scale: float = 1.0
    bias: float = 0.0


def lay_out(vertices, triangles, parts, views, margin=1):
    """(vertex of each corner, texcoords, triangles) with a corner of its own for each chart a vertex is in.

    `parts` (m,) numbers the triangles' parts; `margin` is the room around each chart, in cells of `GRID`.
    """
    label = _merge(triangles, *_assign(vertices, triangles, parts, views))
    chart = _components(triangles, label)
    corners, flat, local = [], [], []
    for k in range(chart.max() + 1):
        used, faces = np.unique(triangles[chart == k], return_inverse=True)
        corners.append(used)
        flat.append(_project(vertices[used], views[label[chart == k][0]]))
        local.append(faces.reshape(-1, 3))
    starts = np.cumsum([0] + [len(used) for used in corners])
    faces = np.empty_like(triangles)
    for k, mine in enumerate(local):
        faces[chart == k] = mine + starts[k]
    return np.concatenate(corners), _pack(flat, local, margin), faces


def _edges(triangles):
    """For each triangle its three neighbours."""
    owner = {}
    for k, (a, b, c) in enumerate(triangles.tolist()):
        for edge in ((a, b), (b, c), (c, a)):
            owner[edge] = k
    return [[owner[(b, a)], owner[(c, b)], owner[(a, c)]] for a, b, c in triangles.tolist()]


def _assign(vertices, triangles, parts, views):
    """The view of each triangle: the one that faces it best, evened out so that charts are whole."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    score = np.full((len(triangles), len(views)), -9.0)
    facing = np.full_like(score, -9.0)
    for k, view in enumerate(views):
        direction = np.asarray(view.direction, float)
        direction = direction / np.sqrt((direction**2).sum())
        mine = parts == view.part
        facing[mine, k] = (normal[mine] * direction).sum(axis=1)
        score[mine, k] = facing[mine, k] + view.bias
    neighbours = np.array(_edges(triangles))
    label = score.argmax(axis=1)
    for _ in range(12):
        votes = np.zeros_like(score)
        for side in range(3):
            np.add.at(votes, (np.arange(len(label)), label[neighbours[:, side]]), 1.0)
        # Seen too flat, a triangle would have hardly any room in the picture.
        label = np.where(facing > 0.25, score + 0.22 * votes, score - 9.0).argmax(axis=1)
    return label, facing


def _merge(triangles, label, facing, smallest=7):
    """Give the triangles of small charts to neighbours that see them at all."""
    neighbours = np.array(_edges(triangles))
    for _ in range(6):
        chart = _components(triangles, label)
        small = np.bincount(chart)[chart] < smallest
        for k in np.flatnonzero(small):
            others = [label[j] for j in neighbours[k] if not small[j] and facing[k, label[j]] > 0.12]
            if others:
                label[k] = max(others, key=lambda view: (facing[k, view], -view))
    return label


def _components(triangles, label):
    """The number of each triangle's chart: connected triangles of one view."""
    neighbours = _edges(triangles)
    chart = np.full(len(triangles), -1)
    count = 0
    for seed in range(len(triangles)):
        if chart[seed] >= 0:
            continue
        waiting = [seed]
        chart[seed] = count
        while waiting:
            for k in neighbours[waiting.pop()]:
                if chart[k] < 0 and label[k] == label[seed]:
                    chart[k] = count
                    waiting.append(k)
        count += 1
    return chart


def _project(points, view):
    direction = np.asarray(view.direction, float)
    direction = direction / np.sqrt((direction**2).sum())
    right = np.cross(np.asarray(view.up, float), direction)
    right = right / np.sqrt((right**2).sum())
    up = np.cross(direction, right)
    flat = np.stack([(points * right).sum(axis=1), (points * up).sum(axis=1)], axis=1)
    return view.scale * (flat - flat.min(axis=0))


def _pack(flat, faces, margin):
    """Texture coordinates of all charts, as large as they fit: large ones first, each where there is room."""
    order = sorted(range(len(flat)), key=lambda k: (-float(flat[k].max(axis=0).prod()), k))
    size = 0.62
    while True:
        taken = np.zeros((GRID, GRID))
        places = {}
        for k in order:
            mask = _footprint(flat[k] * size * GRID, faces[k], margin)
            place = _free(taken, mask)
            if place is None:
                break
            y, x = place
            taken[y : y + mask.shape[0], x : x + mask.shape[1]] += mask
            places[k] = (x + margin, y + margin)
        if len(places) == len(flat):
            return np.concatenate([flat[k] * size + np.array(places[k]) / GRID for k in range(len(flat))])
        size *= 0.985


def _footprint(points, faces, margin):
    """Which cells a chart needs, its margin included."""
    columns, rows = np.ceil(points.max(axis=0)).astype(int) + 2 * margin
    row, column, _, _ = _scan((points + margin) * 4.0, faces)
    cells = np.zeros((rows, columns), bool)
    cells[row // 4, column // 4] = True
    for _ in range(margin):
        grown = np.pad(cells, 1)
        shifts = [(j, i) for j in (0, 1, 2) for i in (0, 1, 2)]
        cells = np.any([grown[j : j + rows, i : i + columns] for j, i in shifts], axis=0)
    return cells.astype(float)


def _free(taken, mask):
    """The first place, rows first, where `mask` meets nothing that is taken; None when there is none."""
    rows, columns = GRID - mask.shape[0] + 1, GRID - mask.shape[1] + 1
    if rows <= 0 or columns <= 0:
        return None
    hits = np.fft.irfft2(np.fft.rfft2(taken) * np.conj(np.fft.rfft2(mask, s=taken.shape)), s=taken.shape)
    free = np.argwhere(hits[:rows, :columns] < 0.5)
    return None if len(free) == 0 else tuple(free[0])


def _barycentric(corners, x, y):
    (ax, ay), (bx, by), (cx, cy) = corners
    whole = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
    v = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / whole
    w = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / whole
    shares = np.stack([1.0 - v - w, v, w], axis=-1)
    return shares, (shares >= -1e-9).all(axis=-1)


def samples(texcoords, triangles, size):
    """(rows, columns, triangle, shares): what the pixel centres of a picture show, row 0 on top."""
    return _scan(np.stack([texcoords[:, 0], 1.0 - texcoords[:, 1]], axis=1) * size, triangles)


def _scan(points, triangles):
    """The unit cells whose centres lie in triangles of points (n, 2): row, column, triangle, shares."""
    found = []
    for k, face in enumerate(triangles):
        corners = points[face]
        x0, y0 = np.floor(corners.min(axis=0)).astype(int)
        x1, y1 = np.ceil(corners.max(axis=0)).astype(int)
        y, x = np.mgrid[y0:y1, x0:x1] + 0.5
        share, inside = _barycentric(corners, x, y)
        row, column = np.nonzero(inside)
        found.append((row + y0, column + x0, np.full(len(row), k), share[inside]))
    return tuple(np.concatenate(part) for part in zip(*found, strict=True))
