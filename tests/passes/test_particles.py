"""Particles in the picture against the float64 reference: one over the other, soft, lit, among dots."""

from functools import cache

import numpy as np
import pytest

from firefly_sample.lab.reference.frame import render_reference
from firefly_sample.lab.reference.particles import add_particles, particle_light
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, PointLights, Spotlight
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene, VerticalGradient
from firefly_sample.settings import CHOICES, Settings
from tests.clouds import ball_of, cloud_scene, floor, light_on, puff
from tests.conftest import borrow_renderer

FINE = {"normal_format": "rgba32f", "albedo_format": "rgba32f"}


def compared(scene, settings=None, size=(96, 72)):
    """Radiance as drawn, and as the reference has it; where a pixel has no triangle in common they differ."""
    with borrow_renderer(size) as renderer:
        return compared_by(renderer, scene, settings or Settings(**FINE))


def compared_by(renderer, scene, settings):
    """As `compared`, by a renderer that may have drawn other scenes."""
    renderer.settings = settings
    frame = renderer.render(scene, 0.0, ("radiance",))
    renderer.settings = settings.with_changes(light_method="volumes", light_resolution="full", supersample=1)
    plan = renderer.plan(scene, 0.0, ("visibility",))
    seen = renderer.draw(plan)["visibility"]
    return frame["radiance"].astype(np.float64), render_reference(plan, seen).radiance


def unlit(node, background=(0.2, 0.3, 0.4)):
    """Particles in nothing but ambient light, seen from (0, -5, 0)."""
    scene = Scene(background=background)
    scene.root.attach_new_node(AmbientLight("sky", (1, 1, 1)))
    scene.root.attach_new_node(node)
    scene.camera.set_pos(0, -5, 0)
    scene.camera.node().lens = PerspectiveLens(vfov=45, near=0.1, far=100)
    return scene


def test_one_particle_takes_its_alpha_of_what_is_behind_its_middle():
    node = ParticleNode("p", [(0, 0, 0)], 1.0, 0.75, (0.5, 0.25, 0.0))
    with borrow_renderer((65, 49)) as renderer:
        radiance = renderer.render(unlit(node), outputs=("radiance",))["radiance"]
    np.testing.assert_allclose(
        radiance[24, 32], 0.75 * np.array([0.5, 0.25, 0]) + 0.25 * np.array([0.2, 0.3, 0.4]), rtol=1e-5
    )
    np.testing.assert_allclose(radiance[0, 0], [0.2, 0.3, 0.4], rtol=1e-6)


def test_the_nearer_one_is_over_the_farther_one():
    places, colors = [(0, 1, 0), (0, -1, 0)], [(1, 0, 0), (0, 1, 0)]
    for order in (slice(None), slice(None, None, -1)):
        node = ParticleNode("p", places[order], 1.0, 1.0, colors[order])
        with borrow_renderer((65, 49)) as renderer:
            middle = renderer.render(unlit(node), outputs=("radiance",))["radiance"][24, 32]
        np.testing.assert_allclose(middle, [0, 1, 0], atol=1e-6)


@pytest.mark.parametrize("alpha", [0.05, 0.5, 1.0])
def test_crowds_are_composed_as_in_the_reference(alpha):
    rng = np.random.default_rng(1)
    node = ParticleNode("p", ball_of(500), rng.uniform(0.02, 0.3, 500), alpha, rng.uniform(0, 1, (500, 3)))
    drawn, expected = compared(unlit(node, VerticalGradient((0.3, 0.2, 0.1), (0.0, 0.1, 0.4))))
    np.testing.assert_allclose(drawn, expected, atol=3e-5)


def test_far_ones_below_a_pixel_neither_vanish_nor_flicker():
    node = ParticleNode("p", ball_of(400) * 40 + [0, 90, 0], 0.05, 1.0, (1, 0.5, 0.2))
    scene = unlit(node)
    scene.camera.node().lens = PerspectiveLens(vfov=45, near=0.1, far=1000)
    drawn, expected = compared(scene)
    np.testing.assert_allclose(drawn, expected, atol=3e-5)


@pytest.mark.parametrize("position", CHOICES["position_method"])
@pytest.mark.parametrize("flat", [False, True])
def test_particles_end_softly_at_surfaces_wherever_positions_come_from(position, flat):
    """A row of balls sinks into the floor; the error is the position's own."""
    places = np.column_stack([np.linspace(-2, 2, 9), np.zeros(9), np.linspace(-1.9, -0.7, 9)])
    scene = unlit(ParticleNode("p", places, 0.5, 0.95, (1, 0.5, 0.2)))
    scene.root.attach_new_node(floor())
    scene.camera.set_pos(0, -5, 1)
    scene.camera.look_at(0, 0, -1)
    if flat:
        scene.camera.node().lens = OrthographicLens(film_size=(5, 3.75), near=1.0, far=20)
    else:
        scene.camera.node().lens = PerspectiveLens(vfov=45, near=1.0, far=20)
    drawn, expected = compared(scene, Settings(position_method=position, **FINE))
    bound = {"depth16": 2e-2, "stored16f": 4e-3}.get(position, 2e-4)
    np.testing.assert_allclose(drawn, expected, atol=bound)
    behind = Settings(position_method=position, **FINE)
    scene.root.find("floor").hide()
    bare, _ = compared(scene, behind)
    assert np.abs(bare - drawn).max() > 0.1  # the floor does hide something


