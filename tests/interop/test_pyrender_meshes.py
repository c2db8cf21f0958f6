"""What becomes of nodes, meshes and materials, by values, both ways."""

from __future__ import annotations

import math

import numpy as np
import pyrender
import pytest

from firefly_sample.interop.pyrender.bridge import from_pyrender, to_pyrender
from firefly_sample.interop.pyrender.conversions import Conversions, Treatment
from firefly_sample.losses import ConversionWarning
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lights import PointLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Camera, Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.srgb import linear_to_srgb, srgb_to_linear
from tests.interop.blocks import matt, only, scene_with, there_and_back, triangle
from tests.scenes import ball, geom_node, wall


def test_nodes_that_look_the_same_share_a_mesh():
    geom, clay, stone = ball(1.0, 1), Material("clay"), Material("stone")
    scene = Scene()
    paths = [scene.root.attach_new_node(geom_node(f"{index}", geom, clay)) for index in range(5)]
    paths[1].set_scale(-1, 1, 1)
    paths[2].set_material(stone)
    paths[3].set_color(0.5, 0.25, 1.0, 1.0)
    mesh = {node.name: node.mesh for node in to_pyrender(scene).mesh_nodes}
    assert mesh["0"] is mesh["4"]
    assert len({id(each) for each in mesh.values()}) == 4
    np.testing.assert_array_equal(mesh["1"].primitives[0].indices, mesh["0"].primitives[0].indices[:, ::-1])
    assert mesh["2"].primitives[0].material.name == "stone"
    np.testing.assert_array_equal(mesh["3"].primitives[0].material.baseColorFactor, [0.5, 0.25, 1, 1])
    assert len({id(each.primitives[0].positions) for each in mesh.values()}) == 1
    back = from_pyrender(to_pyrender(scene))
    geoms = {id(path.node().geoms[0][0]) for path in back.root.get_children() if path.get_name() in mesh}
    assert len(geoms) == 1


def test_axes_are_turned():
    geom = Geom([(1, 2, 3), (0, 0, 0), (1, 0, 0)], [(0, 1, 2)], normals=[(0, 0, 1)] * 3)
    scene = Scene()
    scene.root.attach_new_node(geom_node("leaf", geom)).set_pos(4, 5, 6)
    node = only(to_pyrender(scene).mesh_nodes)
    primitive = only(node.mesh.primitives)
    np.testing.assert_array_equal(primitive.positions[0], [1, 3, -2])
    np.testing.assert_array_equal(primitive.normals[0], [0, 1, 0])
    np.testing.assert_array_equal(node.matrix[:3, 3], [4, 6, -5])
    np.testing.assert_array_equal(node.translation, [4, 6, -5])


def test_a_material_is_carried_over():
    pixels = np.arange(24, dtype=np.uint8).reshape(2, 3, 4)
    texture = Texture(pixels, "bark")
    material = Material("wood", (0.5, 0.25, 0.125, 1), texture, "blend", 0.25, True, emission=(1, 0, 0))
    node = geom_node("trunk", wall(), material)
    node.add_geom(ball(1.0, 1), Material("moss", texture=texture))
    made, moss = (each.material for each in only(to_pyrender(scene_with(node)).meshes).primitives)
    assert (made.name, made.alphaMode, made.alphaCutoff, made.doubleSided) == ("wood", "BLEND", 0.25, True)
    np.testing.assert_array_equal(made.baseColorFactor, [0.5, 0.25, 0.125, 1])
    np.testing.assert_array_equal(made.emissiveFactor, [1, 0, 0])
    np.testing.assert_array_equal(made.baseColorTexture.source, pixels)
    assert (made.metallicFactor, made.roughnessFactor) == (0.0, 1.0)
    assert moss.baseColorTexture is made.baseColorTexture


def test_the_background_is_shown_as_it_is():
    scene = Scene(background=(0.5, 0.1, 0.0))
    np.testing.assert_allclose(
        to_pyrender(scene).bg_color, [*linear_to_srgb((0.5, 0.1, 0.0)), 1.0], rtol=1e-6
    )


