"""Scenes of blended surfaces, and a GPU's picture of them held against float64 rays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from firefly_sample.lab.reference.frame import finished, reference_settings, render_reference
from firefly_sample.lab.reference.layer_rays import steady_layers
from firefly_sample.lab.reference.raycast import cast_visibility
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import AmbientLight
from firefly_sample.scene.material import Material, Texture
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.lit_scenes import KINDS
from tests.scenes import ball, geom_node, wall, wall_scene

SIZE = (48, 36)
FINE = {"normal_format": "rgba32f", "albedo_format": "rgba32f", "cutoff_budget": 0.0}
LIGHTS = ("ramp", "attenuated", "sun", "spots")


def even_texture(alpha):
    """A texture of one alpha and colour: no filter errs."""
    return Texture(np.full((4, 4, 4), (188, 255, 220, alpha), dtype=np.uint8))


def faded_wall(size):
    """A wall whose vertices' alpha and colour vary."""
    geom = wall(size)
    colors = [(1, 0.5, 0.2, 0.1), (0.3, 1, 0.6, 0.9), (0.8, 0.8, 1, 0.4), (0.2, 0.9, 0.4, 0.7)]
    return Geom(geom.vertices, geom.triangles, geom.normals, geom.texcoords, colors, name="faded")


def glass(name, color, alpha, **more):
    return Material(name, (*color, alpha), alpha_mode="blend", **{"double_sided": True} | more)


KINDS_OF_GLASS = (
    {},
    {"specular": (0.5, 0.6, 0.7), "shininess": 24.0},
    {"metallic": 0.0, "roughness": 0.4},
    {"metallic": 1.0, "roughness": 0.6},
    {"unlit": True},
    {"emission": (0.05, 0.1, 0.2), "ambient": (0.9, 0.2, 0.4)},
    {"texture": even_texture(153)},
    {"double_sided": False},
)


def backdrop(orthographic=False):
    """A wall behind all, and a lens that sees most of what is before it."""
    scene = wall_scene(16.0, size=60.0, vfov=45.0)
    if orthographic:
        scene.camera.node().lens = OrthographicLens(film_size=(10.0, 7.5), near=1.0, far=60.0)
    return scene


def add_panes(scene, count, crossing=True, seed=0, kinds=KINDS_OF_GLASS):
    """Put panes of all kinds of glass before the wall: they cross each other, or each has its own place."""
    rng = np.random.default_rng(seed)
    for index in range(count):
        made = glass(
            f"glass {index}",
            rng.uniform(0.2, 1.0, 3),
            rng.uniform(0.2, 0.8),
            **kinds[index % len(kinds)],
        )
        geom = faded_wall(3.0) if index % 5 == 4 else wall(3.0)
        path = scene.root.attach_new_node(geom_node(f"pane {index}", geom, made))
        if crossing:
            path.set_pos(*rng.uniform((-1.5, 7, -1), (1.5, 9, 1)))
            path.set_hpr(*rng.uniform(-60, 60, 3))
        else:
            path.set_pos(rng.uniform(-1, 1), 5 + 7 * index / count, rng.uniform(-1, 1))
            tilt = 50.0 / count  # less than would let neighbours meet
            path.set_hpr(*rng.uniform(-tilt, tilt, 3))
    return scene


def add_lights(scene, kinds=LIGHTS, seed=1):
    rng = np.random.default_rng(seed)
    for kind in kinds:
        KINDS[kind](scene.root, rng)
    scene.root.attach_new_node(AmbientLight("ambient", (0.1, 0.15, 0.2)))
    return scene


def add_squares(scene, count=40, dots=15, seed=2, low=(-2, 5, -1.5), high=(2, 11, 1.5), radius=0.5):
    """Put particles and dots among the panes."""
    rng = np.random.default_rng(seed)
    if count:
        colors = rng.uniform(0.2, 1.0, (count, 3))
        scene.root.attach_new_node(
            ParticleNode("mist", rng.uniform(low, high, (count, 3)), radius, 0.6, colors)
        )
    if dots:
        places = rng.uniform(low, high, (dots, 3))
        scene.root.attach_new_node(Sprites("dots", places, rng.uniform(0, 0.8, (dots, 3)), 0.15))
    return scene


def bubbles():
    """Spheres in each other, whose far sides are seen through the near ones."""
    scene = add_lights(backdrop(), ("sun", "attenuated"))
    for index, radius in enumerate((2.0, 1.3, 0.6)):
        made = glass(
            f"bubble {index}", (0.9, 0.5 + 0.2 * index, 0.4), 0.4, specular=(0.4, 0.4, 0.4), shininess=16.0
        )
        scene.root.attach_new_node(geom_node(f"bubble {index}", ball(radius, 2), made)).set_pos(
            0.3 * index, 9, 0
        )
    return scene


@dataclass(eq=False)
class Held:
    """A frame and its reference; `chosen` are pixels in which a rasteriser and rays see the same layers."""

    plan: object
    frame: object
    reference: object
    chosen: np.ndarray
    exact: object  # the reference's plan, and the triangles that rays see
    cast: np.ndarray

    def codes(self):
        """Largest difference of codes."""
        off = np.abs(self.frame["color"].astype(int) - self.reference.color)
        return int(off[self.chosen].max())

    def share_off(self):
        """Share of the chosen pixels that are off by more than one code."""
        off = np.abs(self.frame["color"].astype(int) - self.reference.color).max(axis=-1)
        return float((off[self.chosen] > 1).mean())


def held(renderer, scene, time=0.0, **settings):
    """Draw a scene, and cast rays into it; several samples per pixel are averaged in linear radiance."""
    own = Settings(**FINE | settings)
    renderer.settings = own
    plan = renderer.plan(scene, time, ("color",) if own.look == "flat" else ("radiance", "color"))
    frame = renderer.draw(plan)
    samples, size = own.supersample, renderer.size
    try:
        renderer.resize(tuple(samples * side for side in size))
        method = "volumes" if own.light_method == "forward" else own.light_method
        renderer.settings = reference_settings(own.with_changes(light_method=method))
        seen = renderer.draw(renderer.plan(scene, time, ("visibility",)))["visibility"]
        exact = renderer.plan(scene, time, ("color",))
    finally:
        renderer.resize(size)
    cast = cast_visibility(exact)
    chosen = (cast == seen).all(axis=-1) & steady_layers(exact, cast)
    reference = render_reference(exact, cast)
    if samples > 1:
        chosen = _blocks(chosen, samples).all(axis=(1, 3))
        radiance = _blocks(reference.radiance, samples).mean(axis=(1, 3))
        light = _blocks(reference.light, samples).mean(axis=(1, 3))
        reference = finished(exact, radiance, light, reference.position)
    assert chosen.mean() > 0.6
    return Held(plan, frame, reference, chosen, exact, cast)


def _blocks(image, samples):
    height, width = image.shape[:2]
    return image.reshape(height // samples, samples, width // samples, samples, *image.shape[2:])


def empty_scene(background=(0.1, 0.2, 0.4)):
    """An orthographic camera that looks along +Y at nothing, over two units."""
    scene = Scene(background=background)
    scene.camera.node().lens = OrthographicLens(film_size=(2, 2), near=1, far=20)
    return scene
