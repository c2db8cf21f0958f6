"""Textures, transparency, sides and light of nodes: what they inherit, beside Panda3D, and what is drawn."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from panda3d import core as panda

from firefly_sample import AmbientLight, Geom, GeomNode, Material, NodePath, PointLight, Scene, Texture
from firefly_sample.errors import NodeError
from firefly_sample.plan.collect import collect
from firefly_sample.scene.surface_overrides import NOTHING, OFF, SurfaceOverrides, overridden
from firefly_sample.scene.traversal import iter_visible
from tests.conftest import borrow_renderer
from tests.scenes import wall

RED, BLUE = (
    Texture(np.full((1, 1, 4), color, dtype=np.uint8)) for color in ((255, 0, 0, 255), (0, 0, 255, 9))
)
PANDAS = {RED: panda.Texture("red"), BLUE: panda.Texture("blue")}
CARD = Geom([(0, 0, 0), (1, 0, 0), (0, 0, 1)], [(0, 1, 2)], name="card")

priorities = st.integers(0, 2)
edits = st.fixed_dictionaries(
    {},
    optional={
        "texture": st.tuples(st.sampled_from((RED, BLUE, OFF)), priorities),
        "transparency": st.tuples(st.sampled_from((0, 1, 3, 4, 5, 6)), priorities),
        "two_sided": st.tuples(st.booleans(), priorities),
        "light": st.tuples(st.sampled_from(("on", OFF)), priorities),
    },
)


def edit(path, lamp, changes, texture):
    """The same edits for both libraries; `texture` is ours as the library has it."""
    for name, (value, priority) in changes.items():
        if value == OFF:
            getattr(path, f"set_{name}_off")(priority)
        elif name == "light":
            path.set_light(lamp, priority)
        else:
            getattr(path, f"set_{name}")(texture(value) if name == "texture" else value, priority)


def net_state(path):
    """Panda3D's values at a node, as ours would be without priorities."""
    state = path.get_net_state()
    texture, transparency, sides, light = (
        state.get_attrib(kind)
        for kind in (panda.TextureAttrib, panda.TransparencyAttrib, panda.CullFaceAttrib, panda.LightAttrib)
    )
    images = {theirs: ours for ours, theirs in PANDAS.items()}
    return (
        None if texture is None else images[texture.get_texture()] if texture.get_num_on_stages() else OFF,
        None if transparency is None else transparency.get_mode(),
        None if sides is None else sides.mode == panda.CullFaceAttrib.M_cull_none,
        None if light is None else light.get_num_on_lights() == 0,
    )


@pytest.mark.filterwarnings("ignore::firefly_sample.NoEffectWarning")
@given(st.lists(edits, min_size=1, max_size=4))
def test_nodes_inherit_as_in_panda(chain):
    ours, theirs = NodePath("root"), panda.NodePath("root")
    lamp, their_lamp = ours.attach_new_node(PointLight("l")), theirs.attach_new_node(panda.PointLight("l"))
    ends, their_ends = [ours], [theirs]
    for changes in chain:
        ends.append(ends[-1].attach_new_node("a"))
        their_ends.append(their_ends[-1].attach_new_node("a"))
        edit(ends[-1], lamp, changes, lambda texture: texture)
        edit(their_ends[-1], their_lamp, changes, PANDAS.__getitem__)
    net = {visit.node: visit.overrides or NOTHING for visit in iter_visible(ours)}
    for path, their_path in zip(ends, their_ends, strict=True):
        found = net[path.node()]
        assert (found.texture, found.transparency, found.two_sided, found.unlit) == net_state(their_path)
        texture = their_path.get_texture()
        assert path.get_texture() == (None if texture is None else {t: o for o, t in PANDAS.items()}[texture])
        for name in ("has_texture", "has_texture_off", "has_transparency", "get_transparency",
                     "has_two_sided", "get_two_sided", "has_light_off"):  # fmt: skip
            assert getattr(path, name)() == getattr(their_path, name)(), name
    for path, their_path in zip(ends, their_ends, strict=True):
        for name in ("texture", "transparency", "two_sided", "light"):
            for each in (path, their_path):
                getattr(each, f"clear_{name}")()
        assert path.node().overrides is None


