"""From glTF files to vertices that move: skins, morph targets and their animations, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firefly_sample import NodePath, load_model
from tests.model.gltf_files import GltfFile
from tests.model.quads import CORNERS, NORMALS, TRIANGLES, quad

BONE = 2.0
"""From the first joint of `skinned` to the second, along +Z of the file, our -Y."""


def load(file: GltfFile, tmp_path) -> NodePath:
    return load_model(file.write(tmp_path / "model.glb"))


def geoms(root: NodePath) -> dict[str, list]:
    """The Geoms of each GeomNode that has some."""
    found = {path.get_name(): path.node().geoms for path in root.find_all_matches("**/+GeomNode")}
    return {name: [geom for geom, _ in pairs] for name, pairs in found.items() if pairs}


def z_up(points) -> np.ndarray:
    return np.float64(points)[:, [0, 2, 1]] * (1, -1, 1)


def linear(file: GltfFile, times, values, **sampler) -> dict:
    given = {"input": file.accessor(np.float32(times)), "output": file.accessor(np.float32(values))}
    return {**given, **sampler}


# --- Morph targets ---


def test_a_sparse_target_moves_only_what_it_names(tmp_path):
    file = GltfFile()
    places = file.view(np.uint16([2]).tobytes())
    values = file.view(np.float32([[0, 0, 1.5]]).tobytes())
    sparse = {
        "count": 1,
        "indices": {"bufferView": places, "componentType": 5123},
        "values": {"bufferView": values},
    }
    target = file.add("accessors", componentType=5126, count=4, type="VEC3", sparse=sparse)
    file.node(name="n", mesh=quad(file, targets=[{"POSITION": target}]), weights=[0.5])
    moved = np.float64(CORNERS)
    moved[2, 2] += 0.75
    np.testing.assert_array_equal(geoms(load(file, tmp_path))["n"][0].vertices, z_up(moved))


def test_targets_without_positions_turn_normals_alone(tmp_path):
    file = GltfFile()
    targets = [{"TANGENT": np.float32([[0, 1, 0]] * 4)}, {"NORMAL": np.float32([[1, 0, 0]] * 4)}]
    tangents = np.float32([[1, 0, 0, 1]] * 4)
    file.node(name="n", mesh=quad(file, TANGENT=tangents, targets=targets), weights=[1, 1])
    (geom,) = geoms(load(file, tmp_path))["n"]
    np.testing.assert_array_equal(geom.vertices, z_up(CORNERS))
    np.testing.assert_allclose(geom.normals, z_up([[math.sqrt(0.5), 0, math.sqrt(0.5)]] * 4), atol=1e-15)


def test_quantised_targets_of_a_quantised_mesh(tmp_path):
    file = GltfFile()
    file.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    moves = file.accessor(np.int8([[0, 0, 64]] * 4), normalized=True)
    corners = file.accessor((CORNERS * 127).astype(np.int8), normalized=True)
    file.node(name="n", mesh=quad(file, POSITION=corners, targets=[{"POSITION": moves}]), weights=[2])
    expected = z_up(CORNERS + np.array([0, 0, 128 / 127]))
    np.testing.assert_allclose(geoms(load(file, tmp_path))["n"][0].vertices, expected, rtol=1e-15)


@pytest.mark.parametrize("interpolation", ["STEP", "LINEAR", "CUBICSPLINE"])
def test_weights_move_all_primitives_of_a_mesh(tmp_path, interpolation):
    times, values = np.array([0, 1, 3]), np.float32([[0, 1], [1, 0], [0.5, 0.25]])
    into = np.float32([[0.125, 0.25], [0.5, -0.5], [0, 0]])
    out_of = np.float32([[1, 2], [-1, 0.5], [0, 0]])
    is_cubic = interpolation == "CUBICSPLINE"
    stored = np.stack([into, values, out_of], axis=1) if is_cubic else values
    file = GltfFile()
    lifts = [{"POSITION": np.float32([[0, 0, 1]] * 4)}, {"POSITION": np.float32([[0, 1, 0]] * 4)}]
    common = {"NORMAL": NORMALS, "indices": TRIANGLES.ravel(), "targets": lifts}
    far = CORNERS - np.float32([0, 0, 5])
    mesh = file.mesh(file.primitive(POSITION=CORNERS, **common), file.primitive(POSITION=far, **common))
    node = file.node(name="n", mesh=mesh)
    sampler = linear(file, times, stored.ravel(), interpolation=interpolation)
    file.add("animations", samplers=[sampler], channels=[channel(0, node, "weights")])
    root = load(file, tmp_path)
    for time in (0.0, 0.25, 1.0, 2.0, 2.75, 3.5):
        now = time % 3
        key = 0 if now < 1 else 1
        length = times[key + 1] - times[key]
        t = (now - times[key]) / length
        a, b = values[key], values[key + 1]
        weights = {
            "STEP": a,
            "LINEAR": (1 - t) * a + t * b,
            "CUBICSPLINE": (2 * t**3 - 3 * t**2 + 1) * a
            + length * (t**3 - 2 * t**2 + t) * out_of[key]
            + (3 * t**2 - 2 * t**3) * b
            + length * (t**3 - t**2) * into[key + 1],
        }[interpolation]
        root.node().update(time)
        for geom, corners in zip(geoms(root)["n"], (CORNERS, far), strict=True):
            expected = corners + np.array([0, weights[1], weights[0]])
            np.testing.assert_allclose(geom.vertices, z_up(expected), atol=1e-12)


# --- Skins ---


def channel(sampler: int, node: int, path: str) -> dict:
    return {"sampler": sampler, "target": {"node": node, "path": path}}


def skinned(joint_type="u1", weight_type="f4", **mesh) -> tuple[GltfFile, int, int, int]:
    """A file, two joints, and a mesh: two corners follow the first joint, one the second, and one both."""
    file = GltfFile()
    first = file.node(name="first")
    second = file.node(name="second", parent=first, translation=[0, 0, BONE])
    weights = np.float32([[1, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0.5, 0.5, 0, 0]])
    is_whole = weight_type != "f4"
    if is_whole:
        weights = np.round(weights * np.iinfo(weight_type).max).astype(weight_type)
    joints = np.zeros((4, 4), joint_type)
    joints[:, 1] = 1
    given = {"JOINTS_0": joints, "WEIGHTS_0": file.accessor(weights, normalized=is_whole)}
    return file, first, second, quad(file, **given, **mesh)


SHARES = np.array([0, 0, 1, 0.5])
"""The part of each corner that follows the second joint."""


@pytest.mark.parametrize("joint_type", ["u1", "u2"])
@pytest.mark.parametrize("weight_type", ["f4", "u1", "u2"])
def test_joints_and_weights_of_every_type(tmp_path, joint_type, weight_type):
    """The node of the mesh does not count, but what is below it follows the node."""
    file, first, second, mesh = skinned(joint_type, weight_type)
    skin = file.add("skins", joints=[first, second], skeleton=first)
    body = file.node(name="body", mesh=mesh, skin=skin, translation=[50, 0, 0])
    file.node(name="child", parent=body, mesh=quad(file), translation=[0, 0, 3])
    root = load(file, tmp_path)
    expected = z_up(CORNERS) - np.outer(SHARES * BONE, (0, 1, 0))
    # the sum of two rounded halves is not 1
    np.testing.assert_allclose(geoms(root)["body"][0].vertices, expected, atol=1e-12)
    np.testing.assert_array_equal(root.find("**/child").get_mat(root)[3, :3], (50, -3, 0))


def test_two_skins_share_joints_that_are_meshes_themselves(tmp_path):
    file, first, second, mesh = skinned()
    file.json["nodes"][second]["mesh"] = quad(file)
    file.node(name="one", mesh=mesh, skin=file.add("skins", joints=[first, second]))
    file.node(name="other", mesh=mesh, skin=file.add("skins", joints=[second, first]))
    sampler = linear(file, [0, 1], [[0, 0, BONE], [0, 0, BONE + 2]])
    file.add("animations", samplers=[sampler], channels=[channel(0, second, "translation")])
    root = load(file, tmp_path)
    root.node().update(0.5)
    moved = BONE + 1
    for name, shares in (("one", SHARES), ("other", 1 - SHARES)):
        expected = z_up(CORNERS) - np.outer(shares * moved, (0, 1, 0))
        np.testing.assert_allclose(geoms(root)[name][0].vertices, expected, atol=1e-12)
    np.testing.assert_allclose(root.find("**/second").get_mat(root)[3, :3], (0, -moved, 0), atol=1e-12)


def test_a_mesh_is_morphed_before_its_skin_moves_it(tmp_path):
    """The second joint is turned by a quarter about Y, so that it turns what the target has moved."""
    lift = np.float32([[0, 0, 1]] * 4)
    file, first, second, mesh = skinned(targets=[{"POSITION": lift}])
    file.json["nodes"][second]["rotation"] = [0, math.sqrt(0.5), 0, math.sqrt(0.5)]
    file.node(name="body", mesh=mesh, skin=file.add("skins", joints=[first, second]), weights=[2])
    moved = CORNERS + np.array([0, 0, 2.0])
    turned = np.stack([moved[:, 2], moved[:, 1], BONE - moved[:, 0]], axis=1)
    expected = moved + SHARES[:, None] * (turned - moved)
    np.testing.assert_allclose(geoms(load(file, tmp_path))["body"][0].vertices, z_up(expected), atol=1e-7)


def test_a_skin_of_a_mesh_without_joints_is_named(tmp_path):
    file = GltfFile()
    skin = file.add("skins", joints=[file.node(translation=[0, 0, 5])])
    file.node(name="statue", mesh=quad(file), skin=skin)
    root = load(file, tmp_path)
    assert "meshes without joints do not follow the skin, of nodes: 'statue'" in root.node().warnings
    np.testing.assert_array_equal(geoms(root)["statue"][0].vertices, z_up(CORNERS))


# --- Clips ---


def test_clips_have_names_of_their_own_and_those_that_move_nothing_are_left_out(tmp_path):
    file = GltfFile()
    node = file.node(mesh=quad(file), scale=[-1, 2, 0.5], rotation=[0.1, 0.2, 0.3, math.sqrt(0.86)])
    moves = [linear(file, [0, 1], [[0, 0, 0], [2, 0, 0]])]
    file.add("animations", name="empty", samplers=[], channels=[])
    for name in ("walk", "", "walk"):
        given = {"name": name} if name else {}
        file.add("animations", samplers=moves, channels=[channel(0, node, "translation")], **given)
    root = load(file, tmp_path)
    assert list(root.node().animations) == ["walk", "animation 2", "walk#2"]
    before = root.get_children()[0].get_mat()
    root.node().update(0.5)
    after = root.get_children()[0].get_mat()
    np.testing.assert_allclose(after[:3], before[:3], atol=1e-12)  # the negative scale stays
    np.testing.assert_allclose(after[3, :3], (1, 0, 0), atol=1e-12)
