"""Scene.update moves what moves by itself below the root, and searches for it only after changes."""

from __future__ import annotations

import copy
import gc
import pickle
import weakref

import numpy as np
import pytest

from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.scene import Scene
from tests.model.figures import bending_tube, bulging_tube, drawn_corners, make_model


class Ticking(PandaNode):
    """A node that keeps the last time it was given."""

    time = None

    def animate(self, time):
        self.time = time


@pytest.fixture
def walks(monkeypatch):
    """How often a graph has been searched, in a list that grows."""
    walked = []
    real = PandaNode.iter_descendants
    monkeypatch.setattr(PandaNode, "iter_descendants", lambda node: (walked.append(node), real(node))[1])
    return walked


def test_models_below_the_root_move_wherever_they_are():
    scene = Scene()
    made = [make_model(make()) for make in (bending_tube, bulging_tube)]
    made[0].reparent_to(scene.root.attach_new_node("a").attach_new_node("b"))
    made[1].reparent_to(made[0].find("**/tip joint"))
    alone = make_model(bending_tube())
    alone.node().update(0.8)
    scene.update(0.8)
    assert np.array_equal(drawn_corners(made[0])["tube"][0], drawn_corners(alone)["tube"][0])
    assert not np.array_equal(
        drawn_corners(made[1])["left"][0], drawn_corners(make_model(bulging_tube()))["left"][0]
    )


def test_nodes_are_found_when_they_come_and_left_when_they_go():
    scene = Scene()
    first, second = (scene.root.attach_new_node(Ticking(name)) for name in "ab")
    scene.update(1.0)
    second.detach_node()
    scene.update(2.0)
    assert (first.node().time, second.node().time) == (2.0, 1.0)
    second.reparent_to(first)
    scene.update(3.0)
    assert (first.node().time, second.node().time) == (3.0, 3.0)


def test_a_node_in_several_places_is_updated_and_another_root_is_searched():
    scene, other = Scene(), Scene()
    node = scene.root.attach_new_node(Ticking("a"))
    node.instance_to(scene.root.attach_new_node("b"))
    scene.update(1.0)
    assert node.node().time == 1.0
    late = other.root.attach_new_node(Ticking("c")).node()
    scene.root = other.root
    scene.update(2.0)
    assert (node.node().time, late.time) == (1.0, 2.0)


def test_a_graph_is_searched_once_though_models_in_it_move(walks):
    scene = Scene()
    make_model(bending_tube()).reparent_to(scene.root)
    scene.update(0.0)
    once = len(walks)
    for time in (0.1, 0.2, 0.3):
        scene.update(time)
    assert len(walks) == once > 0
    scene.root.attach_new_node("new")
    scene.update(0.4)
    assert len(walks) == once + 1


def test_an_update_without_models_changes_no_revision():
    scene = Scene()
    scene.root.attach_new_node("a")
    before = scene.root.node().subtree_revision
    scene.update(1.0)
    assert scene.root.node().subtree_revision == before


def test_a_subclass_calls_the_update_of_scene():
    class Turning(Scene):
        def update(self, time):
            super().update(time)
            self.root.set_h(time)

    scene = Turning()
    node = scene.root.attach_new_node(Ticking("a")).node()
    scene.update(5.0)
    assert (node.time, scene.root.get_h()) == (5.0, 5.0)


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda scene: pickle.loads(pickle.dumps(scene))])
def test_a_copied_scene_moves_its_own_models(duplicate):
    scene = Scene()
    make_model(bending_tube()).reparent_to(scene.root)
    scene.update(0.2)
    before = drawn_corners(scene.root)["tube"][0]
    twin = duplicate(scene)
    twin.update(0.9)
    assert np.array_equal(drawn_corners(scene.root)["tube"][0], before)
    assert not np.array_equal(drawn_corners(twin.root)["tube"][0], before)


def test_a_scene_keeps_no_model_that_was_removed():
    gc.disable()
    try:
        scene = Scene()
        path = scene.root.attach_new_node(Ticking("a"))
        scene.update(0.0)
        gone = weakref.ref(path.node())
        path.remove_node()
        assert gone() is None
    finally:
        gc.enable()
