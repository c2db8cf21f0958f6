"""Clouds of particles whose shadow is known exactly, and the errors of slices in them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.particles import exact_sums, sliced_light
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.plan.particles.shadow import optical_depths
from firefly_sample.renderer import Renderer
from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.particles import ParticleNode, ParticleShadow
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]


def _alpha_of(positions: Float64, radius: float, depth: float) -> float:
    """Return the alpha that gives a line along Z through the centre an optical depth."""
    squares = (positions[:, :2] ** 2).sum(axis=1) / radius**2
    return float(-np.expm1(-depth / (np.maximum(1.0 - squares, 0.0) ** 2).sum()))


def blob(count: int = 20_000, radius: float = 0.12) -> ParticleNode:
    """Return a normal distribution, cut off at 1: optical depth 2 through the centre."""
    positions = np.random.default_rng(1).normal(size=(2 * count, 3)) / 3.0
    positions = positions[np.linalg.norm(positions, axis=1) < 1.0 - radius][:count]
    return ParticleNode("blob", positions, radius, _alpha_of(positions, radius, 2.0))


def sheets(count: int = 6_000, radius: float = 0.15) -> ParticleNode:
    """Return three sheets across the light, each thinner than a slice: optical depth 3 through the centre."""
    rng = np.random.default_rng(2)
    depth = rng.choice([-0.6, 0.0, 0.55], size=count) + rng.normal(size=count) * 0.003
    positions = np.column_stack([rng.uniform(-0.6, 0.6, (count, 2)), depth])
    return ParticleNode("sheets", positions, radius, _alpha_of(positions, radius, 3.0))


def faint(count: int = 20_000) -> ParticleNode:
    """Return particles of alpha 1e-3, most of them in front of each other."""
    rng = np.random.default_rng(3)
    positions = np.column_stack([rng.normal(size=(count, 2)) * 0.1, rng.uniform(-0.8, 0.8, count)])
    return ParticleNode("faint", positions, 0.3, 1e-3)


CLOUDS: dict[str, Callable[[], ParticleNode]] = {"blob": blob, "sheets": sheets, "faint": faint}


def from_above(node: ParticleNode) -> Scene:
    """Return a scene: a cloud, shadowing itself in the light of a sun straight above, seen from the side."""
    scene = Scene()
    sun = DirectionalLight("sun")
    sun.set_direction((0.0, 0.0, -1.0))
    scene.root.attach_new_node(sun)
    node.set_shadow(ParticleShadow(sun))
    scene.root.attach_new_node(node)
    scene.camera.set_pos(0.0, -5.0, 0.0)
    return scene


def slices_of(plan: FramePlan, atlas: NDArray[np.float32]) -> Float64:
    """Split an output "particle_shadow_atlas" into slices (slices, tile, tile, 3), bottom row first."""
    assert plan.particle_shadow is not None
    across, side = plan.particle_shadow.grid[0], plan.particle_shadow.view.tile
    rows = atlas[::-1].astype(np.float64)
    corners = [(side * (k // across), side * (k % across)) for k in range(plan.particle_shadow.view.slices)]
    return np.array([rows[y : y + side, x : x + side] for y, x in corners])


def shadow_errors(
    renderer: Renderer, node: ParticleNode, settings: Sequence[Settings], positions: int = 3000
) -> list[tuple[float, float]]:
    """Return the errors of the light in a cloud, with slices that are drawn with each of some settings.

    An error is the largest one, and the root of the mean square. The positions at which shadows are looked up
    are near the axis, evenly distributed along the light. Exact is the product of the transmittances of all
    particles, whatever the method adds up. The settings share one `particle_shadow_tile`.
    """
    scene, errors = from_above(node), []
    exact: Float64 | None = None
    for chosen in settings:
        renderer.settings = chosen
        plan = renderer.plan(scene, 0.0, ("particle_shadow_atlas",))
        slices = slices_of(plan, np.asarray(renderer.draw(plan)["particle_shadow_atlas"], dtype=np.float32))
        particle_shadow = plan.particle_shadow
        assert particle_shadow is not None
        rng = np.random.default_rng(5)
        across = particle_shadow.view.tile * (0.5 + 0.05 * rng.normal(size=(positions, 2)))
        # the same positions, whatever the number of slices
        at = np.column_stack([across, rng.random(positions) * particle_shadow.view.slices])
        if exact is None:
            depths = np.repeat(optical_depths(node.arrays.alphas)[:, None], 3, axis=1)
            exact = np.exp(-exact_sums(replace(particle_shadow, strengths=depths), at))
        difference = (sliced_light(particle_shadow, slices, at) - exact)[:, 0]
        errors.append((float(np.abs(difference).max()), float(np.sqrt((difference**2).mean()))))
    return errors
