"""Materials and textures of glTF files, against the specification's text and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.errors import ModelError
from firefly_sample.model.gltf.materials import cut_out, phong_highlight
from tests.model.gltf_files import GltfFile
from tests.model.quads import UVS, picture, quad, read, shaded

PLAIN = {"metallicFactor": 0.0}
GREY = np.full((2, 2, 3), 128, np.uint8)


@given(st.floats(0.0, 1.0))
def test_the_highlight_is_as_wide_as_the_microfacets(roughness):
    specular, shininess = phong_highlight(roughness)
    width = roughness**2
    exact = 2.0 / width**2 - 2.0 if width > 1e-100 else math.inf
    if exact < 1.0:
        assert (specular, shininess) == (0.0, 0.0)
    else:
        assert shininess == pytest.approx(min(exact, 1e6), rel=1e-12)
        assert specular == pytest.approx(min(0.04 * (shininess + 8.0) / 8.0, 1.0), rel=1e-12)


def test_a_smooth_surface_has_the_largest_shininess_and_a_rough_one_none():
    assert phong_highlight(0.0) == (1.0, 1e6)
    assert phong_highlight(1.0) == (0.0, 0.0)
    assert phong_highlight((2.0 / 66.0) ** 0.25) == pytest.approx((0.04 * 9.0, 64.0))


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.5), st.integers(0, 255))
def test_alpha_moves_into_the_cutoff(alpha, cutoff, code):
    texel = code / 255.0
    (*rgb, opacity), moved = cut_out((0.1, 0.2, 0.3, alpha), cutoff)
    assert rgb == [0.1, 0.2, 0.3]
    assert 0.0 <= moved <= 1.0
    if abs(texel * alpha - cutoff) > 1e-12:  # else it is rounding that decides
        assert (texel * opacity >= moved) == (texel * alpha >= cutoff)


def test_a_primitive_without_material_is_white_and_no_loss(tmp_path):
    file = shaded(GltfFile(), pbrMetallicRoughness={"baseColorFactor": [1, 0, 0, 1], **PLAIN})
    file.node(mesh=quad(file))
    model = read(file, tmp_path)
    assert [model.materials[geom.material].base_color for geom in model.geoms] == [(1, 0, 0, 1), (1, 1, 1, 1)]
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
    ("surface", "metal"),
    [({}, True), ({"metallicFactor": 0.5}, True), (PLAIN, False), ({"metallicFactor": 1.0}, True)],
)
def test_metalness_is_named_also_where_the_file_leaves_it_at_its_default(tmp_path, surface, metal):
    model = read(shaded(GltfFile(), pbrMetallicRoughness=surface), tmp_path)
    assert model.losses == (["metalness is not drawn, of materials: 'paint'"] if metal else [])


@pytest.mark.parametrize(("blue", "metal"), [(0, False), (1, True)])
def test_a_texture_may_take_metalness_away(tmp_path, blue, metal):
    file = GltfFile()
    texels = np.zeros((2, 2, 3), np.uint8)
    texels[..., 1] = 255
    texels[1, 0, 2] = blue
    shaded(file, pbrMetallicRoughness={"metallicRoughnessTexture": {"index": picture(file, texels)}})
    model = read(file, tmp_path)
    assert bool(model.losses) is metal
    assert model.images == []  # it is not drawn


def test_roughness_is_multiplied_by_the_mean_of_its_texture(tmp_path):
    file = GltfFile()
    texels = np.zeros((1, 2, 3), np.uint8)
    texels[0, :, 1] = 51, 255
    surface = {"roughnessFactor": 0.5, "metallicRoughnessTexture": {"index": picture(file, texels)}, **PLAIN}
    model = read(shaded(file, pbrMetallicRoughness=surface), tmp_path)
    specular, shininess = phong_highlight(0.5 * (51 + 255) / 2 / 255)
    (made,) = model.materials
    assert (made.specular, made.shininess) == ((specular,) * 3, shininess)
    assert model.losses == [
        "roughness textures are drawn by their mean, of materials: 'paint'",
        "roughness is drawn as a Phong highlight, of materials: 'paint'",
    ]


def test_what_is_not_drawn_is_named_once_with_its_materials(tmp_path):
    file = GltfFile()
    texture = {"index": picture(file, GREY)}
    for number in range(10):
        shaded(
            file,
            name=f"m{number}",
            normalTexture=texture,
            occlusionTexture=texture,
            pbrMetallicRoughness=PLAIN,
            extensions={"KHR_materials_clearcoat": {"clearcoatFactor": 0.5}, "KHR_materials_ior": {}},
        )
    file.add("materials", name="unused", normalTexture=texture)
    names = "of materials: 'm0', 'm1', 'm2', 'm3', 'm4', 'm5', 'm6', 'm7', and 2 more"
    assert read(file, tmp_path).losses == [
        f"normal maps are not drawn, {names}",
        f"occlusion maps are not drawn, {names}",
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
