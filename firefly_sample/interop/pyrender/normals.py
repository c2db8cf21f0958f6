"""Lines along the normals of a pyrender primitive, as long and as blue as pyrender's viewer draws them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.interop.pyrender.attributes import usable_attributes
from firefly_sample.interop.pyrender.meshes import corners_of
from firefly_sample.losses import Losses
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.material import Material
from firefly_sample.scene.transforms import vectors_from_gltf
from firefly_sample.srgb import srgb_to_linear

LENGTH = 0.05
"""Of a line, over the diagonal of the primitive's bounding box."""
_BLUE = (0.1, 0.1, 1.0)
"""Display codes, 0 to 1."""
_NO_LINES = "VERTEX_NORMALS and FACE_NORMALS draw nothing of lines and of meshes without normals"


def normal_material(look: str) -> Material:
    """Return the material of the lines, which a look shows in pyrender's colour."""
    codes = np.array(_BLUE)
    linear = {"flat": codes, "pyrender": codes**2.2}.get(look, srgb_to_linear(codes))
    return Material("normals", base_color=(*linear, 1.0), unlit=True)


def normal_lines(primitive: Any, vertices: bool, faces: bool, name: str, losses: Losses) -> Geom | None:
    """Return lines along the normals of a primitive's vertices, and of its triangles; None if there are none.

    Points have lines if either is asked for, as in pyrender's viewer. Primitives without normals have none,
    as there, and lines, which its shader does not take, have none: both are noted as losses of that name.
    """
    mode, corners = corners_of(primitive)
    if primitive.normals is None or mode == "lines":
        losses.add(_NO_LINES, name)
        return None
    # the primitive's own conversion names what is not finite
    usable = usable_attributes(primitive, corners, name, Losses())
    assert usable.normals is not None
    places, corners = usable.positions.astype(np.float64), usable.corners
    starts, ways = [np.zeros((0, 3))], [np.zeros((0, 3))]
    if vertices or mode == "points":
        used = np.unique(corners)
        starts.append(places[used])
        ways.append(usable.normals[used].astype(np.float64))
    if faces and mode == "triangles":
        triangles = places[corners]
        starts.append(triangles.mean(axis=1))
        ways.append(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]))
    start, way = np.concatenate(starts), np.concatenate(ways)
    lengths = np.linalg.norm(way, axis=1)
    has_way = lengths > 0.0
    if not has_way.any():
        return None
    start, way = start[has_way], way[has_way] / lengths[has_way, None]
    ends = np.stack([start, start + LENGTH * _diagonal(places, primitive.poses) * way], axis=1)
    pairs = np.arange(2 * len(start)).reshape(-1, 2)
    return Geom.lines(vectors_from_gltf(ends.reshape(-1, 3)), pairs, name=f"normals of {name}")


def _diagonal(places: NDArray[np.float64], poses: NDArray[Any] | None) -> float:
    """Return the diagonal of a bounding box as pyrender has it: larger by the spread of the instances."""
    spread = 0.0 if poses is None else np.ptp(poses[:, :3, 3].astype(np.float64), axis=0)
    return float(np.linalg.norm(np.ptp(places, axis=0) + spread))
