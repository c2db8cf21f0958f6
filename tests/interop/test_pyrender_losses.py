"""What a conversion warns about, and what it refuses."""

from __future__ import annotations

import sys
import warnings

import numpy as np
import pyrender
import pytest

from firefly_sample.errors import FireflyError, LightError, MissingPackageError, SceneError
from firefly_sample.interop.pyrender import meshes as pyrender_meshes
from firefly_sample.interop.pyrender.bridge import from_pyrender, to_pyrender
from firefly_sample.interop.pyrender.package import import_pyrender
from firefly_sample.losses import ConversionWarning
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lights import DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene, VerticalGradient
from firefly_sample.scene.texture import Texture
from tests.interop.blocks import ball_of, fading, matt, scene_with, triangle
from tests.scenes import geom_node, wall

SIZE = (64, 48)


def with_large_points():
    node = geom_node("dust", Geom.points(np.eye(3)))
    NodePath(node).set_render_mode_thickness(3)
    return node


def with_tag(node):
    node.tags["use"] = "test"
    return node


def hidden(light):
    NodePath(light).hide()
    return light


def shadowed(light):
    light.set_shadow_caster(True)
    return light


def soft(spot):
    spot.set_cone(20, 30)
    return spot


def colored(node):
    for geom, _ in node.geoms:
        geom.set_colors(np.full((len(geom.vertices), 3), 0.5))
    return node


def with_second_texcoords():
    texture = Texture(np.full((2, 2, 4), 255, np.uint8))
    plain, look = wall(), {"emission": (1, 1, 1), "emission_texture": texture, "emission_texcoord": 1}
    second = plain.texcoords[:, ::-1]
    geom = Geom(plain.vertices, plain.triangles, texcoords=plain.texcoords, texcoords_1=second, name="wall")
    return geom_node("wall", geom, Material("glow", **look))


def with_depth_offset():
    node = geom_node("decal", wall())
    NodePath(node).set_depth_offset(1)
    return node


def with_color_scale():
    node = geom_node("glow", wall())
    NodePath(node).set_color_scale(0.5, 1.0, 1.0, 1.0)
    return node


def with_tangents():
    geom = wall()
    geom.set_tangents(np.tile([1.0, 0.0, 0.0, 1.0], (len(geom.vertices), 1)))
    look = Material("bumps", normal_texture=Texture(np.full((1, 1, 4), 128, np.uint8)))
    return geom_node("wall", geom, look)


def shiny_light(light):
    light.set_specular_color((1, 0, 0))
    return light


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        (scene_with(Sprites("dots", [(0, 0, 0)])), "sprites, .* are left out: 'dots'"),
        (scene_with(ParticleNode("smoke", [(0, 0, 0)])), "particles, .* are left out: 'smoke'"),
        (scene_with(hidden(PointLight("lamp"))), "hidden lights, .* are left out: 'lamp'"),
        (scene_with(shadowed(fading(PointLight("lamp")))), "shadow casters are left out: 'lamp'"),
        (scene_with(shiny_light(fading(PointLight("lamp")))), "specular colours of lights, .*: 'lamp'"),
        (
            scene_with(
                PointLights("lamps", [(0, 0, 0)], 1.0, attenuation=(0, 0, 1), specular_colors=(1, 0, 0))
            ),
            "specular colours of lights, .*: 'lamps'",
        ),
        (
            scene_with(PointLights("lamps", np.zeros((5, 3)), 1.0, attenuation=(0, 0, 1))),
            r"at most 4 point lights on a mesh, the nearest: 'lamps\[0\]', .*'lamps\[4\]'$",
        ),
        (
            scene_with(PointLights("lamps", np.zeros((50, 3)), 1.0, attenuation=(0, 0, 1))),
            r"at most 4 point lights on a mesh, the nearest: .*, and 42 more$",
        ),
        (scene_with(ball_of(specular=(1, 1, 1), shininess=9)), "highlights .* are left out .*: 'clay'"),
        (scene_with(ball_of(ambient=(1, 1, 1))), "ambient colours of materials, .*: 'clay'"),
        (
            scene_with(ball_of(base_color=(1, 1, 1, 0.4), alpha_mode="mask")),
            "ignores the alpha cut-off .*: 'clay'",
        ),
        (scene_with(soft(fading(Spotlight("spot")))), r"fade between their two angles by t\^2 .*: 'spot'"),
        (
            scene_with(colored(ball_of(emission=(1, 1, 1)))),
            "multiplies emission by vertex colours, .*: 'ball'",
        ),
        (scene_with(ball_of(emission=(0.5, 0, 0))), "draws the square of emission: 'clay'"),
        (scene_with(ball_of(unlit=True)), "has no unlit materials and lights them: 'clay'"),
        (
            scene_with(ball_of(modulate_texture=Texture(np.zeros((1, 1, 4), np.uint8)))),
            "no second texture .* leaves it out: 'clay'",
        ),
        (scene_with(with_depth_offset()), "depth offsets, .*, are left out: 'decal'"),
        (scene_with(with_color_scale()), "colour scales, .*, are left out: 'glow'"),
        (
            scene_with(ball_of(normal_texture=Texture(np.full((1, 1, 4), 128, np.uint8)), normal_scale=2.0)),
            "scales of normal maps, .*, become 1: 'clay'",
        ),
        (
            scene_with(ball_of(occlusion_texture=Texture(np.zeros((1, 1, 4), np.uint8)))),
            "occlusion darkens all light .*: 'clay'",
        ),
        (scene_with(with_tangents()), "ignores tangents and takes those of normal maps .*: 'wall'"),
        (scene_with(with_second_texcoords()), "all textures at the first texture coordinates: 'wall'"),
        (scene_with(with_tag(PandaNode("box"))), "tags are left out: 'box'"),
        (scene_with(with_large_points()), "sizes of points are left out: .* point_size: 'dust'"),
        (
            Scene(background=VerticalGradient((0, 0, 0), (0, 0, 1))),
            "gradient becomes its horizon's .*: 'root'",
        ),
        (Scene(background=(2, 0, 0)), "brighter than 1 is clipped to 1: 'root'"),
        (Scene(exposure=2.0), "exposure, .* is left out: 'root'"),
    ],
)
def test_what_pyrender_has_not_is_named(scene, message):
    with pytest.warns(ConversionWarning, match=message) as caught:
        to_pyrender(scene)
    assert len(caught) == 1
    assert caught[0].filename == __file__


