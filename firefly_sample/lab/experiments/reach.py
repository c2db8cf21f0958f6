"""The reach of lights, the light that a cut-off loses, and extreme distances and intensities."""

from __future__ import annotations

from decimal import Decimal, localcontext
from itertools import product

import numpy as np

from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.cases import ACCURATE, cases, positioned
from firefly_sample.lab.experiments.experiment import FLOAT64, Experiment, Figures, Float64
from firefly_sample.lab.experiments.scenes import WALL, WHITE, wall_scene
from firefly_sample.plan.lights.reach import light_reach
from firefly_sample.plan.position_error import position_error
from firefly_sample.scene.lights import PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.settings import HALF_CODE

# --- Reach in float64, against decimals ---

DIGITS = 120


def exact_reach(
    constant: float, linear: float, quadratic: float, intensity: float, threshold: float
) -> Decimal:
    """Return where a light fades to a threshold, in `DIGITS` digits, from the floats' exact values.

    It is 0 if the light is below the threshold everywhere, infinity if it does not fade.
    """
    with localcontext(prec=DIGITS):
        kc, kl, kq, i, t = (Decimal(value) for value in (constant, linear, quadratic, intensity, threshold))
        k = i / t - kc
        if i == 0 or k <= 0:
            return Decimal(0)
        below = kl + (kl * kl + 4 * kq * k).sqrt()
        return 2 * k / below if below else Decimal("Infinity")


def _largest_error(found: Float64, lights: Float64) -> float:
    """Return the largest relative error of reaches; 1 if just one of found and exact is 0 or infinite.

    `lights` (n, 5) are the arguments of `exact_reach`.
    """
    worst = 0.0
    with localcontext(prec=DIGITS):
        for value, light in zip(found.tolist(), lights.tolist(), strict=True):
            exact = exact_reach(*light)
            if exact == 0 or not (exact.is_finite() and np.isfinite(value)):
                worst = max(worst, 0.0 if value == exact else 1.0)
            else:
                worst = max(worst, float(abs(Decimal(value) / exact - 1)))
    return worst


def _reach(bench: ExperimentBench, quadratic: float, samples: int) -> Figures:
    """Measure lights whose other coefficients and intensity are log-uniform over six orders of magnitude."""
    rng = np.random.default_rng(11)
    constant, linear = 10.0 ** rng.uniform(-3.0, 3.0, (2, samples))
    intensity = 10.0 ** rng.uniform(1.0, 7.0, samples)
    threshold = 1e-3
    k = intensity / threshold - constant
    textbook = (-linear + np.sqrt(linear**2 + 4.0 * quadratic * k)) / (2.0 * quadratic)
    lights = np.column_stack(np.broadcast_arrays(constant, linear, quadratic, intensity, threshold))
    return _largest_error(textbook, lights), _largest_error(_our_reach(lights), lights)


def _our_reach(lights: Float64) -> Float64:
    return light_reach(lights[:, :3], lights[:, 3], lights[:, 4])


def _spread(*zeros: int) -> Float64:
    """Return a thousand lights over sixty orders of magnitude; the coefficients of these indices are 0."""
    rng = np.random.default_rng(9)
    lights = []
    for _ in range(1000):
        kc, kl, kq, i = 10.0 ** rng.uniform(-30, 30, 4)
        lights.append((kc, kl, kq, i, i * 10.0 ** rng.uniform(-12, 0) / kc))
    return np.where(np.isin(np.arange(5), zeros), 0.0, lights)


_REACHES = {
    "Kq = 0": _spread(2),
    "Kl = 0": _spread(1),
    "Kl = Kq = 0": _spread(1, 2),
    "60 orders": _spread(),
    "Kc >= I/t": np.array([(kc, 1.0, 1.0, 1.0, 0.01) for kc in (100.0, 1e3, 1e30, np.nextafter(100.0, 0.0))]),
    "I = 0": np.array([(1.0, 0.1, 0.01, 0.0, t) for t in (1e-30, 1e-3, 1e30)]),
    "I = 1e30": np.array([(1.0, 0.1, 0.01, 1e30, t) for t in (1e-30, 1e-3, 1.0)]),
}


def _reach_in_float64(bench: ExperimentBench, method: str, name: str) -> float:
    return _largest_error(_our_reach(_REACHES[name]), _REACHES[name])


# --- Pictures ---


def _budget(bench: ExperimentBench, method: str, count: int, budget: float) -> float:
    """Return the light that many lights lose at a pixel, less float32's rounding."""
    rng = np.random.default_rng(count)
    positions = rng.uniform((-6, 2, -5), (6, 9, 5), (count, 3))
    colors = rng.uniform(0, 1, (count, 3))
    # as wide as each light reaches, so that light is lost everywhere
    wide = 0.1 * np.sqrt(count / budget / 1.8)
    scene = wall_scene(10.0 * wide, 20.0 * wide, material=WHITE, near=wide, far=100.0 * wide)
    lights = PointLights("lights", wide * positions, colors, np.inf, attenuation=(1.0, 0.7, 1.8))
    scene.root.attach_new_node(lights)
    cut, whole = (
        bench.draw(scene, positioned(method, cutoff_budget=cutoff), (48, 36))["radiance"]
        for cutoff in (budget, 0.0)
    )
    return max(0.0, float(np.abs(cut - whole).max() - 1e-6 * whole.max()))


def _on_the_surface(bench: ExperimentBench, method: str, gap: float) -> float:
    """Return how many values are not finite under lights `gap` in front of the wall."""
    # the sizes of the scene in which the gap is small, and yet not lost in float64
    units = [
        unit
        for unit in (1.0, 1e-12)
        if gap == 0.0 or (gap < 0.01 * unit * WALL and unit * WALL - gap < unit * WALL)
    ]
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


APART = 4.7
"""Distance of the lights of any intensity from the wall."""


def _strength(bench: ExperimentBench, method: str, strength: float) -> float:
    """Return the relative error in the middle of the wall under a light of any intensity."""
    scene = wall_scene(material=WHITE)
    light = PointLight("light", (strength,) * 3)
    light.set_attenuation((1.0, 0.0, 1.0))
    scene.root.attach_new_node(light).set_pos(0.0, WALL - APART, 0.0)
    drawn = bench.draw(scene, positioned(method, cutoff_budget=0.0), (33, 25), ("radiance", "color"))
    middle, expected = drawn["radiance"][12, 16], strength / (1.0 + APART**2)
    return float(np.abs(middle - expected).max() / (expected or 1.0))


def _bound_of_strength(method: str, strength: float) -> float:
    if strength == 0.0:
        return 0.0
    if method in ACCURATE:
        return 2e-6
    # 1 / (1 + d^2) changes by 2 d / (1 + d^2) of itself per unit
    return 2e-6 + 2.0 * APART / (1.0 + APART**2) * position_error(method, 1.0, 100.0, True, WALL)


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
    *cases("reach in float64, {name}", _reach_in_float64, 1e-14, FLOAT64, name=_REACHES),
    *cases("light on the surface, d = {gap:g}", _on_the_surface, 0.0, gap=(0.0, 1e-25, 1e-12, 1e-6)),
    *cases(
        "cut-off, {count} lights, budget {budget:g}",
        _budget,
        lambda method, count, budget: budget,
        count=(1, 100, 2000),
        budget=(HALF_CODE, 1e-2),
    ),
    *cases("strength {strength:g}", _strength, _bound_of_strength, strength=(0.0, 1e-30, 1e30)),
)
