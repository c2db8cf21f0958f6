"""What becomes of nodes, meshes and materials, by values, both ways."""

from __future__ import annotations

import math

import numpy as np
import pyrender

from firefly_sample.interop.pyrender_bridge import from_pyrender, to_pyrender
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lights import PointLight
from firefly_sample.scene.material import Material, Texture
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Camera, Scene
from firefly_sample.srgb import linear_to_srgb
from tests.interop.blocks import matt, only, scene_with, triangle
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
    source.add(pyrender.Mesh([triangle(material=matt(name=None)), triangle(color_0=[(1, 0.5, 0, 1)] * 3)]))
    (geom, material), (colored, _) = from_pyrender(source).root.node().geoms
    np.testing.assert_array_equal(geom.triangles, [[0, 1, 2]])
    np.testing.assert_allclose(geom.normals, [(0, -1, 0)] * 3)  # computed; glTF's +Z is our -Y
    assert (geom.name, colored.name, material.name) == ("[0]", "[1]", "material")
    np.testing.assert_array_equal(colored.colors[0], [1, 0.5, 0])


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
