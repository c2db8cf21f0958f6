"""The particles of one frame: all of them in world space, and those in view in the order of drawing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import SceneError
from firefly_sample.plan.collect import Snapshot
from firefly_sample.plan.cull import spheres_in_frustum
from firefly_sample.plan.volume import Volume, VolumeMethod, optical_depths, slice_grid, volume_view
from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.particles import ParticleNode, ShadowLight, VolumeShadow
from firefly_sample.settings import ParticleOrder, Settings

__all__ = ["Cloud", "ParticleSet", "gather_particles", "plan_volume", "see_particles"]

Float64 = NDArray[np.float64]

ALL_SLICES = 2**32
"""Depths that an order tells apart where no number is given."""


@dataclass(frozen=True, eq=False)
class Cloud:
    """All particles of a scene at one time, world space.

    Attributes
    ----------
    positions, colors : ndarray of float64, shape (n, 3)
    radii, alphas, darkness, tints : ndarray of float64, shape (n,)
    casts : ndarray of bool, shape (n,)
        Whether a particle casts and receives shadows.
    shadow : VolumeShadow or None
        How, but for darkness and tint, which are the particles' own.
    shadow_net : ndarray of float64, shape (4, 4), or None
        Where that light is; None if it is not seen in the scene.
    sphere : (ndarray of shape (3,), float)
        Center and radius of what casts shadows, given or found.
    outside : dict of str to (int, float)
        By the names of nodes, how many particles leave a given sphere, and what radius would hold them.
    """

    positions: Float64
    radii: Float64
    alphas: Float64
    colors: Float64
    darkness: Float64
    tints: Float64
    casts: NDArray[np.bool_]
    shadow: VolumeShadow | None
    shadow_net: Float64 | None
    sphere: tuple[Float64, float]
    outside: dict[str, tuple[int, float]]

    @property
    def light(self) -> ShadowLight | None:
        """The light whose shadows there are."""
        return None if self.shadow is None or self.shadow_net is None else self.shadow.light

    def __len__(self) -> int:
        return len(self.positions)


@dataclass(frozen=True, eq=False)
class ParticleSet:
    """What the camera sees of the particles, view space.

    Attributes
    ----------
    positions, colors : ndarray of float64, shape (n, 3)
    radii, optical_depths : ndarray of float64, shape (n,)
    fades : ndarray of float64, shape (n,)
        What distance leaves of the light that they take shadows from.
    rows : ndarray of int, shape (n,)
        Their rows in `Volume`; -1 for what has no shadow.
    order : ndarray of int, shape (n + dots,)
        In which particles are drawn, and the soft dots of the same frame, whose numbers follow theirs.
    """

    positions: Float64
    radii: Float64
    optical_depths: Float64
    colors: Float64
    fades: Float64
    rows: NDArray[np.intp]
    order: NDArray[np.intp]

    def __len__(self) -> int:
        return len(self.positions)


def gather_particles(snapshot: Snapshot, time: float) -> Cloud | None:
    """All particles that can be seen at `time`; None where there is none.

    Raises
    ------
    SceneError
        If particles name several lights for their shadows, or a place is not finite.
    """
    parts: list[tuple[Float64, ...]] = []
    spheres: list[tuple[Float64, float]] = []
    outside: dict[str, tuple[int, float]] = {}
    shadow: VolumeShadow | None = None
    owner = ""
    for node, net in snapshot.particles:
        arrays = node.evaluate(time)
        positions = arrays.positions @ net[:3, :3] + net[3, :3]
        useful = np.flatnonzero((arrays.radii > 0.0) & (arrays.alphas > 0.0))
        if not len(useful):
            continue
        positions, radii = positions[useful], arrays.radii[useful]
        if not np.isfinite(positions).all() or np.abs(positions).max() > 1e30:
            raise SceneError(f"particles {node.name!r}: a place in the world is not finite, or beyond 1e30")
        own = node.get_shadow()
        if own is not None:
            if shadow is not None and _shared(own) != _shared(shadow):
                raise SceneError(
                    f"particles {owner!r} and {node.name!r} have different volume shadows, and a frame has "
                    "one: give them the same light, blur, attenuation and interpolation"
                )
            shadow, owner = own, node.name
            spheres.append(_sphere(node, net, positions, radii, outside))
        count = len(useful)
        parts.append(
            (
                positions,
                radii,
                arrays.alphas[useful],
                arrays.colors[useful],
                np.full(count, 0.0 if own is None else own.darkness),
                np.full(count, 0.0 if own is None else own.tint),
                np.full(count, own is not None),
            )
        )
    if not parts:
        return None
    positions, radii, alphas, colors, darkness, tints, casts = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    return Cloud(
        positions,
        radii,
        alphas,
        colors,
        darkness,
        tints,
        np.asarray(casts, dtype=np.bool_),
        shadow,
        None if shadow is None else _net_of(shadow.light, snapshot),
        _around(spheres),
        outside,
    )


def _shared(shadow: VolumeShadow) -> VolumeShadow:
    return replace(shadow, darkness=1.0, tint=0.0)


def _net_of(light: ShadowLight, snapshot: Snapshot) -> Float64 | None:
    nets = [net for node, net in snapshot.lights if node is light]
    if len(nets) > 1:
        raise SceneError(
            f"light {light.name!r}, which particles take shadows from, is {len(nets)} times in the scene: "
            "give them a light of their own"
        )
    return nets[0] if nets else None


def _sphere(
    node: ParticleNode,
    net: Float64,
    positions: Float64,
    radii: Float64,
    outside: dict[str, tuple[int, float]],
) -> tuple[Float64, float]:
    """The sphere that holds a node's particles, as it says or as found."""
    given = node.get_bounding_sphere()
    if given is None:
        low, high = (positions - radii[:, None]).min(axis=0), (positions + radii[:, None]).max(axis=0)
        center = 0.5 * (low + high)
        return center, float((_lengths(positions - center) + radii).max())
    center, radius = np.array(given[0]) @ net[:3, :3] + net[3, :3], given[1]
    ends = _lengths(positions - center) + radii
    leaving = int(np.count_nonzero(ends > radius * (1.0 + 1e-9)))
    if leaving:
        outside[node.name] = leaving, float(ends.max())
    return center, radius


