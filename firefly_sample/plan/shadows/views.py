"""Fit the views of shadow maps: each map's lens and its light's position and axes.

A map's view follows the light and the camera only in steps, so that it stays the same while the camera moves
a little, and the map that was drawn for an earlier frame can be kept.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from firefly_sample.plan.instances import Instances
from firefly_sample.plan.view import Eye
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lens_base import Lens

BORDER = 3
"""Texels around the used part of a map, so that lookups of a filter 4 texels wide stay in its tile."""
FACES = (
    ("+x", (1.0, 0.0, 0.0)),
    ("-x", (-1.0, 0.0, 0.0)),
    ("+y", (0.0, 1.0, 0.0)),
    ("-y", (0.0, -1.0, 0.0)),
    ("+z", (0.0, 0.0, 1.0)),
    ("-z", (0.0, 0.0, -1.0)),
)
"""The six views of a point light, in world space, in the order in which the shader counts them."""
WIDEST_MAP = 60.0
"""Degrees: a spotlight of a wider half-angle has six maps, since one would be coarse in its middle."""
NEAREST, NEAREST_STANDARD = 1e-9, 1e-4
"""Near plane of a map, reversed and standard depth, as a share of the light's reach or, if that is less, of
the distance to the far side of the scene. Geometry nearer to the light may cast no shadow. Reversed depth is
equally accurate for any such share, standard depth is not."""
STEP = 20
"""Powers of two in which reversed depth's near plane moves, so that it hardly ever does."""


@dataclass(frozen=True, eq=False)
class Sight:
    """The part of the scene that the camera sees.

    Geometry in view lies between two finite distances along the view axis; `receivers` is all geometry that
    this camera may come to see.
    """

    eye: Eye
    nearest: float
    farthest: float
    receivers: Instances

    @cached_property
    def corners(self) -> Float64:
        """The eight corners of this part in world space, shape (8, 3): near ones first."""
        return self._to_world(self._slice(self.nearest, self.farthest))

    def sphere(self, distance: float) -> tuple[Float64, float]:
        """Return center and radius, in world space, of a sphere around this part up to a distance.

        It is the smaller one of two: around the view between two distances that change in steps, so that the
        radius stays when the camera moves; and around all geometry.
        """
        lens = self.eye.lens
        near, far = lens.get_near(), min(lens.get_far(), distance)
        if lens.is_perspective():
            near = max(near, 2.0 ** (math.floor(2.0 * math.log2(self.nearest)) / 2.0))
            far = min(far, 2.0 ** (math.ceil(2.0 * math.log2(self.farthest)) / 2.0))
        corners = self._slice(min(near, far), far)
        ends = corners[:4].mean(axis=0), corners[4:].mean(axis=0)
        centers = np.linspace(0.0, 1.0, 65)[:, None] * (ends[1] - ends[0]) + ends[0]
        radii = np.linalg.norm(corners[None] - centers[:, None], axis=2).max(axis=1)
        best = int(np.argmin(radii))
        center, radius = self.receivers.sphere
        if radius <= radii[best]:
            return center, radius
        return self._to_world(centers[best]), float(radii[best])

    def _slice(self, near: float, far: float) -> Float64:
        """Return the view-space corners of the view between two distances."""
        x, y = np.array([-1.0, -1.0, 1.0, 1.0]), np.array([-1.0, 1.0, -1.0, 1.0])
        constants = self.eye.lens.constants()
        return np.concatenate([constants.view_from_distance(x, y, np.full(4, d)) for d in (near, far)])

    def _to_world(self, positions: Float64) -> Float64:
        matrix = self.eye.camera.view_to_world
        return np.asarray(positions @ matrix[:3, :3] + matrix[3, :3])


@dataclass(frozen=True, eq=False)
class ShadowView:
    """One shadow map's view: its face, if there are six, its lens, and a matrix, for row vectors.

    The light looks along +Y.
    """

    name: str
    lens: Lens
    world_to_light: Float64