CLAMP_TO_BORDER = 0x812D
BLACK = np.zeros((2, 2, 3), np.uint8)
CHEQUERED = np.array([[(0, 0, 0), (255, 255, 255)]] * 2, np.uint8)


def textured(**texture):
    pixels = np.zeros((2, 2, 3), np.uint8)
    return triangle(
        texcoord_0=np.zeros((3, 2)),
        material=matt(
            baseColorTexture=pyrender.Texture(**{"source": pixels, "source_channels": "RGB"} | texture)
        ),
    )


@pytest.mark.parametrize(
    ("primitive", "message"),
    [
        (triangle(normals=None), "meshes without normals, .* get smooth ones: 'leaf'"),
        (triangle(tangents=np.zeros((3, 4))), "tangents without a handedness .* are left out: 'leaf'"),
        (
            triangle(
                tangents=[(1, 0, 0, 1)] * 3, texcoord_0=np.eye(3)[:, :2], material=matt(normalTexture=BLACK)
            ),
            "ignores tangents and takes those of normal maps .*: 'leaf'",
        ),
        (triangle(material=matt(occlusionTexture=BLACK)), "occlusion darkens all light .*: 'clay'"),
        (
            triangle(color_0=[(1, 1, 0.5)] * 3, material=matt(emissiveFactor=(1.0, 0.0, 0.0))),
            "multiplies emission by vertex colours, .*: 'leaf'",
        ),
        (triangle(material=matt(emissiveFactor=(0.5, 0.0, 0.0))), "draws the square of emission: 'clay'"),
        (
            triangle(material=matt(alphaMode="MASK", baseColorFactor=(1.0, 1.0, 1.0, 0.4))),
            "ignores the alpha cut-off .*: 'clay'",
        ),
        (
            triangle(
                material=pyrender.material.SpecularGlossinessMaterial(
                    name="glass", diffuseFactor=(1, 0, 0, 1), specularFactor=(0.0, 0.5, 0.5)
                )
            ),
            "metalness and a base colour do not give all colours .*: 'glass'",
        ),
        (
            textured(sampler=pyrender.Sampler(wrapS=CLAMP_TO_BORDER)),
            "wrap modes and filters that glTF lacks .*: 'clay'",
        ),
        (
            textured(sampler=pyrender.Sampler(magFilter=pyrender.GLTF.LINEAR_MIPMAP_LINEAR)),
            "wrap modes and filters that glTF lacks .*: 'clay'",
        ),
        (textured(source=None, width=2, height=2), "textures without a plain image .*: 'clay'"),
    ],
)
def test_what_we_have_not_is_named(primitive, message):
    source = pyrender.Scene()
    source.add(pyrender.Mesh([primitive]), name="leaf")
    with pytest.warns(ConversionWarning, match=message) as caught:
        from_pyrender(source)
    assert len(caught) == 1
    assert caught[0].filename == __file__


def test_a_texture_of_three_channels_is_opaque():
    source = pyrender.Scene()
    source.add(pyrender.Mesh([textured()]), name="leaf")
    ((_, material),) = from_pyrender(source).root.node().geoms
    np.testing.assert_array_equal(material.texture.pixels[..., 3], 255)