def test_what_is_hidden_is_invisible_and_comes_back_hidden():
    scene = Scene()
    group = scene.root.attach_new_node("group")
    for name in ("in", "out"):
        group.attach_new_node(geom_node(name, ball(1.0, 1))).attach_new_node("below")
    group.hide()
    group.get_child(1).show_through()
    converted = to_pyrender(scene)
    assert {node.name: node.mesh.is_visible for node in converted.mesh_nodes} == {"in": False, "out": True}
    back = from_pyrender(converted).root
    assert back.find("**/in/in").is_hidden()
    assert not back.find("**/in/below").is_hidden()
    assert not back.find("**/out").is_hidden()


def test_a_node_of_several_parents_is_one_for_each():
    scene = Scene()
    shared = geom_node("shared", ball(1.0, 1))
    for name in ("left", "right"):
        scene.root.attach_new_node(name).attach_new_node(shared)
    nodes = to_pyrender(scene).get_nodes(name="shared")
    assert len(nodes) == 2
    assert len({id(node.mesh) for node in nodes}) == 1


def test_a_flattened_node_keeps_its_matrix():
    scene = Scene()
    scene.root.attach_new_node(geom_node("flat", ball(1.0, 1))).set_scale(1, 0, 1)
    np.testing.assert_array_equal(only(to_pyrender(scene).mesh_nodes).matrix, np.diag([1.0, 1, 0, 1]))


def test_what_stands_above_the_root_counts():
    top = NodePath("top")
    top.set_pos(1, 2, 3)
    scene = Scene(top.attach_new_node("root"))
    scene.root.attach_new_node(geom_node("ball", ball(1.0, 1)))
    converted = to_pyrender(scene)
    np.testing.assert_array_equal(converted.get_pose(only(converted.mesh_nodes))[:3, 3], [1, 3, -2])


def test_several_tops_hang_below_a_new_root():
    source = pyrender.Scene(name="room")
    for name in ("table", "chair"):
        source.add(pyrender.Mesh([triangle()]), name=name)
    scene = from_pyrender(source)
    assert [str(path) for path in scene.root.get_children()] == ["room/chair", "room/table", "room/camera"]


def test_a_node_that_holds_three_things_becomes_four():
    source = pyrender.Scene()
    source.add_node(
        pyrender.Node(
            "robot",
            mesh=pyrender.Mesh([triangle()], name="body"),
            camera=pyrender.PerspectiveCamera(1.0),
            light=pyrender.PointLight(intensity=math.pi),
            translation=np.array([1.0, 2.0, 3.0]),
        )
    )
    scene = from_pyrender(source)
    assert str(scene.camera) == "robot/robot"
    assert [type(path.node()) for path in scene.root.get_children()] == [GeomNode, PointLight, Camera]
    np.testing.assert_array_equal(scene.root.get_pos(), [1, -3, 2])
    light = scene.root.get_child(1).node()
    np.testing.assert_array_equal(light.get_color(), [1, 1, 1])
    assert light.get_attenuation() == (0, 0, 1)
    assert only(scene.root.get_child(0).node().geoms)[0].name == "body"


def test_triangles_without_indices_and_names():
    source = pyrender.Scene()
    plain = triangle(material=matt(name=None), normals=None)
    source.add(pyrender.Mesh([plain, triangle(color_0=[(1, 0.5, 0, 1)] * 3)]))
    with pytest.warns(ConversionWarning, match="meshes without normals"):
        root = from_pyrender(source).root
    (geom, material), (colored, _) = root.node().geoms
    np.testing.assert_array_equal(geom.triangles, [[0, 1, 2]])
    np.testing.assert_allclose(geom.normals, [(0, -1, 0)] * 3)  # computed; glTF's +Z is our -Y
    assert (root.get_name(), geom.name, colored.name) == ("mesh 1", "mesh 1[0]", "mesh 1[1]")
    assert material.name == "material of mesh 1[0]"
    np.testing.assert_array_equal(colored.colors[0], [1, 0.5, 0])


