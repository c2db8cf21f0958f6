"""Warn of geometry that the near or the far plane clips, and of scenes that float32 does not hold.

A camera sees a pyramid, with an orthographic lens a box, that begins at the eye. The planes clip it to the
view volume. A triangle is clipped if its front, or either side if it is double-sided, reaches into the part
before the near plane or beyond the far plane. Geometry beside the pyramid or behind the eye is not.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.frustum import (
    WIDEST,
    WIDEST_CASTER,
    corners_near,
    frustum_corners,
    has_wide,
    spheres_in_frustum,
)
from firefly_sample.plan.instances import Group, Instances
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.shadows.maps import ShadowMap
from firefly_sample.plan.view import Eye, View
from firefly_sample.plan.visible import Visible, VisiblePart
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.lens_constants import LensConstants

MOST_NAMES = 4
TOUCH = 1e-9
"""Share of a region's size up to which an overlap only touches the region."""
SMALLEST, LARGEST = 1e-15, 1e18
"""Scene units: for geometry in view of a size between these, float32 holds squares of distances with enough
digits, down to a tenth of the smallest size."""
ENDLESS = 1e37
"""Scene units: positions beyond are not drawn, because float32 has no room for a product."""
DEPTHS = 1e-37
"""The least depth, near over distance, that a reversed depth buffer of float32 holds."""


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
    check_near = near > 0.0 and (nothing_left or not lens.near_given)
    check_far = np.isfinite(far) and (nothing_left or not lens.far_given)
    before = _ids_within(instances, eye, 0.0, near) if check_near else ()
    behind = _ids_within(instances, eye, far, np.inf) if check_far else ()
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
    ends = [(0.0, 1.0, 0.0, -low), (0.0, -1.0, 0.0, high)]
    planes = np.array([*eye.planes[:4], *ends[: 1 + bool(np.isfinite(high))]])
    chosen = np.flatnonzero(spheres_in_frustum(planes, centers, instances.radii))
    if not len(chosen):
        return ()
    if not np.isfinite(high):
        high = float((centers[chosen, 1] + instances.radii[chosen]).max())
        if not high > low:
            return ()
    region = _Region(eye, low, high)
    found: dict[int, None] = {}
    for index in chosen:
        group = instances.groups[instances.which[index]]
        if _reaches(group, instances.model_to_world[index] @ to_view, region):
            found[int(instances.ids[index])] = None
            if len(found) > MOST_NAMES:
                break
    return tuple(found)


