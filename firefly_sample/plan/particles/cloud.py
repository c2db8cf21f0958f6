"""Gather all particles of a scene at one time, in world space, and the light that casts their shadows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import SceneError
from firefly_sample.plan.collect import Snapshot
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.particles import ParticleNode, ParticleShadow, ShadowLight


@dataclass(frozen=True, eq=False)
class Cloud:
    """All n particles of a scene at one time, world space."""

    positions: Float64  # (n, 3)
    radii: Float64  # (n,)
    alphas: Float64  # (n,)
    colors: Float64  # (n, 3)
    darkness: Float64  # (n,)
    tints: Float64  # (n,)
    named: NDArray[np.bool_]  # (n,), True if the node names the light, whose attenuation applies then
    casts: NDArray[np.bool_]  # (n,), True if the particle casts and receives shadows
    shadow: ParticleShadow | None  # shared by all particles, except darkness, tint and enabled
    shadow_net: Float64 | None  # (4, 4), the light's net transform; None if the scene does not show it
    sphere: tuple[Float64, float]  # around the particles that cast shadows, given or found: center, radius
    outside: tuple[tuple[str, int, float], ...]
    """Names of nodes whose particles leave that sphere, how many do, and the radius that would hold them."""

    @property
    def light(self) -> ShadowLight | None:
        """The light that casts the shadows; None without one."""
        return None if self.shadow is None or self.shadow_net is None else self.shadow.light

    def __len__(self) -> int:
        return len(self.positions)


def gather_particles(snapshot: Snapshot, time: float) -> Cloud | None:
    """Return all particles that can be seen at `time`; None if there are none.

    It is a `SceneError` if particles name several lights for their shadows, or a position is not finite.
    """
    parts: list[tuple[NDArray[Any], ...]] = []
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
            raise SceneError(
                f"particles {node.name!r}: positions in the world must be finite and at most 1e30 units "
                "along each axis: give the node and its parents positions and scales nearer to 1"
            )
        own, same = node.get_shadow(), (0.0, 0.0, False, False)  # for all particles of a node
        if own is not None:
            shadow, owner = _agreed(shadow, owner, own, node.name), node.name
            same = own.darkness, own.tint, True, bool(own.enabled)
            if own.enabled:
                spheres.append(_sphere(node, net, positions, radii))
                casting.append((node.name, positions, radii))
        columns = positions, radii, arrays.alphas[useful], arrays.colors[useful]
        parts.append((*columns, *(np.full(len(useful), value) for value in same)))
    if not parts:
        return None
    sphere = _around(spheres)
    shadow_net = None if shadow is None else _net_of(shadow.light, snapshot)
    values: list[Any] = [np.concatenate(column) for column in zip(*parts, strict=True)]
    values += [shadow, shadow_net, sphere, tuple(_outside(sphere, casting))]
    return Cloud(*values)


def _agreed(before: ParticleShadow | None, owner: str, own: ParticleShadow, name: str) -> ParticleShadow:
    """Return the settings that two nodes' shadows share."""
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
            f"light {light.name!r}, which casts the shadows of particles, is {len(nets)} times in the scene: "
            "give the particles a light that is there once"
        )
    return nets[0] if nets else None


def _sphere(node: ParticleNode, net: Float64, positions: Float64, radii: Float64) -> tuple[Float64, float]:
    """Return the sphere that holds a node's particles, given by the node or found."""
    given = node.get_bounding_sphere()
    if given is None:
        low, high = (positions - radii[:, None]).min(axis=0), (positions + radii[:, None]).max(axis=0)
        center = 0.5 * (low + high)
        return center, float((lengths(positions - center) + radii).max())
    return np.array(given[0]) @ net[:3, :3] + net[3, :3], given[1]


def _outside(
    sphere: tuple[Float64, float], casting: Sequence[tuple[str, Float64, Float64]]
) -> Iterator[tuple[str, int, float]]:
    """Yield the name of each node with particles outside a sphere, their number, and the radius they need."""
    center, radius = sphere
    for name, positions, radii in casting:
        ends = lengths(positions - center) + radii
        leaving = int(np.count_nonzero(ends > radius * (1.0 + 1e-9)))
        if leaving:
            yield name, leaving, float(ends.max())


def _around(spheres: Sequence[tuple[Float64, float]]) -> tuple[Float64, float]:
    """Return a sphere around several."""
    if not spheres:
        return np.zeros(3), 0.0
    if len(spheres) == 1:
        return spheres[0]
    low = np.min([center - radius for center, radius in spheres], axis=0)
    high = np.max([center + radius for center, radius in spheres], axis=0)
    middle = 0.5 * (low + high)
    return middle, max(float(np.linalg.norm(center - middle)) + radius for center, radius in spheres)


def lengths(vectors: Float64) -> Float64:
    """Return the lengths of vectors, shape (n, 3)."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))
