"""Animations of glTF files as channels, against the arrays that the files were made of."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.errors import ModelError
from firefly_sample.scene.transforms import vectors_from_gltf
from tests.model.gltf_files import GltfFile
from tests.model.quads import CORNERS, quad, read

TIMES = np.float32([0.0, 0.5, 2.0])
RNG = np.random.default_rng(5)


def played(file: GltfFile, path: str, output: int, node: int = 0, **sampler: object) -> GltfFile:
    """Add an animation of one channel."""
    made = {"input": file.accessor(TIMES), "output": output, **sampler}
    target = {"node": node, "path": path}
    file.add("animations", samplers=[made], channels=[{"sampler": 0, "target": target}], name="move")
    return file


def one_node() -> GltfFile:
    file = GltfFile()
    file.node(name="node")
    return file


@pytest.mark.parametrize("interpolation", [None, "LINEAR", "STEP"])
def test_translation_rotation_and_scale_are_turned_to_z_up(tmp_path, interpolation):
    given = {} if interpolation is None else {"interpolation": interpolation}
    moves, scales = (np.float32(RNG.normal(size=(3, 3))) for _ in range(2))
    turns = np.float32(RNG.normal(size=(3, 4)))
    expected = {
        "translation": vectors_from_gltf(moves),
        "scale": scales[:, [0, 2, 1]],
        "rotation": np.stack([turns[:, 3], turns[:, 0], -turns[:, 2], turns[:, 1]], axis=1),
    }
    for path, values in (("translation", moves), ("rotation", turns), ("scale", scales)):
        file = one_node()
        model = read(played(file, path, file.accessor(values), **given), tmp_path)
        ((channel,),) = (made.channels for made in model.animations)
        assert (model.animations[0].name, channel.node, channel.path) == ("move", 0, path)
        assert channel.interpolation == (interpolation or "LINEAR")
        np.testing.assert_array_equal(channel.times, TIMES)
        np.testing.assert_array_equal(channel.values, expected[path])


def test_tangents_are_turned_as_well(tmp_path):
    file = one_node()
    values = np.float32(RNG.normal(size=(9, 3)))
    model = read(played(file, "translation", file.accessor(values), interpolation="CUBICSPLINE"), tmp_path)
    np.testing.assert_array_equal(
        model.animations[0].channels[0].values, vectors_from_gltf(values).reshape(3, 3, 3)
    )


def test_normalised_integers_are_rotations_of_0_to_1(tmp_path):
    file = one_node()
    values = np.int8([[0, 0, 0, 127], [127, 0, 0, 0], [-128, 0, 0, 127]])
    model = read(played(file, "rotation", file.accessor(values, normalized=True)), tmp_path)
    np.testing.assert_array_equal(
        model.animations[0].channels[0].values, [[1, 0, 0, 0], [0, 1, 0, 0], [1, -1, 0, 0]]
    )


@pytest.mark.parametrize("cubic", [False, True])
def test_weights_have_a_column_for_each_target(tmp_path, cubic):
    file = GltfFile()
    file.node(mesh=quad(file, targets=[{"POSITION": CORNERS}, {"POSITION": CORNERS * 2}]))
    values = np.float32(RNG.normal(size=(18 if cubic else 6)))
    played(file, "weights", file.accessor(values), interpolation="CUBICSPLINE" if cubic else "LINEAR")
    (channel,) = read(file, tmp_path).animations[0].channels
    assert channel.path == "morph_weights"
    np.testing.assert_array_equal(channel.values, values.reshape((3, 3, 2) if cubic else (3, 2)))


def test_channels_without_a_node_or_of_nodes_outside_the_scene_are_left_out(tmp_path):
    file = one_node()
    outside = file.add("nodes", name="outside")
    output = file.accessor(np.zeros((3, 3), np.float32))
    played(file, "scale", output, outside)
    played(file, "scale", output)
    del file.json["animations"][1]["channels"][0]["target"]["node"]
    played(file, "scale", output)
    file.json["animations"][2]["channels"] *= 2
    file.json["animations"][2]["channels"][0]["target"] = {"node": outside, "path": "scale"}
    file.json["animations"][2]["channels"][1] = {"sampler": 0, "target": {"node": 0, "path": "scale"}}
    model = read(file, tmp_path)
    assert [len(made.channels) for made in model.animations] == [1]


def test_pointers_are_named_as_not_played(tmp_path):
    file = one_node()
    played(file, "pointer", file.accessor(np.zeros(3, np.float32)))
    target = file.json["animations"][0]["channels"][0]["target"]
    del target["node"]
    target["extensions"] = {"KHR_animation_pointer": {"pointer": "/materials/0/alphaCutoff"}}
    file.json["extensionsUsed"] = ["KHR_animation_pointer"]
    model = read(file, tmp_path)
    assert model.animations == []
    assert model.losses[0] == "channels of KHR_animation_pointer are not played, of animations: 'move'"


def test_an_animation_without_a_name_has_its_number(tmp_path):
    file = one_node()
    played(file, "scale", file.accessor(np.ones((3, 3), np.float32)))
    del file.json["animations"][0]["name"]
    assert read(file, tmp_path).animations[0].name == "animation 0"


def damage(**changes):
    """A file whose only animation is changed: by key of the sampler, the target or the channel."""
    file = one_node()
    played(file, "translation", file.accessor(np.zeros((3, 3), np.float32)))
    (made,) = file.json["animations"]
    places = {
        "sampler": made["samplers"][0],
        "target": made["channels"][0]["target"],
        "channel": made["channels"][0],
    }
    for key, value in changes.items():
        where, _, name = key.partition("__")
        places[where][name] = value(file) if callable(value) else value
    return file


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"sampler__input": lambda f: f.accessor(np.float32([0, 1, 1]))},
            "must be times that ascend strictly",
        ),
        ({"sampler__input": lambda f: f.accessor(np.float32([0, 1]))}, "has 3 elements for 2 times"),
        ({"sampler__input": lambda f: f.accessor(np.uint8([0, 1, 2]))}, "input: must be floats"),
        ({"sampler__output": lambda f: f.accessor(np.zeros((3, 4)))}, "output: must be of type VEC3"),
        ({"sampler__interpolation": "WAVY"}, "interpolation: must be one of STEP, LINEAR, CUBICSPLINE"),
        ({"sampler__interpolation": "CUBICSPLINE"}, "has 3 elements for 3 times"),
        ({"channel__sampler": 1}, "sampler: is 1, but there are 1 samplers"),
        ({"target__node": 9}, r"target\.node: refers to nodes\[9\]"),
        ({"target__path": "weights"}, "its mesh has no morph targets"),
    ],
)
def test_damage_is_named(tmp_path, changes, message):
    with pytest.raises(ModelError, match=r"animations\[0\].*" + message):
        read(damage(**changes), tmp_path)


def test_a_node_with_a_matrix_cannot_be_animated(tmp_path):
    file = damage()
    file.json["nodes"][0]["matrix"] = np.eye(4).ravel().tolist()
    with pytest.raises(ModelError, match=r"nodes\[0\] has a matrix, so it cannot be animated"):
        read(file, tmp_path)


def test_a_rotation_without_length_is_an_error(tmp_path):
    file = one_node()
    played(file, "rotation", file.accessor(np.zeros((3, 4), np.float32)))
    with pytest.raises(ModelError, match="has a rotation without length"):
        read(file, tmp_path)