@given(
    st.builds(
        Material,
        texture=st.none() | st.just(RED),
        alpha_mode=st.sampled_from(("opaque", "mask", "blend")),
        double_sided=st.booleans(),
        unlit=st.booleans(),
    ),
    edits,
)
def test_a_material_counts_as_the_geom_s_own_state(material, changes):
    """Panda3D's composition of a node's state with that of a Geom below it."""
    theirs = panda.NodePath("root")
    lamp = theirs.attach_new_node(panda.PointLight("l"))
    node = theirs.attach_new_node("a")
    edit(node, lamp, changes, PANDAS.__getitem__)
    geom = node.attach_new_node("geom")  # in the place of its Geom's state
    if material.texture is not None:
        geom.set_texture(PANDAS[RED])
    if material.alpha_mode != "opaque":
        geom.set_transparency({"mask": 5, "blend": 1}[material.alpha_mode])
    if material.double_sided:
        geom.set_two_sided(True)
    if material.unlit:
        geom.set_light_off()
    names = {"texture": "texture", "transparency": "transparency", "two_sided": "two_sided", "light": "unlit"}
    values = {}
    for name, (value, priority) in changes.items():
        values[names[name]] = value == OFF if name == "light" else value
        values[f"{names[name]}_priority"] = priority
    drawn = overridden(material, SurfaceOverrides(**values))
    texture, mode, sides, unlit = net_state(geom)
    assert drawn.texture is (None if texture == OFF else texture)
    assert drawn.alpha_mode == {
        None: "opaque", 0: "opaque", 1: "blend", 3: "mask", 4: "mask", 5: "mask", 6: "blend"
    }[mode]  # fmt: skip
    assert (drawn.double_sided, drawn.unlit) == (bool(sides), bool(unlit))
    if drawn is not material:
        kept = {"texture", "modulate_texture", "alpha_mode", "double_sided", "unlit"}
        assert {k: v for k, v in vars(drawn).items() if k not in kept} == {
            k: v for k, v in vars(material).items() if k not in kept
        }


def scene(material=None):
    root = NodePath("root")
    node = GeomNode("card")
    node.add_geom(CARD, material or Material(base_color=(0.5, 0.5, 0.5, 1)))
    return root, root.attach_new_node(node)


def drawn(root):
    (group,) = collect(root, 1).groups
    (material,) = group.materials
    return group, material


def test_what_is_drawn_has_them():
    root, _ = scene()
    root.set_texture(RED)
    root.set_transparency(True)
    root.set_two_sided(True)
    root.set_light_off()
    group, material = drawn(root)
    assert (group.texture, group.double_sided, group.unlit) == (RED, True, True)
    assert material.alpha_mode == "blend"
    assert drawn(root)[1] is material
    root.set_texture(BLUE)
    assert drawn(root)[0].texture is BLUE
    root.clear_texture()
    assert drawn(root)[0].texture is None


def test_pictures_are_those_of_such_materials():
    grain = Texture(np.random.default_rng(1).integers(0, 256, (4, 4, 4), dtype=np.uint8), magfilter="nearest")

    def picture(material, change):
        root = NodePath("root")
        path = root.attach_new_node(GeomNode("card"))
        path.node().add_geom(wall(20.0), material)
        path.set_y(10)
        path.set_h(180)  # its back is seen
        root.attach_new_node(AmbientLight("dim", (0.1, 0.2, 0.3)))
        change(root)
        return renderer.render(Scene(root, background=(0.2, 0.5, 0.1))).color

    def by_nodes(root):
        root.set_texture(grain, 1)
        root.set_transparency(True)
        root.set_two_sided(True)
        root.set_light_off()

    made = Material(texture=grain, alpha_mode="blend", double_sided=True, unlit=True)
    with borrow_renderer((24, 16)) as renderer:
        plain = picture(Material(texture=RED), lambda _: None)
        expected = picture(made, lambda _: None)
        assert np.array_equal(picture(Material(texture=RED), by_nodes), expected)
    assert (expected != plain).any(axis=-1).mean() > 0.9
    assert len(np.unique(expected.reshape(-1, 3), axis=0)) == 4  # the texels in the middle