def test_forward_shading_has_the_same_particles():
    scene = cloud_scene(puff(600))
    deferred, expected = compared(scene)
    forward, _ = compared(scene, Settings(light_method="forward"))
    np.testing.assert_allclose(forward, deferred, atol=2e-4)
    assert np.percentile(np.abs(forward - expected), 99) < 0.02


@pytest.mark.parametrize("method", ["volumes", "fullscreen", "loop"])
def test_all_ways_to_draw_lights_have_the_same_shadows(method):
    scene = cloud_scene(puff(600), blur=1.0, tint=0.5)
    usual, _ = compared(scene)
    other, _ = compared(scene, Settings(light_method=method, **FINE))
    np.testing.assert_allclose(other, usual, atol=1e-5)


def test_half_resolution_light_is_shadowed_too():
    scene = cloud_scene(puff(600))
    usual, _ = compared(scene)
    half, _ = compared(scene, Settings(light_resolution="half", **FINE))
    # every second pixel across and down is lit itself
    np.testing.assert_allclose(half[-1::-2, ::2][:, 1:-1], usual[-1::-2, ::2][:, 1:-1], atol=1e-4)


def test_particles_are_lit_by_every_kind_of_light():
    """By fireflies and by a spotlight beside the one that they take shadows from."""
    scene = cloud_scene(puff(300))
    rng = np.random.default_rng(2)
    flies = PointLights("flies", rng.uniform(-2, 2, (40, 3)), rng.uniform(0.1, 0.8, (40, 3)), 1.5)
    scene.root.attach_new_node(flies)
    lamp = Spotlight("lamp", (1, 0.5, 0.5))
    lamp.set_cone(10, 30)
    lamp.set_attenuation((1, 0, 0.05))
    scene.root.attach_new_node(lamp).set_pos_hpr(0, -4, 0, 0, 0, 0)
    settings = Settings(cutoff_budget=0.0, **FINE)
    with borrow_renderer((64, 48), settings) as renderer:
        plan = renderer.plan(scene, 0.0, ("radiance",))
        renderer.draw(plan)
        found = light_on(renderer, plan)
    expected = particle_light(plan)
    assert np.percentile(np.abs(found - expected), 90) < 0.01  # slices err a little
    scene.root.find("sun").hide()
    with borrow_renderer((64, 48), settings) as renderer:
        plan = renderer.plan(scene, 0.0, ("radiance",))
        renderer.draw(plan)
        found = light_on(renderer, plan)
    np.testing.assert_allclose(found, particle_light(plan), atol=1e-6, rtol=1e-5)


def test_a_wall_keeps_a_shadow_casting_light_from_particles():
    from firefly_sample.scene.geom import Geom
    from firefly_sample.scene.material import Material
    from tests.scenes import geom_node

    scene = cloud_scene(ParticleNode("p", [(-1, 0, 0), (1, 0, 0)], 0.4, 0.9))
    sun = scene.root.find("sun").node()
    sun.set_direction((0, 0, -1))
    sun.set_shadow_caster(True)
    roof = Geom([(0, -2, 2), (3, -2, 2), (3, 2, 2), (0, 2, 2)], [(0, 1, 2), (0, 2, 3)])
    material = Material("roof", double_sided=True)
    scene.root.attach_new_node(geom_node("roof", roof, material))
    drawn, expected = compared(scene)
    np.testing.assert_allclose(np.median(np.abs(drawn - expected)), 0.0, atol=1e-4)
    with borrow_renderer((64, 48)) as renderer:
        plan = renderer.plan(scene, 0.0, ("radiance",))
        renderer.draw(plan)
        lit, dark = light_on(renderer, plan)[:, 0]
    assert lit > 1.0
    assert dark < 0.1


def test_dots_shine_through_what_is_before_them_and_over_what_is_behind():
    node = ParticleNode("p", [(0, 0, 0)], 1.5, 0.5, (0, 0, 0))
    scene = unlit(node, (0, 0, 0))
    scene.root.attach_new_node(Sprites("dots", [(-0.3, 1, 0), (0.3, -1, 0)], (1, 1, 1), 0.2))
    drawn, expected = compared(scene, size=(129, 97))
    np.testing.assert_allclose(drawn, expected, atol=3e-5)
    left, right = drawn[48, :64].max(), drawn[48, 65:].max()
    assert 0.5 < left < 0.6
    assert 0.95 < right <= 1.0


