"""glTF's axes and ours, by hand."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from firefly_sample.scene.transforms import (
    matrix_from_gltf,
    matrix_to_gltf,
    vectors_from_gltf,
    vectors_to_gltf,
)

NUMBER = st.floats(-1e30, 1e30)


def test_up_is_up_and_forward_is_forward():
    np.testing.assert_array_equal(vectors_from_gltf([0, 1, 0]), [0, 0, 1])
    np.testing.assert_array_equal(vectors_from_gltf([0, 0, -1]), [0, 1, 0])
    np.testing.assert_array_equal(vectors_from_gltf([1, 0, 0]), [1, 0, 0])
    np.testing.assert_array_equal(vectors_from_gltf([[1, 2, 3]]), [[1, -3, 2]])
    np.testing.assert_array_equal(vectors_to_gltf([1, -3, 2]), [1, 2, 3])


def test_a_matrix_moves_to_the_last_row():
    moved = np.eye(4)
    moved[:3, 3] = 1, 2, 3
    np.testing.assert_array_equal(matrix_from_gltf(moved)[3], [1, -3, 2, 1])
    np.testing.assert_array_equal(matrix_from_gltf(moved)[:3], np.eye(4)[:3])


def test_matrices_are_converted_together_as_alone():
    given = np.random.default_rng(2).normal(size=(2, 3, 4, 4))
    together = matrix_from_gltf(given)
    for index in np.ndindex(2, 3):
        np.testing.assert_array_equal(together[index], matrix_from_gltf(given[index]))


@given(arrays(np.float64, (4, 4), elements=NUMBER), arrays(np.float64, (5, 3), elements=NUMBER))
def test_both_ways_are_exact(matrix, points):
    matrix[:, 3] = 0, 0, 0, 1
    np.testing.assert_array_equal(matrix_from_gltf(matrix_to_gltf(matrix)), matrix)
    np.testing.assert_array_equal(vectors_from_gltf(vectors_to_gltf(points)), points)


@given(
    arrays(np.float64, (4, 4), elements=st.floats(-8, 8)), arrays(np.float64, (3,), elements=st.floats(-8, 8))
)
def test_matrices_and_points_go_together(matrix, point):
    """To move a point there and turn it is to turn it and move it here."""
    matrix[3] = 0, 0, 0, 1
    there = matrix[:3, :3] @ point + matrix[:3, 3]
    ours = matrix_from_gltf(matrix)
    here = vectors_from_gltf(point) @ ours[:3, :3] + ours[3, :3]
    np.testing.assert_allclose(here, vectors_from_gltf(there), atol=1e-13)
