"""All particles of a scene at one time, world space, and the light that they take shadows from."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import SceneError
from firefly_sample.plan.collect import Snapshot
from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.particles import ParticleNode, ParticleShadow, ShadowLight

Float64 = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Cloud:
    """All particles of a scene at one time, world space.

    Attributes
    ----------
    positions, colors : ndarray of float64, shape (n, 3)
    radii, alphas, darkness, tints : ndarray of float64, shape (n,)
    named : ndarray of bool, shape (n,)
        Whether a particle names the light: it fades on these.
    casts : ndarray of bool, shape (n,)
        Whether it casts and receives shadows.
    shadow : ParticleShadow or None
        How, but for what is the particles' own: darkness, tint, and whether they are enabled.
    shadow_net : ndarray of float64, shape (4, 4), or None
        Where that light is; None if it is not seen in the scene.
    sphere : (ndarray of shape (3,), float)
        Center and radius of what casts shadows, given or found.
    outside : tuple of (str, int, float)
        Names of nodes, how many of their particles leave that sphere, and what radius would hold them.
    """

    positions: Float64
    radii: Float64
    alphas: Float64
    colors: Float64
    darkness: Float64
    tints: Float64
    named: NDArray[np.bool_]
    casts: NDArray[np.bool_]
    shadow: ParticleShadow | None
    shadow_net: Float64 | None
    sphere: tuple[Float64, float]
    outside: tuple[tuple[str, int, float], ...]

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
    casting: list[tuple[str, Float64, Float64]] = []
    shadow: ParticleShadow | None = None
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
            shadow, owner = _agreed(shadow, owner, own, node.name), node.name
            if own.enabled:
                spheres.append(_sphere(node, net, positions, radii))
                casting.append((node.name, positions, radii))
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
                np.full(count, own is not None and own.enabled),
            )
        )
    if not parts:
        return None
    positions, radii, alphas, colors, darkness, tints, named, casts = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    sphere = _around(spheres)
    return Cloud(
        positions,
        radii,
        alphas,
        colors,
        darkness,
        tints,
        np.asarray(named, dtype=np.bool_),
        np.asarray(casts, dtype=np.bool_),
        shadow,
        None if shadow is None else _net_of(shadow.light, snapshot),
        sphere,
        tuple(_outside(sphere, casting)),
    )


def _agreed(before: ParticleShadow | None, owner: str, own: ParticleShadow, name: str) -> ParticleShadow:
    """What two nodes' shadows have in common."""
    shown = own.show_texture or (before is not None and before.show_texture)
    shared = replace(own, darkness=1.0, tint=0.0, enabled=True, show_texture=shown)
    if before is not None:
        differing = [
            field.name
            for field in fields(ParticleShadow)
            if field.name != "show_texture" and getattr(before, field.name) != getattr(shared, field.name)
        ]
        if differing:
            raise SceneError(
                f"particles {owner!r} and {name!r} have different particle shadows, and a frame has one: "
                f"give them the same {', '.join(differing)}"
            )
    return shared


def _net_of(light: ShadowLight, snapshot: Snapshot) -> Float64 | None:
    nets = [net for node, net in snapshot.lights if node is light]
    if len(nets) > 1:
        raise SceneError(
            f"light {light.name!r}, which particles take shadows from, is {len(nets)} times in the scene: "
            "give them a light of their own"
        )
    return nets[0] if nets else None


def _sphere(node: ParticleNode, net: Float64, positions: Float64, radii: Float64) -> tuple[Float64, float]:
    """The sphere that holds a node's particles, as it says or as found."""
    given = node.get_bounding_sphere()
    if given is None:
        low, high = (positions - radii[:, None]).min(axis=0), (positions + radii[:, None]).max(axis=0)
        center = 0.5 * (low + high)
        return center, float((lengths(positions - center) + radii).max())
    return np.array(given[0]) @ net[:3, :3] + net[3, :3], given[1]


def _outside(
    sphere: tuple[Float64, float], casting: Sequence[tuple[str, Float64, Float64]]
) -> Iterator[tuple[str, int, float]]:
    """What of each node leaves a sphere: its name, how many particles, and how far they go."""
    center, radius = sphere
    for name, positions, radii in casting:
        ends = lengths(positions - center) + radii
        leaving = int(np.count_nonzero(ends > radius * (1.0 + 1e-9)))
        if leaving:
            yield name, leaving, float(ends.max())


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
