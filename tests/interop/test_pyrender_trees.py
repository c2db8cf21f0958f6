"""Nodes, geometry and materials there and back: exact, but for what pyrender keeps as float32."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pyrender
import pytest
from hypothesis import given
from hypothesis import settings as search
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from firefly_sample.interop.pyrender.bridge import from_pyrender, to_pyrender
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.material import Material
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import MagFilter, MinFilter, Texture, Wrap
from firefly_sample.scene.traversal import iter_visible
from tests.interop.blocks import ANGLES, SCALES, SINGLE, VECTOR, matt, single, there_and_back, triangle
from tests.scenes import ball, geom_node


@st.composite
def geoms(draw) -> Geom:
    n = draw(st.integers(1, 5))
    numbers = st.floats(-1e6, 1e6)
    return Geom(
        draw(arrays(np.float64, (n, 3), elements=numbers)),
        draw(arrays(np.int64, (draw(st.integers(0, 4)), 3), elements=st.integers(0, n - 1))),
        normals=draw(st.none() | arrays(np.float64, (n, 3), elements=st.floats(-1, 1))),
        texcoords=draw(st.none() | arrays(np.float64, (n, 2), elements=st.floats(-4, 4))),
        colors=draw(
            st.none() | arrays(np.float64, (n, draw(st.sampled_from((3, 4)))), elements=st.floats(0, 1))
        ),
        name=draw(st.sampled_from(["rock", "bark", "leaf"])),
        texcoords_1=draw(st.none() | arrays(np.float64, (n, 2), elements=st.floats(-4, 4))),
    )


@st.composite
def textures(draw) -> Texture:
    choices = {"wrap_u": Wrap, "wrap_v": Wrap, "minfilter": MinFilter, "magfilter": MagFilter}
    options = {name: draw(st.sampled_from(get_args(kind))) for name, kind in choices.items()}
    return Texture(draw(arrays(np.uint8, (2, 3, 4))), "picture", **options)


@st.composite
def materials(draw) -> Material:
    share = st.floats(0, 1)
    return Material(
        draw(st.sampled_from(["stone", "wood"])),
        draw(st.tuples(share, share, share, share)),
        draw(st.none() | textures()),
        draw(st.sampled_from(["opaque", "mask", "blend"])),
        draw(share),
        draw(st.booleans()),
        emission=draw(st.tuples(*[st.floats(0, 1e6)] * 3)),
        emission_texture=draw(st.none() | textures()),
    )


@st.composite
def trees(draw) -> Scene:
    """Up to eight nodes under any transforms, with up to three Geoms each, of three that they share."""
    scene = Scene(NodePath("top"))
    looks = draw(st.lists(st.tuples(geoms(), materials()), min_size=1, max_size=3))
    paths = [scene.root]
    for index in range(draw(st.integers(1, 8))):
        node = GeomNode(f"node {index}")
        for which in draw(st.lists(st.integers(0, len(looks) - 1), max_size=3)):
            node.add_geom(*looks[which])
        path = paths[draw(st.integers(0, len(paths) - 1))].attach_new_node(node)
        path.set_pos_hpr_scale(draw(VECTOR), draw(ANGLES), draw(SCALES))
        path.set_shear(draw(st.tuples(*[st.floats(-1, 1)] * 3)))
        paths.append(path)
    scene.camera.set_pos_hpr(draw(VECTOR), draw(ANGLES))
    return scene


def assert_same_tree(given: NodePath, got: NodePath, same: dict[int, object]) -> None:
    """Names, order, transforms and contents; `same` tells which of ours each that came back stands for."""
    assert got.get_name() == given.get_name()
    np.testing.assert_array_equal(got.get_mat(), given.get_mat())
    mine, its = (getattr(path.node(), "geoms", []) for path in (given, got))
    assert len(its) == len(mine)
    for (geom, material), (other_geom, other_material) in zip(mine, its, strict=True):
        assert_same_geom(geom, other_geom)
        assert_same_material(material, other_material)
        for ours, theirs in ((geom, other_geom), (material, other_material)):
            assert same.setdefault(id(ours), theirs) is theirs
    children = given.get_children()
    assert len(got.get_children()) == len(children)
    for child, other in zip(children, got.get_children(), strict=True):
        assert_same_tree(child, other, same)


def assert_same_geom(given: Geom, got: Geom) -> None:
    np.testing.assert_array_equal(got.triangles, given.triangles)
    np.testing.assert_array_equal(got.vertices, single(given.vertices))
    np.testing.assert_array_equal(got.normals, single(given.normals))
    np.testing.assert_array_equal(got.texcoords, single(given.texcoords))
    assert (got.texcoords_1 is None) == (given.texcoords_1 is None)
    if given.texcoords_1 is not None:
        np.testing.assert_array_equal(got.texcoords_1, single(given.texcoords_1))
    assert (got.colors is None) == (given.colors is None)
    if given.colors is not None:
        np.testing.assert_array_equal(got.colors, single(given.colors))
        alphas = [np.ones(len(one.vertices)) if one.alphas is None else one.alphas for one in (got, given)]
        np.testing.assert_array_equal(alphas[0], single(alphas[1]))


def assert_same_material(given: Material, got: Material) -> None:
    assert got.name == given.name
    assert (got.alpha_mode, got.alpha_cutoff) == (given.alpha_mode, given.alpha_cutoff)
    assert got.double_sided == given.double_sided
    np.testing.assert_array_equal(got.base_color, single(given.base_color))
    np.testing.assert_array_equal(got.emission, single(given.emission))
    for ours, back in ((given.texture, got.texture), (given.emission_texture, got.emission_texture)):
        assert (back is None) == (ours is None)
        if ours is not None:
            assert (back.name, back.sampling) == (ours.name, ours.sampling)
            np.testing.assert_array_equal(back.pixels, ours.pixels)


@pytest.mark.filterwarnings("ignore:pyrender (draws|multiplies|ignores)")
@search(max_examples=50)
@given(trees())
def test_trees_come_back(scene):
    """Also mirrored instances, whose triangles pyrender has the other way round."""
    back = there_and_back(scene)
    assert_same_tree(scene.root, back.root, {})
    assert str(back.camera) == str(scene.camera)
    assert_same_tree(back.root, there_and_back(back).root, {})


@given(st.tuples(*[st.floats(0, 1)] * 3))
def test_backgrounds_come_back(color):
    scene = Scene(background=color)
    np.testing.assert_allclose(there_and_back(scene).background, color, rtol=4 * SINGLE, atol=4e-8)


def test_parts_of_materials_that_nodes_replace_are_written():
    scene, shared = Scene(), Material("paper")
    bark = Texture(np.full((1, 1, 4), 90, np.uint8), "bark")
    for name in ("plain", "covered"):
        scene.root.attach_new_node(name).attach_new_node(geom_node("card", ball(1.0), shared))
    covered = scene.root.find("covered")
    covered.set_texture(bark)
    covered.set_transparency(True)
    covered.hide()
    covered.get_child(0).set_two_sided(True)
    written = [mesh.primitives[0].material for mesh in to_pyrender(scene).meshes]
    looks = {(each.baseColorTexture is None, each.alphaMode, each.doubleSided) for each in written}
    assert looks == {(True, "OPAQUE", False), (False, "BLEND", True)}
    returned = there_and_back(scene).root.find("covered/card").node().geoms[0][1]
    assert returned.texture.pixels.tolist() == bark.pixels.tolist()
    assert (returned.alpha_mode, returned.double_sided) == ("blend", True)


def test_wireframes_go_there_and_back_by_the_net_render_mode():
    scene = Scene()
    above = scene.root.attach_new_node("above")
    above.set_render_mode_wireframe()
    above.attach_new_node(geom_node("wires", ball(1.0, 1)))
    above.attach_new_node(geom_node("filled", ball(1.0, 1))).set_render_mode_filled()
    above.attach_new_node(geom_node("hidden", ball(1.0, 1))).hide()
    written = to_pyrender(scene)
    drawn = {node.name: node.mesh.primitives[0].material.wireframe for node in written.mesh_nodes}
    assert drawn == {"wires": True, "filled": False, "hidden": True}
    modes = {visit.node.name: visit.render_mode.mode for visit in iter_visible(from_pyrender(written).root)}
    assert modes["wires[0]"] == "wireframe"
    assert modes["filled"] == "filled"


def test_a_wireframe_with_instances_is_one_at_each():
    poses = np.array([np.eye(4), np.diag((2.0, 2.0, 2.0, 1.0))])
    source = pyrender.Scene()
    source.add(pyrender.Mesh([triangle(material=matt(wireframe=True), poses=poses)]), name="leaf")
    visits = [visit for visit in iter_visible(from_pyrender(source).root) if visit.node.name != "leaf"]
    assert [visit.render_mode.mode for visit in visits if isinstance(visit.node, GeomNode)] == [
        "wireframe"
    ] * 2
