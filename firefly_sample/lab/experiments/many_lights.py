"""No light, one, and very many: sums stay right, in any order and however they are drawn; none is dropped."""

from __future__ import annotations

import math
from typing import get_args

import numpy as np

from firefly_sample.lab.experiments.bench import Bench
from firefly_sample.lab.experiments.case import Case, positioned
from firefly_sample.lab.experiments.scenes import garden, wall_scene
from firefly_sample.scene.lights import PointLight, PointLights
from firefly_sample.settings import LightMethod, Settings

PLACE = (0.5, 6.0, 0.25)
SMALL, TINY = (48, 36), (8, 6)
"""Pixels of pictures that up to 2,000 lights and that more of them fill."""
OTHER_WAYS: tuple[LightMethod, ...] = tuple(
    way for way in get_args(LightMethod) if way not in ("auto", "volumes")
)
"""Settings `lights` that the other cases leave out."""


def bound_of_sum(count: int) -> float:
    """What float32 may lose of a sum, relative."""
    return 2e-8 * count + 1e-6


def _error_of_pile(bench: Bench, settings: Settings, count: int, size: tuple[int, int]) -> float:
    """Lights of strength 1/N in one place against one light drawn otherwise, over it.

    Infinite if any is dropped.
    """
    settings = settings.with_changes(albedo="rgba32f")  # "forward" rounds no colour
    otherwise = settings.with_changes(
        light_method="fullscreen" if settings.light_method == "volumes" else "volumes"
    )

    def picture(many: int, settings: Settings = settings) -> np.ndarray:
        scene = wall_scene()
        if many:
            places, colors = np.tile(PLACE, (many, 1)), np.full((many, 3), 1.0 / many)
            scene.root.attach_new_node(PointLights("lights", places, colors, 12.0))
        drawn = bench.draw(scene, settings, size)
        if drawn.frame.lights.dropped or drawn.frame.lights.in_view != many:
            return np.full(drawn["radiance"].shape, math.inf)
        return drawn["radiance"]

    given = picture(count)
    if count == 0:
        return float(np.abs(given).max())
    one = picture(1, otherwise)
    if not (one.any() and np.isfinite(one).all()):
        return math.inf
    return float(np.abs(given - one).max() / one.max())


def _pile(count: int, size: tuple[int, int]) -> Case:
    return Case(
        f"{count:,} lights",
        lambda bench, method: _error_of_pile(bench, positioned(method), count, size),
        bound_of_sum(count) if count else 0.0,
    )


def _pile_otherwise(count: int, size: tuple[int, int], ways: tuple[LightMethod, ...]) -> Case:
    def run(bench: Bench, method: str) -> float:
        return _error_of_pile(bench, Settings().with_changes(light_method=method), count, size)

    def bound(method: str) -> float:
        if method == "clustered":  # the sum of a cell's lights does not err the more the more there are
            return 2e-6 if count else 0.0
        return bound_of_sum(count) if count else 0.0

    return Case(f"{count:,} lights without volumes", run, bound, ways)


def _order(count: int) -> Case:
    """Overlapping lights in two orders."""

    def run(bench: Bench, method: str) -> float:
        rng = np.random.default_rng(3)
        places, colors = rng.uniform((-4, 6, -3), (4, 10, 3), (count, 3)), rng.uniform(0, 0.01, (count, 3))

        def picture(order: np.ndarray) -> np.ndarray:
            scene = wall_scene(cells=4)
            scene.root.attach_new_node(PointLights("lights", places[order], colors[order], 6.0))
            return bench.draw(scene, positioned(method), SMALL)["radiance"]

        one, other = picture(np.arange(count)), picture(rng.permutation(count))
        return float(np.abs(one - other).max() / one.max()) if one.any() else math.inf

    return Case(f"{count:,} lights in another order", run, bound_of_sum(count))


def _twice(bench: Bench, method: str) -> float:
    """Two equal lights in one place against one of twice the strength."""
    pictures = []
    for copies, strength in ((2, 0.4), (1, 0.8)):
        scene = wall_scene()
        for index in range(copies):
            light = PointLight(f"light {index}", (strength,) * 3, radius=12.0)
            scene.root.attach_new_node(light).set_pos(*PLACE)
        settings = positioned(method)
        pictures.append(bench.draw(scene, settings)["radiance"])
    if not pictures[1].any():
        return math.inf
    return float(np.abs(pictures[0] - pictures[1]).max() / pictures[1].max())


WAYS: tuple[LightMethod, ...] = ("volumes", "clustered", "fullscreen", "loop")
"""The ways to light a G-buffer; "forward" has none, so that nothing is rounded in one."""


def _ways(bench: Bench, method: str) -> float:
    """The garden by each of `WAYS`: the largest difference of any two, over the 99.9th percentile."""
    pictures = [bench.draw(garden(), positioned(method, lights=way))["radiance"] for way in WAYS]
    bright = np.percentile(pictures[0], 99.9)
    return float(np.ptp(pictures, axis=0).max() / bright) if bright > 0.0 else math.inf


CASES = (
    *(_pile(count, SMALL) for count in (0, 1, 500, 2000)),
    *(_pile(count, TINY) for count in (10_000, 100_000)),
    *(_pile_otherwise(count, SMALL, OTHER_WAYS) for count in (0, 1, 500)),
    *(_pile_otherwise(count, TINY, ("clustered", "loop", "forward")) for count in (10_000, 100_000)),
    Case(f"garden, {len(WAYS)} ways to light", _ways, 5e-6),
    *(_order(count) for count in (500, 2000)),
    Case("equal lights in one place", _twice, bound_of_sum(2)),
)
