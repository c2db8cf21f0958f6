"""Tangents for normal maps: closed forms, a plain walk over triangles, and what has no tangent."""

from __future__ import annotations

import copy
import math
import pickle

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from firefly_sample import Geom
from firefly_sample.scene.tangents import TangentGroups, perpendicular, split_at_tangents

QUAD = np.array([[0, 1, 2], [0, 2, 3]])
SQUARE = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
UP = np.array([0.0, 0.0, 1.0])
NUMBERS = st.floats(-4.0, 4.0)


def corners_of(vertices, triangles, normals, texcoords):
    return TangentGroups(vertices, triangles, normals, texcoords).corners(vertices, normals)


def units(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


@given(arrays(float, (2, 3), elements=NUMBERS))
def test_a_plane_has_the_direction_of_u_and_the_side_of_v(edges):
    along_u, along_v = edges
    normal = np.cross(along_u, along_v)
    assume(np.linalg.norm(normal) > 1e-3)
    for side in (1.0, -1.0):
        vertices = SQUARE @ edges
        normals = np.tile(side * units(normal), (4, 1))
        triangles = QUAD if side > 0.0 else QUAD[:, ::-1]
        found = corners_of(vertices, triangles, normals, SQUARE)
        np.testing.assert_allclose(found[..., :3], np.tile(units(along_u), (2, 3, 1)), atol=1e-9)
        assert (found[..., 3] == side).all()
        bitangent = np.cross(normals[0], found[0, 0, :3]) * side
        assert bitangent @ along_v > 0.0


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_bump_of_the_picture_is_a_bump_of_the_plane(turns, mirrored):
    """glTF 2.0, section 3.9.3: x of a normal map is to the right in the picture, and y is up.

    A hill of height h over the picture has the normals (-dh/dright, -dh/dup, 1). On the plane, whatever way
    the picture lies there, the normals must be those of that hill on it: away from its top on all sides.
    """
    texcoords = np.roll(SQUARE, turns, axis=0) * (1.0, -1.0 if mirrored else 1.0)
    vertices = np.column_stack([SQUARE, np.zeros(4)])
    tangent = corners_of(vertices, QUAD, np.tile(UP, (4, 1)), texcoords)[0, 0]
    bitangent = np.cross(UP, tangent[:3]) * tangent[3]
    to_picture = np.linalg.lstsq(np.column_stack([SQUARE, np.ones(4)]), texcoords, rcond=None)[0]
    top = np.array([0.5, 0.5])
    for place in ([0.2, 0.5], [0.8, 0.5], [0.5, 0.1], [0.9, 0.7]):
        right, up = (np.append(place, 1.0) @ to_picture) - (np.append(top, 1.0) @ to_picture)
        x, y, z = units(np.array([2.0 * right, 2.0 * up, 1.0]))  # h = -right^2 - up^2
        shaded = x * tangent[:3] + y * bitangent + z * UP
        np.testing.assert_allclose(shaded, units(np.append(2.0 * (place - top), 1.0)), atol=1e-12)


def cylinder(around=12, rows=3):
    """A cylinder about Z, whose u runs once around, with a seam; normals point outwards."""
    angle, height = np.meshgrid(
        2 * np.pi * np.arange(around + 1) / around, np.arange(rows + 1), indexing="ij"
    )
    normals = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1).reshape(-1, 3)
    # the seam's two columns are at one position, bit for bit
    normals[-rows - 1 :] = normals[: rows + 1]
    vertices = normals + height.reshape(-1, 1) * UP
    texcoords = np.stack([angle / (2 * np.pi), height / rows], axis=-1).reshape(-1, 2)
    column, row = (index.ravel() for index in np.meshgrid(np.arange(around), np.arange(rows), indexing="ij"))
    first = column * (rows + 1) + row
    quads = np.stack([first, first + rows + 1, first + rows + 2, first + 1], axis=1)
    return vertices, quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3), normals, texcoords


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_cylinder_has_tangents_around_it(mirrored):
    vertices, triangles, normals, texcoords = cylinder()
    if mirrored:
        texcoords = texcoords * (-1.0, 1.0)
    sign = -1.0 if mirrored else 1.0
    expected = sign * np.cross(UP, normals)
    groups = TangentGroups(vertices, triangles, normals, texcoords)
    found = groups.corners(vertices, normals)
    np.testing.assert_allclose(found[..., :3], expected[triangles], atol=1e-15)
    assert (found[..., 3] == sign).all()
    made = groups.vertices(vertices, normals)
    np.testing.assert_allclose(made, np.column_stack([expected, np.full(len(expected), sign)]), atol=1e-15)


