"""Copies of scenes, drawn: the same bytes, and a change of one leaves the other's picture as it is."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from firefly_sample.errors import GpuError
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scenes import build_scene, find_scene
from tests.conftest import make_renderer
from tests.scenes import geom_node, wall

SIZE = (48, 36)


def _pickled(thing):
    return pickle.loads(pickle.dumps(thing))


@pytest.fixture(scope="module")
def renderer():
    with make_renderer(SIZE) as made:
        yield made


def _bytes(renderer, scene, time=2.0):
    frame = renderer.render(scene, time, ("color", "id"))
    return frame.color.tobytes() + frame.id.tobytes()


@pytest.mark.parametrize(
    ("name", "given", "change", "ways"),
    [  # images of models take long to decode: each of these scenes is copied in one way
        ("forest", {"fireflies": 20}, ("fireflies", 60), [_pickled]),
        ("lightbulbs", {}, None, [copy.deepcopy]),
        ("smoke", {"particles": 300}, ("light_heading", -90.0), [copy.deepcopy, _pickled]),
        ("spheres", {"lights": 8}, ("lights", 30), [copy.deepcopy, _pickled]),
    ],
)
def test_a_plugins_scene_and_its_copies_give_the_same_bytes(renderer, name, given, change, ways):
    scene = build_scene(find_scene(name), **given)
    before = _bytes(renderer, scene)
    for duplicate in ways:
        twin = duplicate(scene)
        assert _bytes(renderer, twin) == before
        if change is not None:
            twin.set(*change)
        else:
            twin.camera.set_x(twin.camera, 1)
        twin.root.find("**/+GeomNode").hide()
        assert _bytes(renderer, twin) != before
        assert _bytes(renderer, scene) == before


def _shaded():
    """A wall under a slanting sun, with a card before it."""
    scene = Scene()
    scene.root.attach_new_node(geom_node("wall", wall(20.0, 8), Material("wall"))).set_pos(0, 10, 0)
    sun = DirectionalLight("sun")
    sun.set_shadow_caster(True, 256)
    sun.set_direction((1, 1, 0))
    scene.root.attach_new_node(sun)
    scene.root.attach_new_node(geom_node("card", wall(2.0), Material("card"))).set_pos(-3, 7, 0)
    scene.camera.node().lens = OrthographicLens(film_size=(12, 9), near=1, far=20)
    return scene


@pytest.mark.parametrize("duplicate", [copy.deepcopy, copy.copy, _pickled])
def test_a_copied_geom_has_shadows_of_its_own(renderer, duplicate):
    """A copy is drawn by its own data, not by the original's GPU objects."""
    scene = _shaded()
    node = scene.root.find("**/card").node()
    geom, material = node.geoms[0]
    before = _bytes(renderer, scene)
    twin = duplicate(geom)
    node.geoms[0] = (twin, material)
    node.mark_changed()
    assert _bytes(renderer, scene) == before
    # changed once each, so that revisions alone could not tell them apart
    geom.set_vertices(geom.vertices * 3)
    twin.set_vertices(twin.vertices * (0.25, 1, 1))
    changed = _bytes(renderer, scene)
    node.geoms[0] = (Geom(twin.vertices, twin.triangles, twin.normals, twin.texcoords), material)
    node.mark_changed()
    assert changed == _bytes(renderer, scene) != before


def test_a_scene_of_part_of_a_tree_is_copied_with_what_is_above(renderer):
    """Nodes above the root count: their transform, hiding and colour."""
    scene = _shaded()
    above = Scene().root
    scene.root.reparent_to(above)
    above.set_color(0.2, 0.5, 0.8)
    above.set_r(20)
    before = _bytes(renderer, scene)
    for duplicate in (copy.deepcopy, _pickled):
        assert _bytes(renderer, duplicate(scene)) == before


def test_a_frame_can_be_copied_and_a_renderer_says_why_not(renderer):
    frame = renderer.render(_shaded(), outputs=("color", "depth"))
    for duplicate in (copy.copy, copy.deepcopy, _pickled):
        twin = duplicate(frame)
        assert np.array_equal(twin.depth, frame.depth)
        assert (twin.size, twin.id_names, twin.driver) == (frame.size, frame.id_names, frame.driver)
        with pytest.raises(GpuError, match=r"Renderer cannot be copied.*make Renderer\(size, settings\)"):
            duplicate(renderer)
    assert copy.deepcopy(frame).depth is not frame.depth


@pytest.mark.parametrize("duplicate", [copy.deepcopy, _pickled])
def test_a_plan_is_copied_and_drawn(renderer, duplicate):
    plan = renderer.plan(_shaded())
    assert np.array_equal(renderer.draw(duplicate(plan)).color, renderer.draw(plan).color)
