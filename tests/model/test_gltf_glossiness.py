"""KHR_materials_pbrSpecularGlossiness in glTF files: the same surface with metalness and roughness."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.srgb import linear_to_srgb, srgb_to_linear
from tests.model.gltf_files import GltfFile
from tests.model.quads import picture, quad, read, shaded

NAME = "KHR_materials_pbrSpecularGlossiness"
DIELECTRIC = [0.04] * 3
CORE = {"baseColorFactor": [0, 1, 0, 1], "roughnessFactor": 0.125}
"""The material beside the extension, which must not be seen."""


def glossy(file, *, more=None, unlit=False, **extension):
    """A file of one quad with the extension, and `more` properties of its material."""
    extensions = {NAME: extension} | ({"KHR_materials_unlit": {}} if unlit else {})
    return shaded(file, pbrMetallicRoughness=CORE, extensions=extensions, **(more or {}))


def made(file, tmp_path, losses=()):
    model = read(file, tmp_path)
    assert model.losses == list(losses)
    return model, model.materials[0]


def test_a_dielectric_keeps_its_diffuse_colour(tmp_path):
    file = glossy(
        GltfFile(), diffuseFactor=[0.5, 0.25, 1, 1], specularFactor=DIELECTRIC, glossinessFactor=0.25
    )
    _, material = made(file, tmp_path)
    assert material.base_color == pytest.approx((0.48, 0.24, 0.96, 1.0), rel=1e-12)
    assert (material.metallic, material.roughness) == (0.0, 0.75)
    assert material.texture is material.metallic_roughness_texture is None


def test_a_metal_has_its_specular_colour(tmp_path):
    file = glossy(GltfFile(), diffuseFactor=[0, 0, 0, 1], specularFactor=[0.75, 0.5, 0.25])
    _, material = made(file, tmp_path)
    assert (material.base_color, material.metallic, material.roughness) == ((0.75, 0.5, 0.25, 1.0), 1.0, 0.0)


def test_without_properties_it_is_a_white_mirror(tmp_path):
    """By the extension's defaults; a specular colour of 1 leaves no diffuse share."""
    _, material = made(glossy(GltfFile()), tmp_path)
    assert (material.base_color, material.metallic, material.roughness) == ((1.0, 1.0, 1.0, 1.0), 1.0, 0.0)


def test_alpha_is_that_of_the_diffuse_colour(tmp_path):
    more = {"alphaMode": "MASK", "alphaCutoff": 0.25}
    file = glossy(GltfFile(), more=more, diffuseFactor=[1, 1, 1, 0.5], specularFactor=DIELECTRIC)
    _, material = made(file, tmp_path)
    assert (material.base_color[3], material.alpha_cutoff, material.alpha_mode) == (1.0, 0.5, "mask")


def test_colours_that_metalness_cannot_have_are_named(tmp_path):
    file = glossy(GltfFile(), diffuseFactor=[1, 0, 0, 1], specularFactor=[0, 0.5, 0.5])
    line = "metalness and a base colour do not give all colours of specular-glossiness materials: 'paint'"
    made(file, tmp_path, [line])


def test_factors_out_of_range_are_clipped_and_named(tmp_path):
    file = glossy(GltfFile(), diffuseFactor=[0, 0, 0, 1.5], specularFactor=[2, 1, 1], glossinessFactor=-1)
    losses = (
        "diffuse colours outside 0 to 1 are clipped, of materials: 'paint'",
        "specular colours outside 0 to 1 are clipped, of materials: 'paint'",
        "glossiness factors outside 0 to 1 are clipped, of materials: 'paint'",
    )
    _, material = made(file, tmp_path, losses)
    assert (material.base_color, material.roughness) == ((1.0, 1.0, 1.0, 1.0), 1.0)


def test_an_unlit_material_has_its_core_colour(tmp_path):
    """KHR_materials_unlit: it overrides other models of shading."""
    file = glossy(GltfFile(), unlit=True, diffuseFactor=[1, 0, 0, 1])
    _, material = made(file, tmp_path)
    assert (material.base_color, material.unlit) == ((0.0, 1.0, 0.0, 1.0), True)


PLASTIC, GOLD = (200, 100, 50, 255), (0, 0, 0, 128)
SHINE = [[[56, 56, 56, 51], [255, 200, 80, 204]]]
"""A texel of plastic, 56 being 0.04 in sRGB, and one of gold."""


