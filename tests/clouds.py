"""Clouds of particles over a floor."""

from __future__ import annotations

import numpy as np

from firefly_sample.pipeline import build_plan
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.particles import ParticleNode, ParticleShadow
from firefly_sample.scene.scene import Scene
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
    node.set_shadow(ParticleShadow(light, **shadow))
    scene.root.attach_new_node(node)
    scene.camera.set_pos(0, -5, 1)
    scene.camera.look_at(0, 0, -0.2)
    scene.camera.node().lens = PerspectiveLens(vfov=45, near=0.1, far=100)
    return scene


def puff(count=400, radius=0.12, alpha=0.15, seed=0, colors=(0.8, 0.5, 0.3)):
    return ParticleNode("puff", ball_of(count, seed), radius, alpha, colors)


def light_on(renderer, plan):
    """The radiance of each particle of the plan that was drawn last, shape (n, 3)."""
    with renderer._device:
        texels = renderer._gpu.images.texture(plan, "particle_light").read()
    return np.frombuffer(texels, np.float32).reshape(-1, 4)[: len(plan.particles), :3].astype(np.float64)


def volume_of(scene, settings=None):
    """The particle shadow in the plan of a scene."""
    return build_plan(scene, settings or Settings(), (64, 48)).particle_shadow