@pytest.mark.parametrize(
    ("mode", "indices", "triangles"),
    [
        (pyrender.GLTF.TRIANGLES, None, [(0, 1, 2), (3, 4, 5)]),
        (pyrender.GLTF.TRIANGLE_STRIP, None, [(0, 1, 2), (2, 1, 3), (2, 3, 4), (4, 3, 5)]),
        (pyrender.GLTF.TRIANGLE_STRIP, [5, 3, 1, 0], [(5, 3, 1), (1, 3, 0)]),
        (pyrender.GLTF.TRIANGLE_FAN, None, [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]),
        (pyrender.GLTF.TRIANGLE_FAN, [5, 3, 1, 0], [(5, 3, 1), (5, 1, 0)]),
        (pyrender.GLTF.TRIANGLE_STRIP, [5, 3], np.zeros((0, 3))),
        (pyrender.GLTF.TRIANGLE_FAN, [5, 3], np.zeros((0, 3))),
        (pyrender.GLTF.TRIANGLE_FAN, [], np.zeros((0, 3))),
    ],
)
def test_strips_and_fans_are_triangles_of_the_same_winding(mode, indices, triangles):
    """As OpenGL 3.3 numbers their corners (section 2.6.1): the first triangle's order holds for all."""
    corners = np.random.default_rng(0).normal(size=(6, 3))
    given = pyrender.Primitive(corners, corners, mode=mode, indices=indices, material=matt())
    source = pyrender.Scene()
    source.add(pyrender.Mesh([given]), name="ribbon")
    ((geom, _),) = from_pyrender(source).root.node().geoms

    def turned(rows):
        """Each triangle from its smallest corner on."""
        return [tuple(np.roll(row, -int(np.argmin(row)))) for row in np.asarray(rows, int)]

    assert turned(geom.triangles) == turned(triangles)


@pytest.mark.filterwarnings("ignore:pyrender draws the square")
def test_an_emissive_texture_is_kept_with_its_factor_and_sampler():
    pixels = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)
    sampler = pyrender.Sampler(wrapS=pyrender.GLTF.MIRRORED_REPEAT, magFilter=pyrender.GLTF.NEAREST)
    image = pyrender.Texture("label", sampler, pixels, "RGB")
    glowing = matt(emissiveFactor=(0.5, 0.25, 1.0), emissiveTexture=image, baseColorTexture=image)
    source = pyrender.Scene()
    source.add(pyrender.Mesh([triangle(material=glowing)]), name="bottle")
    ((_, material),) = from_pyrender(source).root.node().geoms
    texture = material.emission_texture
    assert texture is material.texture
    assert material.emission.tolist() == [0.5, 0.25, 1.0]
    assert texture.sampling == ("mirror", "repeat", "linear_mipmap_linear", "nearest")
    assert texture.pixels[..., :3].tolist() == pixels.tolist()
    written = only(to_pyrender(from_pyrender(source)).meshes).primitives[0].material.emissiveTexture
    assert (written.sampler.wrapS, written.sampler.magFilter) == (sampler.wrapS, sampler.magFilter)


def test_an_emissive_texture_that_cannot_be_read_is_black_as_in_pyrender():
    image = pyrender.Texture(width=2, height=2, source_channels="RGB")
    glowing = matt(emissiveFactor=(1.0, 1.0, 1.0), emissiveTexture=image)
    source = pyrender.Scene()
    source.add(pyrender.Mesh([triangle(material=glowing)]), name="bottle")
    with pytest.warns(ConversionWarning, match="textures without a plain image .* left out: 'clay'"):
        ((_, material),) = from_pyrender(source).root.node().geoms
    assert material.emission_texture is None
    assert not material.emission.any()


@pytest.mark.parametrize(
    ("channels", "texel"),
    [("R", (9, 0, 0, 255)), ("RG", (9, 8, 0, 255)), ("RGB", (9, 8, 7, 255)), ("RGBA", (9, 8, 7, 6))],
)
def test_a_texture_has_the_channels_that_opengl_fills_in(channels, texel):
    image = pyrender.Texture(source=np.full((2, 3, 4), (9, 8, 7, 6), np.uint8), source_channels=channels)
    source = pyrender.Scene()
    source.add(pyrender.Mesh([triangle(material=matt(baseColorTexture=image))]), name="leaf")
    ((_, material),) = from_pyrender(source).root.node().geoms
    np.testing.assert_array_equal(material.texture.pixels, np.full((2, 3, 4), texel))


