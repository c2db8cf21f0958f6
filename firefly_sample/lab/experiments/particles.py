"""Particles: faint and opaque, one and a million, far away and out of bounds; their shadow never lightens."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from firefly_sample.lab.clouds import blob, faint, from_above, shadow_errors, slices_of
from firefly_sample.lab.experiments.bench import Bench
from firefly_sample.lab.experiments.case import Case
from firefly_sample.lab.reference.particle_shadow import sliced_light
from firefly_sample.scene.lights import AmbientLight
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

SUMMED = ("optical_depth", "blend", "loop")
SLICES = (16, 32, 64, 128, 256)


def _settings(method: str) -> Settings:
    """Of a method of particle shadows; "stepped" is optical depth without interpolation."""
    if method == "stepped":
        return Settings(particle_shadow_interpolation=False)
    return Settings().with_changes(particle_shadows=method)


def _faint(bench: Bench, method: str) -> float:
    return shadow_errors(bench.renderer, faint(), [_settings(method)])[0][0]


def _doubling(bench: Bench, method: str) -> float:
    """The largest ratio of a blob's root mean square error to that with half as many slices."""
    settings = _settings(method)
    every = [settings.with_changes(particle_shadow_slices=count) for count in SLICES]
    errors = [error for _, error in shadow_errors(bench.renderer, blob(), every)]
    return max(after / before for before, after in pairwise(errors))


def _drawn(bench: Bench, node: ParticleNode, settings: Settings) -> tuple[Scene, float]:
    """The scene, and the largest value of its picture."""
    scene = from_above(node)
    scene.root.attach_new_node(AmbientLight("sky", (0.1, 0.1, 0.1)))
    radiance = bench.draw(scene, settings)["radiance"]
    return scene, float(radiance.max())


def _rising(bench: Bench, method: str) -> float:
    """By how much light rises, at most, from one place to the next along ways through a cloud."""
    settings = _settings(method)
    drawn = bench.draw(from_above(blob(3000)), settings, outputs=("particle_shadow_atlas",))
    particle_shadow = drawn.plan.particle_shadow
    assert particle_shadow is not None
    slices = slices_of(drawn.plan, np.asarray(drawn.frame["particle_shadow_atlas"], dtype=np.float32))
    depth = np.linspace(-1.0, particle_shadow.view.slices + 1.0, 500)
    worst, darkest = 0.0, 1.0
    for x, y in np.random.default_rng(0).uniform(40.0, 88.0, (12, 2)):
        places = np.column_stack([np.full(len(depth), x), np.full(len(depth), y), depth])
        left = sliced_light(particle_shadow, slices, places)
        worst, darkest = max(worst, float(np.diff(left, axis=0).max())), min(darkest, float(left.min()))
    return worst if darkest < 0.5 else math.inf  # where nothing is dark, nothing is shown


def _opaque(bench: Bench, method: str) -> float:
    """The light on a particle behind one of alpha 1, over that on the first."""
    node = ParticleNode("opaque", [(0.0, 0.0, 0.5), (0.0, 0.0, -0.5)], [0.5, 0.1], 1.0, (1.0, 1.0, 1.0))
    scene = from_above(node)
    drawn = bench.draw(scene, _settings(method), (97, 73))["radiance"]
    lit, dark = drawn[:36].max(), drawn[44:, 40:57].max()
    return float(dark / lit) if lit > 0.9 else math.inf


def _alone(bench: Bench, method: str) -> float:
    """What one opaque particle takes of its own light, large and small, with and without a blur."""
    worst = 0.0
    for radius, blur in ((0.5, 0.0), (0.02, 0.0), (0.02, 1.0), (0.05, 2.0), (0.3, 8.0)):
        node = ParticleNode("one", [(0.1, 0.2, 0.3)], radius, 1.0, (1.0, 1.0, 1.0))
        node.set_bounding_sphere(1.0)
        scene = from_above(node)
        node.change_shadow(blur=blur)
        bare = bench.draw(scene, Settings(particle_shadows="none"))["radiance"]
        shadowed = bench.draw(scene, _settings(method))["radiance"]
        worst = max(worst, float(np.abs(bare - shadowed).max() / bare.max()))
    return worst


