"""ParticleNode and ParticleShadow: what they hold, and what they refuse."""

import numpy as np
import pytest

from firefly_sample.errors import SceneError
from firefly_sample.scene.lights import DirectionalLight, PointLight, Spotlight
from firefly_sample.scene.particles import ParticleNode, ParticleShadow

PLACES = [(0, 0, 0), (1, 2, 3)]


def test_what_is_given_once_holds_for_every_particle():
    arrays = ParticleNode("smoke", PLACES, 0.5, [0.1, 0.2], (0.1, 0.2, 0.3)).evaluate(0.0)
    assert len(arrays) == 2
    assert arrays.radii.tolist() == [0.5, 0.5]
    assert arrays.alphas.tolist() == [0.1, 0.2]
    assert arrays.colors.tolist() == [[0.1, 0.2, 0.3]] * 2
    assert all(part.dtype == np.float64 for part in (arrays.positions, arrays.radii, arrays.alphas))


def test_given_arrays_are_copied():
    places = np.array(PLACES, dtype=float)
    node = ParticleNode("smoke", places)
    places[:] = 9.0
    assert node.evaluate(0.0).positions.max() == 3.0


def test_a_function_of_seed_and_time_replaces_the_arrays():
    node = ParticleNode("smoke", function=lambda seed, time: ([(seed, time, 0)], 1, 0.5, (1, 1, 1)), seed=5)
    assert node.evaluate(2.5).positions.tolist() == [[5.0, 2.5, 0.0]]
    assert node.make_copy().evaluate(1.0).positions.tolist() == [[5.0, 1.0, 0.0]]


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        (([(0, 0)], 1, 1, (1, 1, 1)), r"positions must have shape \(n, 3\), got \(1, 2\)"),
        ((PLACES, [1, 2, 3], 1, (1, 1, 1)), r"2 positions need radii of shape \(2,\), got \(3,\)"),
        ((PLACES, 1, [1, 1, 1], (1, 1, 1)), r"2 positions need alphas of shape \(2,\)"),
        ((PLACES, 1, 1, [(1, 1)]), r"2 positions need colors of shape \(2, 3\)"),
        ((PLACES, [1, -1], 1, (1, 1, 1)), "entry 1: its radius is not 0 to 1e18"),
        ((PLACES, [np.nan, 1], 1, (1, 1, 1)), "entry 0: its radius"),
        ((PLACES, 1, [1, 1.1], (1, 1, 1)), "entry 1: its alpha is not 0 to 1"),
        ((PLACES, 1, 1, [(1, 1, 1), (1, 2, 1)]), "entry 1: its color is not 0 to 1"),
        (([(0, 0, 0), (np.nan, 0, 0)], 1, 1, (1, 1, 1)), "entry 1: its position is not finite"),
        ((PLACES, "large", 1, (1, 1, 1)), "radii must be numbers, got 'large'"),
    ],
)
def test_bad_arrays_name_the_node_and_the_entry(arrays, message):
    with pytest.raises(SceneError, match=f"particles 'smoke': .*{message}"):
        ParticleNode("smoke", *arrays)
    node = ParticleNode("smoke", function=lambda seed, time: arrays)
    with pytest.raises(SceneError, match=message):
        node.evaluate(0.0)


def test_a_function_must_give_four_arrays():
    node = ParticleNode("smoke", function=lambda seed, time: (PLACES, 1))
    with pytest.raises(SceneError, match=r"'smoke': its function must return .*, got tuple"):
        node.evaluate(0.0)


def test_changes_are_heard_by_whoever_watches_revisions():
    node, sun = ParticleNode("smoke"), DirectionalLight("sun")
    seen = [node.revision]
    for change in (
        lambda: node.set_arrays(PLACES, 1, 1, (1, 1, 1)),
        lambda: node.set_shadow(ParticleShadow(sun)),
        lambda: node.change_shadow(blur=2.0),
        lambda: node.set_bounding_sphere(3.0),
        lambda: node.set_bounding_sphere(None),
    ):
        change()
        seen.append(node.revision)
    assert seen == sorted(set(seen))
    assert node.get_shadow() == ParticleShadow(sun, blur=2.0)


def test_a_copy_has_all_of_it():
    node = ParticleNode("smoke", PLACES, 0.5, 0.25, (0.1, 0.2, 0.3))
    node.set_shadow(ParticleShadow(DirectionalLight("sun"), tint=0.5))
    node.set_bounding_sphere(3.0, (1, 2, 3))
    copy = node.make_copy()
    assert copy.get_shadow() is node.get_shadow()
    assert copy.get_bounding_sphere() == ((1.0, 2.0, 3.0), 3.0)
    assert copy.evaluate(0.0) is node.evaluate(0.0)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"blur": -1}, "blur must be a number of 0 to 32, got -1"),
        ({"blur": 33}, "blur must be a number of 0 to 32"),
        ({"darkness": -0.1}, "darkness must be a number of 0 to 1e"),
        ({"tint": 1.5}, "tint must be a number of 0 to 1, got 1.5"),
        ({"power": "two"}, "power must be a number of 0 to 16, got 'two'"),
        ({"kernel": "tent"}, "kernel must be one of box, gaussian, got 'tent'"),
        ({"interpolate": "no"}, "interpolate must be one of True, False, got 'no'"),
        ({"attenuation": "line"}, "attenuation must be one of none, point, plane, got 'line'"),
    ],
)
def test_a_shadow_refuses_what_it_cannot_be(values, message):
    with pytest.raises(SceneError, match=f"light 'lamp': {message}"):
        ParticleShadow(Spotlight("lamp"), **values)


def test_a_shadow_is_of_one_sun_or_spotlight():
    with pytest.raises(SceneError, match="must be a DirectionalLight or a Spotlight, got PointLight"):
        ParticleShadow(PointLight("bulb"))
    with pytest.raises(SceneError, match="'smoke' cast no shadows: give them some with set_shadow"):
        ParticleNode("smoke").change_shadow(blur=1.0)


def test_what_is_no_function_and_no_shadow_is_refused():
    with pytest.raises(SceneError, match="'smoke': function must be callable, got 5"):
        ParticleNode("smoke", function=5)
    with pytest.raises(SceneError, match="'smoke': a shadow is a ParticleShadow or None, got 'sun'"):
        ParticleNode("smoke").set_shadow("sun")
    node = ParticleNode("smoke")
    node.set_shadow(ParticleShadow(DirectionalLight("sun")))
    with pytest.raises(SceneError, match=r"has no 'blurr' \(did you mean 'blur'\?\)"):
        node.change_shadow(blurr=1.0)


@pytest.mark.parametrize("radius", [0.0, -1.0, np.inf, np.nan, "wide"])
def test_a_bounding_sphere_has_a_radius(radius):
    with pytest.raises(SceneError, match="'smoke': bounding radius must be a number above 0"):
        ParticleNode("smoke").set_bounding_sphere(radius)


@pytest.mark.parametrize("center", [(0, 0), (0, 0, np.nan), "middle"])
def test_a_bounding_sphere_has_a_middle(center):
    with pytest.raises(SceneError, match="'smoke': the bounding sphere's center must be three numbers"):
        ParticleNode("smoke").set_bounding_sphere(1.0, center)
