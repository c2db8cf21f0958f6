"""Scenes with every kind of light and of material, to hold against the float64 reference."""

from __future__ import annotations

import numpy as np

from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
from tests.scenes import ball_scene


def _ramp(root, rng):
    places = rng.uniform((-6, 4, -1), (6, 16, 2), (30, 3))
    root.attach_new_node(PointLights("ramp", places, rng.uniform(0.2, 1, (30, 3)), 2.5))


def _attenuated(root, rng):
    """One node of many, and single ones: with a linear and a quadratic part, without end or with one."""
    places = rng.uniform((-6, 4, -0.5), (6, 16, 2), (20, 3))
    colors = rng.uniform(0.05, 0.2, (20, 3))
    root.attach_new_node(PointLights("many", places, colors, 6.0, attenuation=(1, 0.09, 0.32)))
    for index, attenuation in enumerate([(1, 0, 1), (0, 1, 0), (0.5, 0, 0.02)]):
        light = PointLight(f"single {index}", (0.3, 0.25, 0.2))
        light.set_attenuation(attenuation)
        if index == 2:
            light.set_max_distance(9.0)
        root.attach_new_node(light).set_pos(*rng.uniform((-5, 5, 0), (5, 14, 2)))


def _endless(root, rng):
    """Panda3D's default: it never fades."""
    root.attach_new_node(PointLight("endless", (0.2, 0.3, 0.25))).set_pos(-4, 2, 5)


def _sun(root, rng):
    light = DirectionalLight("sun", (0.3, 0.3, 0.2))
    light.set_specular_color((0.5, 0.4, 0.9))
    root.attach_new_node(light).set_hpr(30, -50, 0)
    other = DirectionalLight("sky", (0.05, 0.1, 0.2))
    other.set_direction((0.3, 0.8, -2.0))
    root.attach_new_node(other)


def _spots(root, rng):
    """Hard and soft edges, narrow and wide, with and without end."""
    cones = ((20, 30), (1, 4), (50, 70), (80, 120), None, (25, 25))
    for index, cone in enumerate(cones):
        light = Spotlight(f"spot {index}", rng.uniform(0.2, 0.8, 3))
        if cone is None:
            light.set_exponent(20.0)
            light.get_lens().set_fov(50)
        else:
            light.set_cone(*cone)
        if index % 2:
            light.set_attenuation((1, 0, 0.05))
            light.set_max_distance(14.0)
        else:
            light.set_radius(13.0)
        path = root.attach_new_node(light)
        path.set_pos(-5 + 2 * index, rng.uniform(4, 8), rng.uniform(2, 5))
        path.look_at(rng.uniform(-3, 3), 10, -1)


KINDS = {"ramp": _ramp, "attenuated": _attenuated, "endless": _endless, "sun": _sun, "spots": _spots}

MATERIALS = {
    "matte": {},
    "shiny": {"specular": (0.5, 0.6, 0.7)},
    "emissive": {"emission": (0.02, 0.05, 0.1)},
    "ambient": {"ambient": (0.9, 0.2, 0.4)},
    "everything": {
        "specular": (0.5, 0.6, 0.7),
        "emission": (0.02, 0.05, 0.1),
        "ambient": (0.9, 0.2, 0.4),
    },
}


def lit_scene(kinds=tuple(KINDS), material="matte", shininess=32.0, seed=0, orthographic=False):
    """Three balls on a floor under the chosen kinds of light; the middle ball keeps a matte material."""
    scene = ball_scene(0)
    rng = np.random.default_rng(seed)
    for kind in kinds:
        KINDS[kind](scene.root, rng)
    if kinds:
        scene.root.attach_new_node(AmbientLight("ambient", (0.02, 0.03, 0.05)))
    given = MATERIALS[material]
    for name in ("ball", "floor"):
        _, own = scene.root.find(f"**/{name}").node().geoms[0]
        own.set_shininess(shininess if "specular" in given else 0.0)
        own.set_specular(given.get("specular", (0, 0, 0)))
        own.set_emission(given.get("emission", (0, 0, 0)))
        own.set_ambient(given.get("ambient"))
    if orthographic:
        scene.camera.node().lens = OrthographicLens(film_size=(16, 12), near=1, far=60)
    return scene