def glossy(**given):
    """The material of a triangle with a SpecularGlossinessMaterial."""
    source = pyrender.Scene()
    glass = pyrender.material.SpecularGlossinessMaterial(**given)
    source.add(pyrender.Mesh([triangle(material=glass)]), name="pane")
    ((_, material),) = from_pyrender(source).root.node().geoms
    return material


def test_a_glossy_dielectric_has_its_diffuse_colour():
    material = glossy(
        diffuseFactor=(0.5, 0.25, 1.0, 0.75), specularFactor=(0.04, 0.04, 0.04), glossinessFactor=0.25
    )
    np.testing.assert_allclose(material.base_color, [0.96 * 0.5, 0.96 * 0.25, 0.96, 0.75], rtol=1e-6)
    assert (material.metallic, material.roughness) == (0.0, 0.75)


def test_a_glossy_metal_has_its_specular_colour():
    material = glossy(diffuseFactor=(0.0, 0.0, 0.0, 1.0), specularFactor=(0.9, 0.6, 0.3))
    np.testing.assert_allclose(material.base_color, [0.9, 0.6, 0.3, 1.0], rtol=1e-6)
    assert (material.metallic, material.roughness) == (1.0, 0.0)


def test_glossy_textures_are_converted_texel_by_texel():
    """A texel of plastic beside one of gold; the second image is one texel of full gloss and no colour."""
    plastic, gold = (200, 100, 50, 255), (0, 0, 0, 255)
    specular = np.array([[[56, 56, 56, 51], [255, 200, 80, 204]]], np.uint8)  # 56 is 0.04 in sRGB
    material = glossy(
        diffuseTexture=pyrender.Texture(source=np.array([[plastic, gold]], np.uint8), source_channels="RGBA"),
        specularGlossinessTexture=pyrender.Texture(source=specular, source_channels="RGBA"),
    )
    base, others = material.texture.pixels[0], material.metallic_roughness_texture.pixels[0]
    shown = 255 * linear_to_srgb(srgb_to_linear(np.array(plastic[:3]) / 255) * (1 - srgb_to_linear(56 / 255)))
    np.testing.assert_allclose(base[0, :3], shown, atol=0.51)
    np.testing.assert_allclose(base[1, :3], specular[0, 1, :3], atol=0.51)
    assert others[:, 1].tolist() == [204, 51]  # roughness is what gloss leaves
    assert others[1, 2] == 255
    assert others[0, 2] <= 1
    assert (material.metallic, material.roughness) == (1.0, 1.0)


def test_a_glossy_image_without_glossiness_leaves_a_matt_surface():
    """Of an image, pyrender keeps the channels "GB"."""
    with pytest.warns(
        ConversionWarning, match="of whose image pyrender keeps two channels: 'material of pane'"
    ):
        material = glossy(
            diffuseFactor=(0.5, 0.25, 1.0, 1.0), specularGlossinessTexture=np.full((2, 2, 4), 255, np.uint8)
        )
    np.testing.assert_allclose(material.base_color, [0.48, 0.24, 0.96, 1.0], rtol=1e-6)
    assert (material.metallic, material.roughness, material.texture) == (0.0, 1.0, None)


def test_all_uses_of_a_glossy_material_share_its_textures():
    conversions = Conversions()
    source = pyrender.material.SpecularGlossinessMaterial(
        diffuseTexture=np.full((2, 2, 4), 99, np.uint8), alphaMode="BLEND"
    )
    seen, solid = (conversions.material(source, Treatment(opaque=opaque), "pane") for opaque in (False, True))
    assert seen.texture is solid.texture
    assert (seen.alpha_mode, solid.alpha_mode) == ("blend", "opaque")


def unnamed():
    """Two nodes without a name below each of two; a lamp and a camera; two of equal names."""
    source = pyrender.Scene()
    mesh = pyrender.Mesh([triangle()])
    for place in (1.0, 2.0):
        pose = np.eye(4)
        pose[0, 3] = place
        above = source.add(mesh, pose=pose)
        source.add(mesh, pose=pose, parent_node=above)
    source.add(pyrender.PointLight())
    source.add(pyrender.PerspectiveCamera(1.0))
    source.add_node(pyrender.Node())
    source.add(pyrender.Mesh([triangle()], name="chair"))
    source.add(mesh, name="mesh 2")
    source.add(mesh, name="mesh 2")
    return source


