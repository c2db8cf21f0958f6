"""Particles and their shadows: errors and costs of each method, and extreme opacities and positions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from itertools import chain, pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.lab.clouds import CLOUDS, blob, faint, from_above, shadow_errors, slices_of
from firefly_sample.lab.experiments.bench import DrawnFrame, ExperimentBench
from firefly_sample.lab.experiments.cases import cases
from firefly_sample.lab.experiments.experiment import Experiment, Figures, Float64, relative_error
from firefly_sample.lab.experiments.times import ratios_of
from firefly_sample.lab.probe import Size
from firefly_sample.lab.reference.particles import sliced_light
from firefly_sample.plan.particles.shadow import ParticleShadowPlan
from firefly_sample.scene.lights import AmbientLight
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

Changes = dict[str, Any]

_BLEND: Changes = {"particle_shadows": "blend"}
_LOOP: Changes = {"particle_shadows": "loop"}
_EIGHT_BITS: Changes = {"particle_shadow_format": "unorm8"}
_STEPPED: Changes = {"particle_shadow_interpolation": False}
METHODS: dict[str, Changes] = {
    "optical_depth": {},
    "optical_depth, float16": {"particle_shadow_format": "float16"},
    "optical_depth, stepped": _STEPPED,
    "blend": _BLEND,
    "blend, stepped": _BLEND | _STEPPED,
    "blend, 8 bits": _BLEND | _EIGHT_BITS,
    "blend, 8 bits, stepped": _BLEND | _EIGHT_BITS | _STEPPED,
    "loop, all": _LOOP,
    "loop, nearest ten": _LOOP | {"particle_shadow_reads": 10},
}
"""Methods of particle shadows, by the settings that differ from the defaults."""
SLICES = (16, 32, 64, 128, 256)

# --- Tables ---


def _shadow_errors(
    bench: ExperimentBench, changes: Iterable[Changes], make: Callable[..., ParticleNode], *arguments: int
) -> list[tuple[float, float]]:
    """Return `shadow_errors` in a cloud that `make` returns, measured once."""
    settings = [Settings(**each) for each in changes]
    found: list[tuple[float, float]] = bench.once(
        (make, arguments, *settings), lambda: shadow_errors(bench.renderer, make(*arguments), settings)
    )
    return found


def _cloud_errors(bench: ExperimentBench, index: int) -> Figures:
    """Return the largest and the root mean square error of the light in each cloud, by one of `METHODS`."""
    found = (_shadow_errors(bench, METHODS.values(), make)[index] for make in CLOUDS.values())
    return tuple(chain.from_iterable(found))


def _errors_by_slices(
    bench: ExperimentBench, interpolated: bool, count: int = 20_000, slices: Sequence[int] = SLICES
) -> list[float]:
    """Return the root mean square error of the light in the blob, by the number of slices."""
    changes: list[Changes] = [
        {"particle_shadow_slices": number, "particle_shadow_interpolation": chosen}
        for chosen in (True, False)
        for number in slices
    ]
    errors = _shadow_errors(bench, changes, blob, count)  # all at once: they have the exact sums in common
    first = 0 if interpolated else len(slices)
    return [error for _, error in errors[first : first + len(slices)]]


def _slices_and_ratios(bench: ExperimentBench, index: int, count: int, slices: Sequence[int]) -> Figures:
    figures: Figures = ()
    for interpolated in (False, True):
        errors = _errors_by_slices(bench, interpolated, count, slices)
        figures += errors[index], errors[index] / errors[index - 1] if index else None
    return figures


def _cost(
    bench: ExperimentBench, changes: Changes, rounds: int, counts: Sequence[int], size: Size
) -> Figures:
    shadowed, bare = Settings(**changes), Settings(particle_shadows="none")
    figures: Figures = ()
    with bench.measured_frames() as renderer:
        renderer.resize(size)

        def milliseconds(settings: Settings, scene: Scene) -> float:
            renderer.settings = settings
            frame = renderer.draw(renderer.plan(scene, 0.0), read=False)
            return sum(frame.milliseconds.values())

        for count in counts:
            scene = bench.scene("smoke", particles=count)
            times = [(milliseconds(shadowed, scene), milliseconds(bare, scene)) for _ in range(rounds + 1)]
            figures += ratios_of(times[1:])  # the first compiles
    return figures


def _order(bench: ExperimentBench, changes: Changes, count: int, size: Size) -> Figures:
    """Return the differences in display codes to a picture in the exact order."""

    def codes(settings: Settings) -> NDArray[np.int64]:
        drawn = bench.draw(bench.scene("smoke", particles=count), settings, size, ("color",), 3.0)
        return np.asarray(drawn.frame["color"], dtype=np.int64)

    exact = bench.once(("exact order", count, size), lambda: codes(Settings()))
    difference = np.abs(codes(Settings(**changes)) - exact).max(axis=-1)
    return int(difference.max()), float(difference.mean()), float((difference > 2).mean())


# --- Cases: errors of shadows ---

SUMMED = ("optical_depth", "blend", "loop")


def _settings(method: str) -> Settings:
    """Return a shadow method's settings; "stepped" is optical depth without interpolation."""
    if method == "stepped":
        return Settings(particle_shadow_interpolation=False)
    return Settings().with_changes(particle_shadows=method)


