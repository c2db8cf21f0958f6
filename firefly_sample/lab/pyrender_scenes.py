"""Scenes as users of pyrender build them, whose camera and meshes have another pose in each frame."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import firefly_sample.interop.pyrender as pyrender

Float64 = NDArray[np.float64]

_STEP = 0.05
"""Radians by which camera and meshes turn from one frame to the next."""


@dataclass(eq=False)
class PosedScene:
    """A pyrender Scene and the poses of its frames.

    Attributes
    ----------
    scene : pyrender.Scene
    camera : pyrender.Node
        Goes around the origin at a `distance`.
    moving : list of pyrender.Node
        Turn in their places.
    segments : dict of pyrender.Node to int
        A colour for each mesh, for ``RenderFlags.SEG``.
    """

    scene: Any
    camera: Any
    distance: float
    moving: list[Any]

    def __post_init__(self) -> None:
        self._places = [self.scene.get_pose(node)[:3, 3] for node in self.moving]
        self.segments = {node: 1 + index % 255 for index, node in enumerate(self.moving)}

    def pose(self, frame: int) -> None:
        """Set the poses of a frame."""
        angle = _STEP * frame
        eye = self.distance * np.array([math.sin(angle), 0.4, math.cos(angle)])
        self.scene.set_pose(self.camera, looking(eye))
        for index, (node, place) in enumerate(zip(self.moving, self._places, strict=True)):
            self.scene.set_pose(node, _placed(place, angle + index))


def looking(eye: Any) -> Float64:
    """Return the pose of a camera or light at a place that looks at the origin, in pyrender's axes."""
    back = np.asarray(eye, dtype=np.float64)
    back = back / np.linalg.norm(back)
    right = np.cross((0.0, 1.0, 0.0), back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.column_stack([right, np.cross(back, right), back, eye])
    return pose


def _placed(place: Any, angle: float = 0.0) -> Float64:
    """Return a pose at a place, turned about the vertical axis."""
    pose = np.eye(4)
    pose[0, 0] = pose[2, 2] = math.cos(angle)
    pose[0, 2], pose[2, 0] = math.sin(angle), -math.sin(angle)
    pose[:3, 3] = place
    return pose


def one_mesh() -> PosedScene:
    """A ball under one light."""
    import trimesh

    scene = pyrender.Scene(ambient_light=(0.1, 0.1, 0.1))
    ball = scene.add(pyrender.Mesh.from_trimesh(trimesh.creation.icosphere(4)))
    scene.add(pyrender.DirectionalLight(intensity=3.0), pose=looking((1, 2, 3)))
    camera = scene.add(pyrender.PerspectiveCamera(yfov=0.8))
    return PosedScene(scene, camera, 3.5, [ball])


def tabletop() -> PosedScene:
    """Nine things on a table, half of them textured and half with vertex colours, under three lights."""
    import trimesh

    rng = np.random.default_rng(1)
    scene = pyrender.Scene(bg_color=(0.2, 0.3, 0.4), ambient_light=(0.1, 0.1, 0.1))
    table = _textured(trimesh.creation.box((6.0, 0.1, 6.0)), rng)
    scene.add(pyrender.Mesh.from_trimesh(table, smooth=False), pose=_placed((0.0, -0.05, 0.0)))
    shapes: list[Callable[[], Any]] = [
        lambda: trimesh.creation.icosphere(4, radius=0.5),
        lambda: trimesh.creation.cylinder(0.4, 1.0, sections=64),
        lambda: trimesh.creation.torus(0.4, 0.15, major_sections=64, minor_sections=32),
        lambda: trimesh.creation.capsule(0.5, 0.25, count=[48, 48]),
        lambda: trimesh.creation.box((0.8, 0.8, 0.8)),
    ]
    moving = []
    for index in range(9):
        shape = shapes[index % len(shapes)]()
        if index % 2:
            shape = _textured(shape, rng)
        else:
            shape.visual.vertex_colors = rng.integers(60, 256, (len(shape.vertices), 3), dtype=np.uint8)
        mesh = pyrender.Mesh.from_trimesh(shape, smooth=index % len(shapes) != 4)
        place = 1.4 * (index % 3 - 1), 0.5, 1.4 * (index // 3 - 1)
        moving.append(scene.add(mesh, pose=_placed(place)))
    scene.add(pyrender.DirectionalLight((1.0, 1.0, 0.9), 2.0), pose=looking((1, 3, 2)))
    scene.add(pyrender.PointLight((1.0, 0.8, 0.6), 20.0), pose=_placed((2, 3, 0)))
    spotlight = pyrender.SpotLight((0.7, 0.8, 1.0), 40.0, innerConeAngle=0.4, outerConeAngle=0.7)
    scene.add(spotlight, pose=looking((-2, 4, 1)))
    camera = scene.add(pyrender.PerspectiveCamera(yfov=0.8))
    return PosedScene(scene, camera, 5.0, moving)


def many_nodes() -> PosedScene:
    """300 nodes of three meshes, under two lights."""
    import trimesh

    rng = np.random.default_rng(2)
    scene = pyrender.Scene(ambient_light=(0.1, 0.1, 0.1))
    meshes = [
        pyrender.Mesh.from_trimesh(trimesh.creation.icosphere(2, radius=0.12)),
        pyrender.Mesh.from_trimesh(trimesh.creation.box((0.2, 0.2, 0.2)), smooth=False),
        pyrender.Mesh.from_trimesh(trimesh.creation.cylinder(0.1, 0.25)),
    ]
    moving = [
        scene.add(meshes[index % 3], pose=_placed(place))
        for index, place in enumerate(rng.uniform(-2.0, 2.0, (300, 3)))
    ]
    scene.add(pyrender.DirectionalLight(intensity=2.0), pose=looking((1, 2, 3)))
    scene.add(pyrender.PointLight(intensity=20.0), pose=_placed((2, 3, 2)))
    camera = scene.add(pyrender.PerspectiveCamera(yfov=0.8))
    return PosedScene(scene, camera, 6.0, moving)


def _textured(shape: Any, rng: np.random.Generator) -> Any:
    """Give a trimesh object an image of squares, once around it."""
    import trimesh
    from PIL import Image

    visual: Any = trimesh.visual
    x, y, z = shape.vertices.T
    across = np.arctan2(y, x) / (2.0 * math.pi) + 0.5
    squares = rng.integers(60, 256, (16, 16, 3), dtype=np.uint8).repeat(16, axis=0).repeat(16, axis=1)
    material = visual.material.SimpleMaterial(image=Image.fromarray(squares))
    shape.visual = visual.TextureVisuals(uv=np.column_stack([across, z]), material=material)
    return shape


SCENES: dict[str, Callable[[], PosedScene]] = {
    "one mesh": one_mesh,
    "tabletop": tabletop,
    "300 nodes": many_nodes,
}
"""By the names under which they are measured."""
