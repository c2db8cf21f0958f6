"""Panda3D's names on ours: both spellings, their number, and what they do, beside Panda3D itself."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from panda3d import core as panda

from firefly_sample import (
    AmbientLight,
    Camera,
    DirectionalLight,
    GeomNode,
    Material,
    NodePath,
    NoEffectWarning,
    OrthographicLens,
    PandaNode,
    PerspectiveLens,
    PointLight,
    Spotlight,
    Texture,
)
from firefly_sample.errors import NodeError
from firefly_sample.scene.camel_case import CamelCase, camel_case
from firefly_sample.scene.transform_state import TransformState
from tests.panda.sample_names import COUNTS

CLASSES = (
    AmbientLight,
    Camera,
    DirectionalLight,
    GeomNode,
    Material,
    NodePath,
    OrthographicLens,
    PandaNode,
    PerspectiveLens,
    PointLight,
    Spotlight,
    Texture,
    TransformState,
)
OURS = {each.__name__: each for each in CLASSES}


# --- The names of the samples ---


def test_the_samples_names_are_there():
    missing = {name for name in COUNTS if not callable(getattr(NodePath, name, None))}
    assert missing <= {"set_color_scale", "set_color_scale_off"}
    assert len(COUNTS) - len(missing) >= 75


def test_panda_has_the_samples_names():
    """The list has no name that is not one of NodePath's; intervals are added by `direct`."""
    ours = {name for name in COUNTS if not name.endswith("_interval")}
    assert {name for name in ours if not hasattr(panda.NodePath, name)} == set()


# --- Both spellings ---


@pytest.mark.parametrize("ours", CLASSES)
def test_panda_s_camel_case_works_wherever_its_snake_case_does(ours):
    theirs = getattr(panda, ours.__name__)
    shared = [
        name
        for name in dir(theirs)
        if "_" in name.strip("_") and not name.startswith("_") and callable(getattr(ours, name, None))
    ]
    assert len(shared) >= 3
    for name in shared:
        second = camel_case(name)
        assert hasattr(theirs, second), f"Panda3D has no {second}"
        assert getattr(ours, second) == getattr(ours, name)


def test_the_second_spelling_is_the_same_function_and_calls_what_a_subclass_overrides():
    class Loud(NodePath):
        def set_pos(self, *arguments):
            super().set_pos(*arguments)
            self.set_tag("moved", "yes")

        def set_two_words(self):
            self.setName("two")

    assert NodePath.setPosHpr is NodePath.set_pos_hpr
    path = Loud("a")
    path.setPos(1, 2, 3)
    path.setTwoWords()
    assert path.getPos() == (1, 2, 3)
    assert (path.getTag("moved"), path.getName()) == ("yes", "two")


@pytest.mark.parametrize("name", ["set_pos", "setPos"])
def test_a_class_that_overrides_either_spelling_overrides_both(name):
    def moved(self, *arguments):
        self.set_tag("moved", str(arguments))

    overriding = type("Overriding", (NodePath,), {name: moved})
    below = type("Below", (overriding,), {})
    mixed = type("Mixed", (type("Mixin", (), {name: moved}), NodePath), {})
    for kind in (overriding, below, mixed):
        for spelling in ("set_pos", "setPos"):
            path = kind("a")
            getattr(path, spelling)(1, 2, 3)
            assert path.get_tag("moved") == "(1, 2, 3)"
    again = type("Again", (overriding,), {"set_pos": NodePath.set_pos})
    path = again("a")
    path.setPos(1, 2, 3)
    assert path.get_pos() == (1, 2, 3)


def test_typos_are_errors_and_dir_lists_one_spelling():
    path = NodePath("a")
    for name in ("setPoss", "SetPos", "set_Pos", "setpos", "_set_bits", "setBits", "flatColor"):
        if name != "_set_bits":
            with pytest.raises(AttributeError, match=name):
                getattr(path, name)
    assert {"set_pos", "set_pos_hpr", "node"} <= set(dir(path))
    assert [name for name in dir(path) if not name.startswith("_") and name != name.lower()] == []


def test_attributes_have_one_spelling_as_in_panda():
    node, theirs = PandaNode("a"), panda.PandaNode("a")
    node.set_color_twice = "an attribute"
    for each in (node, theirs):
        assert not hasattr(each, "pythonTags")
        assert hasattr(each, "python_tags")
    assert not hasattr(node, "setColorTwice")


@given(st.lists(st.sampled_from(("a", "set", "pos2d", "x", "hpr")), min_size=1, max_size=4))
def test_camel_case(words):
    name = "_".join(words)
    second = camel_case(name)
    assert second.lower() == "".join(words)
    assert [letter for letter in second if letter.isupper()] == [word[0].upper() for word in words[1:]]
    assert camel_case(f"_{name}") == f"_{name}"


def test_class_and_static_methods_have_both_spellings():
    class Thing(CamelCase):
        @classmethod
        def made_here(cls):
            return cls()

        @staticmethod
        def plain_one(number):
            return number + 1

    assert isinstance(Thing.madeHere(), Thing)
    assert Thing.plainOne(1) == 2
    assert TransformState.makePos((1, 2, 3)) == TransformState.make_pos((1, 2, 3))


