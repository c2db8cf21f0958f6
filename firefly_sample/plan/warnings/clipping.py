"""Warn of geometry that only the near or the far plane keeps out of the picture.

A camera sees a pyramid, with an orthographic lens a box, that begins at the eye. The planes clip it to the
view volume. A triangle is clipped if its front, or either side if it is double-sided, reaches into the part
before the near plane or beyond the far plane. Geometry beside the pyramid or behind the eye is not.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.frustum import corners_near, frustum_corners, spheres_in_frustum
from firefly_sample.plan.instances import Group, Instances
from firefly_sample.plan.view import Eye
from firefly_sample.plan.visible import Visible

Float64 = NDArray[np.float64]

MOST_NAMES = 4
TOUCH = 1e-9
"""Share of a region's size up to which an overlap only touches the region."""


class Clipped(NamedTuple):
    """Ids of geometry instances that each plane clips, at most one more than are named."""

    near: tuple[int, ...]
    far: tuple[int, ...]
    nothing_left: bool


def find_clipped(instances: Instances, eye: Eye, seen: Visible, others: bool = False) -> Clipped:
    """Return the geometry that each plane clips, if the user would not expect that.

    A default plane should clip nothing. A plane that was set may, unless nothing is left to see: no geometry
    and, as `others` says, no sprites and no particles.
    """
    lens, near, far = eye.lens, eye.lens.get_near(), eye.lens.get_far()
    nothing_left = not (others or _anything_between(seen, near, far))
    before: tuple[int, ...] = ()
    behind: tuple[int, ...] = ()
    if near > 0.0 and (nothing_left or not lens.near_given):
        before = _ids_within(instances, eye, 0.0, near)
    if np.isfinite(far) and (nothing_left or not lens.far_given):
        behind = _ids_within(instances, eye, far, np.inf)
    return Clipped(before, behind, nothing_left)


def clipping_warnings(found: Clipped, eye: Eye, id_names: Sequence[str]) -> Iterator[str]:
    """Yield a line for each plane that clips geometry, with the nodes' names and the way out."""
    lens = eye.lens
    for plane, ids, distance, given in (
        ("near", found.near, lens.get_near(), lens.near_given),
        ("far", found.far, lens.get_far(), lens.far_given),
    ):
        if ids:
            names = list(dict.fromkeys(id_names[index] for index in ids))
            more = " and more" if len(names) > MOST_NAMES else ""
            default = "" if given else ", Panda3D's default,"
            all_of_it = ", and nothing else is in view" if found.nothing_left else ""
            yield (
                f"camera {eye.name}: the {plane} plane at {distance:g}{default} cuts off "
                f"{', '.join(names[:MOST_NAMES])}{more}{all_of_it}: set the lens's planes by set_near_far"
            )


def _anything_between(seen: Visible, near: float, far: float) -> bool:
    """Return whether the box of anything in view reaches between the planes."""
    for part in seen.parts:
        middles = 0.5 * (part.nearest + part.farthest)  # of the boxes too: cheaper than their ends
        if ((near < middles) & (middles < far)).any():
            return True
        if part.box[1][1] > near and part.box[0][1] < far:
            return True
    return False


def _ids_within(instances: Instances, eye: Eye, low: float, high: float) -> tuple[int, ...]:
    """Return ids of instances with a triangle in view between two distances, up to one more than named."""
    to_view = eye.camera.world_to_view
    centers = instances.centers @ to_view[:3, :3] + to_view[3, :3]
    planes = np.array([*eye.planes[:4], (0.0, 1.0, 0.0, -low)])
    if np.isfinite(high):
        planes = np.array([*planes, (0.0, -1.0, 0.0, high)])
    chosen = np.flatnonzero(spheres_in_frustum(planes, centers, instances.radii))
    if not len(chosen):
        return ()
    if not np.isfinite(high):
        high = float((centers[chosen, 1] + instances.radii[chosen]).max())
        if not high > low:
            return ()
    region = _Region.between(eye, low, high)
    found: dict[int, None] = {}
    for index in chosen:
        group = instances.groups[instances.which[index]]
        if _reaches(group, instances.model_to_world[index] @ to_view, region):
            found[int(instances.ids[index])] = None
            if len(found) > MOST_NAMES:
                break
    return tuple(found)


class _Region(NamedTuple):
    """A convex part of the eye's view.

    Attributes
    ----------
    perspective : bool
    planes : ndarray of float64, shape (6, 4)
        Unit normals inwards.
    corners : ndarray of float64, shape (8, 3)
    edges : ndarray of float64, shape (6, 3)
        Directions of all edges.
    touch : float
        Length up to which an overlap only touches.
    """

    perspective: bool
    planes: Float64
    corners: Float64
    edges: Float64
    touch: float

    @classmethod
    def between(cls, eye: Eye, low: float, high: float) -> _Region:
        constants = eye.lens.constants()
        corners = frustum_corners(constants, low, high)
        planes = np.array([*eye.planes[:4], (0.0, 1.0, 0.0, -low), (0.0, -1.0, 0.0, high)])
        edges = np.array([*(corners[4:] - corners[:4]), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
        edges /= np.linalg.norm(edges, axis=1, keepdims=True)
        return cls(constants.perspective, planes, corners, edges, TOUCH * float(np.abs(corners).max()))


def _reaches(group: Group, model_to_view: Float64, region: _Region) -> bool:
    """Return whether a triangle that faces the eye reaches into the region."""
    planes = region.planes @ model_to_view.T  # in model space, where vertices are
    for corners in corners_near(group.geom, planes, region.touch):
        seen = corners @ model_to_view[:3, :3] + model_to_view[3, :3]
        seen = seen[_facing(seen, group, region.perspective)]
        if len(seen) and _overlaps(seen, region).any():
            return True
    return False


def _facing(corners: Float64, group: Group, perspective: bool) -> NDArray[np.bool_]:
    """Return which triangles, shape (n, 3, 3), turn a side that is drawn to the eye."""
    first = corners[:, 0]
    normals = np.cross(corners[:, 1] - first, corners[:, 2] - first)
    towards = -(normals * first).sum(axis=1) if perspective else -normals[:, 1]
    if group.double_sided:
        return np.asarray(towards != 0.0)
    return np.asarray(towards < 0.0 if group.mirrored else towards > 0.0)


def _overlaps(corners: Float64, region: _Region) -> NDArray[np.bool_]:
    """Return which triangles, shape (n, 3, 3), overlap the region: no axis separates the two.

    The candidate axes are the face normals of both, and the cross products of their edges (S. Gottschalk,
    M. Lin, D. Manocha, "OBBTree", SIGGRAPH 1996).
    """
    sides = corners[:, (1, 2, 0)] - corners
    normals = np.cross(sides[:, 0], sides[:, 1])[:, None]
    across = np.cross(sides[:, :, None], region.edges).reshape(len(corners), -1, 3)
    faces = np.broadcast_to(region.planes[:, :3], (len(corners), len(region.planes), 3))
    axes = np.concatenate([faces, normals, across], axis=1)
    lengths = np.linalg.norm(axes, axis=2, keepdims=True)
    axes = axes / np.where(lengths > 0.0, lengths, 1.0)
    its, others = axes @ corners.transpose(0, 2, 1), axes @ region.corners.T
    depth = np.minimum(its.max(axis=2) - others.min(axis=2), others.max(axis=2) - its.min(axis=2))
    return np.asarray(((depth > region.touch) | (lengths[..., 0] == 0.0)).all(axis=1))
