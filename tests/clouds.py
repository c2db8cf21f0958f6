"""Clouds of particles over a floor, and the three of docs/particles.md whose shadows are known exactly."""

from __future__ import annotations

import numpy as np

from firefly_sample.plan.build import build_plan
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.particles import ParticleNode, VolumeShadow
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.spotlight import Spotlight
from firefly_sample.settings import Settings
from tests.scenes import geom_node


def floor(height=-1.3, size=12.0):
    corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
    vertices = [(size * x, size * y, height) for x, y in corners]
    material = Material("floor", (0.6, 0.6, 0.6, 1.0))
    return geom_node("floor", Geom(vertices, [(0, 1, 2), (0, 2, 3)]), material)


def ball_of(count, seed=0):
    """Points evenly in a ball of radius 1."""
    rng = np.random.default_rng(seed)
    way = rng.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    return way * rng.random((count, 1)) ** (1 / 3)


def sun_lamp(color=(2.0, 1.9, 1.7)):
    """A sun that shines down and a bit to the left."""
    sun = DirectionalLight("sun", color)
    sun.set_direction((-0.4, 0.1, -1.0))
    return sun


def cloud_scene(node, light=None, ground=True, **shadow):
    """A cloud around the origin over a floor, in a light that it dims; None for no shadow."""
    scene = Scene(background=(0.02, 0.02, 0.03))
    light = sun_lamp() if light is None else light
    path = scene.root.attach_new_node(light)
    if isinstance(light, Spotlight):
        path.set_pos(1.5, -0.5, 3.0)
        path.look_at(0, 0, 0)
    scene.root.attach_new_node(AmbientLight("sky", (0.05, 0.06, 0.1)))
    if ground:
        scene.root.attach_new_node(floor())
    node.set_shadow(VolumeShadow(light, **shadow))
    scene.root.attach_new_node(node)
    scene.camera.set_pos(0, -5, 1)
    scene.camera.look_at(0, 0, -0.2)
    scene.camera.node().lens = PerspectiveLens(fov=45, near=0.1, far=100)
    return scene


def puff(count=400, radius=0.12, alpha=0.15, seed=0, colors=(0.8, 0.5, 0.3)):
    return ParticleNode("puff", ball_of(count, seed), radius, alpha, colors)


def volume_of(scene, settings=None):
    """The volume shadow in the plan of a scene."""
    return build_plan(scene, settings or Settings(), (64, 48)).volume


def _alpha_of(positions, radius, depth):
    """The alpha at which the way through the middle along Z has an optical depth."""
    squares = (positions[:, :2] ** 2).sum(axis=1) / radius**2
    return 1.0 - np.exp(-depth / (np.maximum(1.0 - squares, 0.0) ** 2).sum())


def blob(count=20_000, radius=0.12):
    """A normal distribution, cut at 1: optical depth 2 through the middle."""
    positions = np.random.default_rng(1).normal(size=(2 * count, 3)) / 3.0
    positions = positions[np.linalg.norm(positions, axis=1) < 1.0 - radius][:count]
    return ParticleNode("blob", positions, radius, _alpha_of(positions, radius, 2.0))


def sheets(count=6_000, radius=0.15):
    """Three sheets thinner than a slice: optical depth 3 through the middle."""
    rng = np.random.default_rng(2)
    depth = rng.choice([-0.6, 0.0, 0.55], size=count) + rng.normal(size=count) * 0.003
    positions = np.column_stack([rng.uniform(-0.6, 0.6, (count, 2)), depth])
    return ParticleNode("sheets", positions, radius, _alpha_of(positions, radius, 3.0))


def faint(count=20_000):
    """20,000 particles of alpha 1e-3, most of them before each other."""
    rng = np.random.default_rng(3)
    positions = np.column_stack([rng.normal(size=(count, 2)) * 0.1, rng.uniform(-0.8, 0.8, count)])
    return ParticleNode("faint", positions, 0.3, 1e-3)


CLOUDS = {"blob": blob, "sheets": sheets, "faint": faint}


def from_above(node):
    """A cloud lit straight from above, for which its optical depths are set."""
    sun = DirectionalLight("sun")
    sun.set_direction((0, 0, -1))
    return cloud_scene(node, sun, ground=False)
