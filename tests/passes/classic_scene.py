"""A scene of what the original has: vertex colours, textures, cut-out leaves, point lights with a radius."""

from __future__ import annotations

import numpy as np

from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from tests.scenes import ball, geom_node, wall

RADIUS = 3.0


def classic_scene(lights=60):
    """The scene, and for each path with geometry the Geom and the Material."""
    scene = Scene()
    parts = []

    def put(geom, material, pos, hpr=(0, 0, 0), scale=(1, 1, 1)):
        path = scene.root.attach_new_node(geom_node(geom.name, geom, material))
        path.set_pos(*pos)
        path.set_hpr(*hpr)
        path.set_scale(*scale)
        parts.append((path, geom, material))

    rng = np.random.default_rng(3)
    round_ = ball()
    colored = Geom(
        round_.vertices,
        round_.triangles,
        round_.normals,
        colors=0.5 + 0.5 * np.abs(round_.vertices),
        name="colored",
    )
    put(round_, Material("clay", (0.8, 0.5, 0.3, 1.0)), (-2.5, 10, 0), (30, 20, 10), (1.0, 0.6, 1.3))
    put(colored, Material("plain"), (0, 10, 0), (0, 40, 0), (-1.0, 1.0, 1.0))  # mirrored
    put(round_, Material("bright"), (2.5, 10, 0))
    put(wall(40.0, 8, "floor"), Material("earth", texture=_picture(rng)), (0, 10, -1.1), (0, -90, 0))
    leaf = Material("leaf", texture=_picture(rng, cut=True), alpha_mode="mask", double_sided=True)
    for index in range(8):
        put(
            wall(1.6, 1, f"leaf {index}"),
            leaf,
            rng.uniform((-3, 5, -0.5), (3, 9, 1.5)),
            rng.uniform(-180, 180, 3),
        )
    places, colors = rng.uniform((-6, 4, -1), (6, 16, 2), (lights, 3)), rng.uniform(0.2, 1, (lights, 3))
    scene.root.attach_new_node(PointLights("lights", places, colors, RADIUS))
    scene.camera.set_pos(0, -4, 3)
    scene.camera.set_hpr(3, -12, 2)
    scene.camera.node().lens = PerspectiveLens(fov=50, near=0.5, far=100)
    return scene, parts, places, colors


def _picture(rng, cut=False):
    """Four by four texels, so that all of it is magnified and levels do not matter."""
    pixels = rng.integers(60, 256, (4, 4, 4))
    pixels[..., 3] = 255 * (rng.random((4, 4)) < 0.6) if cut else 255
    return Texture(pixels.astype(np.uint8))


def write_parts(path, parts, plan, places, colors):
    """Save what `tests.passes.panda_original` draws."""
    lens, view = plan.view.lens, plan.view
    given = {
        "size": view.size,
        "camera": view.view_to_world,
        "lens": (lens.a, lens.c, view.near, view.far),
        "lights": places,
        "colors": colors,
        "radius": RADIUS,
        "parts": len(parts),
    }
    for index, (placed, geom, material) in enumerate(parts):
        color = np.ones((len(geom.vertices), 4)) * material.base_color
        if geom.colors is not None:
            color[:, :3] *= geom.colors
        white = np.full((1, 1, 4), 255, dtype=np.uint8)
        given |= {
            f"vertices_{index}": np.hstack([geom.vertices, geom.normals, geom.texcoords, color]),
            f"triangles_{index}": geom.triangles,
            f"matrix_{index}": placed.get_net_mat(),
            f"texture_{index}": white if material.texture is None else material.texture.pixels[::-1],
            f"two_sided_{index}": material.double_sided,
        }
    np.savez(path, **given)
