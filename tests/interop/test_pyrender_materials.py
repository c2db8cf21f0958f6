"""Metallic-roughness materials, their textures and tangents are converted to pyrender and back: values."""

from __future__ import annotations

import warnings

import numpy as np
import pyrender
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.interop.pyrender.bridge import from_pyrender, to_pyrender
from firefly_sample.losses import ConversionWarning
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.material import Material
from firefly_sample.scene.texture import Texture
from tests.interop.blocks import matt, only, scene_with, there_and_back, triangle
from tests.scenes import geom_node, wall

SHARE = st.floats(0.0, 1.0)
IMAGE = np.arange(24, dtype=np.uint8).reshape(2, 3, 4)
TURNS = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda turn: np.linalg.norm(turn) > 0.1)


def written(material, geom=None):
    """The pyrender Primitive of a card of this material."""
    return only(only(to_pyrender(scene_with(geom_node("card", geom or wall(), material))).meshes).primitives)


def read(primitive):
    """Our Geom and material of a pyrender Primitive."""
    source = pyrender.Scene()
    source.add(pyrender.Mesh([primitive]), name="leaf")
    return only(from_pyrender(source).root.node().geoms)


def returned(material):
    """A material after the way there and back, without a word."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scene = there_and_back(scene_with(geom_node("card", wall(), material)))
    return only(scene.root.find("**/card").node().geoms)[1]


def look(material):
    """All that a material has, as plain values; base colour and emission in pyrender's float32."""
    said = {}
    for name, value in vars(material).items():
        if isinstance(value, Texture):
            said[name] = value.name, value.pixels.tolist(), value.sampling
        elif isinstance(value, np.ndarray):
            said[name] = value.astype(np.float32).tolist()
        else:
            said[name] = value
    return {name: value for name, value in said.items() if name != "revision"}


@given(metallic=SHARE, roughness=SHARE, color=st.tuples(SHARE, SHARE, SHARE, SHARE))
def test_factors_come_back_as_they_were(metallic, roughness, color):
    material = Material("steel", color, metallic=metallic, roughness=roughness)
    assert look(returned(material)) == look(material)


def test_textures_and_all_that_pyrender_has_come_back_as_they_were():
    plain = IMAGE.copy()
    plain[..., 0] = 255  # no occlusion, on which pyrender differs
    sampled = {"wrap_u": "mirror", "wrap_v": "clamp", "minfilter": "nearest", "magfilter": "nearest"}
    material = Material(
        "steel",
        (0.5, 0.25, 0.125, 0.5),
        Texture(IMAGE, "paint"),
        "blend",
        0.25,
        True,
        emission=(1, 0, 1),
        emission_texture=Texture(IMAGE, "glow"),
        metallic=0.75,
        roughness=0.3,
        metallic_roughness_texture=Texture(IMAGE, "scratches", **sampled),
        normal_texture=Texture(IMAGE, "bumps", **sampled),
        occlusion_texture=Texture(plain, "hollows", **sampled),
    )
    assert look(returned(material)) == look(material)


def test_a_matt_phong_material_comes_back_as_the_metallic_one_that_pyrender_draws():
    made = written(Material("clay", (0.5, 0.25, 1, 1), roughness=0.25)).material
    assert (made.metallicFactor, made.roughnessFactor) == (0.0, 1.0)
    back = returned(Material("clay", (0.5, 0.25, 1, 1)))
    assert look(back) == look(Material("clay", (0.5, 0.25, 1, 1), metallic=0.0, roughness=1.0))


def test_roughness_is_pyrenders_first_channel_and_metalness_its_second():
    """Whatever channels a texture has: the shader reads its .rg."""
    pixels = np.full((2, 2, 4), (10, 20, 30, 40), np.uint8)
    made = written(Material("steel", metallic=1.0, metallic_roughness_texture=Texture(pixels))).material
    assert made.metallicRoughnessTexture.source[0, 0].tolist() == [20, 30, 10, 40]  # our green and blue first
    for channels, first, second in (("R", 10, 0), ("RG", 10, 20), ("GB", 20, 30), ("RGBA", 10, 20)):
        image = pyrender.Texture(source=pixels, source_channels=channels)
        _, material = read(triangle(material=matt(metallicRoughnessTexture=image)))
        assert material.metallic_roughness_texture.pixels[0, 0, 1:3].tolist() == [first, second]


def test_an_image_of_gltf_that_pyrender_took_is_read_as_gltf_has_it():
    _, material = read(triangle(material=matt(metallicRoughnessTexture=IMAGE)))
    np.testing.assert_array_equal(material.metallic_roughness_texture.pixels[..., 1:3], IMAGE[..., 1:3])


def test_one_texture_in_two_roles_is_read_by_each():
    shared = pyrender.Texture("packed", source=np.full((1, 1, 3), (9, 8, 7), np.uint8), source_channels="RGB")
    primitive = triangle(material=matt(metallicRoughnessTexture=shared, normalTexture=shared))
    _, material = read(primitive)
    assert material.normal_texture.pixels.tolist() == [[[9, 8, 7, 255]]]
    assert material.metallic_roughness_texture.pixels[0, 0, 1:3].tolist() == [9, 8]


def test_textures_that_materials_share_stay_shared():
    bumps = Texture(IMAGE, "bumps")
    node = geom_node("card", wall(), Material("a", metallic=1.0, normal_texture=bumps))
    node.add_geom(wall(), Material("b", normal_texture=bumps, texture=bumps))
    scene = scene_with(node)
    a, b = (each.material for each in only(to_pyrender(scene).meshes).primitives)
    assert a.normalTexture is b.normalTexture is b.baseColorTexture
    (_, first), (_, second) = there_and_back(scene).root.find("**/card").node().geoms
    assert first.normal_texture is second.normal_texture is second.texture


@given(turn=TURNS, sign=st.sampled_from([-1.0, 1.0]))
def test_tangents_are_turned_and_keep_their_handedness(turn, sign):
    tangent = np.array(turn) / np.linalg.norm(turn)
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    geom = Geom(corners, [(0, 1, 2)], tangents=[(*tangent, sign)] * 3)
    x, y, z = tangent.astype(np.float32)
    primitive = written(Material(), geom)
    np.testing.assert_array_equal(primitive.tangents, [(x, z, -y, sign)] * 3)
    back, _ = read(primitive)
    np.testing.assert_array_equal(back.tangents, np.float64([(x, y, z, sign)] * 3))


def test_geoms_that_differ_by_their_tangents_alone_stay_two():
    first = triangle(tangents=[(1, 0, 0, 1)] * 3)
    second = triangle(tangents=[(1, 0, 0, -1)] * 3)
    second.positions, second.normals = first.positions, first.normals
    source = pyrender.Scene()
    source.add(pyrender.Mesh([first, second]), name="leaf")
    (one, _), (two, _) = from_pyrender(source).root.node().geoms
    assert (one.tangents[0, 3], two.tangents[0, 3]) == (1.0, -1.0)


@pytest.mark.parametrize(
    "slot", ["normalTexture", "occlusionTexture", "metallicRoughnessTexture", "baseColorTexture"]
)
def test_a_texture_without_an_image_is_named_and_left_out(slot):
    empty = pyrender.Texture("void", width=2, height=2, source_channels="RGB")
    with pytest.warns(ConversionWarning, match="textures without a plain image .* left out: 'void'"):
        _, material = read(triangle(material=matt(**{slot: empty})))
    assert not any(isinstance(value, Texture) for value in vars(material).values())
