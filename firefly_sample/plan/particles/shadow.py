"""Plan the shadows of particles: slices along the light, their tiles in one texture, and the discs in them.

Positions in the slices are in texels and slices: (x, y) in the tile that each slice has in the texture, and
the depth as a number of slices from the side of the light. They are float64. The GPU and
`firefly_sample.lab.reference.particles` draw the discs and look the shadows up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import SceneError
from firefly_sample.plan.lights.light_set import light_direction
from firefly_sample.plan.particles.cloud import Cloud
from firefly_sample.plan.shadows.views import axes_along, world_to_axes
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.particles import BlurKernel, ParticleShadow
from firefly_sample.settings import Settings

ParticleShadowMethod = Literal["optical_depth", "blend", "loop"]

MOST_OPAQUE = 1.0 - 2.0**-24
"""The alpha of opaque particles: their optical depth, 16.6, is finite, and no display shows the light that is
left."""
GUARD = 2
"""Texels around a cloud in its tile, in addition to those of the blur: an interpolating lookup reads them."""
NEAREST = 1.001
"""Least distance of a spotlight from a cloud's middle, in radii of the cloud."""
SMALLEST_SPLAT = 1.5
"""Least radius in texels of a disc in a slice."""


@dataclass(frozen=True, eq=False)
class ParticleShadowView:
    """A light's view of a sphere, cut into slices.

    The axes are X right, Y along the light, Z up; the origin is the sphere's center, in perspective the
    light's position.
    """

    world_to_slices: Float64  # (4, 4), for row vectors
    perspective: bool
    scale: float  # texels per unit across; in perspective, per unit of slope
    first: float  # depth along Y where the first slice begins
    per_unit: float  # slices per unit
    tile: int  # texels across a slice
    slices: int

    def to_slices(self, world: Float64) -> Float64:
        """Return texels across and up, and slices, of points in world space, shape (n, 3).

        They are NaN for points behind the light.
        """
        points = world @ self.world_to_slices[:3, :3] + self.world_to_slices[3, :3]
        w = np.ones(len(points))
        if self.perspective:
            w = np.where(points[:, 1] > 0.0, points[:, 1], np.nan)
        across = points[:, [0, 2]] / w[:, None] * self.scale + 0.5 * self.tile
        depth = (points[:, 1] - self.first) * self.per_unit
        return np.concatenate([across, depth[:, None]], axis=1)

    def radii(self, world: Float64, radii: Float64) -> Float64:
        """Return radii in texels of discs that face the light at points in world space, shape (n,)."""
        if not self.perspective:
            return radii * self.scale
        depth = world @ self.world_to_slices[:3, 1] + self.world_to_slices[3, 1]
        return np.asarray(radii * self.scale / np.where(depth > 0.0, depth, np.nan))


@dataclass(frozen=True, eq=False)
class ParticleShadowPlan:
    """The shadows of particles in one frame, of all that cast any, seen or not."""

    light: str  # its name
    method: ParticleShadowMethod
    view: ParticleShadowView
    grid: tuple[int, int]  # tiles across and up, from the lower left: slice k is (k % across, k // across)
    reads: int  # slices that the method "loop" reads
    interpolate: bool
    blur: float  # half-width in texels
    kernel: BlurKernel
    tinted: bool  # True if each colour has sums of its own
    show: bool  # True if the texture is drawn into the picture's corner
    positions: Float64  # (n, 3), texels across and up, and slices
    radii: Float64  # (n,), texels
    strengths: Float64  # (n, 3), optical depth or alpha through the middle, times darkness, for each colour
    rows: NDArray[np.intp]  # (all particles,), each one's index into these arrays; -1 if it casts no shadow

    @property
    def size(self) -> tuple[int, int]:
        """Of the texture, in texels."""
        return self.grid[0] * self.view.tile, self.grid[1] * self.view.tile

    def __len__(self) -> int:
        return len(self.positions)


def plan_particle_shadow(cloud: Cloud, settings: Settings) -> ParticleShadowPlan | None:
    """Return the shadows of a cloud's particles; None if they cast none.

    It is a `SceneError` if a slice's tile has no room, or a spotlight is within the cloud's bounding sphere.
    """
    shadow, net = cloud.shadow, cloud.shadow_net
    if shadow is None or net is None or not cloud.casts.any() or settings.particle_shadows == "none":
        return None
    method: ParticleShadowMethod = settings.particle_shadows
    slices = settings.particle_shadow_slices
    view = _fit_view(cloud, shadow, net, slices, settings.particle_shadow_tile)
    # behind a spotlight there is no shadow
    positions = view.to_slices(cloud.positions)
    chosen = cloud.casts & np.isfinite(positions).all(axis=1)
    alphas, tints = cloud.alphas[chosen, None], cloud.tints[chosen, None]
    taken = alphas * (1.0 - tints * cloud.colors[chosen])  # of each colour
    positions = positions[chosen]
    # a shader has depths in float32, and must find a particle in the slice into which it was put
    positions[:, 2] = positions[:, 2].astype(np.float32)
    strengths = optical_depths(taken) if method == "optical_depth" else taken
    return ParticleShadowPlan(
        light=shadow.light.name,
        method=method,
        view=view,
        grid=slice_grid(slices),
        reads=min(settings.particle_shadow_reads or slices, slices),
        interpolate=shadow.interpolate and settings.particle_shadow_interpolation,
        blur=shadow.blur,
        kernel=shadow.kernel,
        tinted=bool(tints.any()),
        show=shadow.show_texture,
        positions=positions,
        radii=view.radii(cloud.positions[chosen], cloud.radii[chosen]),
        strengths=strengths * cloud.darkness[chosen, None],
        rows=np.where(chosen, np.cumsum(chosen) - 1, -1),
    )


