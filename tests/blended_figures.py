"""Measures the three ways to draw blended surfaces, for docs/trade.md: `python -m tests.blended_figures`.

The first table has errors against rays and times of drawing, the second the time that the order takes.
"""

from __future__ import annotations

import statistics
import time

import numpy as np

from firefly_sample.lab.reference.frame import reference_settings
from firefly_sample.lab.reference.layer_rays import cast_layers
from firefly_sample.lab.trade_bench import TradeBench
from firefly_sample.scene.geom import Geom
from firefly_sample.settings import Settings
from tests.blended import KINDS_OF_GLASS, add_lights, add_panes, add_squares, backdrop, glass
from tests.conftest import make_renderer
from tests.scenes import ball, geom_node

SIZE = (320, 240)
METHODS = ("sorted", "exact", "weighted")
COUNTS = (100, 1_000, 10_000, 100_000)
ROUNDS = 5


def spheres(count):
    """Two-sided spheres, none of which meets another."""
    scene = add_lights(backdrop(), ("sun", "attenuated"))
    places = [(x, y, z) for y in (8.0, 10.5, 13.0) for x in (-2.4, 0.0, 2.4) for z in (-1.2, 1.2)]
    for index, place in enumerate(places[:count]):
        color = np.random.default_rng(index).uniform(0.3, 1.0, 3)
        made = glass(f"glass {index}", color, 0.4, specular=(0.4, 0.4, 0.4), shininess=24.0)
        scene.root.attach_new_node(geom_node(f"sphere {index}", ball(1.1, 3), made)).set_pos(*place)
    return scene


def panes(count, crossing, squares=False):
    scene = add_panes(add_lights(backdrop()), count, crossing=crossing, kinds=KINDS_OF_GLASS[:4])
    return add_squares(scene) if squares else scene


SCENES = {
    "12 panes apart": lambda: panes(12, False),
    "12 panes that cross": lambda: panes(12, True),
    "40 panes apart": lambda: panes(40, False),
    "40 panes that cross": lambda: panes(40, True),
    "12 crossing panes, 40 particles, 15 dots": lambda: panes(12, True, True),
    "18 spheres of 1,280 triangles": lambda: spheres(18),
}


def shards(count, seed=0):
    """Small two-sided triangles, strewn through the view: together they cover it about once."""
    rng = np.random.default_rng(seed)
    centers = rng.uniform((-4, 8, -3), (4, 14, 3), (count, 3))
    corners = centers[:, None] + rng.normal(size=(count, 3, 3)) * (3.0 / count**0.5)
    geom = Geom(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    scene = add_lights(backdrop(), ("sun",))
    scene.root.attach_new_node(geom_node("shards", geom, glass("glass", (0.6, 0.8, 0.9), 0.5)))
    return scene


def errors():
    print("| scene | layers | method | time | largest | 99 % | codes |")
    print("|---|--:|---|--:|--:|--:|--:|")
    left_out = []
    with make_renderer(SIZE) as renderer:
        for name, make in SCENES.items():
            scene = make()
            bench = TradeBench(renderer, scene, 0.0, Settings())
            left_out.append(1.0 - bench.agreed.mean())
            renderer.settings = reference_settings(Settings())
            exact = renderer.plan(scene, 0.0, ("color",))
            y = bench.reference.position[..., 1]
            most = cast_layers(exact, np.where(np.isfinite(y), y, np.inf)).most
            for method in METHODS:
                settings = Settings(transparency=method)
                drawn = bench.draw(settings)
                timing = bench.time_of(settings, 2.0, most=9)
                off = drawn.errors
                print(
                    f"| {name} | {most} | {method} | {timing.ratio:.2f} | {off.largest:.1e} "
                    f"| {off.percentile_99:.1e} | {off.codes} |"
                )
    print(f"\nNot compared: at most {max(left_out):.1%} of the pixels.")


def times():
    """Print the milliseconds of a frame after a move, planned and drawn, by the number of triangles."""
    print("\n| triangles | order | drawn, sorted | drawn, weighted |")
    print("|--:|--:|--:|--:|")
    with make_renderer(SIZE) as renderer:
        for count in COUNTS:
            scene = shards(count)
            planned = {method: [] for method in METHODS}
            drawn = {method: [] for method in METHODS}
            for step in range(ROUNDS + 1):
                for method in ("sorted", "weighted"):
                    renderer.settings = Settings(transparency=method)
                    scene.camera.set_x(0.01 * step + (0.003 if method == "sorted" else 0.0))
                    start = time.perf_counter()
                    plan = renderer.plan(scene, 0.0, ("color",))
                    middle = time.perf_counter()
                    renderer.draw(plan, read=False)
                    if step:  # the first compiles shaders
                        planned[method].append(1e3 * (middle - start))
                        drawn[method].append(1e3 * (time.perf_counter() - middle))
            order = statistics.median(planned["sorted"]) - statistics.median(planned["weighted"])
            own, other = (statistics.median(drawn[method]) for method in ("sorted", "weighted"))
            print(f"| {count:,} | {order:.1f} | {own:.1f} | {other:.1f} |")


if __name__ == "__main__":
    errors()
    times()
