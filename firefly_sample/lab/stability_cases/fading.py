"""How far lights reach, and what is lost where they are cut off."""

from __future__ import annotations

from decimal import Decimal, localcontext
from itertools import product

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.numerics_reach import DIGITS, exact_reach
from firefly_sample.lab.stability_cases.bench import Bench
from firefly_sample.lab.stability_cases.case import ACCURATE, DOUBLES, Case, positioned
from firefly_sample.lab.stability_cases.scenes import WALL, wall_scene
from firefly_sample.plan.lights.reach import light_reach
from firefly_sample.plan.position_error import position_error
from firefly_sample.scene.lights import PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.settings import HALF_CODE

Float64 = NDArray[np.float64]

Rows = list[tuple[float, float, float, float, float]]


def _worst(rows: Rows) -> float:
    """Largest relative error over (Kc, Kl, Kq, I, t)."""
    columns = np.array(rows)
    given = light_reach(columns[:, :3], columns[:, 3], columns[:, 4])
    worst = 0.0
    for row, reach in zip(rows, given.tolist(), strict=True):
        exact = exact_reach(*row)
        if exact == 0 or exact.is_infinite():
            worst = max(worst, 0.0 if reach == exact else 1.0)
        elif not np.isfinite(reach):
            worst = 1.0
        else:
            with localcontext() as context:
                context.prec = DIGITS
                worst = max(worst, float(abs(Decimal(reach) / exact - 1)))
    return worst


def _spread(make: str) -> Rows:
    """A thousand lights over sixty orders of magnitude, some of their coefficients 0."""
    rng = np.random.default_rng(9)
    rows: Rows = []
    for _ in range(1000):
        kc, kl, kq, i = (10.0 ** rng.uniform(-30, 30, 4)).tolist()
        t = i * 10.0 ** float(rng.uniform(-12, 0)) / (kc or 1.0)
        kinds = {"kq": (kc, kl, 0.0), "kl": (kc, 0.0, kq), "both": (kc, 0.0, 0.0), "all": (kc, kl, kq)}
        rows.append((*kinds[make], i, t))
    return rows


_REACHES: dict[str, Rows] = {
    "Kq = 0": _spread("kq"),
    "Kl = 0": _spread("kl"),
    "Kl = Kq = 0": _spread("both"),
    "60 orders": _spread("all"),
    "Kc >= I/t": [(kc, 1.0, 1.0, 1.0, 0.01) for kc in (100.0, 1e3, 1e30, np.nextafter(100.0, 0.0))],
    "I = 0": [(1.0, 0.1, 0.01, 0.0, t) for t in (1e-30, 1e-3, 1e30)],
    "I = 1e30": [(1.0, 0.1, 0.01, 1e30, t) for t in (1e-30, 1e-3, 1.0)],
}


def _budget(count: int, budget: float) -> Case:
    """What a budget lets many lights lose at a pixel, less what float32 may."""

    def run(bench: Bench, method: str) -> float:
        rng = np.random.default_rng(count)
        places, colors = rng.uniform((-6, 2, -5), (6, 9, 5), (count, 3)), rng.uniform(0, 1, (count, 3))
        # as wide as each light reaches, so that there is something to lose everywhere
        wide = 0.1 * np.sqrt(count / budget / 1.8)
        white = Material("white", (1.0, 1.0, 1.0, 1.0))
        scene = wall_scene(10.0 * wide, 20.0 * wide, material=white, near=wide, far=100.0 * wide)
        lights = PointLights("lights", wide * places, colors, np.inf, attenuation=(1.0, 0.7, 1.8))
        scene.root.attach_new_node(lights)
        settings = positioned(method, cutoff_budget=budget)
        cut = bench.draw(scene, settings, (48, 36))["radiance"]
        whole = bench.draw(scene, settings.with_changes(cutoff_budget=0.0), (48, 36))["radiance"]
        return max(0.0, float(np.abs(cut - whole).max() - 1e-6 * whole.max()))

    return Case(f"cut-off, {count} lights, budget {budget:g}", run, budget)


def _units(gap: float) -> list[float]:
    """The sizes of the scene, of 1 and 1e-12, in which the gap is small and yet not lost in float64."""
    return [
        unit
        for unit in (1.0, 1e-12)
        if gap == 0.0 or (gap < 0.01 * unit * WALL and unit * WALL - gap < unit * WALL)
    ]


def _on_the_surface(gap: float) -> Case:
    """Lights of every way to fade, `gap` before the wall: how many values are no number."""

    def run(bench: Bench, method: str) -> float:
        wrong = 0
        for unit, make in product(_units(gap), (PointLight, Spotlight)):
            for attenuation in (None, (1.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)):
                material = Material("shiny", (0.5, 0.5, 0.5, 1.0), specular=(1.0, 1.0, 1.0), shininess=1e4)
                scene = wall_scene(unit * WALL, unit * 20.0, 1, material, unit, unit * 100.0)
                light = make("light", radius=unit * 2.0)
                if attenuation is not None:
                    light.set_attenuation(attenuation)
                scene.root.attach_new_node(light).set_pos(0.0, unit * WALL - gap, 0.0)
                for changes in ({}, {"specular_model": "blinn_phong"}, {"light_method": "loop"}):
                    settings = positioned(method, **changes)
                    drawn = bench.draw(scene, settings, (33, 25), ("radiance", "light"))
                    wrong += int(np.count_nonzero(~np.isfinite(drawn["radiance"])))
        return float(wrong)

    return Case(f"light on the surface, d = {gap:g}", run, 0.0)


def _of_strength(strength: float) -> Case:
    """A light of any strength against what it must show in the middle of the wall."""
    apart = 4.7

    def run(bench: Bench, method: str) -> float:
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
        # 1 / (1 + d^2) changes by 2 d / (1 + d^2) of itself for each unit
        return 2e-6 + 2.0 * apart / (1.0 + apart**2) * position_error(method, 1.0, 100.0, True, WALL)

    return Case(f"strength {strength:g}", run, bound)


def _reach(name: str) -> Case:
    return Case(f"reach in float64, {name}", lambda bench, method: _worst(_REACHES[name]), 1e-14, DOUBLES)


CASES = (
    *(_reach(name) for name in _REACHES),
    *(_on_the_surface(gap) for gap in (0.0, 1e-25, 1e-12, 1e-6)),
    *(_budget(count, budget) for count in (1, 100, 2000) for budget in (HALF_CODE, 1e-2)),
    *(_of_strength(strength) for strength in (0.0, 1e-30, 1e30)),
)
