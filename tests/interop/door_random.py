"""Scenes of pyrender from a seed: things of several shapes and looks, some below others, and lights."""

from __future__ import annotations

import numpy as np
import pyrender
import trimesh
from trimesh.transformations import random_rotation_matrix, scale_matrix, translation_matrix

from tests.interop.door_parts import look, picture

CAMERAS = (
    pyrender.PerspectiveCamera(0.6),
    pyrender.PerspectiveCamera(0.5, znear=0.5, zfar=30.0, aspectRatio=1.2),
    pyrender.IntrinsicsCamera(fx=140.0, fy=120.0, cx=45.0, cy=39.0),
    pyrender.OrthographicCamera(2.4, 2.4, znear=0.5, zfar=30.0),
)
SHAPES = (
    trimesh.creation.box((1.0, 0.8, 0.6)),
    trimesh.creation.icosphere(2, 0.6),
    trimesh.creation.torus(0.5, 0.2, major_sections=20, minor_sections=10),
    trimesh.creation.cylinder(0.3, 1.2, sections=16),
)


def turn(rng):
    return random_rotation_matrix(rng.uniform(size=3))


def pose(rng, reach):
    return translation_matrix(rng.uniform(-reach, reach, 3)) @ turn(rng) @ scale_matrix(rng.uniform(0.8, 1.2))


def add_camera(made, rng, seed):
    """One of `CAMERAS`, which looks at the origin from a distance of 8."""
    made.add(CAMERAS[seed % len(CAMERAS)], pose=turn(rng) @ translation_matrix((0, 0, 8)))


def random_mesh(rng):
    """A shape with a material, colours of vertices or of faces, or a texture; a third is of two instances."""
    shape, kind, smooth = SHAPES[rng.integers(len(SHAPES))].copy(), rng.integers(4), bool(rng.integers(2))
    material = None
    if kind == 0:
        material = look(
            (*rng.uniform(size=3), 1.0),
            rng.uniform(),
            rng.uniform(),
            doubleSided=bool(rng.integers(2)),
            emissiveFactor=rng.uniform(0.0, 0.5, 3),
        )
    elif kind == 1:
        shape.visual.vertex_colors = rng.integers(0, 256, (len(shape.vertices), 3), dtype=np.uint8)
    elif kind == 2:
        shape.visual.face_colors = rng.integers(0, 256, (len(shape.faces), 3), dtype=np.uint8)
    else:
        image = trimesh.visual.material.SimpleMaterial(image=picture(seed=int(rng.integers(100))))
        places = shape.vertices[:, :2] * rng.uniform(0.5, 3.0)
        shape.visual = trimesh.visual.TextureVisuals(uv=places, material=image)
    poses = np.array([pose(rng, 0.5) for _ in range(2)]) if rng.uniform() < 0.3 else None
    return pyrender.Mesh.from_trimesh(shape, material, poses=poses, smooth=smooth and kind != 2)


def random_scene(seed):
    """Eight things, stretched and some mirrored, and up to four lights of each kind."""
    rng = np.random.default_rng(seed)
    made = pyrender.Scene(bg_color=rng.uniform(size=4), ambient_light=rng.uniform(0.0, 0.3, 3))
    add_camera(made, rng, seed)
    nodes = []
    for index in range(8):
        place = pose(rng, 1.4) @ np.diag((*rng.uniform(0.6, 1.4, 3) * rng.choice((1, 1, 1, -1), 3), 1.0))
        parent = nodes[rng.integers(len(nodes))] if index % 2 else None
        nodes.append(made.add(random_mesh(rng), pose=place, parent_node=parent))
    for _ in range(rng.integers(1, 5)):
        made.add(pyrender.DirectionalLight(rng.uniform(0.2, 1.0, 3), rng.uniform(0.0, 2.0)), pose=turn(rng))
    for _ in range(rng.integers(0, 5)):
        light = pyrender.PointLight(rng.uniform(0.2, 1.0, 3), rng.uniform(0.0, 30.0))
        made.add(light, pose=translation_matrix(rng.uniform(-4.0, 4.0, 3)))
    for _ in range(rng.integers(0, 5)):
        inner, outer = sorted(rng.uniform(0.05, 1.2, 2))
        light = pyrender.SpotLight(rng.uniform(0.2, 1.0, 3), rng.uniform(0.0, 60.0), None, inner, outer)
        made.add(light, pose=turn(rng) @ translation_matrix((0, 0, 5)))
    return made