@pytest.mark.parametrize(
    "primitive",
    [
        triangle(material=matt(alphaMode="BLEND")),
        triangle(color_0=[(0.5, 0.5, 0.5, 1.0)] * 3, material=matt(alphaMode="BLEND")),
        triangle(color_0=[(1, 1, 1, 0.5)] * 3, material=matt(alphaMode="OPAQUE")),
        triangle(material=matt(alphaMode="MASK", alphaCutoff=0.5, baseColorFactor=(1.0, 1.0, 1.0, 0.5))),
        triangle(material=matt(emissiveTexture=CHEQUERED)),
        triangle(material=matt(metallicFactor=0.25, roughnessFactor=0.5)),
        triangle(tangents=[(1, 0, 0, 1)] * 3),
        triangle(material=matt(occlusionTexture=BLACK + 255)),
        triangle(material=matt(emissiveFactor=(1.0, 0.0, 1.0), emissiveTexture=CHEQUERED)),
        textured(sampler=pyrender.Sampler(wrapS=pyrender.GLTF.CLAMP_TO_EDGE)),
        triangle(
            material=matt(emissiveFactor=(1.0, 1.0, 1.0), emissiveTexture=np.zeros((2, 2, 3), np.uint8))
        ),
    ],
    ids=[
        "blend 1",
        "vertex alpha 1",
        "alpha that is not used",
        "at the cut-off",
        "no emission",
        "metalness and roughness",
        "tangents",
        "no occlusion",
        "emissive texture",
        "sampler",
        "black texture",
    ],
)
def test_what_is_drawn_the_same_is_no_loss(renderer, primitive):
    """Neither the conversion nor the frame says anything."""
    source = pyrender.Scene()
    source.add(pyrender.Mesh([primitive]), name="leaf")
    assert renderer.render(from_pyrender(source)).warnings == ()


class Fisheye(pyrender.Camera):
    def get_projection_matrix(self, width=None, height=None):
        return np.eye(4)


def scene_of(camera=None, pose=None, **scene):
    source = pyrender.Scene(**scene)
    if camera is not None:
        source.add(camera, name="eye", pose=pose)
    return source


@pytest.mark.parametrize(
    ("source", "message"),
    [
        (scene_of(Fisheye()), "cameras of the class Fisheye are left out: 'eye'"),
        (scene_of(pyrender.PerspectiveCamera(1.0), np.diag([2.0, 2, 2, 1])), "scale and shear of .*: 'eye'"),
        (scene_of(bg_color=(0.0, 0.0, 0.0, 0.0), name="room"), "background's alpha is left out: 'room'"),
    ],
)
def test_other_things_of_a_scene_that_we_have_not_are_named(source, message):
    with pytest.warns(ConversionWarning, match=message) as caught:
        from_pyrender(source, size=SIZE)
    assert len(caught) == 1


def test_skins_are_named():
    source = pyrender.Scene()
    source.add_node(pyrender.Node("arm", skin=3))
    with pytest.warns(ConversionWarning, match="skins and morph weights are left out: 'arm'"):
        from_pyrender(source)


def test_geometry_without_vertices_is_named_and_left_out():
    scene = scene_with(geom_node("void", Geom(np.zeros((0, 3)), np.zeros((0, 3), int), name="nothing")))
    with pytest.warns(ConversionWarning, match="geometry without vertices is left out: 'void/nothing'"):
        assert not to_pyrender(scene).mesh_nodes


def test_a_plain_scene_is_converted_without_a_word():
    scene = scene_with(ball_of())
    for index in range(4):
        scene.root.attach_new_node(fading(PointLight(f"lamp {index}")))
    scene.root.attach_new_node(DirectionalLight("sun"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        from_pyrender(to_pyrender(scene))


def test_more_vertices_than_float32_can_count_are_refused(monkeypatch):
    monkeypatch.setattr(pyrender_meshes, "LARGEST_INDEX", 10)
    with pytest.raises(SceneError, match=r"geom 'ball': 42 vertices, .* parts of 10 at most"):
        to_pyrender(scene_with(ball_of()))


@pytest.mark.parametrize("convert", [to_pyrender, from_pyrender])
def test_without_pyrender_the_error_says_how_to_install_it(monkeypatch, convert):
    monkeypatch.setitem(sys.modules, "pyrender", None)
    with pytest.raises(MissingPackageError, match=r"-m pip install 'pyrender-maintained>=1.0'$") as caught:
        convert(Scene())
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, FireflyError)
    assert isinstance(caught.value, ImportError)


def test_a_package_that_pyrender_needs_is_named_with_how_to_install_it(monkeypatch):
    for name in [name for name in sys.modules if name.partition(".")[0] == "pyrender"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(MissingPackageError, match=r"trimesh.*-m pip install 'pyrender-maintained>=1.0'$"):
        import_pyrender()


def test_a_spotlight_without_direction_is_refused():
    scene = Scene()
    scene.root.attach_new_node(fading(Spotlight("spot"))).set_scale(1, 0, 1)
    with pytest.raises(LightError, match=r"light 'spot': .* no direction"):
        to_pyrender(scene)


@pytest.mark.parametrize("wrong", [42, None, "forest", []])
def test_what_is_no_scene_is_named(wrong):
    with pytest.raises(SceneError, match=r"to_pyrender takes a firefly_sample\.Scene, got "):
        to_pyrender(wrong)
    with pytest.raises(SceneError, match=r"from_pyrender takes a pyrender\.Scene, got "):
        from_pyrender(wrong)
