"""All particles of a scene at one time, world space, and the light that they take shadows from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import SceneError
from firefly_sample.plan.collect import Snapshot
from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.particles import ParticleNode, ShadowLight, VolumeShadow

__all__ = ["Cloud", "gather_particles", "lengths", "light_direction"]

Float64 = NDArray[np.float64]


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
        return center, float((lengths(positions - center) + radii).max())
    center, radius = np.array(given[0]) @ net[:3, :3] + net[3, :3], given[1]
    ends = lengths(positions - center) + radii
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


def light_direction(light: PandaNode, net: Float64) -> Float64:
    """Where a light shines, a unit vector in world space."""
    own = light.get_direction() if isinstance(light, DirectionalLight) else np.array([0.0, 1.0, 0.0])
    direction = own @ net[:3, :3]
    length = float(np.linalg.norm(direction))
    if not (np.isfinite(length) and length > 0.0):
        raise SceneError(f"light {light.name!r}: its net transform leaves it no direction to shine in")
    return np.asarray(direction / length)


def lengths(vectors: Float64) -> Float64:
    """Of vectors, shape (n, 3)."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))