def test_a_cloud_over_a_floor_is_the_references():
    drawn, expected = compared(cloud_scene(puff(3000, radius=0.1)), size=(160, 120))
    difference = np.abs(drawn - expected)
    assert np.percentile(difference, 99) < 0.02
    assert difference.max() < 0.15


def test_supersampling_averages_four_samples():
    scene = cloud_scene(puff(600))
    with borrow_renderer((48, 36), Settings(supersample=2)) as renderer:
        averaged = renderer.render(scene, outputs=("radiance",))["radiance"]
    with borrow_renderer((96, 72)) as renderer:
        fine = renderer.render(scene, outputs=("radiance",))["radiance"]
    expected = fine.reshape(36, 2, 48, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(averaged, expected, atol=1e-5)


def codes(radiance):
    from firefly_sample.lab.reference.shading import tone_curve
    from firefly_sample.srgb import linear_to_srgb

    return linear_to_srgb(tone_curve(radiance, "exponential")) * 255.0


def orbit(scene, degrees):
    angle = np.radians(degrees)
    scene.camera.set_pos(5 * np.sin(angle), -5 * np.cos(angle), 1.0)
    scene.camera.look_at(0, 0, -0.2)


@cache
def pops(settings, steps=8, start=20.0):
    """By how many codes a step of an orbit changes a pixel, compared with particles in exact order."""
    colors = np.random.default_rng(4).uniform(0, 1, (1500, 3))
    scene = cloud_scene(puff(1500, radius=0.2, alpha=0.3, colors=colors))
    pictures = []
    with borrow_renderer((120, 90), settings) as renderer:
        for degree in range(steps + 1):
            orbit(scene, start + degree)
            plan = renderer.plan(scene, 0.0, ("radiance", "position"))
            frame = renderer.draw(plan)
            light = light_on(renderer, plan)
            # the same light, and the same surfaces: the order alone differs
            layer = np.zeros((90, 120, 3))
            y = frame["position"][..., 1].astype(np.float64)
            distance = np.where(np.isfinite(y), y, np.inf)
            add_particles(layer, plan, distance, light)
            same = np.zeros((90, 120, 3))
            add_particles(same, plan, distance, light, plan.particles.order)
            exact = frame["radiance"] - same + layer
            pictures.append((codes(frame["radiance"].astype(np.float64)), codes(np.maximum(exact, 0.0))))
    drawn, exact = (np.array(column) for column in zip(*pictures, strict=True))
    return np.abs(np.diff(drawn, axis=0) - np.diff(exact, axis=0)).max(), np.abs(drawn - exact).max()


def test_nothing_pops_when_the_order_changes():
    change, _ = pops(Settings())
    assert change <= 2.0
    coarse, _ = pops(Settings(particle_order_depths=16), steps=2)
    assert coarse > change


def test_unsorted_particles_are_wrong_by_many_codes():
    _, wrong = pops(Settings(particle_order="unsorted"), steps=1)
    _, right = pops(Settings())
    assert right < 0.5
    assert wrong > 20.0


@pytest.mark.parametrize("position", [None, "linear32f", "depth32f", "depth24", "stored32f"])
def test_nothing_jumps_where_a_particle_crosses_the_near_or_the_far_plane(position):
    """With no surface at all, and with a floor beside it, wherever its position comes from."""
    values, steps = [], 20 if position else 60
    settings = Settings(**FINE, position_method=position or "linear32f")
    with borrow_renderer((33, 25)) as renderer:
        for y in [*np.linspace(-1.0, 1.5, steps), *np.linspace(8.5, 11.5, steps)]:
            scene = unlit(ParticleNode("p", [(0, y, 0)], 1.0, 0.9, (1, 1, 1)), (0, 0, 0))
            if position:
                scene.root.attach_new_node(floor())
            scene.camera.set_pos(0, 0, 0)
            scene.camera.node().lens = PerspectiveLens(vfov=45, near=0.1, far=10.0)
            drawn, expected = compared_by(renderer, scene, settings)
            np.testing.assert_allclose(drawn, expected, atol=2e-4 if position == "depth24" else 2e-5)
            values.append(drawn[12, 16, 0])
    near, far = values[:steps], values[steps:]
    assert near[0] == 0.0
    assert near[-1] > 0.85
    assert far[0] > 0.85
    assert far[-1] == 0.0
    assert np.abs(np.diff(near)).max() < 3.5 / steps
    assert np.abs(np.diff(far)).max() < 4.5 / steps
