"""Lines along the normals of a pyrender primitive, as long and as blue as pyrender's viewer draws them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.interop.pyrender.meshes import corners_of
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.material import Material
from firefly_sample.scene.transforms import vectors_from_gltf
from firefly_sample.srgb import srgb_to_linear

LENGTH = 0.05
"""Of a line, over the diagonal of the primitive's bounding box."""
_BLUE = (0.1, 0.1, 1.0)
"""Display codes, 0 to 1."""


def normal_material(look: str) -> Material:
    """Return the material of the lines, which a look shows in pyrender's colour."""
    codes = np.array(_BLUE)
    linear = {"flat": codes, "pyrender": codes**2.2}.get(look, srgb_to_linear(codes))
    return Material("normals", base_color=(*linear, 1.0), unlit=True)


def normal_lines(primitive: Any, vertices: bool, faces: bool, name: str) -> Geom | None:
    """Return lines along the normals of a primitive's vertices, and of its triangles.

    None if there are none: pyrender draws them for primitives with normals alone.
    """
    if primitive.normals is None:
        return None
    mode, corners = corners_of(primitive)
    places, normals = primitive.positions.astype(np.float64), primitive.normals.astype(np.float64)
    starts, ways = [np.zeros((0, 3))], [np.zeros((0, 3))]
    if vertices and mode != "lines":
        used = np.unique(corners)
        starts.append(places[used])
        ways.append(_unit(normals[used]))
    if faces and mode == "triangles":
        triangles = places[corners]
        starts.append(triangles.mean(axis=1))
        ways.append(_unit(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])))
    start, way = np.concatenate(starts), np.concatenate(ways)
    if not len(start):
        return None
    ends = np.stack([start, start + LENGTH * primitive.scale * way], axis=1)
    pairs = np.arange(2 * len(start)).reshape(-1, 2)
    return Geom.lines(vectors_from_gltf(ends.reshape(-1, 3)), pairs, name=f"normals of {name}")


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(lengths > 0.0, lengths, 1.0))
