"""The reach of lights, the light that a cut-off loses, and extreme distances and intensities."""

from __future__ import annotations

from decimal import Decimal, localcontext
from itertools import product

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.experiment import FLOAT64, Experiment, Value
from firefly_sample.lab.experiments.position_bounds import ACCURATE, positioned
from firefly_sample.lab.experiments.scenes import WALL, wall_scene
from firefly_sample.plan.lights.reach import light_reach
from firefly_sample.plan.position_error import position_error
from firefly_sample.scene.lights import PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.settings import HALF_CODE

Float64 = NDArray[np.float64]
Rows = list[tuple[float, float, float, float, float]]
"""Attenuation (Kc, Kl, Kq), intensity I and threshold t of lights."""

# --- Reach in float64, against decimals ---

DIGITS = 120


def exact_reach(
    constant: float, linear: float, quadratic: float, intensity: float, threshold: float
) -> Decimal:
    """Return where a light fades to a threshold, in `DIGITS` digits, from the floats' exact values.

    It is 0 if the light is below the threshold everywhere, infinity if it does not fade.
    """
    with localcontext() as context:
        context.prec = DIGITS
        kc, kl, kq, i, t = (Decimal(value) for value in (constant, linear, quadratic, intensity, threshold))
        k = i / t - kc
        if i == 0 or k <= 0:
            return Decimal(0)
        below = kl + (kl * kl + 4 * kq * k).sqrt()
        return 2 * k / below if below else Decimal("Infinity")


def _largest_error(found: Float64, rows: Rows) -> float:
    """Return the largest relative error; 1 if only one of a value and the exact one is 0 or infinite."""
    worst = 0.0
    with localcontext() as context:
        context.prec = DIGITS
        for value, row in zip(found.tolist(), rows, strict=True):
            exact = exact_reach(*row)
            if exact == 0 or exact.is_infinite():
                worst = max(worst, 0.0 if value == exact else 1.0)
            else:
                worst = max(worst, float(abs(Decimal(value) / exact - 1)) if np.isfinite(value) else 1.0)
    return worst


def _reach(bench: ExperimentBench, quadratic: float, samples: int) -> tuple[Value, ...]:
    """Measure lights whose other coefficients and intensity are log-uniform over six orders of magnitude."""
    rng = np.random.Generator(np.random.PCG64(11))
    constant, linear = 10.0 ** rng.uniform(-3.0, 3.0, (2, samples))
    intensity = 10.0 ** rng.uniform(1.0, 7.0, samples)
    threshold = 1e-3
    k = intensity / threshold - constant
    textbook = (-linear + np.sqrt(linear**2 + 4.0 * quadratic * k)) / (2.0 * quadratic)
    columns = [constant, linear, np.full(samples, quadratic), intensity, np.full(samples, threshold)]
    rows: Rows = list(zip(*(column.tolist() for column in columns), strict=True))
    ours = light_reach(np.stack(columns[:3], axis=1), intensity, threshold)
    return _largest_error(textbook, rows), _largest_error(ours, rows)


def _spread(zeros: tuple[int, ...]) -> Rows:
    """Return a thousand lights over sixty orders of magnitude; the coefficients of these places are 0."""
    rng = np.random.default_rng(9)
    rows: Rows = []
    for _ in range(1000):
        kc, kl, kq, i = (10.0 ** rng.uniform(-30, 30, 4)).tolist()
        t = i * 10.0 ** float(rng.uniform(-12, 0)) / (kc or 1.0)
        kc, kl, kq = (0.0 if place in zeros else value for place, value in enumerate((kc, kl, kq)))
        rows.append((kc, kl, kq, i, t))
    return rows


_REACHES: dict[str, Rows] = {
    "Kq = 0": _spread((2,)),
    "Kl = 0": _spread((1,)),
    "Kl = Kq = 0": _spread((1, 2)),
    "60 orders": _spread(()),
    "Kc >= I/t": [(kc, 1.0, 1.0, 1.0, 0.01) for kc in (100.0, 1e3, 1e30, np.nextafter(100.0, 0.0))],
    "I = 0": [(1.0, 0.1, 0.01, 0.0, t) for t in (1e-30, 1e-3, 1e30)],
    "I = 1e30": [(1.0, 0.1, 0.01, 1e30, t) for t in (1e-30, 1e-3, 1.0)],
}


def _reach_in_float64(name: str, rows: Rows) -> Experiment:
    def run(bench: ExperimentBench, method: str) -> float:
        columns = np.array(rows)
        return _largest_error(light_reach(columns[:, :3], columns[:, 3], columns[:, 4]), rows)

    return Experiment(f"reach in float64, {name}", run, FLOAT64, bound=1e-14)


# --- Pictures ---