def axes_along(direction: Float64) -> Float64:
    """Return right, forward and up (rows) of a view along a unit vector, with up near +Z, else +Y."""
    up = np.array([0.0, 0.0, 1.0]) if abs(direction[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    right = np.cross(direction, up)
    right /= np.linalg.norm(right)
    return np.array([right, direction, np.cross(right, direction)])


def world_to_axes(axes: Float64, origin: Float64) -> Float64:
    """Return the matrix, shape (4, 4), from world space to axes (rows) with an origin in world space."""
    matrix = np.eye(4)
    matrix[:3, :3] = axes.T
    matrix[3, :3] = -origin @ axes.T
    return matrix


def _perspective(half_angle: float, resolution: int, near: float) -> PerspectiveLens:
    """Return a lens that leaves the border around a cone of this half-angle in degrees."""
    tangent = math.tan(math.radians(half_angle)) * resolution / (resolution - 2 * BORDER)
    return PerspectiveLens(fov=2.0 * math.degrees(math.atan(tangent)), near=near, far=math.inf)


def near_plane(position: Float64, reach: float, casters: Instances, reverse: bool) -> float:
    """Return the near distance of a light's maps: a power of two, with reversed depth in large steps."""
    center, radius = casters.sphere
    end = min(reach, float(np.linalg.norm(center - position)) + radius)
    share, step = (NEAREST, STEP) if reverse else (NEAREST_STANDARD, 1)
    return 2.0 ** (step * math.floor(math.log2(max(share * end, 1e-20)) / step))


def cube_views(position: Float64, near: float, resolution: int) -> list[ShadowView]:
    """Return six views around a position, along the world's axes."""
    lens = _perspective(45.0, resolution, near)
    return [
        ShadowView(name, lens, world_to_axes(axes_along(np.array(axis)), position)) for name, axis in FACES
    ]


def spot_views(
    position: Float64, direction: Float64, half_angle: float, near: float, resolution: int
) -> list[ShadowView]:
    """Return the view of a spotlight of a half-angle in degrees, or six if it is too wide for one."""
    if half_angle > WIDEST_MAP:
        return cube_views(position, near, resolution)
    lens = _perspective(half_angle, resolution, near)
    return [ShadowView("", lens, world_to_axes(axes_along(direction), position))]


def sun_view(
    direction: Float64, distance: float, sight: Sight, resolution: int, casters: Instances
) -> ShadowView:
    """Return the view of a directional light, fitted to the camera's view up to a distance.

    It is a square as wide as the sphere around that view, with a margin, so that it can stay while the camera
    moves a little; then it moves by whole texels, so that shadow edges do not crawl. It begins at the first
    geometry in the light's path.
    """
    center, radius = sight.sphere(distance)
    axes = axes_along(direction)
    inner = resolution - 2 * BORDER
    wanted = max(radius, 1e-30) * (1.0 + 1.0 / 16.0 + 2.0 / inner)
    half = 2.0 ** (math.ceil(4.0 * math.log2(wanted)) / 4.0)
    texel = 2.0 * half / inner
    step = max(1, math.floor(half / 16.0 / texel)) * texel
    x, y, z = axes @ center
    origin = np.array([round(x / step) * step, round(y / half) * half, round(z / step) * step])
    centers = casters.centers @ axes.T - origin
    reach = half + casters.radii
    column = (np.abs(centers[:, 0]) <= reach) & (np.abs(centers[:, 2]) <= reach)
    near, far = -half, half
    if column.any():
        near = float((centers[column, 1] - casters.radii[column]).min())
        far = float((centers[column, 1] + casters.radii[column]).max())
    grow = 0.01 * (far - near) + texel
    side = texel * resolution
    lens = OrthographicLens(film_size=(side, side), near=near - grow, far=far + grow)
    return ShadowView("", lens, world_to_axes(axes, origin @ axes))