def test_nodes_without_a_name_get_one_of_their_own_in_the_order_in_which_they_came():
    scene = from_pyrender(unnamed())
    assert [str(path) for path in scene.root.find_all_matches("**")] == [
        "root", "root/mesh 1", "root/mesh 4", "root/light 1", "root/camera 1", "root/node 1", "root/chair",
        "root/mesh 2", "root/mesh 2", "root/mesh 1/mesh 3", "root/mesh 4/mesh 5",
    ]  # fmt: skip
    assert [path.get_x() for path in scene.root.get_children()[:2]] == [1.0, 2.0]


def test_ids_tell_all_instances_apart(renderer):
    frame = renderer.render(from_pyrender(unnamed()), outputs="id")
    assert frame.id_names == (
        "root/mesh 1", "root/mesh 1/mesh 3", "root/mesh 4", "root/mesh 4/mesh 5", "root/chair", "root/mesh 2",
        "root/mesh 2#2",
    )  # fmt: skip


def test_a_scene_with_a_name_is_a_root_of_that_name():
    source = pyrender.Scene(name="room")
    source.add(pyrender.Mesh([triangle()]), name="chair")
    assert str(from_pyrender(source).root.get_child(0)) == "room/chair"


def test_instances_become_nodes():
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[1, :3, 3] = 1, 2, 3
    source = pyrender.Scene()
    source.add(pyrender.Mesh([triangle(poses=poses)]), name="reed")
    root = from_pyrender(source).root
    first, second = root.find_all_matches("reed*")
    assert first.node().geoms[0][0] is second.node().geoms[0][0]
    np.testing.assert_array_equal(second.get_pos(), [1, -3, 2])


def test_rounding_in_a_last_row_is_let_pass():
    source = pyrender.Scene()
    pose = np.eye(4)
    pose[3, 0] = 1e-17
    source.add(pyrender.Mesh([triangle()]), name="leaf", pose=pose)
    np.testing.assert_array_equal(from_pyrender(source).root.get_mat(), np.eye(4))


@pytest.mark.parametrize("normals", [None, np.eye(3)])
def test_points_and_lines_go_there_and_back(normals):
    colors = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    for geom in (
        Geom.points(np.eye(3), normals=normals, colors=colors),
        Geom.lines(np.eye(3), [(0, 1), (1, 2)], normals=normals, colors=colors),
    ):
        ((back, _),) = there_and_back(scene_with(geom_node("marks", geom))).root.find("marks").node().geoms
        assert back.mode == geom.mode
        for name in ("vertices", "indices", "normals", "colors"):
            np.testing.assert_array_equal(getattr(back, name), getattr(geom, name))


@pytest.mark.parametrize(
    ("mode", "indices", "expected"),
    [
        ("POINTS", None, [[0], [1], [2], [3], [4]]),
        ("LINES", None, [[0, 1], [2, 3]]),  # one vertex is left over
        ("LINES", [0, 4, 4, 2], [[0, 4], [4, 2]]),
        ("LINE_STRIP", None, [[0, 1], [1, 2], [2, 3], [3, 4]]),
        ("LINE_STRIP", [4, 0, 2], [[4, 0], [0, 2]]),
        ("LINE_LOOP", [4, 0, 2], [[4, 0], [0, 2], [2, 4]]),
    ],
)
def test_modes_of_points_and_lines(mode, indices, expected):
    """Also of a wireframe's material, which changes neither."""
    source = pyrender.Scene()
    places = np.arange(15.0).reshape(5, 3)
    wires, kind = matt(wireframe=True), getattr(pyrender.GLTF, mode)
    source.add(pyrender.Mesh([pyrender.Primitive(places, indices=indices, mode=kind, material=wires)]))
    ((geom, _),) = from_pyrender(source).root.node().geoms
    assert geom.indices.tolist() == expected
