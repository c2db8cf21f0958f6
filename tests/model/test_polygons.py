"""Polygons cut into triangles: their areas add up to the polygon's, and all turn as it does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.model.polygons import cut_faces, triangulate

ARROW = [(0, 0), (2, -1), (0, 2), (-2, -1)]
L_SHAPE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
COMB = [(0, 0), (5, 0), (5, 3), (4, 1), (3, 3), (2, 1), (1, 3)]
TILT = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]


def lifted(flat: list[tuple[float, float]]) -> np.ndarray:
    """Corners in a tilted plane off the origin."""
    return np.column_stack([np.array(flat, dtype=float), np.full(len(flat), 3.0)]) @ TILT


def shoelace(flat: np.ndarray) -> float:
    x, y = flat.T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2)


@pytest.mark.parametrize("turned", [1, -1])
@pytest.mark.parametrize("start", range(4))
@pytest.mark.parametrize("flat", [ARROW, L_SHAPE, COMB])
def test_concave_polygons_are_filled_exactly(flat: list, start: int, turned: int) -> None:
    flat = (flat[start:] + flat[:start])[::turned]
    points = lifted(flat)
    triangles, owners = cut_faces([list(range(len(flat)))], points)
    assert len(triangles) == len(flat) - 2
    assert (owners == 0).all()
    areas = [shoelace(np.array(flat, dtype=float)[triangle]) for triangle in triangles]
    whole = shoelace(np.array(flat, dtype=float))
    assert all(np.sign(area) == np.sign(whole) for area in areas)
    assert sum(areas) == pytest.approx(whole, rel=1e-12)


@given(st.lists(st.floats(0.2, 1.0), min_size=3, max_size=12))
def test_polygons_around_a_point_are_filled(radii: list[float]) -> None:
    angle = 2 * np.pi * np.arange(len(radii)) / len(radii)
    flat = np.stack([np.cos(angle), np.sin(angle)], axis=1) * np.array(radii)[:, None]
    triangles = triangulate(np.column_stack([flat, np.zeros(len(flat))])[None])[0]
    areas = [shoelace(flat[triangle]) for triangle in triangles]
    assert min(areas) >= -1e-12
    assert sum(areas) == pytest.approx(shoelace(flat), abs=1e-12)


def test_faces_keep_their_order() -> None:
    points = np.random.default_rng(2).normal(size=(9, 3))
    faces = [[0, 1, 2, 3], [4, 5, 6], [0, 1, 2, 3, 4], [6, 7, 8]]
    triangles, owners = cut_faces(faces, points)
    assert owners.tolist() == [0, 0, 1, 2, 2, 2, 3]
    for triangle, owner in zip(triangles.tolist(), owners.tolist(), strict=True):
        assert set(triangle) <= set(faces[owner])


def test_arrays_and_lists_of_faces_are_alike() -> None:
    points = np.random.default_rng(3).normal(size=(20, 3))
    quads = np.random.default_rng(4).permuted(np.tile(np.arange(20), (7, 1)), axis=1)[:, :4]
    for one, other in zip(cut_faces(quads, points), cut_faces(quads.tolist(), points), strict=True):
        assert (one == other).all()


def test_convex_quads_share_the_diagonal_from_the_first_corner() -> None:
    square = np.array([[[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]])
    assert triangulate(square).tolist() == [[[0, 1, 2], [0, 2, 3]]]


@pytest.mark.parametrize("faces", [[[0, 1]], [[0, 1, 3]], [[0, 1, -1]], [[]]])
def test_faces_of_other_vertices_are_refused(faces: list[list[int]]) -> None:
    with pytest.raises(ValueError, match=r"a face (has|uses)"):
        cut_faces(faces, np.zeros((3, 3)))


def test_no_faces_are_no_triangles() -> None:
    triangles, owners = cut_faces([], np.zeros((3, 3)))
    assert triangles.shape == (0, 3)
    assert owners.shape == (0,)


def test_polygons_that_cross_themselves_end() -> None:
    star = [(np.cos(4 * np.pi * k / 5), np.sin(4 * np.pi * k / 5)) for k in range(5)]
    eight = [(0, 0), (1, 1), (1, 0), (0, 1)]
    for flat in (star, eight, [(0, 0)] * 6, [(0, 0), (1, 0), (2, 0), (3, 0), (1, 0)]):
        assert triangulate(lifted(flat)[None]).shape == (1, len(flat) - 2, 3)
