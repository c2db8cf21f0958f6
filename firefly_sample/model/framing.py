"""Placing a camera so that a model fills the picture.

All of it happens in the axes of the camera, whose direction is given. The model is known by its support
function alone: which of its points is farthest in a direction. That is as easy for points that turn about a
vertical axis, each of which sweeps a circle, as for points that stay.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from firefly_sample.errors import SceneError
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.transform_state import TransformState
from firefly_sample.scene.transforms import rows_from_hpr
from firefly_sample.scene.traversal import iter_visible
from firefly_sample.settings import to_number

AZIMUTH, ELEVATION = 35.0, 20.0
"""The direction of a three-quarter view, in degrees: to the right of the front, and above the horizon."""
FOV = 30.0
"""The field of view in degrees across the side that the model fills."""
FILL = 0.9
"""Share of the picture's width or height that the model fills."""
CLOSEST = 0.1
"""The least distance from the eye to the model, in radii: a rod that points at the eye fills less instead."""
MARGIN = 1.02
"""Nothing is in front of a sphere around the model of this many radii; the near plane is well before it."""
SHADOW_ROOM = 4.0
"""The far plane is this many radii behind the model's centre, so that a shadow on the ground is in view."""
MOST_POINTS = 16_000_000
"""Points that are looked at one by one: they take 400 MB."""
_BOX = np.array([[corner >> axis & 1 for axis in range(3)] for corner in range(8)], dtype=bool)
_THINNEST = 1e-3
"""The least ratio of the two sides of the framed rectangle: a line has an angle of 0 across it."""


class Bounds(NamedTuple):
    """The visible points of a model in world space, and the centre of their box.

    Attributes
    ----------
    points : ndarray of float64, shape (n, 3)
        From the centre; if the model turns, (distance from the axis, 0, height), one for each circle.
    center : ndarray of float64, shape (3,)
    radius : float
        The largest distance from the centre; 0 if there is only one point.
    low : float
        The height of the lowest point.
    turns : bool
        True if the model turns about the vertical axis through the centre.
    """

    points: Float64
    center: Float64
    radius: float
    low: float
    turns: bool

    def support(self, direction: Float64) -> Float64:
        """Return the point, from the centre, that is farthest in a direction, shape (3,)."""
        if not self.turns:
            return np.asarray(self.points[np.argmax(self.points @ direction)])
        across = math.hypot(direction[0], direction[1])
        reach, _, height = self.points[np.argmax(self.points @ (across, 0.0, direction[2]))]
        x, y = (direction[:2] / across).tolist() if across > 0.0 else (1.0, 0.0)
        return np.array([x * reach, y * reach, height])


def visible_bounds(
    scene: Scene, path: NodePath | None = None, *, turns: bool = False, times: Iterable[float] = ()
) -> Bounds:
    """Return the bounds of what the scene's camera would see at and below a path; see `frame_camera`."""
    top, mask = path if path is not None else scene.root, scene.camera_node.camera_mask
    drawn: dict[tuple[int, int], Float64] = {}
    placed: dict[tuple[int, bytes], tuple[Float64, Float64]] = {}  # what does not move counts once
    for time in tuple(times) or (None,):
        if time is not None:
            scene.update(time)
        for visit in iter_visible(top, mask):
            for points in _points(visit.node, drawn):
                placed[id(points), visit.net.tobytes()] = points, visit.net
    points = _in_world(list(placed.values()))
    if not len(points):
        raise SceneError(
            f"there is nothing to frame: no visible triangles at or below {top}; place the camera yourself"
        )
    low, high = points.min(axis=0), points.max(axis=0)
    if not np.isfinite(high - low).all():
        raise SceneError(f"{top} cannot be framed: its points are not finite in world space")
    center = 0.5 * low + 0.5 * high
    points -= center
    if turns:
        points = np.stack([np.hypot(points[:, 0], points[:, 1]), np.zeros(len(points)), points[:, 2]], axis=1)
    # scaled, because squares of small numbers underflow
    largest = float(max(points.max(), -points.min()))
    radius = largest * max(map(float, _lengths(points, largest))) if largest > 0.0 else 0.0
    return Bounds(points, center, radius, float(low[2]), turns)


def _in_world(placed: list[tuple[Float64, Float64]]) -> Float64:
    """Return points, each with the matrix to world space, in one array.

    If there are more than `MOST_POINTS`, as of a mesh with very many instances, the corners of boxes stand
    for them.
    """
    if sum(len(points) for points, _ in placed) > MOST_POINTS:
        boxes: dict[int, Float64] = {}
        for points, _ in placed:
            if id(points) not in boxes:
                low, high = points.min(axis=0), points.max(axis=0)
                boxes[id(points)] = np.where(_BOX, high, low)
        placed = [(boxes[id(points)], net) for points, net in placed]
    world = np.empty((sum(len(points) for points, _ in placed), 3))
    end = 0
    with np.errstate(over="ignore", invalid="ignore"):  # the caller checks the result
        for points, net in placed:
            start, end = end, end + len(points)
            world[start:end] = points @ net[:3, :3] + net[3, :3]
    return world


def _lengths(points: Float64, unit: float) -> Iterator[np.float64]:
    """Give the largest length, in a unit, of every million points, which take no more memory than that."""
    for start in range(0, len(points), 1_000_000):
        yield np.linalg.norm(points[start : start + 1_000_000] / unit, axis=1).max()


