"""Find the particles in view, and the order in which they are drawn."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.frustum import spheres_in_frustum
from firefly_sample.plan.lights.light_set import light_direction
from firefly_sample.plan.particles.cloud import Cloud, lengths
from firefly_sample.plan.particles.shadow import ParticleShadowPlan, optical_depths
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.lights import Spotlight
from firefly_sample.settings import ParticleOrder, Settings

PLANE_MARGIN = 1e-5
"""Share of the near distance, or of the planes' distance, by which discs are drawn within the planes."""


@dataclass(frozen=True, eq=False)
class ParticleSet:
    """The n particles in view, in view space."""

    positions: Float64  # (n, 3)
    drawn: Float64  # (n, 3), positions of their discs: on the near or far plane if that cuts a particle
    radii: Float64  # (n,)
    optical_depths: Float64  # (n,), through the middle, of the part between these planes
    colors: Float64  # (n, 3)
    attenuations: Float64  # (n,), with the distance from the light that casts their shadows
    rows: NDArray[np.intp]  # (n,), in `ParticleShadowPlan`; -1 for particles without a shadow
    order: NDArray[np.intp]  # (n + dots,), of drawing; the numbers of soft dots follow the particles'

    def __len__(self) -> int:
        return len(self.positions)


def see_particles(
    cloud: Cloud | None,
    world_to_view: Float64,
    lens: Lens,
    dots: Float64,
    settings: Settings,
    particle_shadow: ParticleShadowPlan | None,
) -> ParticleSet:
    """Return the particles of a cloud that are in view.

    The soft dots in view, at `dots` in view space, shape (m, 3), are drawn among them.
    """
    if cloud is None:
        vectors, numbers, indices = np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype=np.intp)
        return ParticleSet(vectors, vectors, numbers, numbers, vectors, numbers, indices, indices)
    positions = cloud.positions @ world_to_view[:3, :3] + world_to_view[3, :3]
    chosen = np.flatnonzero(spheres_in_frustum(lens.frustum_planes(), positions, cloud.radii))
    positions = positions[chosen]
    rows = np.full(len(cloud), -1, dtype=np.intp) if particle_shadow is None else particle_shadow.rows
    axis = _axis(settings.particle_order, cloud, world_to_view)
    radii = cloud.radii[chosen]
    drawn, share = _between_planes(positions, radii, lens.get_near(), lens.get_far())
    return ParticleSet(
        positions=positions,
        drawn=drawn,
        radii=radii,
        optical_depths=optical_depths(cloud.alphas[chosen]) * share,
        colors=cloud.colors[chosen],
        attenuations=_attenuations(cloud, chosen),
        rows=rows[chosen],
        order=_order(positions, dots, axis, settings.particle_order_depths),
    )


def _between_planes(positions: Float64, radii: Float64, near: float, far: float) -> tuple[Float64, Float64]:
    """Return positions moved between the planes, and the share of each sphere that lies between them."""
    y = positions[:, 1]
    share = np.clip(0.5 + 0.5 * (y - near) / radii, 0.0, 1.0)
    margin = PLANE_MARGIN * (abs(near) if math.isinf(far) else max(abs(near), PLANE_MARGIN * (far - near)))
    drawn = positions.copy()
    drawn[:, 1] = np.maximum(y, near + margin)
    if not math.isinf(far):
        share *= np.clip(0.5 + 0.5 * (far - y) / radii, 0.0, 1.0)
        drawn[:, 1] = np.minimum(drawn[:, 1], far - PLANE_MARGIN * (far - near))
    return drawn, share


def _attenuations(cloud: Cloud, chosen: NDArray[np.intp]) -> Float64:
    """Return 1 / max(distance^power, 1), of the distance from the light or from the plane through it."""
    shadow, net = cloud.shadow, cloud.shadow_net
    attenuations = np.ones(len(chosen))
    if shadow is None or net is None or shadow.attenuation == "none":
        return attenuations
    named = cloud.named[chosen]
    offsets = cloud.positions[chosen[named]] - net[3, :3]
    if shadow.attenuation == "plane":
        distances = np.abs(offsets @ light_direction(shadow.light, net))
    else:
        distances = lengths(offsets)
    attenuations[named] = np.maximum(distances, 1.0) ** -shadow.power
    return attenuations


def _axis(order: ParticleOrder, cloud: Cloud, world_to_view: Float64) -> Float64 | None:
    """Return the axis along which particles are sorted, view space; None if they are not."""
    if order == "unsorted":
        return None
    forward = np.array([0.0, 1.0, 0.0])
    if order == "view" or cloud.shadow is None or cloud.shadow_net is None:
        return forward
    light = light_direction(cloud.shadow.light, cloud.shadow_net)
    if isinstance(cloud.shadow.light, Spotlight) and cloud.sphere[1] > 0.0:
        towards = cloud.sphere[0] - cloud.shadow_net[3, :3]  # the axis of the slices
        light = towards / max(float(np.linalg.norm(towards)), 1e-300)
    light = light @ world_to_view[:3, :3]
    half = forward + (light if light[1] >= 0.0 else -light)
    return np.asarray(half / np.linalg.norm(half))


def _order(positions: Float64, dots: Float64, axis: Float64 | None, slices: int | None) -> NDArray[np.intp]:
    """Return indices of particles, then dots, from back to front along an axis.

    They are sorted by the float32 depth, or by slices between the nearest and the farthest particle, within
    which the order stays. Two radix sorts, which NumPy has for 16 bits, are several times as fast as
    comparing numbers.
    """
    both = np.concatenate([positions, dots])
    if axis is None or not len(positions):
        return np.arange(len(both))
    depths = both @ axis
    if slices is None:
        bits = (-depths).astype(np.float32).view(np.uint32)
        # the bits of floats are in order except for the sign: inverted, those of negative numbers are too
        keys = np.where(bits >> 31, ~bits, bits | np.uint32(1 << 31))
    else:
        low, high = depths[: len(positions)].min(), depths[: len(positions)].max()
        share = np.floor((high - depths) * (slices / max(high - low, 1e-30)))
        share[: len(positions)] = np.minimum(share[: len(positions)], slices - 1)
        # dots may lie in front of or behind all slices
        keys = np.clip(share + 1.0, 0.0, slices + 1.0).astype(np.uint32)
    upper = (keys >> 16).astype(np.uint16)
    lower = np.argsort(keys.astype(np.uint16), kind="stable")
    return np.asarray(lower[np.argsort(upper[lower], kind="stable")])
