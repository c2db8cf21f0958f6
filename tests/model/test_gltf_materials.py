"""Materials and textures of glTF files, against the specification's text and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.errors import ModelError
from firefly_sample.model.data import MaterialData
from firefly_sample.model.gltf.materials import cut_out
from tests.model.gltf_files import GltfFile
from tests.model.quads import UVS, picture, quad, read, shaded

PLAIN = {"metallicFactor": 0.0}
GREY = np.full((2, 2, 3), 128, np.uint8)


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.5), st.integers(0, 255))
def test_alpha_moves_into_the_cutoff(alpha, cutoff, code):
    texel = code / 255.0
    (*rgb, opacity), moved = cut_out((0.1, 0.2, 0.3, alpha), cutoff)
    assert rgb == [0.1, 0.2, 0.3]
    assert 0.0 <= moved <= 1.0
    if abs(texel * alpha - cutoff) > 1e-12:  # else it is rounding that decides
        assert (texel * opacity >= moved) == (texel * alpha >= cutoff)


def test_a_primitive_without_material_has_the_defaults_of_the_specification(tmp_path):
    """Sections 3.9.2 and 3.9.6: white, a metal and rough, like a material that says nothing."""
    file = shaded(GltfFile())
    file.node(mesh=quad(file))
    model = read(file, tmp_path)
    said, default = (model.materials[geom.material] for geom in model.geoms)
    assert (default.base_color, default.metallic, default.roughness) == ((1, 1, 1, 1), 1.0, 1.0)
    assert replace(said, name=default.name) == default
    assert model.losses == []


def test_colours_alpha_and_sides_are_read(tmp_path):
    file = shaded(
        GltfFile(),
        alphaMode="MASK",
        alphaCutoff=0.25,
        doubleSided=True,
        emissiveFactor=[0.1, 0.2, 0.3],
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 50.0}},
        pbrMetallicRoughness={"baseColorFactor": [0.1, 0.2, 0.3, 0.5], **PLAIN},
    )
    (made,) = read(file, tmp_path).materials
    assert (made.name, made.alpha_mode, made.double_sided) == ("paint", "mask", True)
    assert (made.base_color, made.alpha_cutoff) == ((0.1, 0.2, 0.3, 1.0), 0.5)
    np.testing.assert_allclose(made.emission, [5.0, 10.0, 15.0], rtol=1e-15)


@pytest.mark.parametrize(
    ("surface", "expected"),
    [
        ({}, (1.0, 1.0)),
        ({"metallicFactor": 0.25}, (0.25, 1.0)),
        ({"roughnessFactor": 0.0}, (1.0, 0.0)),
        ({"metallicFactor": 0.0, "roughnessFactor": 0.5}, (0.0, 0.5)),
    ],
)
def test_factors_of_metal_and_roughness(tmp_path, surface, expected):
    model = read(shaded(GltfFile(), pbrMetallicRoughness=surface), tmp_path)
    (made,) = model.materials
    assert (made.metallic, made.roughness) == expected
    assert (made.specular, made.shininess, made.unlit) == ((0.0, 0.0, 0.0), 0.0, False)
    assert model.losses == []


def test_all_five_textures_of_a_material(tmp_path):
    file = GltfFile()
    base, metal, normal, occlusion, glow = ({"index": picture(file, GREY)} for _ in range(5))
    shaded(
        file,
        pbrMetallicRoughness={"baseColorTexture": base, "metallicRoughnessTexture": metal},
        normalTexture={**normal, "scale": -2.5},
        occlusionTexture={**occlusion, "strength": 0.25},
        emissiveTexture=glow,
        emissiveFactor=[1, 1, 1],
    )
    model = read(file, tmp_path)
    ((made,), (geom,)) = model.materials, model.geoms
    images = [
        model.textures[number].image
        for number in (
            made.texture,
            made.normal_texture,
            made.metallic_roughness_texture,
            made.occlusion_texture,
            made.emission_texture,
        )
    ]
    assert [model.images[image].name for image in images] == [f"image {i}" for i in (0, 2, 1, 3, 4)]
    assert (made.normal_scale, made.occlusion_strength) == (-2.5, 0.25)
    assert texcoords_of(made) == (0, 0, 0, 0)
    assert "texcoords_1" not in geom.arrays
    assert model.losses == []


def texcoords_of(made):
    """The numbers of the texture coordinates, in the order in which slots get them."""
    return (
        made.normal_texcoord,
        made.metallic_roughness_texcoord,
        made.occlusion_texcoord,
        made.emission_texcoord,
    )


MOVED = {"extensions": {"KHR_texture_transform": {"offset": [0.5, 0]}}}
OTHER = {"texCoord": 1}


@pytest.mark.parametrize(
    ("infos", "numbers", "sets", "lost"),
    [
        (({}, OTHER, {}, OTHER, {}), (1, 0, 1, 0), [UVS, UVS / 2], 0),
        (({}, {}, MOVED, MOVED, {}), (0, 1, 1, 0), [UVS, UVS + np.array([0.5, 0])], 0),
        ((OTHER, {}, {}, {}, OTHER), (1, 1, 1, 0), [UVS / 2, UVS], 0),
        ((None, OTHER, {}, OTHER, {}), (0, 1, 0, 1), [UVS / 2, UVS], 0),
        (({}, OTHER, MOVED, {}, MOVED), (1, 0, 0, 0), [UVS, UVS / 2], 2),
    ],
)
def test_textures_share_two_sets_of_texture_coordinates(tmp_path, infos, numbers, sets, lost):
    """In the order base colour, normal, metallic-roughness, occlusion, emission."""
    file = GltfFile()
    index = picture(file, GREY)
    base, normal, metal, occlusion, glow = (
        None if info is None else {"index": index, **info} for info in infos
    )
    surface = {"metallicRoughnessTexture": metal} | ({} if base is None else {"baseColorTexture": base})
    material = file.add(
        "materials",
        name="paint",
        pbrMetallicRoughness=surface,
        normalTexture=normal,
        occlusionTexture=occlusion,
        emissiveTexture=glow,
        emissiveFactor=[1, 1, 1],
    )
    file.node(mesh=quad(file, material=material, TEXCOORD_1=np.float32(UVS / 2)))
    model = read(file, tmp_path)
    ((made,), (geom,)) = model.materials, model.geoms
    assert texcoords_of(made) == numbers
    for name, expected in zip(("texcoords", "texcoords_1"), sets, strict=True):
        np.testing.assert_array_equal(geom.arrays[name], with_v_up(expected))
    line = "textures with a third set of texture coordinates are left out, of materials: 'paint'"
    assert model.losses == ([line] if lost else [])
    left_out = (made.metallic_roughness_texture, made.emission_texture).count(None)
    assert left_out == lost


def test_textures_without_effect_are_left_out(tmp_path):
    file = GltfFile()
    texture = {"index": picture(file, GREY)}
    surface = {"metallicFactor": 0, "roughnessFactor": 0, "metallicRoughnessTexture": texture}
    shaded(file, pbrMetallicRoughness=surface, occlusionTexture={**texture, "strength": 0})
    model = read(file, tmp_path)
    assert (model.textures, model.images, model.losses) == ([], [], [])


def test_an_unlit_material_keeps_its_colour_alone(tmp_path):
    file = GltfFile()
    texture = {"index": picture(file, GREY)}
    shaded(
        file,
        pbrMetallicRoughness={
            "baseColorFactor": [0.5, 0.25, 1, 0.5],
            "baseColorTexture": texture,
            "metallicRoughnessTexture": {**texture, **MOVED},
        },
        normalTexture=texture,
        occlusionTexture=texture,
        emissiveTexture=texture,
        emissiveFactor=[1, 1, 1],
        alphaMode="BLEND",
        extensions={"KHR_materials_unlit": {}},
    )
    model = read(file, tmp_path)
    ((made,), (geom,)) = model.materials, model.geoms
    assert made == MaterialData("paint", (0.5, 0.25, 1.0, 0.5), texture=0, alpha_mode="blend", unlit=True)
    assert {"texcoords_1", "tangents"}.isdisjoint(geom.arrays)
    assert model.losses == []


@pytest.mark.parametrize(
    ("properties", "field", "expected", "line"),
    [
        (
            {"pbrMetallicRoughness": {"metallicFactor": 1.5}},
            "metallic",
            1.0,
            "metallic factors outside 0 to 1",
        ),
        (
            {"pbrMetallicRoughness": {"roughnessFactor": -1}},
            "roughness",
            0.0,
            "roughness factors outside 0 to 1",
        ),
        (
            {"normalTexture": {"scale": -2e3}},
            "normal_scale",
            -1e3,
            "scales of normal maps outside -1000 to 1000",
        ),
        (
            {"occlusionTexture": {"strength": 7}},
            "occlusion_strength",
            1.0,
            "strengths of occlusion outside 0 to 1",
        ),
    ],
)
def test_factors_out_of_range_are_clipped_and_named(tmp_path, properties, field, expected, line):
    file = GltfFile()
    index = picture(file, GREY)
    given = {
        name: {"index": index, **info} if name.endswith("Texture") else info
        for name, info in properties.items()
    }
    model = read(shaded(file, **given), tmp_path)
    assert getattr(model.materials[0], field) == expected
    assert model.losses == [f"{line} are clipped, of materials: 'paint'"]


def test_what_is_not_drawn_is_named_once_with_its_materials(tmp_path):
    file = GltfFile()
    for number in range(10):
        shaded(
            file,
            name=f"m{number}",
            pbrMetallicRoughness=PLAIN,
            extensions={"KHR_materials_clearcoat": {"clearcoatFactor": 0.5}, "KHR_materials_ior": {}},
        )
    file.add("materials", name="unused", extensions={"KHR_materials_clearcoat": {"clearcoatFactor": 0.5}})
    names = "of materials: 'm0', 'm1', 'm2', 'm3', 'm4', 'm5', 'm6', 'm7', and 2 more"
    assert read(file, tmp_path).losses == [
        f"KHR_materials_clearcoat is not drawn, {names}",
    ]


@pytest.mark.parametrize(
    ("sampler", "expected"),
    [
        ({}, ("repeat", "repeat", "linear_mipmap_linear", "linear")),
        ({"wrapS": 33071}, ("clamp", "repeat", "linear_mipmap_linear", "linear")),
        ({"wrapT": 33648, "magFilter": 9728}, ("repeat", "mirror", "linear_mipmap_linear", "nearest")),
        ({"minFilter": 9728}, ("repeat", "repeat", "nearest", "linear")),
        ({"minFilter": 9729}, ("repeat", "repeat", "linear", "linear")),
        ({"minFilter": 9984}, ("repeat", "repeat", "nearest_mipmap_nearest", "linear")),
        ({"minFilter": 9985}, ("repeat", "repeat", "linear_mipmap_nearest", "linear")),
        ({"minFilter": 9986}, ("repeat", "repeat", "nearest_mipmap_linear", "linear")),
    ],
)
def test_samplers(tmp_path, sampler, expected):
    file = GltfFile()
    shaded(file, pbrMetallicRoughness={"baseColorTexture": {"index": picture(file, GREY, **sampler)}})
    (made,) = read(file, tmp_path).textures
    assert (made.wrap_u, made.wrap_v, made.minfilter, made.magfilter) == expected


def with_v_up(uvs):
    return np.stack([uvs[:, 0], 1.0 - uvs[:, 1]], axis=1)


def textured(file, info, **more):
    given = {"index": picture(file, GREY), **info}
    return shaded(file, pbrMetallicRoughness={"baseColorTexture": given, **PLAIN}, **more)


def test_the_example_of_the_extension_is_the_lower_left_quarter_of_the_picture_turned_clockwise(tmp_path):
    """KHR_texture_transform, "Example JSON": the corners of the quad, and where they fall in the picture."""
    moved = {"offset": [0, 1], "rotation": math.pi / 2, "scale": [0.5, 0.5]}
    file = textured(GltfFile(), {"extensions": {"KHR_texture_transform": moved}})
    (geom,) = read(file, tmp_path).geoms
    # v up. The lower left corner of the picture goes to the upper left of the quad, and so on.
    expected = {(0, 1): (0, 0), (1, 1): (0, 0.5), (1, 0): (0.5, 0.5), (0, 0): (0.5, 0)}
    for corner, found in zip(with_v_up(UVS), geom.arrays["texcoords"], strict=True):
        np.testing.assert_allclose(found, expected[tuple(corner)], atol=1e-12)


def test_offset_and_scale_move_texture_coordinates(tmp_path):
    moved = {"offset": [0.5, 0.25], "scale": [2, -1]}
    file = textured(GltfFile(), {"extensions": {"KHR_texture_transform": moved}})
    (geom,) = read(file, tmp_path).geoms
    np.testing.assert_allclose(geom.arrays["texcoords"], with_v_up(UVS * (2, -1) + (0.5, 0.25)), atol=1e-15)


@pytest.mark.parametrize(
    ("info", "number"),
    [
        ({}, 0),
        ({"texCoord": 1}, 1),
        ({"texCoord": 0, "extensions": {"KHR_texture_transform": {"texCoord": 1}}}, 1),
        ({"texCoord": 1, "extensions": {"KHR_texture_transform": {}}}, 1),
    ],
)
def test_the_set_of_texture_coordinates_is_chosen(tmp_path, info, number):
    file = GltfFile()
    texture = {"index": picture(file, GREY), **info}
    material = file.add("materials", pbrMetallicRoughness={"baseColorTexture": texture})
    sets = UVS, np.float32(UVS[::-1] / 2)
    file.node(mesh=quad(file, material=material, TEXCOORD_1=sets[1]))
    (geom,) = read(file, tmp_path).geoms
    np.testing.assert_array_equal(geom.arrays["texcoords"], with_v_up(np.float64(sets[number])))
    assert "texcoords_1" not in geom.arrays


def test_an_emission_texture_shares_or_has_its_own_texture_coordinates(tmp_path):
    for info, own in (({}, False), ({"extensions": {"KHR_texture_transform": {"offset": [0.5, 0]}}}, True)):
        file = GltfFile()
        glow = {"index": picture(file, GREY), **info}
        textured(file, {}, emissiveTexture=glow, emissiveFactor=[1, 1, 1])
        model = read(file, tmp_path)
        ((made,), (geom,)) = model.materials, model.geoms
        assert (made.texture, made.emission_texture, made.emission_texcoord) == (0, 1, int(own))
        assert ("texcoords_1" in geom.arrays) is own
        if own:
            np.testing.assert_array_equal(geom.arrays["texcoords_1"], with_v_up(UVS + np.array([0.5, 0.0])))


def test_a_texture_of_black_emission_is_left_out(tmp_path):
    file = GltfFile()
    shaded(file, emissiveTexture={"index": picture(file, GREY)}, pbrMetallicRoughness=PLAIN)
    model = read(file, tmp_path)
    assert (model.materials[0].emission_texture, model.images, model.losses) == (None, [], [])


def test_an_emission_texture_alone_uses_the_first_texture_coordinates(tmp_path):
    file = GltfFile()
    info = {"index": picture(file, GREY), "texCoord": 1}
    material = file.add("materials", emissiveTexture=info, emissiveFactor=[1, 1, 1])
    file.node(mesh=quad(file, material=material, TEXCOORD_1=np.float32(UVS / 2)))
    model = read(file, tmp_path)
    assert (model.materials[0].texture, model.materials[0].emission_texcoord) == (None, 0)
    np.testing.assert_array_equal(model.geoms[0].arrays["texcoords"], with_v_up(UVS / 2))


@pytest.mark.parametrize(
    ("material", "message"),
    [
        (
            {"alphaMode": "GLASS"},
            r"materials\[0\]\.alphaMode: must be one of OPAQUE, MASK, BLEND, got 'GLASS'",
        ),
        ({"emissiveTexture": {"index": 7}}, r"emissiveTexture\.index: refers to textures\[7\]"),
        ({"emissiveTexture": {}}, r"emissiveTexture\.index: is missing"),
        ({"emissiveFactor": [1, 1]}, r"emissiveFactor: must be 3 numbers"),
        ({"pbrMetallicRoughness": 3}, r"pbrMetallicRoughness: must be an object"),
        ({"doubleSided": 1}, r"doubleSided: must be true or false"),
    ],
)
def test_damage_is_named(tmp_path, material, message):
    with pytest.raises(ModelError, match=message):
        read(shaded(GltfFile(), **material), tmp_path)


def test_colours_out_of_range_are_clipped_and_named(tmp_path):
    model = read(
        shaded(GltfFile(), pbrMetallicRoughness={"baseColorFactor": [2, -1, 0.5, 1], **PLAIN}), tmp_path
    )
    assert model.materials[0].base_color == (1.0, 0.0, 0.5, 1.0)
    assert model.losses == ["base colours outside 0 to 1 are clipped, of materials: 'paint'"]
