"""Tangents of glTF files, given and computed, by the text of sections 3.7.2.1 and 3.7.2.2."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample import load_model
from firefly_sample.disk_cache import VARIABLE
from firefly_sample.errors import ModelError
from firefly_sample.scene.tangents import TangentGroups
from firefly_sample.scene.transforms import vectors_from_gltf
from tests.model.gltf_files import GltfFile
from tests.model.quads import CORNERS, NORMALS, TRIANGLES, UVS, picture, quad, read

GREY = np.full((2, 2, 3), 128, np.uint8)
ALONG_X = np.float32([[1, 0, 0, 1]] * 4)


def mapped(file, info=None, **attributes):
    """A file with a quad that has a normal map; attributes that are None are left out."""
    texture = {"index": picture(file, GREY), **(info or {})}
    material = file.add("materials", name="paint", normalTexture=texture)
    given = {"POSITION": CORNERS, "NORMAL": NORMALS, "TEXCOORD_0": UVS, "indices": TRIANGLES.ravel()}
    given = {key: value for key, value in {**given, **attributes}.items() if value is not None}
    return file.node(mesh=file.mesh(material=material, **given), name="quad")


def arrays_of(tmp_path, info=None, **attributes):
    file = GltfFile()
    mapped(file, info, **attributes)
    model = read(file, tmp_path)
    assert model.losses == []
    return model.geoms[0].arrays


def test_computed_tangents_are_those_that_a_file_would_give(tmp_path):
    """The quad shows the picture upright: its tangents are (1, 0, 0, 1), as exporters write them."""
    given, computed = arrays_of(tmp_path, TANGENT=ALONG_X), arrays_of(tmp_path)
    np.testing.assert_array_equal(given["tangents"], [[1.0, 0.0, 0.0, 1.0]] * 4)
    np.testing.assert_array_equal(computed["tangents"], given["tangents"])
    # glTF's bitangent is upwards in the picture: in its axes +Y, in ours +Z
    bitangents = np.cross(given["normals"], given["tangents"][:, :3]) * given["tangents"][:, 3:]
    np.testing.assert_array_equal(bitangents, [[0.0, 0.0, 1.0]] * 4)


def test_given_tangents_are_turned_to_z_up_and_of_length_1(tmp_path):
    tangents = np.float32([[0, 2, 0, 1], [0, 0.5, 0, -1], [3, 4, 0, 1], [0, 0, 0, -1]])
    found = arrays_of(tmp_path, TANGENT=tangents)["tangents"]
    assert found[:3].tolist() == [[0, 0, 1, 1], [0, 0, 1, -1], [0.6, 0, 0.8, 1]]
    # the last has no direction: any at a right angle to the normal, which is -Y
    assert (np.linalg.norm(found[3, :3]), found[3, 1], found[3, 3]) == (1.0, 0.0, -1.0)


def test_without_a_normal_map_there_are_none(tmp_path):
    file = GltfFile()
    file.node(mesh=quad(file, TANGENT=ALONG_X))
    assert "tangents" not in read(file, tmp_path).geoms[0].arrays


def test_without_normals_given_tangents_are_ignored(tmp_path):
    upwards = np.float32([[0, 1, 0, -1]] * 4)
    target = {"POSITION": CORNERS, "TANGENT": np.float32(ALONG_X[:, :3])}
    found = arrays_of(tmp_path, NORMAL=None, TANGENT=upwards, targets=[target])
    np.testing.assert_array_equal(found["tangents"], [[1.0, 0.0, 0.0, 1.0]] * 6)
    assert "morph_tangents" not in found


def test_the_texture_coordinates_are_those_of_the_normal_map(tmp_path):
    """A quarter turn counter-clockwise of the second set: u grows downwards, v to the right."""
    turned = np.roll(UVS, 1, axis=0)
    found = arrays_of(tmp_path, {"texCoord": 1}, TEXCOORD_1=turned)
    expected = vectors_from_gltf([0.0, 1.0, 0.0])
    across = found["texcoords"][1] - found["texcoords"][0]
    assert across[0] == 0.0
    np.testing.assert_allclose(found["tangents"][:, :3], np.tile(expected * -np.sign(across[1]), (4, 1)))
    moved = {"extensions": {"KHR_texture_transform": {"scale": [-1, 1]}}}
    found = arrays_of(tmp_path, moved)
    np.testing.assert_array_equal(found["tangents"], [[-1.0, 0.0, 0.0, -1.0]] * 4)


MIRRORED = np.float32([[0, 1], [1, 1], [1, 0], [0, 0], [0, 1], [0, 0]])
STRIP = np.float32([[-1, -1, 0], [0, -1, 0], [0, 1, 0], [-1, 1, 0], [1, -1, 0], [1, 1, 0]])
"""Two squares side by side, the right one mirrored: u is 0, 1 and 0 from left to right."""
STRIP_TRIANGLES = np.uint16([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]])


def test_vertices_are_copied_with_everything_where_a_texture_is_mirrored(tmp_path):
    rng = np.random.default_rng(1)
    targets = [{"POSITION": rng.normal(size=(6, 3)), "NORMAL": rng.normal(size=(6, 3)) / 9} for _ in range(2)]
    given = {
        "POSITION": STRIP,
        "NORMAL": np.tile(NORMALS[:1], (6, 1)),
        "indices": STRIP_TRIANGLES.ravel(),
        "TEXCOORD_0": MIRRORED,
        "COLOR_0": np.float32(rng.random((6, 4))),
        "JOINTS_0": np.uint8(rng.integers(0, 2, (6, 4))),
        "WEIGHTS_0": np.float32([[1, 0, 0, 0]] * 6),
        "targets": targets,
    }
    found, plain = (
        arrays_of(tmp_path, **given),
        arrays_of(tmp_path, TANGENT=np.float32([[1, 0, 0, 1]] * 6), **given),
    )
    assert found["triangles"].tolist() == [[0, 1, 2], [0, 2, 3], [6, 4, 5], [6, 5, 7]]
    sources = [0, 1, 2, 3, 4, 5, 1, 2]
    for name in plain.keys() - {"triangles", "tangents"}:
        per_target = name.startswith("morph_")
        np.testing.assert_array_equal(
            found[name], plain[name][:, sources] if per_target else plain[name][sources]
        )
    left, right = [1.0, 0.0, 0.0, 1.0], [-1.0, 0.0, 0.0, -1.0]
    assert found["tangents"].tolist() == [left, left, left, left, right, right, right, right]


def test_morph_targets_displace_given_tangents(tmp_path):
    moved = np.float32([[0, 1, 2]] * 4)
    targets = [{"POSITION": CORNERS}, {"TANGENT": moved}]
    found = arrays_of(tmp_path, TANGENT=ALONG_X, targets=targets)["morph_tangents"]
    np.testing.assert_array_equal(found, [np.zeros((4, 3)), [[0.0, -2.0, 1.0]] * 4])


def test_computed_tangents_are_computed_for_each_morph_target(tmp_path):
    rng = np.random.default_rng(2)
    targets = [
        {"POSITION": rng.normal(size=(4, 3)), "NORMAL": rng.normal(size=(4, 3)) / 9},
        {"POSITION": rng.normal(size=(4, 3))},
    ]
    found = arrays_of(tmp_path, targets=targets)
    for target in range(2):
        vertices = found["vertices"] + found["morph_vertices"][target]
        normals = found["normals"] + found["morph_normals"][target]
        groups = TangentGroups(vertices, found["triangles"], normals, found["texcoords"])
        expected = groups.vertices(vertices, normals)
        at_target = found["tangents"][:, :3] + found["morph_tangents"][target]
        np.testing.assert_allclose(at_target, expected[:, :3], atol=1e-12)


def test_a_normal_map_without_texture_coordinates_is_named(tmp_path):
    file = GltfFile()
    mapped(file, TEXCOORD_0=None)
    model = read(file, tmp_path)
    line = "a texture is not drawn right, because TEXCOORD_0 is missing, of meshes: 'mesh 0'"
    assert model.losses == [line]
    assert "tangents" not in model.geoms[0].arrays


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ({"TANGENT": ALONG_X[:, :3]}, r"TANGENT: must be of type VEC4, got VEC3"),
        ({"TANGENT": ALONG_X[:3]}, r"TANGENT: has 3 elements for 4 vertices"),
        (
            {"TANGENT": ALONG_X, "targets": [{"TANGENT": ALONG_X}]},
            r"targets\[0\]\.TANGENT: must be of type VEC3",
        ),
    ],
)
def test_damage_is_named(tmp_path, attributes, message):
    with pytest.raises(ModelError, match=message):
        arrays_of(tmp_path, **attributes)


def test_a_kept_model_has_the_same_materials_and_tangents(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "kept"))
    file = GltfFile()
    maps = [{"index": picture(file, GREY)} for _ in range(3)]
    made = {
        "normalTexture": {**maps[0], "scale": -2.0},
        "occlusionTexture": {**maps[1], "texCoord": 1, "strength": 0.25},
        "pbrMetallicRoughness": {"metallicFactor": 0.5, "metallicRoughnessTexture": maps[2]},
    }
    metal = file.add("materials", name="metal", **made)
    flat = file.add("materials", name="flat", extensions={"KHR_materials_unlit": {}})
    for material in (metal, flat):
        file.node(mesh=quad(file, material=material, TEXCOORD_1=UVS[::-1]))
    path = file.write(tmp_path / "model.glb")
    fresh, kept = (load_model(path) for _ in range(2))
    for one, other in zip(fresh.get_children(), kept.get_children(), strict=True):
        ((geom, material), (again, material_again)) = one.node().geoms[0], other.node().geoms[0]
        if material.name == "metal":
            np.testing.assert_array_equal(geom.tangents, [[1.0, 0.0, 0.0, 1.0]] * 4)
            np.testing.assert_array_equal(again.tangents, geom.tangents)
        for name, value in vars(material).items():
            again = getattr(material_again, name)
            if name.endswith("texture"):
                assert (value is None) == (again is None), name
            else:
                assert np.array_equal(value, again), name
    metal_made, flat_made = (child.node().geoms[0][1] for child in kept.get_children())
    assert (metal_made.metallic, metal_made.roughness, metal_made.normal_scale) == (0.5, 1.0, -2.0)
    assert (metal_made.occlusion_strength, metal_made.occlusion_texcoord) == (0.25, 1)
    assert (flat_made.unlit, flat_made.metallic) == (True, None)