def grid(size, seed):
    """A bumpy grid with any texture coordinates: many triangles show them mirrored."""
    rng = np.random.default_rng(seed)
    places = np.stack(np.meshgrid(np.arange(size), np.arange(size), indexing="ij"), axis=-1).reshape(-1, 2)
    vertices = np.column_stack([places, rng.normal(size=size * size) / 3])
    first = np.arange(size * size).reshape(size, size)[:-1, :-1].ravel()
    quads = np.stack([first, first + size, first + size + 1, first + 1], axis=1)
    triangles = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    normals = units(rng.normal(size=vertices.shape) / 3 + UP)
    return vertices, triangles, normals, rng.random((len(vertices), 2))


def walked(vertices, triangles, normals, texcoords):
    """The tangents of corners by a plain walk from triangle to triangle around each vertex."""
    keys = np.column_stack([vertices, normals, texcoords])
    ids = [[keys[vertex].tobytes() for vertex in triangle] for triangle in triangles]
    beside = {}  # the triangle behind each directed edge
    for number, names in enumerate(ids):
        for corner in range(3):
            beside[names[corner], names[(corner + 1) % 3]] = number

    def direction(number):
        a, b, c = triangles[number]
        (u1, v1), (u2, v2) = texcoords[b] - texcoords[a], texcoords[c] - texcoords[a]
        area = u1 * v2 - u2 * v1
        along = v2 * (vertices[b] - vertices[a]) - v1 * (vertices[c] - vertices[a])
        return units(along / area), math.copysign(1.0, area)

    def laid(vector, normal):
        return units(vector - normal * (normal @ vector))

    found = np.empty((len(triangles), 3, 4))
    for number, names in enumerate(ids):
        for corner, name in enumerate(names):
            sign = direction(number)[1]
            waiting, seen, total = [number], set(), np.zeros(3)
            while waiting:
                here = waiting.pop()
                if here in seen or direction(here)[1] != sign:
                    continue
                seen.add(here)
                place = ids[here].index(name)
                at, after, before = (triangles[here][(place + step) % 3] for step in (0, 1, 2))
                normal = normals[at]
                edges = (laid(vertices[other] - vertices[at], normal) for other in (after, before))
                angle = math.acos(np.clip(np.dot(*edges), -1.0, 1.0))
                total += angle * laid(direction(here)[0], normal)
                for step in (1, 2):
                    other = ids[here][(place + step) % 3]
                    edge = (other, name) if step == 1 else (name, other)
                    if edge in beside:
                        waiting.append(beside[edge])
            found[number, corner] = [*units(total), sign]
    return found