def _many(bench: Bench, method: str) -> float:
    """A million particles: what all slices have together, against the sum of their discs."""
    count = 1_000_000
    rng = np.random.default_rng(1)
    node = ParticleNode("many", rng.uniform(-0.5, 0.5, (count, 3)), 0.05, 1e-5)
    settings = _settings(method).with_changes(particle_shadow_tile=48, particle_shadow_slices=8)
    drawn = bench.draw(from_above(node), settings, (8, 6), outputs=("particle_shadow_atlas", "radiance"))
    particle_shadow = drawn.plan.particle_shadow
    assert particle_shadow is not None
    slices = slices_of(drawn.plan, np.asarray(drawn.frame["particle_shadow_atlas"], dtype=np.float32))
    found = slices.sum() if method == "loop" else slices[-1].sum()
    # a disc of (1 - r^2)^2 has the area pi R^2 / 3
    expected = (particle_shadow.strengths.sum(axis=1) * particle_shadow.radii**2).sum() * math.pi / 3.0
    return float(abs(found / expected - 1.0)) if len(drawn.plan.particles) == count else math.inf


def _moved(bench: Bench, method: str, power: int) -> float:
    """A cloud with its camera moved along each axis: the largest difference, over the largest value."""
    scene = from_above(blob(2000))
    here = bench.draw(scene, _settings(method))["radiance"]
    shift = 2.0**power * np.array([1.0, 1.0, -1.0])
    for name in ("blob", "camera"):
        path = scene.root.find(name)
        path.set_pos(*(np.array(path.get_pos()) + shift))
    there = bench.draw(scene, _settings(method))["radiance"]
    return float(np.abs(there - here).max() / here.max())


def _moved_case(power: int, bound: float) -> Case:
    def run(bench: Bench, method: str) -> float:
        return _moved(bench, method, power)

    return Case(f"particles moved by 2^{power}", run, bound, SUMMED)


def _outside(bench: Bench, method: str) -> float:
    """Particles at, beside, before, behind and far from the sphere that was given: values above all light."""
    places = [(1.0, 0, 0), (1.4, 0, 0), (0, 0, 3.0), (0, 0, -3.0), (1e9, 0, 0), (0, 0, 0), (0, 0, 0.999)]
    node = ParticleNode("stray", places, 0.5, 0.9, (1.0, 1.0, 1.0))
    node.set_bounding_sphere(1.0)
    _, largest = _drawn(bench, node, _settings(method))
    return max(largest - 1.1, 0.0)


def _across_the_eye(bench: Bench, method: str) -> float:
    """Particles around the eye, across the near plane and behind it: values above all light."""
    places = [(0.0, -5.0 + 0.1 * k, 0.0) for k in range(-5, 20)]
    node = ParticleNode("near", places, 0.4, 0.9, (1.0, 1.0, 1.0))
    _, largest = _drawn(bench, node, _settings(method))
    return max(largest - 1.1, 0.0) if largest > 0.0 else math.inf


def _background(bench: Bench, method: str) -> float:
    """What particles in a corner do to the background elsewhere."""
    scene = from_above(ParticleNode("corner", [(1.5, 0, 1.0)], 0.3, 0.9))
    scene.background = (0.25, 0.5, 0.125)
    radiance = bench.draw(scene, _settings(method))["radiance"]
    return float(np.abs(radiance[40:, :48] - scene.background).max())


CASES = (
    Case("20,000 particles of alpha 1e-3", _faint, 0.15, ("optical_depth",)),
    Case("slices doubled, in steps", _doubling, 0.6, ("stepped",)),
    Case("slices doubled, interpolated", _doubling, 0.75, ("optical_depth",)),
    Case("light along the way through particles", _rising, 1e-7, (*SUMMED, "stepped")),
    Case("an opaque particle", _opaque, 1e-6, ("optical_depth", "stepped")),
    Case("one particle", _alone, 2e-6, (*SUMMED, "stepped")),
    Case("a million particles", _many, 2e-3, SUMMED),
    *(_moved_case(power, bound) for power, bound in ((10, 1e-6), (20, 1e-6), (30, 1e-4))),
    Case("particles out of their sphere", _outside, 1e-6, SUMMED),
    Case("particles around the eye", _across_the_eye, 1e-6, ("optical_depth",)),
    Case("background beside particles", _background, 0.0, ("optical_depth",)),
)
