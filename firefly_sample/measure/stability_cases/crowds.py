"""No light, one, and very many: sums stay right, in any order, and none is dropped."""

from __future__ import annotations

import numpy as np

from firefly_sample.measure.stability_cases.bench import Bench
from firefly_sample.measure.stability_cases.case import Case, positioned
from firefly_sample.measure.stability_cases.scenes import wall_scene
from firefly_sample.scene.lights import PointLight, PointLights

__all__ = ["CASES"]

PLACE = (0.5, 6.0, 0.25)


def bound_of_sum(count: int) -> float:
    """What float32 may lose of a sum, relative."""
    return 2e-8 * count + 1e-6


def _pile(count: int, size: tuple[int, int]) -> Case:
    """Lights of strength 1/N in one place, against one light; 1 if any is dropped."""

    def run(bench: Bench, method: str) -> float:
        settings = positioned(method)

        def picture(many: int) -> np.ndarray:
            scene = wall_scene()
            if many:
                places, colors = np.tile(PLACE, (many, 1)), np.full((many, 3), 1.0 / many)
                scene.root.attach_new_node(PointLights("lights", places, colors, 12.0))
            drawn = bench.draw(scene, settings, size)
            if drawn.frame.lights.dropped or drawn.frame.lights.in_view != many:
                return np.full(drawn["radiance"].shape, 1e30)
            return drawn["radiance"]

        given = picture(count)
        if count == 0:
            return float(np.abs(given).max())
        one = picture(1)
        return float(np.abs(given - one).max() / one.max())

    return Case(f"{count:,} lights", run, bound_of_sum(count) if count else 0.0)


def _order(count: int) -> Case:
    """Overlapping lights in two orders."""

    def run(bench: Bench, method: str) -> float:
        rng = np.random.default_rng(3)
        places, colors = rng.uniform((-4, 6, -3), (4, 10, 3), (count, 3)), rng.uniform(0, 0.01, (count, 3))

        def picture(order: np.ndarray) -> np.ndarray:
            scene = wall_scene(cells=4)
            scene.root.attach_new_node(PointLights("lights", places[order], colors[order], 6.0))
            return bench.draw(scene, positioned(method), (48, 36))["radiance"]

        one, other = picture(np.arange(count)), picture(rng.permutation(count))
        return float(np.abs(one - other).max() / one.max())

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
    return float(np.abs(pictures[0] - pictures[1]).max() / pictures[1].max())


CASES = (
    *(_pile(count, (48, 36)) for count in (0, 1, 500, 2000)),
    *(_pile(count, (8, 6)) for count in (10_000, 100_000)),
    *(_order(count) for count in (500, 2000)),
    Case("equal lights in one place", _twice, bound_of_sum(2)),
)