def test_off_removes_the_modulating_texture_too():
    root, _ = scene(Material(texture=RED, modulate_texture=BLUE))
    root.set_texture_off(1)
    _, material = drawn(root)
    assert material.texture is material.modulate_texture is None
    root.set_texture(BLUE, 1)
    _, material = drawn(root)
    assert material.texture is material.modulate_texture is BLUE


def test_a_node_s_material_is_varied_too():
    root, path = scene()
    bark = Material("bark", (0.2, 0.3, 0.4, 1.0))
    path.set_material(bark)
    root.set_two_sided(True)
    _, material = drawn(root)
    assert (material.name, material.double_sided, bark.double_sided) == ("bark", True, False)


def test_changes_of_the_material_show():
    own = Material(base_color=(0.5, 0.5, 0.5, 1))
    root, _ = scene(own)
    root.set_texture(RED)
    snapshot = collect(root, 1)
    assert snapshot.is_current(root, 1)
    own.set_base_color((0.25, 0.5, 0.75, 1))
    assert not snapshot.is_current(root, 1)
    (group,) = collect(root, 1).groups
    assert group.factors().base_colors.tolist() == [[0.25, 0.5, 0.75, 1]]
    snapshot = collect(root, 1)
    own.double_sided = True
    assert not snapshot.is_current(root, 1)
    assert drawn(root)[0].double_sided


def test_scenes_without_them_have_no_variants():
    own = Material()
    root, _ = scene(own)
    assert drawn(root)[1] is own
    assert next(iter_visible(root)).overrides is None
    root.set_two_sided(False)  # as it is
    assert drawn(root)[1] is own


def test_variants_of_a_film_of_textures_do_not_stay():
    material, textures = Material(), []
    for _ in range(200):
        texture = Texture(np.zeros((1, 1, 4), dtype=np.uint8))
        textures.append(weakref.ref(texture))
        overridden(material, SurfaceOverrides(texture=texture))
        del texture
    gc.collect()
    assert sum(reference() is not None for reference in textures) <= 64


def test_copies_keep_them():
    root, _ = scene()
    root.set_texture(RED, 1)
    made = root.copy_to(NodePath("other"))
    assert made.get_texture() is RED
    made.clear_texture()
    assert root.has_texture()


def test_a_light_is_one_of_the_scene_s_if_both_have_one_root():
    root, path = scene()
    lamp = root.attach_new_node(PointLight("lamp"))
    assert path.has_light(lamp)
    lamp.detach_node()
    assert not path.has_light(lamp)
    assert not path.has_light(NodePath())


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda path: path.set_texture("bark.png"), r"'root'.*set_texture takes a Texture, got 'bark.png'"),
        (lambda path: path.set_texture(RED, 0.5), r"'root'.*whole number as priority"),
        (lambda path: path.set_transparency(2), r"'root'.*set_transparency takes one of .* got 2"),
        (lambda path: path.set_transparency("alpha"), r"'root'.*set_transparency takes one of"),
        (lambda path: path.set_two_sided(True, "high"), r"'root'.*whole number as priority"),
    ],
)
def test_errors_name_the_node_and_change_nothing(call, message):
    root, _ = scene()
    revision = root.node().revision
    with pytest.raises(NodeError, match=message):
        call(root)
    assert (root.node().overrides, root.node().revision) == (None, revision)