class _Region:
    """The part of the eye's view between two distances.

    It has planes (6, 4), corners (8, 3) and edge directions (6, 3). An overlap up to the length `touch` only
    touches it.
    """

    def __init__(self, eye: Eye, low: float, high: float) -> None:
        constants = eye.lens.constants()
        self.perspective = constants.perspective
        self.corners = frustum_corners(constants, low, high)
        self.planes = np.array([*eye.planes[:4], (0.0, 1.0, 0.0, -low), (0.0, -1.0, 0.0, high)])
        edges = np.array([*(self.corners[4:] - self.corners[:4]), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
        self.edges = edges / np.linalg.norm(edges, axis=1, keepdims=True)
        self.touch = TOUCH * float(np.abs(self.corners).max())


def _reaches(group: Group, model_to_view: Float64, region: _Region) -> bool:
    """Return whether a triangle that faces the eye, or a line or point, reaches into the region."""
    planes = region.planes @ model_to_view.T  # in model space, where vertices are
    for corners in corners_near(group.geom, planes, region.touch):
        seen = corners @ model_to_view[:3, :3] + model_to_view[3, :3]
        if group.geom.mode == "triangles":
            seen = seen[_facing(seen, group, region.perspective)]
        else:  # as triangles without area
            seen = seen[:, np.minimum((0, 1, 2), seen.shape[1] - 1)]
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


class Extent(NamedTuple):
    """The size of the geometry in view.

    `name` is of the Geom that reaches farthest from the eye, empty if none is in view or all are of ordinary
    size. `size` is its largest coordinate in view space, 0 if none is in view, a bound if all are of ordinary
    size. `wide` are names of the Geoms that have triangles too wide for a rasterizer.
    """

    name: str
    size: float
    wide: tuple[str, ...]


def find_extent(seen: Visible, planes: Float64, lens: LensConstants, near: float) -> Extent:
    """Return the extent of the geometry in view, within `planes` as `Lens.frustum_planes` gives them.

    Geometry before the near plane is clipped first, however wide it is.
    """
    if _is_ordinary(seen, lens, near):  # nearly always: boxes take longer than spheres
        return Extent("", float((np.abs(seen.centers).max(axis=1) + seen.radii).max()), ())
    sizes = ((float(np.abs(part.box).max()), part.group.geom.name) for part in seen.parts)
    size, name = max(sizes, default=(0.0, ""))
    wide = [part.group.geom.name for part in seen.parts if _is_wide(part, planes, lens, near)]
    return Extent(name, size, tuple(dict.fromkeys(wide)))


def extent_warnings(
    extent: Extent, sets: Sequence[LightSet], view: View, farthest: float, maps: Iterable[ShadowMap]
) -> Iterator[str]:
    """Yield a line for each quantity that float32 does not hold.

    `farthest` is of all geometry in view, along the view axis; `maps` are the shadow maps.
    """
    name, size, wide = extent
    placed = [lights for lights in sets if lights.kind != "directional" and len(lights)]
    if size > ENDLESS:
        yield (
            f"geom {name!r} reaches {size:.1g} units from the eye, and float32 holds positions up to "
            f"{ENDLESS:g}: parts of it are not drawn; scale the scene down"
        )
    elif size > LARGEST and any(lights.reaches.max() > LARGEST for lights in placed):
        yield (
            f"geom {name!r} reaches {size:.1g} units from the eye, and float32 holds squares of distances "
            f"up to {LARGEST:g}: lights without a max distance do not light it there; scale the scene down"
        )
    elif 0.0 < size < SMALLEST and placed:
        yield (
            f"all geometry in view lies within {size:.1g} units of the eye, and float32 holds squares of "
            f"distances accurately down to {SMALLEST:g}: light on it is wrong; scale the scene up"
        )
    if view.reverse and view.lens.perspective and view.near < DEPTHS * min(farthest, view.far):
        yield (
            f"the near plane, {view.near:g}, is less than {DEPTHS:g} of the farthest distance in view, "
            f"{farthest:.1g}: distant surfaces hide nothing behind them; move the near plane out"
        )
    if wide:
        yield (
            f"geoms {', '.join(map(repr, wide))} have triangles that reach more than {WIDEST:g} half widths "
            "of the view to a side, which lose pixels when they are clipped to it: cut them into smaller ones"
        )
    wide_casters: dict[str, dict[str, None]] = {}
    for shadow in maps:
        if shadow.wide:
            wide_casters.setdefault(shadow.light, {}).update(dict.fromkeys(shadow.wide))
    for light, names in wide_casters.items():
        yield (
            f"light {light!r}: geoms {', '.join(map(repr, names))} have triangles that reach more than "
            f"{WIDEST_CASTER:g} half widths of its shadow map's view to a side, so that light may shine "
            "through them: cut them into smaller ones"
        )


def _is_ordinary(seen: Visible, lens: LensConstants, near: float) -> bool:
    """Return whether the bounding spheres of all geometry in view are within all bounds."""
    if not len(seen.radii):
        return False
    middle = np.abs(seen.centers).max(axis=1)
    reach = middle + seen.radii
    ahead = np.maximum(near, seen.centers[:, 1] - seen.radii) if lens.perspective else 1.0
    wide = reach * max(lens.a, lens.c) > WIDEST * ahead
    return bool(middle.max() >= SMALLEST and reach.max() <= LARGEST and not wide.any())


def _is_wide(part: VisiblePart, planes: Float64, lens: LensConstants, near: float) -> bool:
    low = float(part.box[0][1])
    side = np.abs(part.box).max(axis=0)[[0, 2]] * (lens.a, lens.c)
    if side.max() <= WIDEST * (max(near, low) if lens.perspective else 1.0):
        return False  # nearly always: the rest looks at every vertex
    return has_wide(part.group.geom, part.model_to_view, planes, lens, near, WIDEST)
