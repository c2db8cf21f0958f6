"""Normals of meshes without: against closed forms, and a plain loop over all pairs of triangles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.model.creases import FLAT, split_at_creases
from firefly_sample.scene.groups import row_ids

CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
CUBE_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


def prism(sides: int) -> tuple[np.ndarray, np.ndarray]:
    """The side walls of a prism around Z: two rings of vertices, two triangles a side."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(sides)], axis=1)
    vertices = np.concatenate([ring, ring + np.array([0.0, 0.0, 1.0])])
    a = np.arange(sides)
    b = (a + 1) % sides
    walls = [np.stack([a, b, b + sides], axis=1), np.stack([a, b + sides, a + sides], axis=1)]
    return vertices, np.stack(walls, axis=1).reshape(-1, 3)


def test_a_cube_has_sharp_edges() -> None:
    source, triangles, normals = split_at_creases(CUBE, CUBE_FACES)
    assert len(source) == 24
    assert (CUBE[source][triangles] == CUBE[CUBE_FACES]).all()
    corners = CUBE[CUBE_FACES]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.allclose(normals[triangles], flat[:, None], atol=1e-15)


@pytest.mark.parametrize(("sides", "smooth"), [(6, False), (8, False), (11, False), (12, True), (24, True)])
def test_prisms_are_smooth_from_twelve_sides_on(sides: int, smooth: bool) -> None:
    """Two sides of a prism of n meet at 360/n degrees, and 30 is smooth."""
    vertices, faces = prism(sides)
    source, _, normals = split_at_creases(vertices, faces)
    assert len(source) == (2 if smooth else 4) * sides
    if smooth:
        assert (np.abs(normals[:, 2]) < 1e-15).all()
        spread = (normals * vertices[source])[:, :2].sum(axis=1)
        assert (spread > np.cos(np.pi / sides) - 1e-12).all()


def test_separate_triangles_are_as_smooth_as_joined_ones() -> None:
    vertices, faces = prism(24)
    soup = vertices[faces].reshape(-1, 3)
    alone = np.arange(len(soup)).reshape(-1, 3)
    _, triangles, normals = split_at_creases(soup, alone)
    _, joined, expected = split_at_creases(vertices, faces)
    assert np.allclose(normals[triangles], expected[joined], atol=1e-15)
    source, _, _ = split_at_creases(soup, alone, merge=True)
    assert len(source) == len(vertices)
    source, _, _ = split_at_creases(soup, alone)
    assert len(source) == len(soup)


def test_smoothing_groups_beat_angles() -> None:
    one = np.ones(12, dtype=np.int64)
    source, _, normals = split_at_creases(CUBE, CUBE_FACES, one)
    assert len(source) == 8
    assert ((normals * (CUBE[source] - 0.5)).sum(axis=1) > 0.8).all()
    vertices, faces = prism(24)
    source, _, _ = split_at_creases(vertices, faces, np.full(48, FLAT))
    assert len(source) == 3 * 48
    halves = np.repeat([1, 2], 24)
    source, _, _ = split_at_creases(vertices, faces, halves)
    assert len(source) == 48 + 2 * 2  # the two lines between the halves


def test_a_double_sided_sheet_keeps_two_normals() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    _, triangles, normals = split_at_creases(vertices, np.array([[0, 1, 2], [0, 2, 1]]))
    assert np.allclose(normals[triangles[0]], [0, 0, 1])
    assert np.allclose(normals[triangles[1]], [0, 0, -1])


@pytest.mark.parametrize("scale", [1e-300, 1e-30, 1e30, 1e300])
def test_normals_do_not_depend_on_size(scale: float) -> None:
    _, _, normals = split_at_creases(CUBE * scale, CUBE_FACES)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-12)


def test_triangles_without_area_have_some_normal() -> None:
    _, _, normals = split_at_creases(np.zeros((3, 3)), np.array([[0, 1, 2], [0, 0, 0]]))
    assert (normals == [0, 0, 1]).all()


@given(st.lists(st.tuples(st.integers(-2, 2), st.integers(-2, 2)), max_size=30))
def test_equal_rows_have_equal_numbers(rows: list[tuple[int, int]]) -> None:
    ids = row_ids(np.array(rows, dtype=np.float64).reshape(-1, 2))
    assert set(ids.tolist()) == set(range(len(set(rows))))
    assert all((ids[i] == ids[j]) == (rows[i] == rows[j]) for i in range(len(rows)) for j in range(i))


@given(
    st.lists(st.tuples(*[st.integers(0, 11)] * 3), min_size=1, max_size=20),
    st.lists(st.integers(-1, 2), min_size=20, max_size=20),
)
@settings(max_examples=60)
def test_fans_are_those_of_a_plain_loop(faces: list[tuple[int, int, int]], groups: list[int]) -> None:
    """Corners at one position share a normal if smooth edges at that position lead from one to the other.

    Only for edges of two triangles: which of three or more are neighbours is a choice.
    """
    vertices, _ = prism(6)
    edges = [frozenset(pair) for face in faces for pair in zip(face, face[1:] + face[:1], strict=True)]
    if any(edges.count(edge) > 2 for edge in edges) or any(len(set(face)) < 3 for face in faces):
        return
    corners = vertices[np.array(faces)]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(area, axis=1)

    def smooth(one: int, other: int) -> bool:
        if groups[one] != groups[other] or groups[one] == FLAT:
            return False
        if groups[one] > 0:
            return True
        product = length[one] * length[other]
        return bool(product > 0 and area[one] @ area[other] / product >= np.cos(np.pi / 6) - 1e-9)

    _, triangles, normals = split_at_creases(vertices, np.array(faces), np.array(groups[: len(faces)]))
    for number, face in enumerate(faces):
        for place, vertex in enumerate(face):
            fan, waiting = {number}, [number]
            while waiting:
                here = waiting.pop()
                for other, shared in enumerate(faces):
                    both = set(shared) & set(faces[here])
                    if other not in fan and vertex in both and len(both) >= 2 and smooth(here, other):
                        fan.add(other)
                        waiting.append(other)
            total = area[sorted(fan)].sum(axis=0)
            size = np.linalg.norm(total)
            if size > 1e-9:
                assert np.allclose(normals[triangles[number, place]], total / size, atol=1e-9)