def _budget(count: int, budget: float) -> Experiment:
    """Return the case of the light that many lights lose at a pixel, less float32's rounding."""

    def run(bench: ExperimentBench, method: str) -> float:
        rng = np.random.default_rng(count)
        positions = rng.uniform((-6, 2, -5), (6, 9, 5), (count, 3))
        colors = rng.uniform(0, 1, (count, 3))
        # as wide as each light reaches, so that light is lost everywhere
        wide = 0.1 * np.sqrt(count / budget / 1.8)
        white = Material("white", (1.0, 1.0, 1.0, 1.0))
        scene = wall_scene(10.0 * wide, 20.0 * wide, material=white, near=wide, far=100.0 * wide)
        lights = PointLights("lights", wide * positions, colors, np.inf, attenuation=(1.0, 0.7, 1.8))
        scene.root.attach_new_node(lights)
        settings = positioned(method, cutoff_budget=budget)
        cut = bench.draw(scene, settings, (48, 36))["radiance"]
        whole = bench.draw(scene, settings.with_changes(cutoff_budget=0.0), (48, 36))["radiance"]
        return max(0.0, float(np.abs(cut - whole).max() - 1e-6 * whole.max()))

    return Experiment(f"cut-off, {count} lights, budget {budget:g}", run, bound=budget)


def _on_the_surface(gap: float) -> Experiment:
    """Return the case of lights `gap` in front of the wall: how many values are not finite."""
    # the sizes of the scene in which the gap is small, and yet not lost in float64
    units = [
        unit
        for unit in (1.0, 1e-12)
        if gap == 0.0 or (gap < 0.01 * unit * WALL and unit * WALL - gap < unit * WALL)
    ]

    def run(bench: ExperimentBench, method: str) -> float:
        wrong = 0
        material = Material("shiny", (0.5, 0.5, 0.5, 1.0), specular=(1.0, 1.0, 1.0), shininess=1e4)
        attenuations = (None, (1.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
        for unit, make, attenuation in product(units, (PointLight, Spotlight), attenuations):
            scene = wall_scene(unit * WALL, unit * 20.0, 1, material, unit, unit * 100.0)
            light = make("light", radius=unit * 2.0)
            if attenuation is not None:
                light.set_attenuation(attenuation)
            scene.root.attach_new_node(light).set_pos(0.0, unit * WALL - gap, 0.0)
            for changes in ({}, {"specular_model": "blinn_phong"}, {"light_method": "loop"}):
                drawn = bench.draw(scene, positioned(method, **changes), (33, 25), ("radiance", "light"))
                wrong += int(np.count_nonzero(~np.isfinite(drawn["radiance"])))
        return float(wrong)

    return Experiment(f"light on the surface, d = {gap:g}", run, bound=0.0)


def _of_strength(strength: float) -> Experiment:
    """Return the case of a light of any intensity: the relative error in the middle of the wall."""
    apart = 4.7

    def run(bench: ExperimentBench, method: str) -> float:
        scene = wall_scene(material=Material("white", (1.0, 1.0, 1.0, 1.0)))
        light = PointLight("light", (strength,) * 3)
        light.set_attenuation((1.0, 0.0, 1.0))
        scene.root.attach_new_node(light).set_pos(0.0, WALL - apart, 0.0)
        settings = positioned(method, cutoff_budget=0.0)
        drawn = bench.draw(scene, settings, (33, 25), ("radiance", "color"))
        middle, expected = drawn["radiance"][12, 16], strength / (1.0 + apart**2)
        return float(np.abs(middle - expected).max() / (expected or 1.0))

    def bound(method: str) -> float:
        if strength == 0.0:
            return 0.0
        if method in ACCURATE:
            return 2e-6
        # 1 / (1 + d^2) changes by 2 d / (1 + d^2) of itself per unit
        return 2e-6 + 2.0 * apart / (1.0 + apart**2) * position_error(method, 1.0, 100.0, True, WALL)

    return Experiment(f"strength {strength:g}", run, bound=bound)


EXPERIMENTS = (
    Experiment(
        "reach",
        _reach,
        {f"{quadratic:g}": quadratic for quadratic in (1.0, 1e-6, 1e-12, 1e-18, 1e-24, 1e-30)},
        ("quadratic", "textbook", "conjugate"),
        "Largest relative error of a light's reach in float64, by its quadratic coefficient: by the "
        "textbook's formula, and by its conjugate, 2k / (Kl + sqrt(Kl^2 + 4 Kq k)) with k = I/t - Kc.",
        {"samples": 1000},
    ),
    *(_reach_in_float64(name, rows) for name, rows in _REACHES.items()),
    *(_on_the_surface(gap) for gap in (0.0, 1e-25, 1e-12, 1e-6)),
    *(_budget(count, budget) for count in (1, 100, 2000) for budget in (HALF_CODE, 1e-2)),
    *(_of_strength(strength) for strength in (0.0, 1e-30, 1e30)),
)
