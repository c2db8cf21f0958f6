"""Particle shadows of particles: how a light sees a cloud, in slices along its way, and where these lie.

Positions in it are in texels and slices: (x, y) in the tile that each slice has in one texture, and the
depth as a number of slices from the side of the light. They are float64; what is in the texture is what
particles put there, and is found in `firefly_sample.lab.reference.particle_shadow` and on the GPU alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import SceneError
from firefly_sample.plan.particles.cloud import Cloud, light_direction
from firefly_sample.plan.shadows.views import axes_along
from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.particles import BlurKernel
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]
ParticleShadowMethod = Literal["optical_depth", "blend", "loop"]

MOST_OPAQUE = 1.0 - 2.0**-24
"""Alpha of what is called opaque: its optical depth, 16.6, is finite, and lets through less than any display
shows."""
GUARD = 2
"""Texels around a cloud in its tile, besides those that a blur needs: what a lookup between texels reads."""
NEAREST = 1.001
"""Radii of a cloud: how near to its middle a spotlight may be."""


@dataclass(frozen=True, eq=False)
class ParticleShadowView:
    """How a light sees a sphere.

    Attributes
    ----------
    world_to_slices : ndarray of float64, shape (4, 4)
        For row vectors: X right, Y along the light, Z up; from the sphere's center, or the light's place.
    perspective : bool
    scale : float
        Texels for each unit across; in perspective, for each unit of slope.
    first, per_unit : float
        Depth along Y where the first slice begins, and slices for each unit.
    tile : int
        Texels across a slice.
    slices : int
    """

    world_to_slices: Float64
    perspective: bool
    scale: float
    first: float
    per_unit: float
    tile: int
    slices: int

    def place(self, world: Float64) -> Float64:
        """Texels across and up, and slices, of points in world space, shape (n, 3); NaN behind the light."""
        points = world @ self.world_to_slices[:3, :3] + self.world_to_slices[3, :3]
        w = np.ones(len(points))
        if self.perspective:
            w = np.where(points[:, 1] > 0.0, points[:, 1], np.nan)
        across = points[:, [0, 2]] / w[:, None] * self.scale + 0.5 * self.tile
        depth = (points[:, 1] - self.first) * self.per_unit
        return np.concatenate([across, depth[:, None]], axis=1)

    def radii(self, world: Float64, radii: Float64) -> Float64:
        """Radii in texels of discs that face the light at points in world space, shape (n,)."""
        if not self.perspective:
            return radii * self.scale
        depth = world @ self.world_to_slices[:3, 1] + self.world_to_slices[3, 1]
        return np.asarray(radii * self.scale / np.where(depth > 0.0, depth, np.nan))


@dataclass(frozen=True, eq=False)
class ParticleShadowPlan:
    """The particle shadow of one frame.

    Attributes
    ----------
    light : str
        Its name.
    method : {"optical_depth", "blend", "loop"}
    view : ParticleShadowView
    grid : (int, int)
        Tiles across and up; slice k is tile (k % across, k // across), the first one lower left.
    reads : int
        How many slices "loop" reads.
    interpolate : bool
    blur : float
        Half-width in texels.
    kernel : {"box", "gaussian"}
    tinted : bool
        Whether each colour has sums of its own.
    show : bool
        Whether the texture is drawn into the picture's corner.
    places : ndarray of float64, shape (n, 3)
        Of all particles, seen or not: texels across and up, and slices.
    radii : ndarray of float64, shape (n,)
        Texels.
    strengths : ndarray of float64, shape (n, 3)
        Optical depth, or alpha, through a particle's middle, as far as it darkens: for each colour.
    rows : ndarray of int, shape (all particles,)
        Where in these arrays a particle of the scene is; -1 where it casts no shadow.
    """

    light: str
    method: ParticleShadowMethod
    view: ParticleShadowView
    grid: tuple[int, int]
    reads: int
    interpolate: bool
    blur: float
    kernel: BlurKernel
    tinted: bool
    show: bool
    places: Float64
    radii: Float64
    strengths: Float64
    rows: NDArray[np.intp]

    @property
    def size(self) -> tuple[int, int]:
        """Of the texture, in texels."""
        return self.grid[0] * self.view.tile, self.grid[1] * self.view.tile

    def __len__(self) -> int:
        return len(self.places)


def optical_depths(alphas: Float64) -> Float64:
    """-ln(1 - alpha), finite for what is opaque."""
    return np.asarray(-np.log1p(-np.minimum(alphas, MOST_OPAQUE)))


def slice_grid(slices: int) -> tuple[int, int]:
    """Tiles across and up: as square as can be without an empty one, if that is not too long."""
    high = next(rows for rows in range(math.isqrt(slices), 0, -1) if slices % rows == 0)
    if slices // high <= 4 * high:
        return slices // high, high
    across = math.ceil(math.sqrt(slices))
    return across, math.ceil(slices / across)


def particle_shadow_view(
    kind: Literal["directional", "spot"],
    light: str,
    place: Float64,
    direction: Float64,
    center: Float64,
    radius: float,
    slices: int,
    tile: int,
    blur: float,
) -> ParticleShadowView:
    """Fit a light's view to a sphere, with room for the blur around it.

    Parameters
    ----------
    light : str
        Its name, for messages.
    place, direction : ndarray of float64, shape (3,)
        World space; a spotlight looks at the sphere wherever it shines.
    center, radius : ndarray of shape (3,), float
        Of the sphere, world space.

    Raises
    ------
    SceneError
        If the tile has no room, or a spotlight is within the sphere.
    """
    guard = GUARD + math.ceil(blur)
    inner = tile - 2 * guard
    if inner < 8:
        raise SceneError(
            f"particle shadow of light {light!r}: a blur of {blur:g} leaves {max(inner, 0)} texels of a "
            f"slice's {tile}: choose a smaller blur, or a particle_shadow_tile of {8 + 2 * guard} or more"
        )
    radius = max(radius, 1e-30)
    matrix = np.eye(4)
    if kind == "directional":
        matrix[:3, :3] = axes_along(direction).T
        matrix[3, :3] = -center @ matrix[:3, :3]
        return ParticleShadowView(
            matrix, False, 0.5 * inner / radius, -radius, 0.5 * slices / radius, tile, slices
        )
    distance = float(np.linalg.norm(center - place))
    if distance < NEAREST * radius:
        raise SceneError(
            f"particle shadow of light {light!r}: the light is within the particles' bounding sphere of radius "
            f"{radius:g}, {distance:g} from its middle: move it out, or give a smaller bounding sphere"
        )
    matrix[:3, :3] = axes_along((center - place) / distance).T
    matrix[3, :3] = -place @ matrix[:3, :3]
    slope = radius / math.sqrt(distance**2 - radius**2)
    first, per_unit = distance - radius, 0.5 * slices / radius
    return ParticleShadowView(matrix, True, 0.5 * inner / slope, first, per_unit, tile, slices)


def plan_particle_shadow(cloud: Cloud, settings: Settings) -> ParticleShadowPlan | None:
    """The particle shadow of a cloud; None without one.

    Raises
    ------
    SceneError
        As `particle_shadow_view`.
    """
    shadow, net = cloud.shadow, cloud.shadow_net
    if shadow is None or net is None or not cloud.casts.any() or settings.particle_shadows == "none":
        return None
    method: ParticleShadowMethod = settings.particle_shadows
    light, place = shadow.light, net[3, :3]
    kind: Literal["directional", "spot"] = "directional" if isinstance(light, DirectionalLight) else "spot"
    slices = settings.particle_shadow_slices
    view = particle_shadow_view(
        kind,
        light.name,
        place,
        light_direction(light, net),
        *cloud.sphere,
        slices,
        settings.particle_shadow_tile,
        shadow.blur,
    )
    # what is behind a spotlight is no part of it, nor of the cloud's sphere
    places = view.place(cloud.positions)
    chosen = cloud.casts & np.isfinite(places).all(axis=1)
    positions, alphas = cloud.positions[chosen], cloud.alphas[chosen, None]
    tints = cloud.tints[chosen, None]
    taken = alphas * (1.0 - tints * cloud.colors[chosen])  # of each colour
    places = places[chosen]
    # a shader has depths in float32, and must find a particle in the slice into which it was put
    places[:, 2] = places[:, 2].astype(np.float32)
    strengths = optical_depths(taken) if method == "optical_depth" else taken
    return ParticleShadowPlan(
        light=light.name,
        method=method,
        view=view,
        grid=slice_grid(slices),
        reads=min(settings.particle_shadow_reads or slices, slices),
        interpolate=shadow.interpolate and settings.particle_shadow_interpolation,
        blur=shadow.blur,
        kernel=shadow.kernel,
        tinted=bool(tints.any()),
        show=shadow.show_texture,
        places=places,
        radii=view.radii(positions, cloud.radii[chosen]),
        strengths=strengths * cloud.darkness[chosen, None],
        rows=np.where(chosen, np.cumsum(chosen) - 1, -1),
    )