# --- What has no effect ---

SILENT = ("clear_shader", "clear_fog", "hide_bounds", "clear_model_nodes", "clear_bin", "clear_depth_test")


def test_what_has_no_effect_says_so_in_one_line():
    path = NodePath("a")
    light = path.attach_new_node(PointLight("lamp"))
    for name in ("set_light", "set_light_off", "clear_light"):
        with pytest.warns(NoEffectWarning, match=f"NodePath.{name} is not") as caught:
            getattr(path, camel_case(name))(light)
        assert "\n" not in str(caught[0].message)
        assert caught[0].filename == __file__
    revision = path.node().subtree_revision
    for name in ("set_shader_auto", "set_shader_input", "set_shader", "set_fog", "set_bin", "set_antialias",
                 "set_depth_test", "set_depth_write", "set_collide_mask", "set_attrib", "set_state",
                 "set_tex_gen", "set_tex_scale", "project_texture", "set_occluder", "show_bounds",
                 "flatten_light", "flatten_medium", "flatten_strong"):  # fmt: skip
        with pytest.warns(NoEffectWarning, match=f"^NodePath.{name} is not") as caught:
            assert getattr(path, camel_case(name))("anything", 1) in (None, 0)
        assert caught[0].filename == __file__
    for name in SILENT:
        assert getattr(path, name)() in (None, 0)
    assert (path.get_fog(), path.has_fog(), path.get_shader(), path.has_shader()) == (
        None,
        False,
        None,
        False,
    )
    assert path.node().subtree_revision == revision


def test_a_line_of_a_program_is_told_once():
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("default")
        for number in range(50):
            NodePath(f"fly {number}").set_shader_input("lightcolor", number)
    assert len(caught) == 1


@pytest.mark.parametrize("name", ["posInterval", "hprInterval", "scaleInterval", "colorScaleInterval"])
def test_intervals_belong_to_direct(name):
    with pytest.raises(NodeError, match=f"'a'.*{name[:3]}.*direct.interval"):
        getattr(NodePath("a"), name)(1, (0, 0, 0))
    with pytest.raises(NodeError, match="get_state is not there"):
        NodePath("a").getState()


# --- Cameras and lights ---


def test_cameras_have_a_lens():
    for library, lens in ((Camera, PerspectiveLens()), (panda.Camera, panda.PerspectiveLens())):
        camera = library("eye")
        camera.setLens(lens)
        assert camera.getLens() is lens or camera.getLens() == lens
        lens.setNearFar(2, 30)
        assert (camera.get_lens().getNear(), camera.get_lens().getFar()) == (2, 30)
    with pytest.raises(NodeError, match=r"'eye'.*takes a Lens"):
        Camera("eye").set_lens("wide")


def test_shadow_maps_take_panda_s_two_numbers():
    for light in (Spotlight("lamp"), panda.Spotlight("lamp")):
        light.setShadowCaster(True, 512, 512)
        assert light.is_shadow_caster()
    with pytest.raises(ValueError, match=r"'lamp'.*square"):
        Spotlight("lamp").set_shadow_caster(True, 512, 256)


@pytest.mark.parametrize(
    ("kind", "name", "value"),
    [
        ("PointLight", "color", (0.25, 0.5, 1.0, 1.0)),
        ("PointLight", "attenuation", (1.0, 0.5, 0.25)),
        ("PointLight", "max_distance", 7.0),
        ("Spotlight", "exponent", 12.0),
        ("Spotlight", "specular_color", (0.25, 0.5, 1.0, 1.0)),
        ("DirectionalLight", "direction", (0.0, 0.0, -1.0)),
        ("AmbientLight", "color", (0.25, 0.5, 1.0, 1.0)),
        ("PerspectiveLens", "near", 2.0),
        ("PerspectiveLens", "far", 30.0),
        ("PerspectiveLens", "focal_length", 0.5),
        ("PerspectiveLens", "fov", (90.0, 60.0)),
        ("PerspectiveLens", "min_fov", 40.0),
        ("PerspectiveLens", "aspect_ratio", 2.0),
        ("OrthographicLens", "film_size", (4.0, 3.0)),
        ("OrthographicLens", "film_offset", (0.5, 0.25)),
    ],
)
def test_attributes_of_lights_and_lenses_call_the_setters(kind, name, value):
    ours, theirs = OURS[kind], getattr(panda, kind)
    for make in (ours, theirs):
        made = make("lamp") if "Light" in kind or kind == "Spotlight" else make()
        setattr(made, name, value)
        given = np.ravel(getattr(made, name))
        assert np.ravel(getattr(made, f"get_{name}")()).tolist() == given.tolist()
        np.testing.assert_allclose(given, np.ravel(value)[: len(given)], rtol=1e-6)


def test_an_attribute_refuses_what_its_setter_refuses():
    light = PointLight("lamp")
    revision = light.revision
    with pytest.raises(ValueError, match="'lamp'"):
        light.attenuation = (-1, 0, 0)
    assert light.revision == revision
    light.color = (1, 0, 0)
    assert light.revision > revision