def _fit_view(
    cloud: Cloud, shadow: ParticleShadow, net: Float64, slices: int, tile: int
) -> ParticleShadowView:
    """Return the light's view of a cloud's sphere, with room for the blur; a spotlight faces its center."""
    light, blur = shadow.light, shadow.blur
    center, radius = cloud.sphere[0], max(cloud.sphere[1], 1e-30)
    guard = GUARD + math.ceil(blur)
    inner = tile - 2 * guard
    if inner < 8:
        raise SceneError(
            f"particle shadow of light {light.name!r}: a blur of {blur:g} leaves {max(inner, 0)} texels of a "
            f"slice's {tile}: choose a smaller blur, or a particle_shadow_tile of {8 + 2 * guard} or more"
        )
    per_unit = 0.5 * slices / radius
    if isinstance(light, DirectionalLight):
        matrix = world_to_axes(axes_along(light_direction(light, net)), center)
        return ParticleShadowView(matrix, False, 0.5 * inner / radius, -radius, per_unit, tile, slices)
    position = net[3, :3]
    distance = float(np.linalg.norm(center - position))
    if distance < NEAREST * radius:
        raise SceneError(
            f"particle shadow of light {light.name!r}: the light is within the particles' bounding sphere of "
            f"radius {radius:g}, {distance:g} from its middle: move it out, or give a smaller bounding sphere"
        )
    matrix = world_to_axes(axes_along((center - position) / distance), position)
    slope = radius / math.sqrt(distance**2 - radius**2)
    return ParticleShadowView(matrix, True, 0.5 * inner / slope, distance - radius, per_unit, tile, slices)


def optical_depths(alphas: Float64) -> Float64:
    """Return -ln(1 - alpha), finite for opaque particles too."""
    return np.asarray(-np.log1p(-np.minimum(alphas, MOST_OPAQUE)))


def slice_grid(slices: int) -> tuple[int, int]:
    """Return tiles across and up: as square as possible without an empty one, if that is not too long."""
    high = next(rows for rows in range(math.isqrt(slices), 0, -1) if slices % rows == 0)
    if slices // high <= 4 * high:
        return slices // high, high
    across = math.ceil(math.sqrt(slices))
    return across, math.ceil(slices / across)


def splats(shadow: ParticleShadowPlan) -> tuple[Float64, Float64]:
    """Return radii in texels of the discs drawn into slices, and factors of their strengths, shape (n,).

    A disc smaller than `SMALLEST_SPLAT` is enlarged to it, and its strength reduced by the ratio of areas.
    """
    radii = np.maximum(shadow.radii, SMALLEST_SPLAT)
    return radii, (shadow.radii / radii) ** 2


def own_contributions(shadow: ParticleShadowPlan) -> Float64:
    """Return a particle's own contribution to an interpolated lookup at its middle, shape (n, 3).

    It is the sum over its disc, weighted as the blur and the interpolation weight texels around the middle.
    """
    radii, factors = splats(shadow)
    # texels that the lookup reaches, up to the size of the largest disc
    reach = min(math.ceil(shadow.blur), math.ceil(float(radii.max(initial=1.0)))) + 1
    weights = np.pad(blur_weights(shadow.blur, shadow.kernel), reach + 2)
    middle = len(weights) // 2
    first = np.floor(shadow.positions[:, :2] - 0.5)
    part = shadow.positions[:, :2] - 0.5 - first
    offsets = np.arange(-reach + 1, reach + 1)  # from the texel below the middle
    near, far = weights[middle + offsets], weights[middle + offsets - 1]
    share = near * (1.0 - part[..., None]) + far * part[..., None]  # (n, 2, taps)
    squares = (offsets - part[..., None]) ** 2 / radii[:, None, None] ** 2
    found = np.zeros(len(shadow))
    for index in range(len(offsets)):
        disc = np.maximum(1.0 - squares[:, 1, index, None] - squares[:, 0], 0.0) ** 2
        found += share[:, 1, index] * (share[:, 0] * disc).sum(axis=1)
    return np.asarray(shadow.strengths * (factors * found)[:, None])


def blur_weights(blur: float, kernel: BlurKernel) -> Float64:
    """Return weights of the texels from -ceil(blur) to ceil(blur); they sum to 1."""
    reach = math.ceil(blur)
    offsets = np.abs(np.arange(-reach, reach + 1.0))
    if kernel == "gaussian" and blur > 0.0:
        weights = np.where(offsets <= blur, np.exp(-2.0 * (offsets / blur) ** 2), 0.0)
    else:
        weights = np.clip(blur + 1.0 - offsets, 0.0, 1.0)
    return np.asarray(weights / weights.sum())