def _around(spheres: Sequence[tuple[Float64, float]]) -> tuple[Float64, float]:
    """A sphere around some."""
    if not spheres:
        return np.zeros(3), 0.0
    if len(spheres) == 1:
        return spheres[0]
    low = np.min([center - radius for center, radius in spheres], axis=0)
    high = np.max([center + radius for center, radius in spheres], axis=0)
    middle = 0.5 * (low + high)
    return middle, max(float(np.linalg.norm(center - middle)) + radius for center, radius in spheres)


def _lengths(vectors: Float64) -> Float64:
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))


def plan_volume(cloud: Cloud, settings: Settings) -> Volume | None:
    """The volume shadow of a cloud; None without one.

    Raises
    ------
    SceneError
        As `firefly_sample.plan.volume.volume_view`.
    """
    shadow, net = cloud.shadow, cloud.shadow_net
    if shadow is None or net is None or not shadow.enabled or settings.volume_shadows == "none":
        return None
    method: VolumeMethod = settings.volume_shadows
    light, place = shadow.light, net[3, :3]
    kind: Literal["directional", "spot"] = "directional" if isinstance(light, DirectionalLight) else "spot"
    slices = settings.volume_slices
    view = volume_view(
        kind,
        light.name,
        place,
        light_direction(light, net),
        *cloud.sphere,
        slices,
        settings.volume_tile,
        shadow.blur,
    )
    # what is behind a spotlight is no part of it, nor of the cloud's sphere
    chosen = cloud.casts & np.isfinite(view.place(cloud.positions)).all(axis=1)
    positions, alphas = cloud.positions[chosen], cloud.alphas[chosen, None]
    tints = cloud.tints[chosen, None]
    taken = alphas * (1.0 - tints * cloud.colors[chosen])  # of each colour
    strengths = optical_depths(taken) if method == "optical_depth" else taken
    return Volume(
        light=light.name,
        method=method,
        view=view,
        grid=slice_grid(slices),
        reads=min(settings.volume_reads or slices, slices),
        interpolate=shadow.interpolate and settings.volume_interpolation,
        blur=shadow.blur,
        kernel=shadow.kernel,
        tinted=bool(tints.any()),
        show=shadow.show_texture,
        light_place=place @ view.world_to_volume[:3, :3] + view.world_to_volume[3, :3],
        places=view.place(positions),
        radii=view.radii(positions, cloud.radii[chosen]),
        strengths=strengths * cloud.darkness[chosen, None],
        rows=np.where(chosen, np.cumsum(chosen) - 1, -1),
    )