def _doubling(bench: ExperimentBench, method: str) -> float:
    """Return the largest ratio of a blob's root mean square error to that with half as many slices."""
    errors = _errors_by_slices(bench, interpolated=method != "stepped")
    return max(after / before for before, after in pairwise(errors))


def _slices(
    bench: ExperimentBench, scene: Scene, settings: Settings, size: Size
) -> tuple[DrawnFrame, ParticleShadowPlan, Float64]:
    """Draw a scene with a cloud, and return its shadow's plan and slices with the frame."""
    drawn = bench.draw(scene, settings, size, ("particle_shadow_atlas", "radiance"))
    assert drawn.plan.particle_shadow is not None
    atlas = np.asarray(drawn.frame["particle_shadow_atlas"], dtype=np.float32)
    return drawn, drawn.plan.particle_shadow, slices_of(drawn.plan, atlas)


def _rising(bench: ExperimentBench, method: str) -> float:
    """Return the largest rise of the light between neighbouring positions on lines through a cloud."""
    _, shadow, slices = _slices(bench, from_above(blob(3000)), _settings(method), (96, 72))
    depth = np.linspace(-1.0, shadow.view.slices + 1.0, 500)
    worst, darkest = 0.0, 1.0
    for x, y in np.random.default_rng(0).uniform(40.0, 88.0, (12, 2)):
        line = np.column_stack([np.full(len(depth), x), np.full(len(depth), y), depth])
        light = sliced_light(shadow, slices, line)
        worst, darkest = max(worst, float(np.diff(light, axis=0).max())), min(darkest, float(light.min()))
    return worst if darkest < 0.5 else math.inf  # without a dark position, nothing is shown


def _many(bench: ExperimentBench, method: str) -> float:
    """Compare the sum of the slices of a million particles with the sum of the particles' discs."""
    count = 1_000_000

    def cloud() -> Scene:
        positions = np.random.default_rng(1).uniform(-0.5, 0.5, (count, 3))
        return from_above(ParticleNode("many", positions, 0.05, 1e-5))

    settings = _settings(method).with_changes(particle_shadow_tile=48, particle_shadow_slices=8)
    drawn, shadow, slices = _slices(bench, bench.once("a million particles", cloud), settings, (8, 6))
    found = slices.sum() if method == "loop" else slices[-1].sum()
    # a disc of (1 - r^2)^2 has the area pi R^2 / 3
    expected = (shadow.strengths.sum(axis=1) * shadow.radii**2).sum() * math.pi / 3.0
    return float(abs(found / expected - 1.0)) if len(drawn.plan.particles) == count else math.inf


# --- Cases: pictures ---


def _white(positions: ArrayLike, radii: ArrayLike, alpha: float) -> ParticleNode:
    return ParticleNode("particles", positions, radii, alpha, (1.0, 1.0, 1.0))


def _opaque(bench: ExperimentBench, method: str) -> float:
    """Return the light on a particle behind one of alpha 1, over that on the first."""
    scene = from_above(_white([(0.0, 0.0, 0.5), (0.0, 0.0, -0.5)], [0.5, 0.1], 1.0))
    drawn = bench.draw(scene, _settings(method), (97, 73))["radiance"]
    lit, dark = drawn[:36].max(), drawn[44:, 40:57].max()
    return float(dark / lit) if lit > 0.9 else math.inf


def _alone(bench: ExperimentBench, method: str) -> float:
    """Return how much an opaque particle shadows itself, large and small, with and without a blur."""
    worst = 0.0
    for radius, blur in ((0.5, 0.0), (0.02, 0.0), (0.02, 1.0), (0.05, 2.0), (0.3, 8.0)):
        node = _white([(0.1, 0.2, 0.3)], radius, 1.0)
        node.set_bounding_sphere(1.0)
        scene = from_above(node)
        node.change_shadow(blur=blur)
        bare = bench.draw(scene, Settings(particle_shadows="none"))["radiance"]
        shadowed = bench.draw(scene, _settings(method))["radiance"]
        worst = max(worst, relative_error(shadowed, bare))
    return worst


def _moved(bench: ExperimentBench, method: str, power: int) -> float:
    """Move a cloud and its camera along each axis."""
    scene = from_above(blob(2000))
    here = bench.draw(scene, _settings(method))["radiance"]
    for name in ("blob", "camera"):
        path = scene.root.find(name)
        path.set_pos(*(np.array(path.get_pos()) + 2.0**power * np.array([1.0, 1.0, -1.0])))
    return relative_error(bench.draw(scene, _settings(method))["radiance"], here)


