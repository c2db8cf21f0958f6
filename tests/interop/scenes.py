"""Scenes of boxes, balls and planes from a seed: turned, stretched, mirrored, sheared by their parents."""

from __future__ import annotations

import numpy as np
import trimesh

from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from tests.scenes import ball, geom_node, wall


def box() -> Geom:
    mesh = trimesh.creation.box((1.6, 1.2, 0.8))
    return Geom(mesh.vertices, mesh.faces, name="box")


SHAPES = (
    (box(), Material("box", (0.8, 0.3, 0.2, 1.0))),
    (ball(1.0, 2), Material("ball", (0.2, 0.7, 0.3, 1.0))),
    (wall(2.5, 3), Material("board", (0.3, 0.4, 0.8, 1.0), double_sided=True)),
    (wall(2.5, 3), Material("one-sided board", (0.7, 0.7, 0.2, 1.0))),
)


def random_scene(seed: int, lens: Lens) -> Scene:
    """Four to nine things around the origin, and a camera 7 to 10 units away that looks at it."""
    rng = np.random.default_rng(seed)
    scene = Scene()
    groups = [scene.root]
    for index in range(2):
        group = groups[-1].attach_new_node(f"group {index}")
        group.set_hpr(*rng.uniform(-180, 180, 3))
        group.set_scale(*rng.uniform(0.8, 1.3, 3))
        groups.append(group)
    for index in range(int(rng.integers(4, 10))):
        shape, material = SHAPES[rng.integers(len(SHAPES))]
        path = groups[rng.integers(3)].attach_new_node(geom_node(f"thing {index}", shape, material))
        path.set_pos(*rng.uniform(-2.5, 2.5, 3))
        path.set_hpr(*rng.uniform(-180, 180, 3))
        path.set_scale(*(rng.uniform(0.4, 1.5, 3) * rng.choice((-1.0, 1.0), 3)))
    direction = rng.normal(size=3)
    scene.camera.set_pos(*(direction / np.linalg.norm(direction) * rng.uniform(7, 10)))
    scene.camera.look_at(0, 0, 0)
    scene.camera.set_r(scene.camera.get_r() + rng.uniform(-180, 180))
    scene.camera_node.lens = lens
    return scene
