"""Primitives of every mode, with and without normals, and each attribute, by the specification's text."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.errors import ModelError
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.meshes import Primitive, count_targets, read_primitive
from firefly_sample.scene.transforms import vectors_from_gltf
from tests.model.gltf_files import GltfFile

FOLDER = tempfile.TemporaryDirectory(prefix="firefly-tests-")
CORNERS = np.float32([[0, 0, 0], [2, 0, 0], [0, 3, 0], [0, 0, 5], [1, 1, 1], [4, 0, 1]])
UP = np.float32([[0, 1, 0]] * 6)
ONE = np.uint16([0, 1, 2])


def read(uv_sets: Any = (), **given_: Any) -> Primitive:
    file = GltfFile()
    file.mesh(**given_)
    return read_primitive(Document.open(file.write(Path(FOLDER.name) / "a.glb")), 0, 0, uv_sets)


def arrays(uv_sets: Any = (), **given_: Any) -> dict[str, np.ndarray]:
    found = read(uv_sets, **given_)
    assert found.arrays is not None
    return found.arrays


def triangles(**given_: Any) -> list[tuple[tuple[float, ...], ...]]:
    """Corners of each triangle as they are in the file, from the one that is first in order."""
    found = arrays(**given_)
    corners = found["vertices"][found["triangles"]]
    turned = corners[..., [0, 2, 1]] * [1.0, 1.0, -1.0]
    return [canonical([tuple(corner) for corner in each]) for each in turned.tolist()]


def canonical(corners: list[Any]) -> tuple[Any, ...]:
    """A triangle with its winding, whichever of its corners is first."""
    first = corners.index(min(corners))
    return tuple(corners[first:] + corners[:first])


def indexed(rows: list[tuple[int, int, int]]) -> list[tuple[Any, ...]]:
    return [canonical([tuple(CORNERS[i].tolist()) for i in row]) for row in rows]


# modes: the rows are those that section 3.7.2.1 writes out

LISTED = {
    4: [(0, 1, 2), (3, 4, 5)],
    5: [(0, 1, 2), (1, 3, 2), (2, 3, 4), (3, 5, 4)],
    6: [(1, 2, 0), (2, 3, 0), (3, 4, 0), (4, 5, 0)],
}
ORDER = [5, 3, 1, 0, 2, 4]


@pytest.mark.parametrize("mode", LISTED)
@pytest.mark.parametrize("more", [{}, {"NORMAL": UP}], ids=["flat", "normals"])
def test_modes_with_and_without_indices(mode: int, more: dict[str, Any]) -> None:
    assert triangles(POSITION=CORNERS, mode=mode, **more) == indexed(LISTED[mode])
    again = [tuple(ORDER[i] for i in row) for row in LISTED[mode]]
    for dtype in (np.uint8, np.uint16, np.uint32):
        assert triangles(POSITION=CORNERS, indices=dtype(ORDER), mode=mode, **more) == indexed(again)


@settings(max_examples=40)
@given(st.sampled_from([4, 5, 6]), st.lists(st.integers(0, 5), min_size=0, max_size=12))
def test_numbers_of_triangles(mode: int, chosen: list[int]) -> None:
    """n / 3 of a list and n - 2 of a strip or fan; the rest is ignored, and no triangle is no error."""
    expected = len(chosen) // 3 if mode == 4 else max(len(chosen) - 2, 0)
    found = read(POSITION=CORNERS, NORMAL=UP, indices=np.uint16(chosen or [0]), mode=mode)
    if expected:
        assert found.arrays is not None
        assert len(found.arrays["triangles"]) == expected
    else:
        assert found.arrays is None
        assert found.losses == ()


def test_the_mode_is_a_list_unless_the_file_says_otherwise() -> None:
    assert triangles(POSITION=CORNERS) == indexed(LISTED[4])


MARKS = {
    0: [(0,), (1,), (2,), (3,), (4,), (5,)],
    1: [(0, 1), (2, 3), (4, 5)],
    2: [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 0)],
    3: [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5)],
}


@pytest.mark.parametrize("mode", MARKS)
@pytest.mark.parametrize("more", [{}, {"NORMAL": UP}], ids=["plain", "normals"])
def test_points_and_lines_with_and_without_indices(mode: int, more: dict[str, Any]) -> None:
    found = read(POSITION=CORNERS, mode=mode, **more)
    assert found.arrays is not None
    assert found.arrays["triangles"].tolist() == [list(row) for row in MARKS[mode]]
    assert (found.mode, found.flat, found.losses) == ("points" if mode == 0 else "lines", False, ())
    assert ("normals" in found.arrays) == bool(more)
    for dtype in (np.uint8, np.uint16, np.uint32):
        again = arrays(POSITION=CORNERS, indices=dtype(ORDER), mode=mode, **more)
        assert again["triangles"].tolist() == [[ORDER[i] for i in row] for row in MARKS[mode]]


@settings(max_examples=40)
@given(st.sampled_from([0, 1, 2, 3]), st.lists(st.integers(0, 5), min_size=1, max_size=9))
def test_numbers_of_points_and_lines(mode: int, chosen: list[int]) -> None:
    """A loop of two is one line; vertices that nothing uses are left out."""
    n = len(chosen)
    expected = {0: n, 1: n // 2, 2: n if n > 2 else n - 1, 3: n - 1}[mode]
    found = read(POSITION=CORNERS, indices=np.uint16(chosen), mode=mode)
    if not expected:
        assert found.arrays is None
        assert found.losses == ()
        return
    made = found.arrays
    assert made is not None
    assert len(made["triangles"]) == expected
    used = chosen[: expected * 2] if mode == 1 else chosen
    assert len(made["vertices"]) == len(set(used))
    first = made["vertices"][made["triangles"][0, 0]]
    assert first.tolist() == (CORNERS[chosen[0]][[0, 2, 1]] * (1, -1, 1)).tolist()


@pytest.mark.parametrize(("mode", "kind"), [(0, "points"), (3, "lines"), (4, "triangles")])
def test_what_has_no_positions_is_named(mode: int, kind: str) -> None:
    assert read(NORMAL=UP, mode=mode).losses == (f"{kind} without positions are not drawn",)


@pytest.mark.parametrize("mode", [7, -1, 4.5, "4", True])
def test_other_modes_are_errors(mode: Any) -> None:
    with pytest.raises(ModelError, match=r"meshes\[0\]\.primitives\[0\]\.mode: must be"):
        read(POSITION=CORNERS, mode=mode)


@pytest.mark.parametrize(
    ("indices", "message"),
    [
        (np.uint16([0, 1, 6]), "has the index 6, but there are 6 vertices"),
        (np.uint8([0, 1, 255]), "has the index 255, which would restart a strip"),
        (np.uint16([0, 1, 65535]), "has the index 65535, which would restart a strip"),
        (np.uint32([0, 1, 2**32 - 1]), "has the index 4294967295, which would restart a strip"),
        (np.int16([0, 1, 2]), "must be unsigned integers"),
        (np.float32([0, 1, 2]), "must be unsigned integers"),
        (np.uint16([[0, 1, 2]]), "must be of type SCALAR, got VEC3"),
        (77, r"refers to accessors\[77\]"),
    ],
)
@pytest.mark.parametrize("more", [{}, {"NORMAL": UP}], ids=["flat", "normals"])
def test_wrong_indices(indices: Any, message: str, more: dict[str, Any]) -> None:
    with pytest.raises(ModelError, match=rf"primitives\[0\]\.indices: {message}"):
        read(POSITION=CORNERS, indices=indices, **more)


# normals and vertices


def test_given_normals_are_kept_as_unit_vectors_with_z_up() -> None:
    normals = np.float32([[0, 2, 0], [0, 0, 0.5], [3, 0, 4], [0, 0, 0], [1e-30, 0, 0], [-1e30, 0, 0]])
    found = read(POSITION=CORNERS, NORMAL=normals)
    assert found.arrays is not None
    expected = [[0, 0, 1], [0, -1, 0], [0.6, -0.8, 0], [0, 0, 1], [1, 0, 0], [-1, 0, 0]]
    np.testing.assert_allclose(found.arrays["normals"], expected, atol=1e-15)
    assert not found.flat


def test_vertices_are_only_moved_to_z_up() -> None:
    found = arrays(POSITION=CORNERS, NORMAL=UP)
    np.testing.assert_array_equal(found["vertices"], CORNERS[:, [0, 2, 1]] * [1.0, -1.0, 1.0])
    assert found["vertices"].dtype == np.float64
    assert found["triangles"].dtype == np.int32


def test_vertices_that_no_triangle_uses_are_left_out() -> None:
    found = arrays(
        ((0, None),), POSITION=CORNERS, NORMAL=UP, indices=np.uint16([4, 1, 5]), TEXCOORD_0=CORNERS[:, :2]
    )
    np.testing.assert_array_equal(found["vertices"], vectors_from_gltf(CORNERS[[1, 4, 5]]))
    np.testing.assert_array_equal(found["triangles"], [[1, 0, 2]])
    np.testing.assert_array_equal(found["texcoords"], CORNERS[[1, 4, 5], :2] * [1, -1] + [0, 1])


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.integers(-120, 120))
def test_flat_normals_are_at_right_angles_to_their_triangle(seed: int, exponent: int) -> None:
    generator = np.random.default_rng(seed)
    corners = (generator.normal(size=(9, 3)) * 2.0**exponent).astype(np.float32)
    found = read(POSITION=corners)
    assert found.arrays is not None
    assert found.flat
    vertices, normals = found.arrays["vertices"], found.arrays["normals"]
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-14)
    for row in found.arrays["triangles"]:
        a, b, c = np.ldexp(vertices[row], -exponent)
        across = np.cross(b - a, c - a)
        expected = across / np.linalg.norm(across)
        np.testing.assert_allclose(normals[row], [expected] * 3, atol=1e-9)


def test_flat_triangles_share_no_vertices() -> None:
    found = arrays(POSITION=CORNERS, indices=np.uint16([0, 1, 2, 2, 1, 3]))
    np.testing.assert_array_equal(found["triangles"], [[0, 1, 2], [3, 4, 5]])
    np.testing.assert_array_equal(found["vertices"], vectors_from_gltf(CORNERS[[0, 1, 2, 2, 1, 3]]))


@pytest.mark.parametrize("indices", [[0, 0, 0], [0, 1, 1], [0, 1, 4]])
def test_triangles_without_area_have_some_unit_normal(indices: list[int]) -> None:
    corners = np.float32([[0, 0, 0], [1, 1, 1], [9, 9, 9], [9, 9, 8], [2, 2, 2], [0, 0, 0]])
    found = arrays(POSITION=corners, indices=np.uint16(indices))
    np.testing.assert_array_equal(found["normals"], [[0, 0, 1]] * 3)


def test_every_attribute_follows_its_corner_of_a_flat_triangle() -> None:
    rows = np.arange(6)
    order = [5, 3, 1, 1, 0, 4]
    found = arrays(
        ((0, None), (1, None)),
        POSITION=CORNERS,
        indices=np.uint16(order),
        TEXCOORD_0=np.float32([[i, 0] for i in rows]),
        TEXCOORD_1=np.float32([[10 + i, 0] for i in rows]),
        COLOR_0=np.float32([[i / 8, 0, 0] for i in rows]),
        JOINTS_0=np.uint16([[i, 0, 0, 0] for i in rows]),
        WEIGHTS_0=np.float32([[1, 0, 0, 0]] * 6),
        targets=[{"POSITION": CORNERS * 2}, {"POSITION": CORNERS * 3}],
    )
    np.testing.assert_array_equal(found["texcoords"][:, 0], order)
    np.testing.assert_array_equal(found["texcoords_1"][:, 0], np.add(order, 10))
    np.testing.assert_array_equal(found["colors"][:, 0], np.divide(order, 8))
    np.testing.assert_array_equal(found["joints"][:, 0], order)
    np.testing.assert_array_equal(found["morph_vertices"][1], vectors_from_gltf(CORNERS[order] * 3))


# attributes


def test_texture_coordinates_are_turned_v_up_after_their_transform() -> None:
    uv = np.float32([[0, 0], [1, 0], [0, 1], [0.25, 0.5], [2, 3], [-1, 0]])
    transform = np.array([[0.0, 2.0], [-1.0, 0.0], [0.5, 0.25]])  # u' = -v + 0.5, v' = 2 u + 0.25
    found = arrays(((1, None), (0, transform)), POSITION=CORNERS, NORMAL=UP, TEXCOORD_1=uv, TEXCOORD_0=uv)
    np.testing.assert_array_equal(found["texcoords"], np.stack([uv[:, 0], 1 - uv[:, 1]], axis=1))
    expected = np.stack([0.5 - uv[:, 1], 1 - (2 * uv[:, 0] + 0.25)], axis=1)
    np.testing.assert_array_equal(found["texcoords_1"], expected)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_normalised_texture_coordinates(dtype: type) -> None:
    file, most = GltfFile(), np.iinfo(dtype).max
    uv = file.accessor(dtype([[0, most]] * 6), normalized=True)
    file.mesh(POSITION=CORNERS, NORMAL=UP, TEXCOORD_0=uv)
    document = Document.open(file.write(Path(FOLDER.name) / "a.glb"))
    found = read_primitive(document, 0, 0, ((0, None),)).arrays
    assert found is not None
    np.testing.assert_array_equal(found["texcoords"], [[0.0, 0.0]] * 6)


def test_a_set_that_is_missing_is_named_and_one_that_nobody_asks_for_is_not_read() -> None:
    found = read(((3, None),), POSITION=CORNERS, NORMAL=UP, TEXCOORD_0=CORNERS, _OWN=CORNERS[:2])
    assert found.losses == ("a texture is not drawn right, because TEXCOORD_3 is missing",)
    assert found.arrays is not None
    assert set(found.arrays) == {"vertices", "normals", "triangles"}


@pytest.mark.parametrize("width", [3, 4])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
@pytest.mark.parametrize("says_normalized", [True, False])
def test_colours_of_every_type(width: int, dtype: Any, says_normalized: bool) -> None:
    most = np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else 1.0
    colors = np.array([[0, 1, 0.5, 0.25]] * 6)[:, :width]
    stored = (colors * most).astype(dtype)
    file = GltfFile()
    accessor = file.accessor(stored, normalized=says_normalized)
    file.mesh(POSITION=CORNERS, NORMAL=UP, COLOR_0=accessor)
    found = read_primitive(Document.open(file.write(Path(FOLDER.name) / "a.glb")), 0, 0).arrays
    assert found is not None
    expected = np.ones((6, 4))
    expected[:, :width] = stored / np.float64(most)
    np.testing.assert_array_equal(found["colors"], expected)


def test_colours_are_clipped_and_named() -> None:
    for colors, losses in (
        ([-1, 2, 0.5], ("vertex colours outside 0 to 1 are clipped",)),
        ([0, 1, 0.5], ()),
    ):
        found = read(POSITION=CORNERS, NORMAL=UP, COLOR_0=np.float32([colors] * 6))
        assert found.losses == losses
        assert found.arrays is not None
        np.testing.assert_array_equal(found.arrays["colors"], [[0.0, 1.0, 0.5, 1.0]] * 6)


def test_quantised_meshes() -> None:
    """KHR_mesh_quantization: positions of small integers, with or without normalisation, and byte normals."""
    for dtype in (np.int8, np.uint8, np.int16, np.uint16):
        for normalized in (False, True):
            most = np.iinfo(dtype).max
            corners = (CORNERS * 20).astype(dtype)
            file = GltfFile()
            file.mesh(
                POSITION=file.accessor(corners, normalized=normalized),
                NORMAL=file.accessor(np.int8([[0, 127, 0]] * 6), normalized=True),
                targets=[{"POSITION": file.accessor(corners, normalized=normalized)}],
            )
            found = read_primitive(Document.open(file.write(Path(FOLDER.name) / "a.glb")), 0, 0).arrays
            assert found is not None
            expected = vectors_from_gltf(corners / np.float64(most if normalized else 1))
            np.testing.assert_array_equal(found["vertices"], expected)
            np.testing.assert_array_equal(found["morph_vertices"][0], expected)
            np.testing.assert_array_equal(found["normals"], [[0, 0, 1]] * 6)


@settings(max_examples=40)
@given(st.integers(1, 3), st.integers(0, 10**6))
def test_any_number_of_joints(sets: int, seed: int) -> None:
    generator = np.random.default_rng(seed)
    joints = generator.integers(1, 60, (6, 4 * sets))
    weights = generator.random((6, 4 * sets)).astype(np.float32) * (generator.random((6, 4 * sets)) > 0.4)
    weights[:, 0] += 0.5
    given_ = {f"JOINTS_{i}": joints[:, 4 * i : 4 * i + 4].astype(np.uint8) for i in range(sets)}
    given_ |= {f"WEIGHTS_{i}": weights[:, 4 * i : 4 * i + 4] for i in range(sets)}
    found = arrays(POSITION=CORNERS, NORMAL=UP, **given_)
    np.testing.assert_array_equal(found["joints"], np.where(weights > 0, joints, 0))
    total = weights.astype(np.float64).sum(axis=1, keepdims=True)
    np.testing.assert_allclose(found["joint_weights"], weights / total, atol=1e-15)
    assert found["joints"].dtype == np.int32


def test_weights_of_integers_and_of_nothing() -> None:
    joints = np.uint8([[5, 6, 7, 8]] * 6)
    weights = np.uint8([[51, 204, 0, 0]] * 3 + [[0, 0, 0, 0]] * 3)
    file = GltfFile()
    file.mesh(POSITION=CORNERS, NORMAL=UP, JOINTS_0=joints, WEIGHTS_0=file.accessor(weights, normalized=True))
    found = read_primitive(Document.open(file.write(Path(FOLDER.name) / "a.glb")), 0, 0).arrays
    assert found is not None
    np.testing.assert_allclose(
        found["joint_weights"], [[0.2, 0.8, 0, 0]] * 3 + [[1, 0, 0, 0]] * 3, atol=1e-15
    )
    np.testing.assert_array_equal(found["joints"], [[5, 6, 0, 0]] * 3 + [[5, 0, 0, 0]] * 3)


@pytest.mark.parametrize(
    ("joints", "weights", "message"),
    [
        (np.uint8([[0, 1, 2, 3]] * 6), np.float32([[1, 0, -1, 0]] * 6), "WEIGHTS_0: must not be negative"),
        (np.float32([[0.5, 1, 2, 3]] * 6), np.float32([[1, 0, 0, 0]] * 6), "JOINTS_0: must be whole numbers"),
        (np.int8([[-1, 1, 2, 3]] * 6), np.float32([[1, 0, 0, 0]] * 6), "JOINTS_0: has a joint outside"),
        (np.uint8([[0, 1, 2]] * 6), np.float32([[1, 0, 0, 0]] * 6), "JOINTS_0: must be of type VEC4"),
    ],
)
def test_wrong_joints(joints: np.ndarray, weights: np.ndarray, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        read(POSITION=CORNERS, NORMAL=UP, JOINTS_0=joints, WEIGHTS_0=weights)


@pytest.mark.parametrize("name", ["NORMAL", "TEXCOORD_0", "COLOR_0", "JOINTS_0", "WEIGHTS_0"])
@pytest.mark.parametrize("count", [0, 5, 7])
def test_attributes_have_as_many_elements_as_there_are_vertices(name: str, count: int) -> None:
    width = {"NORMAL": 3, "TEXCOORD_0": 2}.get(name, 4)
    file = GltfFile()
    given_ = {"JOINTS_0": np.uint8([[0] * 4] * 6), "WEIGHTS_0": np.float32([[1, 0, 0, 0]] * 6)}
    short = file.accessor(np.ones((count, width), np.uint8 if name == "JOINTS_0" else np.float32))
    file.mesh(**(given_ | {"POSITION": CORNERS, "NORMAL": UP, name: short}))
    document = Document.open(file.write(Path(FOLDER.name) / "a.glb"))
    with pytest.raises(ModelError, match=rf"attributes\.{name}: has {count} elements for 6 vertices"):
        read_primitive(document, 0, 0, ((0, None),))


# morph targets


def test_morph_targets_are_displacements_and_zero_where_a_target_says_nothing() -> None:
    found = arrays(
        POSITION=CORNERS,
        NORMAL=UP,
        targets=[{"POSITION": CORNERS + 1}, {"NORMAL": UP * 2, "TANGENT": UP}, {}],
    )
    zero = np.zeros((6, 3))
    np.testing.assert_array_equal(found["morph_vertices"], [vectors_from_gltf(CORNERS + 1), zero, zero])
    np.testing.assert_array_equal(found["morph_normals"], [zero, vectors_from_gltf(UP * 2), zero])


def test_targets_without_normals_have_none() -> None:
    found = arrays(POSITION=CORNERS, NORMAL=UP, targets=[{"POSITION": CORNERS}])
    assert "morph_normals" not in found


def test_normals_of_targets_are_not_used_where_the_mesh_has_none() -> None:
    """Section 3.7.2.2: flat normals are then calculated for the mesh as it is morphed."""
    found = read(POSITION=CORNERS, targets=[{"POSITION": CORNERS, "NORMAL": UP}])
    assert found.flat
    assert found.arrays is not None
    assert "morph_normals" not in found.arrays


def test_targets_of_colours_are_named() -> None:
    found = read(POSITION=CORNERS, NORMAL=UP, targets=[{"COLOR_0": CORNERS}, {"TEXCOORD_0": CORNERS}])
    assert found.losses == ("morph targets of colours and texture coordinates are not drawn",)


def test_wrong_targets() -> None:
    with pytest.raises(ModelError, match=r"targets\[1\]\.POSITION: has 3 elements for 6 vertices"):
        read(POSITION=CORNERS, NORMAL=UP, targets=[{}, {"POSITION": CORNERS[:3]}])
    with pytest.raises(ModelError, match=r"targets\[0\]\.POSITION: must be of type VEC3, got VEC2"):
        read(POSITION=CORNERS, NORMAL=UP, targets=[{"POSITION": CORNERS[:, :2]}])


def test_many_targets_of_a_small_file_are_refused() -> None:
    """A file of a few hundred kilobytes would otherwise become 24 GB of zeros."""
    file = GltfFile()
    zeros = file.add("accessors", componentType=5126, count=10_000, type="VEC3")
    file.mesh(POSITION=zeros, targets=[{"POSITION": zeros}] * 10_000)
    document = Document.open(file.write(Path(FOLDER.name) / "a.glb"))
    with pytest.raises(ModelError, match=r"primitives\[0\]\.targets: too large"):
        read_primitive(document, 0, 0)


def test_all_primitives_of_a_mesh_have_as_many_targets() -> None:
    file = GltfFile()
    two = file.primitive(POSITION=CORNERS, targets=[{"POSITION": CORNERS}] * 2)
    file.mesh(two, two)
    file.mesh(two, file.primitive(POSITION=CORNERS))
    document = Document.open(file.write(Path(FOLDER.name) / "a.glb"))
    assert count_targets(document.item("meshes", 0, "x")) == 2
    with pytest.raises(ModelError, match=r"meshes\[1\]\.primitives\[1\]\.targets: are 0"):
        count_targets(document.item("meshes", 1, "x"))