def light_direction(light: PandaNode, net: Float64) -> Float64:
    """Where a light shines, a unit vector in world space."""
    own = light.get_direction() if isinstance(light, DirectionalLight) else np.array([0.0, 1.0, 0.0])
    direction = own @ net[:3, :3]
    length = float(np.linalg.norm(direction))
    if not (np.isfinite(length) and length > 0.0):
        raise SceneError(f"light {light.name!r}: its net transform leaves it no direction to shine in")
    return np.asarray(direction / length)


def see_particles(
    cloud: Cloud | None,
    world_to_view: Float64,
    planes: Float64,
    dots: Float64,
    settings: Settings,
    volume: Volume | None,
) -> ParticleSet:
    """What of a cloud is in view, and in which order it is drawn.

    Parameters
    ----------
    dots : ndarray of float64, shape (m, 3)
        Places of the soft dots in view, view space: they are drawn among the particles.
    """
    if cloud is None:
        none = np.zeros(0)
        nobody = np.zeros(0, dtype=np.intp)
        return ParticleSet(np.zeros((0, 3)), none, none, np.zeros((0, 3)), none, nobody, nobody)
    positions = cloud.positions @ world_to_view[:3, :3] + world_to_view[3, :3]
    chosen = np.flatnonzero(spheres_in_frustum(planes, positions, cloud.radii))
    positions = positions[chosen]
    rows = np.full(len(cloud), -1) if volume is None else volume.rows
    axis = _axis(settings.particle_order, cloud, world_to_view)
    return ParticleSet(
        positions=positions,
        radii=cloud.radii[chosen],
        optical_depths=optical_depths(cloud.alphas[chosen]),
        colors=cloud.colors[chosen],
        fades=_fades(cloud)[chosen],
        rows=np.asarray(rows[chosen], dtype=np.intp),
        order=_order(np.concatenate([positions, dots]), axis, settings.particle_slices),
    )


def _fades(cloud: Cloud) -> Float64:
    """1 / max(distance^power, 1), of the distance from the light or from the plane through it."""
    shadow, net = cloud.shadow, cloud.shadow_net
    fades = np.ones(len(cloud))
    if shadow is None or net is None or shadow.attenuation == "none":
        return fades
    offsets = cloud.positions[cloud.casts] - net[3, :3]
    if shadow.attenuation == "plane":
        distances = np.abs(offsets @ light_direction(shadow.light, net))
    else:
        distances = _lengths(offsets)
    fades[cloud.casts] = np.maximum(distances, 1.0) ** -shadow.power
    return fades


def _axis(order: ParticleOrder, cloud: Cloud, world_to_view: Float64) -> Float64 | None:
    """Where particles are sorted along, view space; None where they are not."""
    if order == "unsorted":
        return None
    forward = np.array([0.0, 1.0, 0.0])
    if order == "view" or cloud.shadow is None or cloud.shadow_net is None:
        return forward
    light = light_direction(cloud.shadow.light, cloud.shadow_net) @ world_to_view[:3, :3]
    half = forward + (light if light[1] >= 0.0 else -light)
    return np.asarray(half / np.linalg.norm(half))


def _order(positions: Float64, axis: Float64 | None, slices: int | None) -> NDArray[np.intp]:
    """Indices from back to front by slices along an axis; within one, as they come.

    By two radix sorts, which NumPy has for 16 bits: several times as fast as by comparing numbers.
    """
    if axis is None or not len(positions):
        return np.arange(len(positions))
    depths = positions @ axis
    low, high = depths.min(), depths.max()
    count = ALL_SLICES if slices is None else slices
    share = np.minimum((high - depths) * (count / max(high - low, 1e-30)), count - 1).astype(np.uint32)
    upper = (share >> 16).astype(np.uint16)
    lower = np.argsort(share.astype(np.uint16), kind="stable")
    return np.asarray(lower[np.argsort(upper[lower], kind="stable")])
