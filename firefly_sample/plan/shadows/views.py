"""How a light looks at the scene: the lens and the place of each of its shadow maps.

A map's view depends on the light and on what the camera sees only in steps, so that it stays the same while
the camera moves a little, and what was drawn for it can be kept.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.lens_orthographic import OrthographicLens

Float64 = NDArray[np.float64]

BORDER = 3
"""Texels around what a map is for, so that the lookups of a filter 4 texels wide stay in its tile."""
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
"""Degrees: a spotlight of a wider half-angle has six maps, for one would be coarse in its middle."""
NEAREST, NEAREST_STANDARD = 1e-9, 1e-4
"""Of how far a light reaches, or the scene if that is less: what is nearer casts no shadow, or, with reversed
depth, may cast none. Reversed depth is as exact for any such number, standard depth is not."""
STEP = 20
"""Powers of two by which reversed depth's begin goes, so that it hardly ever does."""


@dataclass(frozen=True, eq=False)
class Spheres:
    """Bounding spheres of everything that may cast a shadow: centers (n, 3) in world space, radii (n,)."""

    centers: Float64
    radii: Float64

    @cached_property
    def around(self) -> tuple[Float64, float]:
        """Center and radius of a sphere around all of them; radius 0 where there are none."""
        if not len(self.radii):
            return np.zeros(3), 0.0
        low = (self.centers - self.radii[:, None]).min(axis=0)
        high = (self.centers + self.radii[:, None]).max(axis=0)
        return 0.5 * (low + high), float(0.5 * np.linalg.norm(high - low))


@dataclass(frozen=True, eq=False)
class Sight:
    """What the camera sees.

    Attributes
    ----------
    view_to_world : ndarray of float64, shape (4, 4)
    lens : Lens
    nearest, farthest : float
        Distances along the view axis between which there is geometry in view; finite.
    receivers : Spheres
        All geometry that this camera may come to see.
    """

    view_to_world: Float64
    lens: Lens
    nearest: float
    farthest: float
    receivers: Spheres

    @cached_property
    def corners(self) -> Float64:
        """The eight corners of what is seen, world space, shape (8, 3): near ones first."""
        return (
            self._slice(self.nearest, self.farthest) @ self.view_to_world[:3, :3] + self.view_to_world[3, :3]
        )

    def _slice(self, near: float, far: float) -> Float64:
        x, y = np.array([-1.0, -1.0, 1.0, 1.0]), np.array([-1.0, 1.0, -1.0, 1.0])
        constants = self.lens.constants()
        return np.concatenate([constants.view_from_distance(x, y, np.full(4, d)) for d in (near, far)])

    def sphere(self, distance: float) -> tuple[Float64, float]:
        """Center and radius, in world space, of a sphere around what is seen up to a distance.

        The smaller one of two: around the view between two distances that go in steps, so that the radius
        stays when the camera moves; and around all geometry.
        """
        near, far = self.lens.get_near(), min(self.lens.get_far(), distance)
        if self.lens.is_perspective():
            near = max(near, 2.0 ** (math.floor(2.0 * math.log2(self.nearest)) / 2.0))
            far = min(far, 2.0 ** (math.ceil(2.0 * math.log2(self.farthest)) / 2.0))
        corners = self._slice(min(near, far), far)
        ends = corners[:4].mean(axis=0), corners[4:].mean(axis=0)
        places = np.linspace(0.0, 1.0, 65)[:, None] * (ends[1] - ends[0]) + ends[0]
        radii = np.linalg.norm(corners[None] - places[:, None], axis=2).max(axis=1)
        best = int(np.argmin(radii))
        center, radius = self.receivers.around
        if radius <= radii[best]:
            return center, radius
        return places[best] @ self.view_to_world[:3, :3] + self.view_to_world[3, :3], float(radii[best])


@dataclass(frozen=True, eq=False)
class LightView:
    """One map's view.

    Attributes
    ----------
    name : str
        Which of six, empty for the only one.
    lens : Lens
    world_to_light : ndarray of float64, shape (4, 4)
        For row vectors; the light looks along +Y.
    """

    name: str
    lens: Lens
    world_to_light: Float64


def axes_along(direction: Float64) -> Float64:
    """Right, forward and up (rows) of a view along a unit vector; up is as near to +Z (or +Y) as can be."""
    up = np.array([0.0, 0.0, 1.0]) if abs(direction[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    right = np.cross(direction, up)
    right /= np.linalg.norm(right)
    return np.array([right, direction, np.cross(right, direction)])


def _world_to_light(axes: Float64, place: Float64) -> Float64:
    matrix = np.eye(4)
    matrix[:3, :3] = axes.T
    matrix[3, :3] = -place @ axes.T
    return matrix


def _perspective(half_angle: float, resolution: int, near: float) -> PerspectiveLens:
    """A lens that leaves the border around a cone of this half-angle in degrees."""
    tangent = math.tan(math.radians(half_angle)) * resolution / (resolution - 2 * BORDER)
    return PerspectiveLens(fov=2.0 * math.degrees(math.atan(tangent)), near=near, far=math.inf)


def nearest_caster(place: Float64, reach: float, casters: Spheres, reverse: bool) -> float:
    """Where a light that reaches so far begins to see: a power of two, reversed depth's in large steps."""
    center, radius = casters.around
    end = min(reach, float(np.linalg.norm(center - place)) + radius)
    share, step = (NEAREST, STEP) if reverse else (NEAREST_STANDARD, 1)
    return 2.0 ** (step * math.floor(math.log2(max(share * end, 1e-20)) / step))


def cube_views(place: Float64, near: float, resolution: int) -> list[LightView]:
    """Six views around a place, along the world's axes."""
    lens = _perspective(45.0, resolution, near)
    return [LightView(name, lens, _world_to_light(axes_along(np.array(axis)), place)) for name, axis in FACES]


def spot_views(
    place: Float64, direction: Float64, half_angle: float, near: float, resolution: int
) -> list[LightView]:
    """The view of a spotlight of a half-angle in degrees, or six where it is too wide for one."""
    if half_angle > WIDEST_MAP:
        return cube_views(place, near, resolution)
    lens = _perspective(half_angle, resolution, near)
    return [LightView("", lens, _world_to_light(axes_along(direction), place))]


def sun_view(
    direction: Float64, distance: float, sight: Sight, resolution: int, casters: Spheres
) -> LightView:
    """The view of a directional light, fitted to what the camera sees up to a distance.

    It is a square as wide as the sphere around what is seen, and some more, so that it can stand still while
    the camera moves; when it must move, it does so by whole texels, so that no shadow's edge crawls. It
    begins where the first thing stands in the light's way.
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
    places = casters.centers @ axes.T - origin
    reach = half + casters.radii
    column = (np.abs(places[:, 0]) <= reach) & (np.abs(places[:, 2]) <= reach)
    near, far = -half, half
    if column.any():
        near = float((places[column, 1] - casters.radii[column]).min())
        far = float((places[column, 1] + casters.radii[column]).max())
    grow = 0.01 * (far - near) + texel
    side = texel * resolution
    lens = OrthographicLens(film_size=(side, side), near=near - grow, far=far + grow)
    return LightView("", lens, _world_to_light(axes, origin @ axes))
