"""Scenes, nodes, cameras, lights, instances and skins of glTF files."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firefly_sample.errors import ModelError
from firefly_sample.scene.transforms import compose_matrix, matrix_from_gltf, rows_from_quat
from tests.model.gltf_files import GltfFile
from tests.model.quads import CORNERS, quad, read

TURN = np.array([0.5, 0.5, -0.5, 0.5])  # x, y, z, w: a third of a turn


def gltf_matrix(translation=(0, 0, 0), rotation=(0, 0, 0, 1), scale=(1, 1, 1)) -> np.ndarray:
    """The matrix for column vectors, T * R * S, written from section 3.5.3 by itself."""
    x, y, z, w = rotation
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = turn @ np.diag(scale)
    matrix[:3, 3] = translation
    return matrix


def matrix_of(node) -> np.ndarray:
    """The transform of a NodeData, for row vectors."""
    if node.matrix is not None:
        return node.matrix
    return compose_matrix(node.translation, rows_from_quat(node.rotation), node.scale, (0.0, 0.0, 0.0))


def names(model) -> list[tuple[str, int]]:
    return [(node.name, node.parent) for node in model.nodes]


def test_nodes_keep_their_names_and_order(tmp_path):
    file = GltfFile()
    top = file.node(name="b")
    file.node(name="a")
    file.node(name="same", parent=top)
    inner = file.node(name="same", parent=top)
    file.node(parent=inner, mesh=quad(file, name="sheet"))
    file.node(parent=inner, mesh=quad(file))
    file.node(name="", parent=top)
    expected = [("b", -1), ("same", 0), ("same", 0), ("sheet", 2), ("node 5", 2), ("node 6", 0), ("a", -1)]
    assert names(read(file, tmp_path)) == expected


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"translation": [1, 2, 3]},
        {"rotation": TURN.tolist()},
        {"rotation": (TURN * 3).tolist()},
        {"scale": [2, 3, -4]},
        {"translation": [1, 2, 3], "rotation": [0.6, 0, 0, 0.8], "scale": [1, 0, 5]},
    ],
)
def test_transforms_are_turned_to_z_up(tmp_path, given):
    file = GltfFile()
    file.node(**given)
    unit = {key: np.array(value) for key, value in given.items()}
    if "rotation" in unit:
        unit["rotation"] = unit["rotation"] / np.linalg.norm(unit["rotation"])
    matrix = gltf_matrix(**unit)
    (node,) = read(file, tmp_path).nodes
    np.testing.assert_allclose(matrix_of(node), matrix_from_gltf(matrix), atol=1e-15)
    file = GltfFile()
    file.node(matrix=matrix.T.ravel().tolist())
    (node,) = read(file, tmp_path).nodes
    np.testing.assert_allclose(matrix_of(node), matrix_from_gltf(matrix), atol=1e-15)


def two_scenes() -> GltfFile:
    file = GltfFile()
    first, second = (file.add("nodes", name=name) for name in ("one", "two"))
    file.json["scenes"] = [{"nodes": [first], "name": "day"}, {"nodes": [second], "name": "night"}]
    file.json["scene"] = 1
    return file


@pytest.mark.parametrize(
    ("scene", "node"),
    [(None, "two"), (0, "one"), (1, "two"), ("0", "one"), ("1", "two"), ("day", "one"), ("night", "two")],
)
def test_a_scene_is_chosen_by_name_or_index(tmp_path, scene, node):
    assert names(read(two_scenes(), tmp_path, scene=scene)) == [(node, -1)]


def test_a_scenes_name_goes_before_an_index(tmp_path):
    file = two_scenes()
    file.json["scenes"][0]["name"] = "1"
    assert names(read(file, tmp_path, scene="1")) == [("one", -1)]


@pytest.mark.parametrize("scene", [2, -1, "2", "-1", "01", True, "dusk"])
def test_a_scene_that_is_not_there_is_an_error_that_lists_them(tmp_path, scene):
    with pytest.raises(ModelError, match=r"there is no scene .*: it has 0 'day', 1 'night'"):
        read(two_scenes(), tmp_path, scene=scene)


def test_without_a_default_scene_the_first_counts_and_without_scenes_all_roots(tmp_path):
    file = two_scenes()
    del file.json["scene"]
    assert names(read(file, tmp_path)) == [("one", -1)]
    del file.json["scenes"]
    file.json["nodes"][0]["children"] = [file.add("nodes", name="below")]
    assert names(read(file, tmp_path)) == [("one", -1), ("below", 0), ("two", -1)]


@pytest.mark.parametrize(
    ("nodes", "roots", "message"),
    [
        ([{"children": [2]}, {"children": [2]}, {}], [0, 1], r"nodes\[2\]: has two parents, nodes\[0\] and"),
        ([{"children": [1, 1]}, {}], [0], r"nodes\[1\]: has two parents"),
        ([{"children": [0]}], [0], r"nodes\[0\]: it, or a node above it, is its own ancestor"),
        ([{}, {"children": [2]}, {"children": [1]}], [0], r"nodes\[1\]: it, or a node above it, is its own"),
        (
            [{"children": [1]}, {}],
            [0, 1],
            r"nodes\[1\]: is a root of the scene, but also a child of nodes\[0\]",
        ),
        ([{}], [0, 0], r"nodes\[0\]: is a root of the scene twice"),
        ([{"children": [1]}], [0], r"nodes\[0\]\.children\[0\]: refers to nodes\[1\]"),
        ([{"rotation": [0, 0, 0, 0]}], [0], r"rotation: must be a unit quaternion"),
        ([{"matrix": [1.0] * 16}], [0], r"matrix: has a last row other than 0, 0, 0, 1"),
        ([{"scale": [1, 1]}], [0], r"scale: must be 3 numbers"),
        ([{"name": 3}], [0], r"nodes\[0\]\.name: must be a text"),
    ],
)
def test_damage_is_named(tmp_path, nodes, roots, message):
    file = GltfFile()
    file.json |= {"nodes": nodes, "scenes": [{"nodes": roots}]}
    with pytest.raises(ModelError, match=message):
        read(file, tmp_path)


def test_cameras(tmp_path):
    file = GltfFile()
    lens = {"yfov": math.pi / 3, "znear": 0.5}
    file.add("cameras", type="perspective", perspective=lens, name="eye")
    file.add("cameras", type="perspective", perspective={**lens, "zfar": 9, "aspectRatio": 1.5})
    file.add("cameras", type="orthographic", orthographic={"xmag": 2, "ymag": 3, "znear": 0, "zfar": 8})
    for camera in (0, 2, 1, 0):
        file.node(camera=camera)
    model = read(file, tmp_path)
    assert [node.camera for node in model.nodes] == [0, 1, 2, 0]
    first, flat, second = model.cameras
    assert (first.name, first.near, first.far, first.aspect, first.film_size) == (
        "eye",
        0.5,
        math.inf,
        None,
        None,
    )
    assert first.fov == second.fov == pytest.approx(60.0, rel=1e-15)
    assert (second.name, second.far, second.aspect) == ("camera 1", 9.0, 1.5)
    assert (flat.fov, flat.film_size, flat.near, flat.far) == (None, (4.0, 6.0), 0.0, 8.0)


def test_a_negative_magnification_is_named_and_counts_as_a_positive_one(tmp_path):
    file = GltfFile()
    lens = {"xmag": -2, "ymag": 3, "znear": 0, "zfar": 8}
    file.add("cameras", type="orthographic", orthographic=lens, name="mirror")
    file.node(camera=0, mesh=quad(file))
    model = read(file, tmp_path)
    assert model.cameras[0].film_size == (4.0, 6.0)
    assert model.losses == ["a negative xmag or ymag does not mirror the picture, of cameras: 'mirror'"]


@pytest.mark.parametrize(
    ("camera", "message"),
    [
        ({"type": "fisheye"}, "type: must be perspective or orthographic"),
        ({"type": "perspective"}, "perspective: is missing"),
        (
            {"type": "perspective", "perspective": {"yfov": 4, "znear": 1}},
            "yfov: must be above 0 and below pi",
        ),
        ({"type": "perspective", "perspective": {"yfov": 1, "znear": 0}}, "znear must be above 0"),
        (
            {"type": "perspective", "perspective": {"yfov": 1, "znear": 2, "zfar": 1}},
            "below zfar, got 2 and 1",
        ),
        (
            {"type": "orthographic", "orthographic": {"xmag": 0, "ymag": 1, "znear": 0, "zfar": 1}},
            "xmag: must not be 0",
        ),
    ],
)
def test_damage_to_cameras_is_named(tmp_path, camera, message):
    file = GltfFile()
    file.node(camera=file.add("cameras", **camera))
    with pytest.raises(ModelError, match=r"cameras\[0\].*" + message):
        read(file, tmp_path)


def lit(*lights: dict) -> GltfFile:
    file = GltfFile()
    file.json["extensionsUsed"] = ["KHR_lights_punctual"]
    file.json["extensions"] = {"KHR_lights_punctual": {"lights": list(lights)}}
    for index in range(len(lights)):
        file.node(extensions={"KHR_lights_punctual": {"light": index}})
    return file


def test_lights(tmp_path):
    model = read(
        lit(
            {"type": "point", "name": "lamp", "color": [1, 0.5, 0.25], "intensity": 20, "range": 7},
            {"type": "directional"},
            {"type": "spot", "spot": {"innerConeAngle": math.pi / 6, "outerConeAngle": math.pi / 2}},
            {"type": "spot", "spot": {}},
        ),
        tmp_path,
    )
    lamp, sun, spot, plain = model.lights
    assert (lamp.name, lamp.kind, lamp.color) == ("lamp", "point", (1.0, 0.5, 0.25))
    assert (lamp.intensity, lamp.range) == (20.0, 7.0)
    assert (sun.name, sun.kind, sun.color) == ("light 1", "directional", (1.0, 1.0, 1.0))
    assert (sun.intensity, sun.range) == (1.0, math.inf)
    assert (spot.inner, spot.outer) == (pytest.approx(30.0, rel=1e-15), 90.0)
    assert (plain.inner, plain.outer) == (0.0, 45.0)
    assert [node.light for node in model.nodes] == [0, 1, 2, 3]
    assert model.losses == ["the file has no triangles, lines or points, so that there is nothing to draw"]


@pytest.mark.parametrize(
    ("light", "message"),
    [
        ({"type": "area"}, "type: must be one of point, spot, directional"),
        ({"type": "point", "range": 0}, "range: must be above 0"),
        ({"type": "point", "intensity": -1}, "intensity: must be at least 0"),
        ({"type": "spot"}, "spot: is missing"),
        ({"type": "spot", "spot": {"innerConeAngle": 1, "outerConeAngle": 0.5}}, "innerConeAngle < outer"),
    ],
)
def test_damage_to_lights_is_named(tmp_path, light, message):
    with pytest.raises(ModelError, match=message):
        read(lit(light), tmp_path)


@pytest.mark.parametrize("quantized", [False, True])
def test_instances(tmp_path, quantized):
    moves = np.float32([[1, 2, 3], [0, 0, 0], [-5, 0, 1]])
    turns = np.array([[0, 0, 0, 1], TURN, [0, 1, 0, 0]])
    scales = np.float32([[1, 1, 1], [2, 3, 4], [1, -1, 1]])
    file = GltfFile()
    rotation = file.accessor(turns)
    if quantized:
        turns = np.round(turns * 127).astype(np.int8)
        rotation = file.accessor(turns, normalized=True)
        turns = turns / 127.0
        turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    attributes = {
        "TRANSLATION": file.accessor(moves),
        "ROTATION": rotation,
        "SCALE": file.accessor(scales),
        "_ID": file.accessor(np.float32([1, 2, 3])),
    }
    file.node(mesh=quad(file), extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})
    (node,) = read(file, tmp_path).nodes
    expected = [matrix_from_gltf(gltf_matrix(*row)) for row in zip(moves, turns, scales, strict=True)]
    np.testing.assert_allclose(node.instances, expected, atol=1e-14)


def test_instances_may_have_nothing_but_attributes_of_an_application(tmp_path):
    file = GltfFile()
    attributes = {"_ID": file.accessor(np.float32([1, 2, 3]))}
    file.node(mesh=quad(file), extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})
    (node,) = read(file, tmp_path).nodes
    np.testing.assert_array_equal(node.instances, [np.eye(4)] * 3)


def test_instances_of_different_counts_are_an_error(tmp_path):
    file = GltfFile()
    attributes = {
        "TRANSLATION": file.accessor(np.zeros((2, 3), np.float32)),
        "SCALE": file.accessor(np.zeros((3, 3), np.float32)),
    }
    file.node(mesh=quad(file), extensions={"EXT_mesh_gpu_instancing": {"attributes": attributes}})
    with pytest.raises(ModelError, match="must have one and the same count"):
        read(file, tmp_path)


def skinned(file: GltfFile, **skin: object) -> int:
    joints = np.uint8([[0, 1, 0, 0]] * 4)
    weights = np.float32([[0.5, 0.5, 0, 0]] * 4)
    return file.node(
        name="body", mesh=quad(file, JOINTS_0=joints, WEIGHTS_0=weights), skin=file.add("skins", **skin)
    )


def test_skins(tmp_path):
    file = GltfFile()
    bind = np.array([gltf_matrix((1, 2, 3), TURN), gltf_matrix((0, 0, 0), (0, 0, 0, 1), (2, 2, 2))])
    hip = file.node(name="hip")
    knee = file.node(name="knee", parent=hip)
    skinned(file, joints=[knee, hip], inverseBindMatrices=file.accessor(bind), name="leg")
    model = read(file, tmp_path)
    (skin,) = model.skins
    assert (skin.name, skin.joints, model.nodes[2].skin) == ("leg", (1, 0), 0)
    np.testing.assert_allclose(skin.inverse_bind, [matrix_from_gltf(one) for one in bind], atol=1e-7)


def test_joints_outside_the_scene_follow_with_the_nodes_above_them(tmp_path):
    file = GltfFile()
    hip = file.add("nodes", name="hip", mesh=0)  # its mesh is not in the scene either
    knee = file.add("nodes", name="knee")
    file.add("nodes", name="above", children=[hip])
    file.json["nodes"][hip]["children"] = [knee]
    skinned(file, joints=[knee, hip])
    model = read(file, tmp_path)
    assert names(model) == [("body", -1), ("above", -1), ("hip", 1), ("knee", 2)]
    assert [len(node.geoms) for node in model.nodes] == [1, 0, 0, 0]
    (skin,) = model.skins
    assert skin.joints == (3, 2)
    np.testing.assert_array_equal(skin.inverse_bind, [np.eye(4)] * 2)


@pytest.mark.parametrize(
    ("node", "mesh", "expected"),
    [
        ({}, {}, (0.0, 0.0)),
        ({}, {"weights": [0.25, 0.5]}, (0.25, 0.5)),
        ({"weights": [1, -1]}, {"weights": [0.25, 0.5]}, (1.0, -1.0)),
    ],
)
def test_weights_of_the_node_replace_those_of_the_mesh(tmp_path, node, mesh, expected):
    file = GltfFile()
    targets = [{"POSITION": CORNERS}, {"POSITION": -CORNERS}]
    file.node(mesh=quad(file, targets=targets, **mesh), **node)
    (made,) = read(file, tmp_path).nodes
    assert made.morph_weights == expected


def test_weights_of_another_count_are_an_error(tmp_path):
    file = GltfFile()
    file.node(mesh=quad(file, targets=[{"POSITION": CORNERS}]), weights=[1, 2])
    with pytest.raises(ModelError, match=r"nodes\[0\]\.weights: are 2 for 1 morph targets"):
        read(file, tmp_path)


def test_a_mesh_of_many_nodes_is_read_once(tmp_path):
    file = GltfFile()
    mesh = quad(file)
    for _ in range(3):
        file.node(mesh=mesh)
    model = read(file, tmp_path)
    assert len(model.geoms) == 1
    assert [node.geoms for node in model.nodes] == [(0,)] * 3