def _points(node: PandaNode, drawn: dict[tuple[int, int], Float64]) -> list[Float64]:
    """Return a node's own points; of geoms, the vertices that are drawn, which `drawn` keeps."""
    if not isinstance(node, GeomNode):
        return node.iter_local_points()
    found = []
    for geom, _ in node.geoms:
        key = geom.serial, geom.revision
        if key not in drawn:
            marked = np.zeros(len(geom.vertices), dtype=bool)
            marked[geom.indices.ravel()] = True
            drawn[key] = geom.vertices if marked.all() else geom.vertices[marked]
        if len(drawn[key]):
            found.append(drawn[key])
    return found


def frame_camera(
    scene: Scene,
    path: NodePath | None = None,
    *,
    azimuth: float = AZIMUTH,
    elevation: float = ELEVATION,
    fov: float = FOV,
    fill: float = FILL,
    turns: bool = False,
    times: Iterable[float] = (),
) -> None:
    """Place the scene's camera so that everything visible at and below a path fills the picture.

    The camera gets a new lens, which keeps the model in view in pictures of every shape. Its near and far
    planes enclose the sphere around the model, and its shadow on a ground. `scene.focus` becomes the model's
    centre.

    Parameters
    ----------
    scene : Scene
    path : NodePath, optional
        The root of the scene when absent.
    azimuth : float
        Degrees from the front (-Y, where the front of a glTF model faces) to the right (+X).
    elevation : float
        Degrees above the horizon, -90 to 90.
    fov : float
        Degrees across the side of the picture that the model fills.
    fill : float
        Share of that side, above 0, at most 1. A model so long that the eye would be inside fills less.
    turns : bool
        Leave room for the model to turn about the vertical axis through its centre.
    times : iterable of float
        Seconds: frame the model at all of these times, for which the scene is updated. As it is when absent.

    Raises
    ------
    SceneError
        If there is nothing to frame, or a number is out of its range.
    """
    azimuth = _checked("azimuth", azimuth, -math.inf, math.inf)
    elevation = _checked("elevation", elevation, -90.0, 90.0)
    fov, fill = _checked("fov", fov, 1.0, 120.0), _checked("fill", fill, 0.01, 1.0)
    bounds = visible_bounds(scene, path, turns=turns, times=times)
    hpr = (azimuth % 360.0, -elevation, 0.0)
    # a single point has no size; it gets that of the unit sphere
    scale = bounds.radius if bounds.radius > 0.0 else 1.0
    unit = bounds._replace(points=bounds.points / scale)
    axes = np.array(rows_from_hpr(hpr))
    eye, half = _framed(unit, axes, fill * math.tan(math.radians(0.5 * fov)))
    forward = axes[1]
    ahead = -float(eye @ forward)  # from the eye to the centre, along the view axis
    nearest = ahead + float(unit.support(-forward) @ forward)
    lens = PerspectiveLens()
    lens.set_min_fov(*(2.0 * math.degrees(math.atan(side / fill)) for side in half))
    lens.set_near_far(scale * 0.2 * max(ahead - MARGIN, 0.5 * nearest), scale * (ahead + SHADOW_ROOM))
    camera = scene.camera
    scene.camera_node.lens = lens
    pos = bounds.center + scale * eye
    world = TransformState.make_pos_hpr_scale_shear(tuple(pos.tolist()), hpr, (1.0, 1.0, 1.0))
    if camera.has_parent():
        world = camera.get_parent().get_net_transform().invert_compose(world)
    camera.set_transform(world)
    scene.focus = tuple(bounds.center.tolist())


def _framed(bounds: Bounds, axes: Float64, tangent: float) -> tuple[Float64, tuple[float, float]]:
    """Return the eye, from the centre, and the tangents of the half-angles across the model.

    `axes` are the camera's right, forward and up. The larger tangent is `tangent`, unless the eye would come
    too close. Points are within tangents on both sides of the view axis, and one or more on each side are at
    them.
    """
    right, forward, up = axes

    def sides(axis: Float64, slope: float) -> tuple[Float64, Float64]:
        """Return the points that are farthest across, to each side, as seen along lines of a slope."""
        return bounds.support(axis - slope * forward), bounds.support(-axis - slope * forward)

    # The eye (x, y) sees a point (px, py) within the tangent t to both sides if px - x <= t (py - y) and
    # x - px <= t (py - y). The sum of the tightest of each kind bounds y, whatever x is.
    def farthest_forward(axis: Float64) -> float:
        high, low = sides(axis, tangent)
        across = (high - low) @ axis - tangent * ((high + low) @ forward)
        return -float(across) / (2.0 * tangent)

    closest = float(bounds.support(-forward) @ forward) - CLOSEST
    along = min(farthest_forward(right), farthest_forward(up), closest)

    def centered(axis: Float64) -> tuple[float, float]:
        """Return where the eye is along an axis, and the tangent with which it sees the model evenly.

        Newton's method from below: the width that is left over, as a function of the tangent, is convex,
        falls, and is linear between finitely many corners.
        """
        slope = 0.0
        for _ in range(100):
            high, low = sides(axis, slope)
            depths = float((high + low) @ forward) - 2.0 * along
            after = float((high - low) @ axis) / depths
            if after <= slope:
                break
            slope = after
        # halfway between the bounds of the two sides, with the distance of each
        middle = float((high + low) @ axis) - slope * float((high - low) @ forward)
        return 0.5 * middle, slope

    (x, wide), (z, tall) = centered(right), centered(up)
    least = _THINNEST * max(wide, tall) or tangent
    return x * right + along * forward + z * up, (max(wide, least), max(tall, least))


def _checked(what: str, value: float, least: float, most: float) -> float:
    given = to_number(value)
    if not (math.isfinite(given) and least <= given <= most):
        ranged = f" of {least:g} to {most:g}" if math.isfinite(most) else ""
        raise SceneError(f"{what} must be a number{ranged}, got {value!r}")
    return given
