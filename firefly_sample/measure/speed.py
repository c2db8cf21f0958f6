"""How fast lights are drawn, by four methods on the same frames, and how much of that work is needed.

Times on a shared machine mean little by themselves, so each frame is drawn by every method in turn and
the ratios are taken within a frame. What does not depend on the machine is counted: fragments that the
light pass shades, over (pixel, light) pairs that are really in range, counted in float64.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from firefly_sample.errors import SceneError
from firefly_sample.reference.shade import count_pairs
from firefly_sample.renderer import Renderer
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings

__all__ = ["METHODS", "measure_speed"]

METHODS: dict[str, dict[str, Any]] = {
    "volumes": {"lights": "volumes", "volume_depth_test": True},
    "original": {"lights": "volumes", "volume_depth_test": False},
    "fullscreen": {"lights": "fullscreen"},
    "loop": {"lights": "loop"},
}
"""Settings of each method: our volumes; the original's, without a depth test; a full-screen pass for each
light; and one full-screen pass that loops over all lights."""

CHOSEN = "volumes"


def measure_speed(
    scene: str = "forest",
    *,
    parameters: Mapping[str, Any] | None = None,
    size: tuple[int, int] = (800, 600),
    settings: Settings | None = None,
    time: float = 5.0,
    seeds: Sequence[int] | None = None,
    rounds: int = 3,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Draw the same frames by every method of `METHODS`.

    Parameters
    ----------
    scene : str
        Name of a scene plugin, or "package.module:object".
    parameters : mapping, optional
        The scene's parameters.
    size : (int, int)
        Pixels.
    settings : Settings, optional
        What all methods share; "lights" and "volume_depth_test" are each method's own.
    time : float
        Seconds.
    seeds : sequence of int, optional
        One frame for each, through the scene's parameter "seed"; the scene as it is when absent.
    rounds : int
        How often each frame is drawn by each method; a first round that compiles is not counted.
    progress : callable, optional
        Called with (draws done, draws in all).

    Returns
    -------
    dict
        {"scene", "size", "driver", "rows", "chosen"}. A row has "method", "lights" (in the scene), "ms"
        (median of a frame's passes), "spread" (interquartile range over median), "ratio" (median over the
        draws of this method's time over that of `CHOSEN` in the same round), "passes" (median
        milliseconds of each), "shaded" and "pairs" (sums over the frames) and "shaded_per_pair". The loop
        shades every light in one fragment: its "shaded" counts fragments times lights.

    Raises
    ------
    FireflyError
        If the scene, a parameter, the size or the driver is not as it must be.
    """
    plugin = find_scene(scene)
    given = dict(parameters or {})
    if seeds is not None and not any(parameter.name == "seed" for parameter in plugin.parameters):
        raise SceneError(f"scene {plugin.name!r} has no parameter 'seed': leave the seeds out")
    if rounds < 1 or (seeds is not None and not seeds):
        raise SceneError("there is nothing to measure: give at least one round and one seed")
    variations = [given] if seeds is None else [{**given, "seed": seed} for seed in seeds]
    base = settings or Settings()
    draws = {name: _Draws() for name in METHODS}
    total, done = len(variations) * (rounds + 1) * len(METHODS), 0
    pairs, lights = 0, 0
    with Renderer(size, base, count_fragments=True) as renderer:
        for changed in variations:
            built = build_scene(plugin, **changed)
            for round_index in range(rounds + 1):
                for name, changes in METHODS.items():
                    renderer.settings = base.with_changes(**changes)
                    plan = renderer.plan(built, time, ("color", "position"))
                    frame = renderer.draw(plan, read=False)
                    if round_index == 0:
                        many = frame.lights.in_view if name == "loop" else 1
                        draws[name].shaded += (frame.shaded or 0) * many
                        if name == CHOSEN:
                            pairs += count_pairs(renderer.surface(plan).position(), plan.lights)
                            lights = frame.lights.in_scene
                    else:
                        draws[name].add(frame.milliseconds)
                    done += 1
                    if progress is not None:
                        progress(done, total)
        driver = renderer.driver
    rows = [_row(name, draws, lights, pairs) for name in METHODS]
    return {"scene": plugin.name, "size": list(size), "driver": driver, "rows": rows, "chosen": CHOSEN}


class _Draws:
    """What one method's draws took."""

    def __init__(self) -> None:
        self.totals: list[float] = []
        self.passes: dict[str, list[float]] = {}
        self.shaded = 0

    def add(self, milliseconds: Mapping[str, float]) -> None:
        self.totals.append(sum(milliseconds.values()))
        for name, value in milliseconds.items():
            self.passes.setdefault(name, []).append(value)


def _row(name: str, draws: Mapping[str, _Draws], lights: int, pairs: int) -> dict[str, Any]:
    own, chosen = draws[name], draws[CHOSEN]
    median = statistics.median(own.totals)
    ratios = [a / b for a, b in zip(own.totals, chosen.totals, strict=True)]
    return {
        "method": name,
        "lights": lights,
        "ms": median,
        "spread": _quartile_range(own.totals) / median,
        "ratio": statistics.median(ratios),
        "passes": {step: statistics.median(values) for step, values in own.passes.items()},
        "shaded": own.shaded,
        "pairs": pairs,
        "shaded_per_pair": own.shaded / pairs if pairs else None,
    }


def _quartile_range(values: list[float]) -> float:
    if len(values) < 2:
        return 0.0
    first, _, third = statistics.quantiles(values, n=4, method="inclusive")
    return third - first
