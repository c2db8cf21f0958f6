"""Many lights or dots in one node: arrays, functions of time, and what is wrong with them."""

import numpy as np
import pytest

from firefly_sample.errors import LightError, SceneError
from firefly_sample.scene.lights import PointLights
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.points import Sprites

PLACES = [(0.0, 1.0, 2.0), (3.0, 4.0, 5.0)]


@pytest.mark.parametrize("kind", [PointLights, Sprites])
def test_what_is_given_once_holds_for_every_point_and_is_copied(kind):
    places = np.array(PLACES)
    node = kind("swarm", places, (1, 0.5, 0.25), 3.0)
    places[:] = 0
    arrays = node.evaluate(0.0)
    assert np.array_equal(arrays.positions, PLACES)
    assert np.array_equal(arrays.colors, [(1, 0.5, 0.25)] * 2)
    assert np.array_equal(arrays.radii, [3.0, 3.0])
    assert len(kind("none").evaluate(0.0)) == 0


@pytest.mark.parametrize(
    ("kind", "error", "called"), [(PointLights, LightError, "light"), (Sprites, SceneError, "sprites")]
)
@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        (([(0, 0)], (1, 1, 1), 1), r"positions must have shape \(n, 3\), got \(1, 2\)"),
        ((PLACES, [(1, 1, 1)] * 3, 1), r"2 positions need colors of shape \(2, 3\)"),
        ((PLACES, (1, 1, 1), [1, 2, 3]), r"positions need radii of shape \(2,\), got \(3,\)"),
        ((PLACES, (1, 1, 1), [1, -2]), "entry 1: its radius is negative or not finite"),
        ((PLACES, [(1, 1, 1), (1, np.nan, 1)], 1), "entry 1: its color is negative or not finite"),
        (([(0, 0, np.inf), (0, 0, 0)], (1, 1, 1), 1), "entry 0: its position is not finite"),
        (([(0, 0, 0), (0, 1e19, 0)], (1, 1, 1), 1), "entry 1: its position is beyond 1e18"),
        ((PLACES, (1, 1e31, 1), 1), "entry 0: its color is above 1e30"),
        ((PLACES, "red", 1), "colors must be numbers, got 'red'"),
    ],
)
def test_bad_arrays_name_the_node_and_the_entry(kind, error, called, arrays, message):
    with pytest.raises(error, match=message) as caught:
        kind("swarm", *arrays)
    assert str(caught.value).startswith(f"{called} 'swarm': ")
    # a function's result is checked in the same way
    with pytest.raises(error, match=message):
        kind("swarm", function=lambda t: arrays).evaluate(1.0)


def test_a_function_that_gives_something_else_is_named():
    with pytest.raises(LightError, match=r"'swarm': its function must return .*, got list"):
        PointLights("swarm", function=lambda t: []).evaluate(0.0)


@pytest.mark.parametrize(
    "node",
    [
        PointLights("a", PLACES, (1, 2, 3), 4.0),
        PointLights("b", function=lambda t: ([(t, 0, 0)], (1, 1, 1), 1)),
        Sprites("d", PLACES, (1, 2, 3), 4.0),
    ],
    ids=lambda node: node.name,
)
def test_copies_have_the_same_points_and_then_lead_their_own_life(node):
    copy = NodePath("root").attach_new_node(node).copy_to(NodePath("other")).node()
    assert type(copy) is type(node)
    assert copy is not node
    for name in ("positions", "colors", "radii"):
        assert np.array_equal(getattr(copy.evaluate(2.0), name), getattr(node.evaluate(2.0), name))
    before = node.evaluate(2.0).radii.copy()
    copy.function = None
    copy.set_arrays([(9, 9, 9)], (1, 1, 1), 9.0)
    assert np.array_equal(node.evaluate(2.0).radii, before)