def _above_all_light(bench: ExperimentBench, method: str, node: ParticleNode) -> float:
    """Return by how much a picture is brighter than all lights together; infinite if it is black."""
    scene = from_above(node)
    scene.root.attach_new_node(AmbientLight("sky", (0.1, 0.1, 0.1)))
    largest = float(bench.draw(scene, _settings(method))["radiance"].max())
    return max(largest - 1.1, 0.0) if largest > 0.0 else math.inf


def _outside(bench: ExperimentBench, method: str) -> float:
    """Draw particles at, beside, before, behind and far from their bounding sphere."""
    positions = [(1.0, 0, 0), (1.4, 0, 0), (0, 0, 3.0), (0, 0, -3.0), (1e9, 0, 0), (0, 0, 0), (0, 0, 0.999)]
    node = _white(positions, 0.5, 0.9)
    node.set_bounding_sphere(1.0)
    return _above_all_light(bench, method, node)


def _across_the_eye(bench: ExperimentBench, method: str) -> float:
    """Draw particles around the eye, across the near plane and behind it."""
    node = _white([(0.0, -5.0 + 0.1 * k, 0.0) for k in range(-5, 20)], 0.4, 0.9)
    return _above_all_light(bench, method, node)


def _background(bench: ExperimentBench, method: str) -> float:
    """Return by how much particles in a corner change the background elsewhere."""
    scene = from_above(ParticleNode("corner", [(1.5, 0, 1.0)], 0.3, 0.9))
    scene.background = (0.25, 0.5, 0.125)
    radiance = bench.draw(scene, _settings(method))["radiance"]
    return float(np.abs(radiance[40:, :48] - scene.background).max())


EXPERIMENTS = (
    Experiment(
        "particle_shadows",
        _cloud_errors,
        {name: index for index, name in enumerate(METHODS)},
        ("method", *(f"{name} {error}" for name in CLOUDS for error in ("max", "rms"))),
        "Error of the share of light that particles leave, at 3,000 positions evenly along the light, "
        "against the exact product; 64 slices of 128 texels. blob: 20,000 particles, optical depth 2; "
        "sheets: three sheets thinner than a slice, optical depth 3; faint: 20,000 particles of alpha 1e-3.",
    ),
    Experiment(
        "particle_shadow_slices",
        _slices_and_ratios,
        {f"{number}": index for index, number in enumerate(SLICES)},
        ("slices", "stepped", "ratio", "interpolated", "ratio"),
        "Root mean square error of the light in the blob of {count:,} particles by slices, in steps and "
        "interpolated, and its ratio to that of half as many.",
        {"count": 20_000, "slices": SLICES},
    ),
    Experiment(
        "particle_shadow_cost",
        _cost,
        {name: changes for name, changes in METHODS.items() if "stepped" not in name}
        | {f"optical_depth, {number} slices": {"particle_shadow_slices": number} for number in SLICES},
        ("method", "{counts[0]:,} particles", "spread", "{counts[1]:,} particles", "spread"),
        "Time of a frame of the scene smoke at {size[0]}x{size[1]} over that of the same frame without "
        "shadows, by method: median of {rounds} interleaved rounds, and their interquartile range over it. "
        "64 slices unless stated otherwise. They change from run to run.",
        {"rounds": 5, "counts": (10_000, 100_000), "size": (800, 600)},
    ),
    Experiment(
        "particle_order",
        _order,
        {
            "view, 4,096 depths": {"particle_order_depths": 4096},
            "view, 64 depths": {"particle_order_depths": 64},
            "half_angle": {"particle_order": "half_angle"},
            "unsorted": {"particle_order": "unsorted"},
        },
        ("order", "max", "mean", "above 2"),
        "Difference in display codes of a picture of {count:,} particles in another order from the exact "
        "one: the largest, the mean, and the share of pixels whose difference exceeds 2.",
        {"count": 20_000, "size": (320, 240)},
    ),
    Experiment(
        "20,000 particles of alpha 1e-3",
        lambda bench, method: _shadow_errors(bench, [{"particle_shadows": method}], faint)[0][0],
        ("optical_depth",),
        bound=0.15,
    ),
    Experiment("slices doubled, in steps", _doubling, ("stepped",), bound=0.6),
    Experiment("slices doubled, interpolated", _doubling, ("optical_depth",), bound=0.75),
    Experiment("light along a line through particles", _rising, (*SUMMED, "stepped"), bound=1e-7),
    Experiment("an opaque particle", _opaque, ("optical_depth", "stepped"), bound=1e-6),
    Experiment("one particle", _alone, (*SUMMED, "stepped"), bound=2e-6),
    Experiment("a million particles", _many, SUMMED, bound=2e-3),
    *cases("particles moved by 2^{power}", _moved, 1e-6, SUMMED, power=(10, 20)),
    *cases("particles moved by 2^{power}", _moved, 1e-4, SUMMED, power=[30]),
    Experiment("particles out of their sphere", _outside, SUMMED, bound=1e-6),
    Experiment("particles around the eye", _across_the_eye, ("optical_depth",), bound=1e-6),
    Experiment("background beside particles", _background, ("optical_depth",), bound=0.0),
)