@pytest.mark.parametrize("seed", range(4))
def test_corners_are_those_of_a_plain_walk(seed):
    mesh = grid(6, seed)
    np.testing.assert_allclose(corners_of(*mesh), walked(*mesh), atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_indices_do_not_matter(seed):
    vertices, triangles, normals, texcoords = mesh = grid(5, seed)
    apart = (vertices[triangles.ravel()], np.arange(triangles.size).reshape(-1, 3))
    rest = (normals[triangles.ravel()], texcoords[triangles.ravel()])
    np.testing.assert_array_equal(corners_of(*apart, *rest), corners_of(*mesh))


@pytest.mark.parametrize("seed", range(3))
def test_vertices_are_split_where_corners_differ_and_only_there(seed):
    vertices, triangles, normals, texcoords = grid(5, seed)
    found = corners_of(vertices, triangles, normals, texcoords)
    chosen, new = split_at_tangents(triangles, found)
    sources = triangles.ravel()[chosen]
    np.testing.assert_array_equal(sources[: len(vertices)], np.arange(len(vertices)))
    np.testing.assert_array_equal(sources[new], triangles)
    np.testing.assert_array_equal(found.reshape(-1, 4)[chosen][new], found)
    pairs = np.column_stack([triangles.ravel(), found.reshape(-1, 4)])
    assert len(chosen) == len(np.unique(pairs, axis=0)) > len(vertices)


def test_a_mirrored_texture_splits_its_seam_alone():
    vertices, triangles, normals, _ = grid(5, 0)
    texcoords = np.column_stack([np.abs(vertices[:, 0] - 2.0), vertices[:, 1]])
    found = corners_of(vertices, triangles, normals, texcoords)
    right = vertices[triangles][:, :, 0].mean(axis=1) > 2.0
    np.testing.assert_array_equal(found[..., 3], np.repeat(np.where(right, 1.0, -1.0), 3).reshape(-1, 3))
    chosen, _ = split_at_tangents(triangles, found)
    assert (vertices[triangles.ravel()[chosen[25:]], 0] == 2.0).all()
    assert len(chosen) == 25 + 5


def test_without_area_of_the_texture_a_tangent_is_at_a_right_angle():
    vertices, triangles, normals, texcoords = grid(4, 0)
    for flat in (np.zeros_like(texcoords), texcoords[:, :1] * (1.0, 0.3)):
        found = corners_of(vertices, triangles, normals, flat)
        np.testing.assert_allclose((found[..., :3] * normals[triangles]).sum(axis=2), 0.0, atol=1e-15)
        np.testing.assert_allclose(np.linalg.norm(found[..., :3], axis=2), 1.0, rtol=1e-15)
        assert (found[..., 3] == 1.0).all()


def fan(texcoords):
    """Four triangles around vertex 0 in a plane, open on one side; the last two corners are 5 and 0."""
    angles = np.radians([0, 60, 120, 180, 240])
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    vertices = np.concatenate([np.zeros((1, 3)), ring])
    triangles = np.array([[0, i, i + 1] for i in range(1, 5)])
    return vertices, triangles, np.tile(UP, (6, 1)), texcoords


def test_a_triangle_without_area_of_the_texture_joins_its_neighbours():
    """The second triangle has no area: the first and the third share a tangent across it."""
    texcoords = np.array([[0, 0], [1, 0], [1, 1], [2, 2], [-1, 1], [-1, 0]], float)
    vertices, triangles, normals, _ = mesh = fan(texcoords)
    found = corners_of(*mesh)
    assert (found[:, 0] == found[0, 0]).all()
    for sign in (1.0, -1.0):
        turned = corners_of(vertices, triangles, normals, texcoords * (sign, 1.0))
        assert (turned[..., 3] == sign).all()


def test_a_degenerate_triangle_takes_what_others_have_there():
    vertices, _, normals, texcoords = fan(np.random.default_rng(0).random((6, 2)))
    triangles = np.array([[0, 0, 1], [0, 1, 2], [3, 4, 5], [5, 5, 5]])
    found = corners_of(vertices, triangles, normals, texcoords)
    assert (found[0] == found[1, [0, 0, 1]]).all()
    assert (found[3] == found[2, 2]).all()


@pytest.mark.parametrize("size", [1e-30, 1e-12, 1e12, 1e30])
def test_sizes_do_not_matter(size):
    vertices, triangles, normals, texcoords = mesh = grid(5, 1)
    expected = corners_of(*mesh)
    for scaled in ((vertices * size, texcoords), (vertices, texcoords * size)):
        np.testing.assert_allclose(corners_of(scaled[0], triangles, normals, scaled[1]), expected, atol=1e-9)


def test_numbers_that_overflow_give_tangents_all_the_same():
    vertices, triangles, normals, texcoords = grid(4, 2)
    found = corners_of(vertices, triangles, normals, texcoords * 1e300)
    np.testing.assert_allclose(np.linalg.norm(found[..., :3], axis=2), 1.0, rtol=1e-12)


@given(arrays(float, 3, elements=NUMBERS))
def test_perpendicular(normal):
    (found,) = perpendicular(normal[None])
    assert math.isclose(np.linalg.norm(found), 1.0, rel_tol=1e-12)
    assert abs(found @ normal) <= 1e-12 * np.abs(normal).max() + 1e-300


def test_a_geom_makes_tangents_once_for_each_revision():
    vertices, triangles, normals, texcoords = cylinder()
    geom = Geom(vertices, triangles, normals, texcoords, texcoords_1=texcoords * (-1.0, 1.0))
    made = geom.tangents_or_made()
    expected = TangentGroups(vertices, triangles, normals, texcoords).vertices(vertices, normals)
    np.testing.assert_array_equal(made, expected)
    assert geom.tangents is None
    assert geom.tangents_or_made() is made
    assert not made.flags.writeable
    second = geom.tangents_or_made(1)
    np.testing.assert_allclose(second, -made, atol=1e-15)
    geom.set_vertices(vertices[:, [1, 0, 2]])
    assert not np.array_equal(geom.tangents_or_made(), made)
    twin = pickle.loads(pickle.dumps(geom))
    np.testing.assert_array_equal(twin.tangents_or_made(), geom.tangents_or_made())
    np.testing.assert_array_equal(copy.copy(geom).tangents_or_made(), geom.tangents_or_made())
    given_tangents = np.tile([0.0, 0.0, 1.0, -1.0], (len(vertices), 1))
    geom.set_tangents(given_tangents)
    np.testing.assert_array_equal(geom.tangents_or_made(), given_tangents)


def test_a_vertex_whose_triangles_disagree_has_their_mean_by_angle():
    """At the middle, u grows along x over 60 degrees, and along y over 120."""
    angles = np.radians([0, 60, 180, 300])
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    vertices = np.concatenate([np.zeros((1, 3)), ring])
    texcoords = vertices[:, :2].copy()
    texcoords[3:] = vertices[3:, [1, 0]] * (1.0, -1.0)
    geom = Geom(vertices, [[0, 1, 2], [0, 3, 4]], np.tile(UP, (5, 1)), texcoords)
    expected = np.array([[1.0, 2.0, 0.0], [1, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0]])
    np.testing.assert_allclose(geom.tangents_or_made()[:, :3], units(expected), atol=1e-15)
    assert (geom.tangents_or_made()[:, 3] == 1.0).all()
