"""Morph targets and skins, number by number."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from firefly_sample.model.data import GeomData
from firefly_sample.model.deform import (
    Shape,
    blend_matrices,
    flat_normals,
    morphed,
    normalized_weights,
    skinned_normals,
    skinned_points,
    skinned_tangents,
)
from firefly_sample.scene.tangents import TangentGroups
from tests.model.figures import bending_tube, bulging_tube, make_model, posed_corners, tube

NUMBERS = st.floats(-10.0, 10.0)


def affine(seed, count):
    """Affine matrices that are far from singular."""
    rng = np.random.default_rng(seed)
    matrices = np.tile(np.eye(4), (count, 1, 1))
    matrices[:, :3, :3] += rng.uniform(-0.25, 0.25, (count, 3, 3))
    matrices[:, 3, :3] = rng.uniform(-5.0, 5.0, (count, 3))
    return matrices


@pytest.mark.parametrize("influences", [1, 2, 4, 8, 13])
def test_any_number_of_influences_is_the_weighted_sum(influences):
    rng = np.random.default_rng(influences)
    points = rng.uniform(-3.0, 3.0, (50, 3))
    normals = rng.normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    matrices = affine(influences, 20)
    joints = rng.integers(0, 20, (50, influences))
    weights = normalized_weights(rng.uniform(0.0, 1.0, (50, influences)))
    blended = blend_matrices(joints.T, weights.T, matrices)
    moved, turned = skinned_points(points, blended), skinned_normals(normals, blended)
    for vertex in range(50):
        matrix = sum(w * matrices[j] for j, w in zip(joints[vertex], weights[vertex], strict=True))
        expected = np.append(points[vertex], 1.0) @ matrix
        np.testing.assert_allclose(moved[vertex], expected[:3], rtol=0, atol=1e-12)
        normal = normals[vertex] @ np.linalg.inv(matrix[:3, :3]).T
        np.testing.assert_allclose(turned[vertex], normal / np.linalg.norm(normal), rtol=0, atol=1e-12)


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_normal_stays_perpendicular_to_its_surface_and_on_its_side(mirrored):
    matrices = affine(5, 1)
    if mirrored:
        matrices[:, :, 0] *= -1.0
    rng = np.random.default_rng(1)
    normals, other = rng.normal(size=(2, 30, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    tangents = np.cross(normals, other)
    blended = blend_matrices(np.zeros((1, 30), np.intp), np.ones((1, 30)), matrices)
    turned = skinned_normals(normals, blended)
    moved_tangents, moved_normals = tangents @ matrices[0, :3, :3], normals @ matrices[0, :3, :3]
    np.testing.assert_allclose((turned * moved_tangents).sum(axis=1), 0.0, atol=1e-14)
    assert ((turned * moved_normals).sum(axis=1) > 0.0).all()


def test_a_matrix_that_flattens_space_gives_the_normal_of_the_plane():
    flat = np.diag([1.0, 1.0, 0.0, 1.0])
    blended = blend_matrices(np.zeros((1, 2), np.intp), np.ones((1, 2)), flat[None])
    normals = np.array([[0.6, 0.0, 0.8], [1.0, 0.0, 0.0]])
    # the second has no length: it stays
    assert skinned_normals(normals, blended).tolist() == [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]


@pytest.mark.parametrize("scale", [1e-120, 1e-30, 1e30, 1e60])
def test_normals_survive_extreme_scales(scale):
    matrix = np.diag([scale, scale, 2.0 * scale, 1.0])
    blended = blend_matrices(np.zeros((1, 1), np.intp), np.ones((1, 1)), matrix[None])
    expected = np.array([0.6, 0.0, 0.4]) / np.hypot(0.6, 0.4)
    np.testing.assert_allclose(skinned_normals(np.array([[0.6, 0.0, 0.8]]), blended)[0], expected, atol=1e-15)


def test_weights_are_divided_by_their_sum_and_the_first_joint_has_what_nobody_has():
    given = np.array([[0.25, 0.25], [0.0, 0.0], [3.0, 1.0]])
    assert normalized_weights(given).tolist() == [[0.5, 0.5], [1.0, 0.0], [0.75, 0.25]]


@given(
    rest=arrays(float, (4, 3), elements=NUMBERS),
    targets=arrays(float, (3, 4, 3), elements=NUMBERS),
    weights=st.lists(NUMBERS, max_size=3),
)
def test_targets_are_added_with_their_weights(rest, targets, weights):
    expected = rest.copy()
    for target, weight in zip(targets, weights, strict=False):
        expected = expected + weight * target
    np.testing.assert_allclose(morphed(rest, targets, weights), expected, rtol=0, atol=1e-12)


def test_a_shape_without_weights_is_the_one_at_rest():
    made = bulging_tube().geoms[0]
    vertices, normals, _ = Shape(made, made.arrays["normals"]).posed((0.0, 0.0))
    assert vertices.tobytes() == made.arrays["vertices"].tobytes()
    assert normals.tobytes() == made.arrays["normals"].tobytes()


@pytest.mark.parametrize("flat", [False, True])
def test_a_morphed_shape_is_that_of_plain_loops(flat):
    data = bulging_tube(flat)
    shape = Shape(data.geoms[0], data.geoms[0].arrays["normals"])
    expected = posed_corners(data, 0.0, None)[0, 0]
    vertices, normals, _ = shape.posed((0.5, 0.0))
    np.testing.assert_allclose(vertices + data.nodes[0].translation, expected[0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(normals, expected[1], rtol=0, atol=1e-12)


def test_flat_normals_are_those_of_the_triangles():
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 0), (0, 2, 0), (0, 0, 2), (5, 5, 5)], float)
    triangles = np.array([(0, 1, 2), (3, 4, 5), (6, 6, 6)], np.int32)
    found = flat_normals(vertices, triangles, np.tile([0.0, 1.0, 0.0], (7, 1)))
    assert found.tolist() == [[0, 0, 1]] * 3 + [[1, 0, 0]] * 3 + [[0, 1, 0]]


def framed(count, seed):
    """Normals, tangents at right angles to them with either sign, and bitangents."""
    rng = np.random.default_rng(seed)
    normals, other = rng.normal(size=(2, count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    directions = np.cross(normals, other)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    signs = rng.choice([-1.0, 1.0], count)
    return normals, np.column_stack([directions, signs]), signs[:, None] * np.cross(normals, directions)


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_tangent_moves_with_its_surface_and_its_bitangent_stays_on_its_side(mirrored):
    matrices = affine(7, 1)
    if mirrored:
        matrices[:, :, 1] *= -1.0
    normals, tangents, bitangents = framed(40, 3)
    blended = blend_matrices(np.zeros((1, 40), np.intp), np.ones((1, 40)), matrices)
    turned, moved = skinned_normals(normals, blended), skinned_tangents(tangents, blended)
    expected = tangents[:, :3] @ matrices[0, :3, :3]
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(moved[:, :3], expected, rtol=0, atol=1e-14)
    np.testing.assert_allclose((moved[:, :3] * turned).sum(axis=1), 0.0, atol=1e-14)
    made = moved[:, 3:] * np.cross(turned, moved[:, :3])
    assert ((made * (bitangents @ matrices[0, :3, :3])).sum(axis=1) > 0.0).all()


def test_a_tangent_whose_length_would_be_0_stays():
    flat = np.diag([0.0, 1.0, 1.0, 1.0])
    blended = blend_matrices(np.zeros((1, 1), np.intp), np.ones((1, 1)), flat[None])
    assert skinned_tangents(np.array([[1.0, 0.0, 0.0, -1.0]]), blended).tolist() == [[1.0, 0.0, 0.0, -1.0]]


def flat_geom(seed, **more):
    """Three separate triangles with texture coordinates and their tangents; the last shows them mirrored."""
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(9, 3))
    triangles = np.arange(9, dtype=np.int32).reshape(3, 3)
    texcoords = np.array([[0, 0], [1, 0.25], [0.5, 1]] * 3)
    texcoords[6:, 0] *= -1.0
    normals = flat_normals(vertices, triangles, np.zeros((9, 3)))
    arrays = {"vertices": vertices, "triangles": triangles, "normals": normals, **more}
    arrays["tangents"] = tangents_of(vertices, triangles, normals, texcoords)
    return GeomData("g", 0, arrays, flat=True), texcoords


def tangents_of(vertices, triangles, normals, texcoords):
    return TangentGroups(vertices, triangles, normals, texcoords).corners(vertices, normals).reshape(-1, 4)


def test_the_tangents_of_a_flat_geom_are_those_of_its_posed_triangles():
    targets = np.random.default_rng(4).normal(size=(2, 9, 3))
    made, texcoords = flat_geom(1, morph_vertices=targets)
    triangles = made.arrays["triangles"]
    shape = Shape(made, made.arrays["normals"])
    for weights in ((0.0, 0.0), (0.75, -0.5)):
        vertices, normals, tangents = shape.posed(weights)
        expected = tangents_of(vertices, triangles, normals, texcoords)
        np.testing.assert_allclose(tangents, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("turned", [False, True])
def test_a_flat_skin_keeps_the_side_of_its_bitangents(mirrored, turned):
    """The bitangent is along v on the moved triangle, whichever way its normal looks."""
    joints = {"joints": np.zeros((9, 1), np.int32), "joint_weights": np.ones((9, 1))}
    made, _ = flat_geom(2, **joints)
    matrices = affine(3, 1)
    if mirrored:
        matrices[:, :, 0] *= -1.0
    rest, tangents = made.arrays["normals"], made.arrays["tangents"]
    along_v = tangents[:, 3:] * np.cross(rest, tangents[:, :3]) @ matrices[0, :3, :3]
    _, normals, posed = Shape(made, rest, True, turned).posed((), matrices)
    assert ((posed[:, 3:] * np.cross(normals, posed[:, :3]) * along_v).sum(axis=1) > 0.0).all()
    expected = tangents[:, :3] @ matrices[0, :3, :3]
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(posed[:, :3], expected, rtol=0, atol=1e-12)


def test_a_flat_triangle_without_area_has_any_tangent_at_a_right_angle():
    vertices = np.array([(0, 0, 0), (1, 0, 0), (2, 0, 0)], float)
    triangles = np.array([(0, 1, 2)], np.int32)
    normals = np.tile([0.0, 0.0, 1.0], (3, 1))
    arrays = {"vertices": vertices, "triangles": triangles, "tangents": np.tile([0.0, 1.0, 0.0, 1.0], (3, 1))}
    found = Shape(GeomData("g", 0, arrays, flat=True), normals).posed(()).tangents
    np.testing.assert_allclose(np.linalg.norm(found[:, :3], axis=1), 1.0)
    assert (found[:, 2] == 0.0).all()


def test_morphed_tangents_are_added_and_of_length_1():
    normals, tangents, _ = framed(4, 8)
    targets = np.random.default_rng(9).normal(size=(1, 4, 3))
    arrays = {
        "vertices": normals,
        "triangles": np.array([(0, 1, 2)], np.int32),
        "tangents": tangents,
        "morph_tangents": targets,
    }
    shape = Shape(GeomData("g", 0, arrays), normals)
    assert shape.posed((0.0,)).tangents.tobytes() == tangents.tobytes()
    expected = tangents[:, :3] + 0.5 * targets[0]
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    found = shape.posed((0.5,)).tangents
    np.testing.assert_allclose(found, np.column_stack([expected, tangents[:, 3]]), rtol=0, atol=1e-14)


@pytest.mark.parametrize("make", [bending_tube, bulging_tube])
def test_tangents_of_a_model_follow_joints_and_targets(make):
    data = make()
    arrays = data.geoms[0].arrays
    around = np.cross([0.0, 0.0, 1.0], arrays["normals"])
    arrays["tangents"] = np.column_stack([around, np.ones(len(around))])
    if "morph_normals" in arrays:
        # those with which all tangents stay at a right angle, for the normals of one target
        moved = arrays["normals"] + arrays["morph_normals"]
        arrays["morph_tangents"] = np.cross([0.0, 0.0, 1.0], moved) - around
    model = make_model(data)
    model.node().update(0.75)
    for below in model.find_all_matches("**/+GeomNode"):
        for geom, _ in below.node().geoms:
            tangents = geom.tangents
            np.testing.assert_allclose(np.linalg.norm(tangents[:, :3], axis=1), 1.0, rtol=1e-12)
            np.testing.assert_allclose((tangents[:, :3] * geom.normals).sum(axis=1), 0.0, atol=1e-12)
            assert np.abs(tangents[:, :3] - around).max() > 0.01
            revision = geom.revision
            model.node().update(0.75)
            assert geom.revision == revision


def test_a_pickled_shape_is_read_only_and_equal_and_copies_are_the_same():
    vertices, triangles, normals = tube()
    shape = Shape(GeomData("g", 0, {"vertices": vertices, "triangles": triangles}), normals)
    assert copy.copy(shape) is copy.deepcopy(shape) is shape
    twin = pickle.loads(pickle.dumps(shape))
    assert np.array_equal(twin.vertices, vertices)
    with pytest.raises(ValueError, match="read-only"):
        twin.vertices[0] = 1.0