def test_textures_are_converted_texel_by_texel(tmp_path):
    file = GltfFile()
    diffuse, shine = picture(file, [[PLASTIC, GOLD]], wrapS=33071), picture(file, SHINE, wrapS=33071)
    slots = {"diffuseTexture": {"index": diffuse}, "specularGlossinessTexture": {"index": shine}}
    model, material = made(glossy(file, **slots), tmp_path)
    textures = [model.textures[place] for place in (material.texture, material.metallic_roughness_texture)]
    base, reflection = (model.images[texture.image].decode()[0] for texture in textures)
    assert [texture.wrap_u for texture in textures] == ["clamp", "clamp"]
    shown = 255 * linear_to_srgb(srgb_to_linear(np.array(PLASTIC[:3]) / 255) * (1 - srgb_to_linear(56 / 255)))
    np.testing.assert_allclose(base[0, :3], shown, atol=0.51)
    np.testing.assert_array_equal(base[1, :3], SHINE[0][1][:3])
    np.testing.assert_array_equal(base[:, 3], [255, 128])
    np.testing.assert_array_equal(reflection[:, 1], [204, 51])  # roughness is what gloss leaves
    assert reflection[0, 2] <= 1
    assert reflection[1, 2] == 255
    assert (material.base_color, material.metallic, material.roughness) == ((1.0, 1.0, 1.0, 1.0), 1.0, 1.0)
    assert len(model.textures) == len(model.images) == 2


def test_factors_multiply_the_texels(tmp_path):
    file = GltfFile()
    shine = picture(file, [[[255, 255, 255, 51]]])
    factors = {"diffuseFactor": [0, 0, 0, 0.5], "specularFactor": [1, 0.5, 0.25], "glossinessFactor": 0.5}
    model, material = made(glossy(file, specularGlossinessTexture={"index": shine}, **factors), tmp_path)
    base = model.images[model.textures[material.texture].image].decode()
    np.testing.assert_array_equal(base[0, 0], [255, 188, 137, 255])  # sRGB codes of 1, 1/2 and 1/4
    assert material.base_color == (1.0, 1.0, 1.0, 0.5)
    assert (material.metallic, material.metallic_roughness_texture) == (1.0, None)
    assert material.roughness == pytest.approx(0.9, abs=0.5 / 255)


def test_texture_coordinates_are_those_of_the_textures(tmp_path):
    file = GltfFile()
    moved = {"extensions": {"KHR_texture_transform": {"offset": [0.25, 0.5]}}}
    slots = {"diffuseTexture": {"index": picture(file, [[PLASTIC]]), **moved}}
    slots["specularGlossinessTexture"] = {"index": picture(file, SHINE), **moved}
    more = {"normalTexture": {"index": picture(file, [[PLASTIC]])}}
    model, material = made(glossy(file, more=more, **slots), tmp_path)
    arrays = model.geoms[0].arrays
    np.testing.assert_allclose(arrays["texcoords"] - arrays["texcoords_1"], [[0.25, -0.5]] * 4, atol=1e-7)
    assert (material.metallic_roughness_texcoord, material.normal_texcoord) == (0, 1)


def test_textures_that_lie_otherwise_become_their_mean(tmp_path):
    """Half a texel of gloss 0.2 and half of 0.8; the means of the colours are those of light."""
    file = GltfFile()
    turned = {"extensions": {"KHR_texture_transform": {"rotation": 1.0}}}
    grey = [[[0, 0, 0, 51], [255, 255, 255, 204]]]
    slots = {"diffuseTexture": {"index": picture(file, [[(0, 0, 0, 255)]])}}
    slots["specularGlossinessTexture"] = {"index": picture(file, grey), **turned}
    line = "specular-glossiness textures that lie otherwise than diffuse ones become their mean, of materials"
    model, material = made(glossy(file, **slots), tmp_path, [f"{line}: 'paint'"])
    base = model.images[model.textures[material.texture].image].decode()
    np.testing.assert_array_equal(base, [[[188, 188, 188, 255]]])  # the sRGB code of 1/2
    assert material.roughness == pytest.approx(0.5, abs=0.5 / 255)


def test_a_texture_without_an_image_leaves_a_matt_surface(tmp_path):
    file = GltfFile()
    shine = file.add("textures")
    file = glossy(file, diffuseFactor=[1, 0.5, 0, 1], specularGlossinessTexture={"index": shine})
    line = "textures without a PNG, JPEG or WebP image are left out, of materials: 'paint'"
    _, material = made(file, tmp_path, [line])
    assert material.base_color == pytest.approx((0.96, 0.48, 0.0, 1.0))
    assert (material.metallic, material.roughness) == (0.0, 1.0)


def test_materials_that_are_alike_share_their_textures(tmp_path):
    file = GltfFile()
    slots = {"specularGlossinessTexture": {"index": picture(file, SHINE)}}
    for index in range(3):
        factors = {"diffuseFactor": [0, 0, 0, 1] if index else [1, 1, 1, 1]}
        material = file.add("materials", extensions={NAME: {**factors, **slots}}, name=f"paint {index}")
        file.node(mesh=quad(file, material=material))
    first, second, third = read(file, tmp_path).materials
    assert second.texture == third.texture != first.texture
    assert second.metallic_roughness_texture == third.metallic_roughness_texture
