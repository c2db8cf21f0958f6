"""What whole frames of the forest lose and what they shade: the renderer itself, against float64."""

from __future__ import annotations

import statistics

import numpy as np

from firefly_sample.lab.experiments.table import Table, Value
from firefly_sample.lab.reference.shade import count_pairs, shade_lights
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.renderer import Renderer
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import PositionMethod, Settings

APART = 5.0
"""Seconds from moment to moment."""
POSITIONS: tuple[PositionMethod, ...] = ("linear32f", "depth32f", "depth24", "inverse_matrix")
_OUTPUTS = ("light", "position", "normal", "albedo", "specular")


def frames(renderer: Renderer, moments: int = 24, size: tuple[int, int] = (80, 60)) -> Table:
    """Largest error of the light of 500 fireflies, by setting `position`, to float64 on the same G-buffer.

    Parameters
    ----------
    moments : int
        Frames, `APART` seconds from each other: fireflies are elsewhere in each.
    size : (int, int)
        Pixels.
    """
    renderer.resize(size)
    errors: dict[str, list[float]] = {name: [] for name in POSITIONS}
    scene = build_scene(find_scene("forest"))
    for moment in range(moments):
        for name in POSITIONS:
            renderer.settings = Settings(position=name, light_method="volumes")
            errors[name].append(_error(renderer, renderer.plan(scene, APART * moment, _OUTPUTS)))
    rows: list[tuple[Value, ...]] = [
        (name, max(found), statistics.median(found)) for name, found in errors.items()
    ]
    about = (
        f"The light of 500 fireflies in the forest at {moments} moments: a frame's largest error over its "
        "largest value, of the worst frame and of the median one."
    )
    return Table("frames", about, ("position", "largest", "median"), rows)


def _error(renderer: Renderer, plan: FramePlan) -> float:
    drawn = renderer.draw(plan)["light"].astype(np.float64)
    gbuffer = renderer.surface(plan).gbuffer()
    _, light = shade_lights(gbuffer, plan.lights, plan.settings)
    covered = np.isfinite(gbuffer.position).all(axis=-1)
    off = np.abs(drawn - plan.ambient - light)[covered]
    return float(off.max() / light[covered].max())


def fragments(renderer: Renderer, moments: int = 4, size: tuple[int, int] = (320, 240)) -> Table:
    """What the pass of lights shades, over (pixel, light) pairs in range: fragments, or lists' lengths.

    Parameters
    ----------
    renderer : Renderer
        One that counts fragments.
    moments : int
        Frames, `APART` seconds from each other.
    size : (int, int)
        Pixels.
    """
    renderer.resize(size)
    ways = {
        "volumes, depth test": Settings(light_method="volumes"),
        "volumes without": Settings(light_method="volumes", volume_depth_test=False),
        "clusters": Settings(light_method="clustered"),
    }
    shaded = dict.fromkeys(ways, 0)
    pairs = 0
    scene = build_scene(find_scene("forest"))
    for moment in range(moments):
        for name in shaded:
            renderer.settings = ways[name]
            plan = renderer.plan(scene, APART * moment, ("light", "position"))
            shaded[name] += renderer.draw(plan, read=False).shaded or 0
        pairs += count_pairs(renderer.surface(plan).position(), plan.lights)
    rows: list[tuple[Value, ...]] = [(name, count, pairs, count / pairs) for name, count in shaded.items()]
    about = (
        f"How often 500 fireflies shade a pixel in {moments} frames of the forest, over the pairs of a pixel "
        "and a light that reaches it: fragments of volumes with a depth test and without, and the lights in "
        "the lists of the pixels' cells."
    )
    return Table("fragments", about, ("lights", "shaded", "pairs", "a pair"), rows)
