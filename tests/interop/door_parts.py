"""Parts of the door's scenes, of pyrender's classes alone: shapes, lights, pictures, materials."""

from __future__ import annotations

import numpy as np
import pyrender
import trimesh
from PIL import Image
from trimesh.transformations import rotation_matrix, translation_matrix

EYE = translation_matrix((0, 0, 6))
ASKEW = rotation_matrix(0.7, (1, 2, 3))


def scene(**given) -> pyrender.Scene:
    made = pyrender.Scene(**({"bg_color": (0.2, 0.3, 0.4), "ambient_light": (0.1, 0.1, 0.1)} | given))
    made.add(pyrender.PerspectiveCamera(yfov=0.7), pose=EYE)
    return made


def look(color=(0.8, 0.5, 0.3, 1.0), metallic=0.2, roughness=0.6, **others):
    return pyrender.MetallicRoughnessMaterial(
        baseColorFactor=color, metallicFactor=metallic, roughnessFactor=roughness, **others
    )


def at(x, y, z=0.0, turn=0.7):
    return translation_matrix((x, y, z)) @ rotation_matrix(turn, (1, 2, 3))


def add_shapes(made, material=None, **how):
    """A ball, a box with hard edges and a ring."""
    box = trimesh.creation.box((1.2, 1.2, 1.2))
    ring = trimesh.creation.torus(0.6, 0.25, major_sections=40, minor_sections=20)
    ball = trimesh.creation.icosphere(3, radius=0.8)
    mesh = pyrender.Mesh.from_trimesh
    made.add(mesh(ball, material=material, **how), pose=at(-1.7, 0.3), name="ball")
    made.add(mesh(box, material=material, smooth=False, **how), pose=at(0.1, -0.4, -0.5), name="box")
    made.add(mesh(ring, material=material, **how), pose=at(1.8, 0.4, 0.2), name="ring")
    return made


def add_lights(made, suns=0, lamps=0, spots=0):
    rng = np.random.default_rng(3)
    for _ in range(suns):
        turn = rotation_matrix(rng.uniform(-0.9, 0.9), (1, 0, 0)) @ rotation_matrix(
            rng.uniform(-0.9, 0.9), (0, 1, 0)
        )
        made.add(pyrender.DirectionalLight(rng.uniform(0.3, 1.0, 3), 3.0 / suns), pose=turn)
    for _ in range(lamps):
        made.add(
            pyrender.PointLight(rng.uniform(0.3, 1.0, 3), 30.0 / lamps),
            pose=translation_matrix(rng.uniform((-2, -2, 2), (2, 2, 4))),
        )
    for _ in range(spots):
        light = pyrender.SpotLight(
            rng.uniform(0.3, 1.0, 3), 60.0 / spots, innerConeAngle=0.15, outerConeAngle=0.4
        )
        made.add(
            light, pose=translation_matrix((*rng.uniform(-0.8, 0.8, 2), 4)) @ rotation_matrix(0.1, (1, 1, 0))
        )
    return made


def picture(size=(16, 16), seed=1, channels=3) -> Image.Image:
    """An image of few large squares, whose rows are a multiple of four bytes."""
    rng = np.random.default_rng(seed)
    small = rng.integers(40, 256, (size[1] // 4, size[0] // 4, channels), dtype=np.uint8)
    return Image.fromarray(small.repeat(4, axis=0).repeat(4, axis=1))


def bumps() -> np.ndarray:
    """A normal map of few large squares."""
    normals = np.random.default_rng(6).normal(0.0, 0.3, (4, 4, 3))
    normals[..., 2] = 1.0
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.rint(127.5 * normals + 127.5).astype(np.uint8).repeat(4, axis=0).repeat(4, axis=1)


def shell(radius, top, material, **how):
    """A ball without what is above a height, so that its inside can be seen."""
    mesh = trimesh.creation.icosphere(3, radius)
    mesh.update_faces(mesh.triangles_center[:, 2] < top)
    return pyrender.Mesh.from_trimesh(mesh, material, **how)


def card(image=None, material=None, size=1.5, repeat=1.0):
    """A square of two triangles with texture coordinates, facing +z."""
    half = 0.5 * size
    corners = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
    places = repeat * np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
    if material is None:
        material = trimesh.visual.material.SimpleMaterial(image=image)
    visual = trimesh.visual.TextureVisuals(uv=places, material=material)
    return trimesh.Trimesh(corners, [(0, 1, 2), (0, 2, 3)], visual=visual, process=False)


def textured(mapping, **factors):
    """A square with a pyrender material of its own textures."""
    flat = card(picture())
    primitive = pyrender.Primitive(
        flat.vertices,
        normals=np.tile((0.0, 0.0, 1.0), (4, 1)),
        texcoord_0=flat.visual.uv,
        indices=flat.faces,
        material=look(**factors, **mapping),
    )
    return pyrender.Mesh([primitive])


def colored(smooth, faces=False):
    """A ball with colours of vertices or of faces."""
    mesh = trimesh.creation.icosphere(2, radius=0.9)
    rng = np.random.default_rng(10)
    if faces:
        mesh.visual.face_colors = rng.integers(0, 256, (len(mesh.faces), 3), dtype=np.uint8)
    else:
        mesh.visual.vertex_colors = rng.uniform(size=mesh.vertices.shape)
    return pyrender.Mesh.from_trimesh(mesh, smooth=smooth)


def backwards(made):
    """The same scene, with the triangles of each primitive in the opposite order."""
    for mesh in made.meshes:
        for primitive in mesh.primitives:
            if primitive.indices is None:
                order = np.arange(len(primitive.positions)).reshape(-1, 3)[::-1].ravel()
                primitive.positions, primitive.normals = primitive.positions[order], primitive.normals[order]
            else:
                primitive.indices = primitive.indices[::-1]
    return made
