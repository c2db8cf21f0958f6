"""How fast lights are drawn, by four methods on the same frames, and how much of that work is needed.

Times on a shared machine mean little by themselves, so each frame is drawn by every method in turn and
the ratios are taken within a frame. What does not depend on the machine is counted: fragments that the
light pass shades, over (pixel, light) pairs that are really in range, counted in float64.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from firefly_sample.errors import SceneError, SettingsError
from firefly_sample.measure.bench import quartile_spread
from firefly_sample.plan.frame_plan import FramePlan
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
    rounds: int = 5,
    device: int | None = None,
    require_gpu: bool = False,
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
        What all methods share; "lights" and "volume_depth_test" are each method's own, and "supersample"
        must be 1.
    time : float
        Seconds.
    seeds : sequence of int, optional
        One frame for each, through the scene's parameter "seed"; the scene as it is when absent.
    rounds : int
        How often each frame is drawn by each method, after a first round that compiles and is not timed.
    device, require_gpu : see `firefly_sample.Renderer`
    progress : callable, optional
        Called with (draws done, draws in all).

    Returns
    -------
    dict
        What ``firefly measure speed --json`` prints: "scene", the plugin's name; "size", [width, height];
        "driver", the GL renderer string; "chosen", the method that the ratios refer to; and "rows", one a
        method, each with

        "method" : str
            A key of `METHODS`.
        "lights" : int
            Lights in the scene (of the last seed).
        "ms" : float
            Milliseconds of a frame, all passes: the median over seeds and rounds.
        "spread" : float
            Interquartile range over median of one seed's rounds; the median of this over the seeds.
        "ratio" : float or None
            This method's time over the chosen one's in the same round: the median over seeds and rounds.
        "passes" : dict
            Milliseconds of each pass by its name, medians as of "ms".
        "shaded" : int
            Fragments that the light pass shaded, summed over the seeds' frames. The loop shades every light
            in one fragment: its fragments count once for each light.
        "pairs" : int
            (Pixel, light) pairs in range, summed likewise; the same for all methods.
        "shaded_per_pair" : float or None
            "shaded" over "pairs", None where no pixel is in range of a light.

    Raises
    ------
    FireflyError
        If the scene, a parameter, a setting, the size or the driver is not as it must be.
    """
    plugin = find_scene(scene)
    given = dict(parameters or {})
    if seeds is not None and not any(parameter.name == "seed" for parameter in plugin.parameters):
        raise SceneError(f"scene {plugin.name!r} has no parameter 'seed': leave the seeds out")
    if rounds < 1 or (seeds is not None and not seeds):
        raise SceneError("there is nothing to measure: give at least one round and one seed")
    variations = [given] if seeds is None else [{**given, "seed": seed} for seed in seeds]
    base = settings or Settings()
    if base.supersample != 1:
        raise SettingsError(f"setting 'supersample' must be 1 to measure speed; got {base.supersample}")
    draws = {name: _Draws() for name in METHODS}
    total, done = len(variations) * (rounds + 1) * len(METHODS), 0
    pairs, lights = 0, 0
    with Renderer(
        size, base, device=device, require_gpu=require_gpu, count_fragments=True, reuse=False
    ) as renderer:
        for variation, changed in enumerate(variations):
            built = build_scene(plugin, **changed)
            for round_index in range(rounds + 1):
                for name, changes in METHODS.items():
                    renderer.settings = base.with_changes(**changes)
                    plan = renderer.plan(built, time, ("color", "position"))
                    frame = renderer.draw(plan, read=False)
                    if round_index == 0:
                        draws[name].shaded += _shaded(name, frame.shaded or 0, plan)
                        if name == CHOSEN:
                            lights = frame.lights.in_scene
                            if plan.batches:
                                pairs += count_pairs(renderer.surface(plan).position(), plan.lights)
                    else:
                        draws[name].add(variation, frame.milliseconds)
                    done += 1
                    if progress is not None:
                        progress(done, total)
        driver = renderer.driver
    rows = [_row(name, draws, lights, pairs) for name in METHODS]
    return {"scene": plugin.name, "size": list(size), "driver": driver, "rows": rows, "chosen": CHOSEN}


def _shaded(method: str, fragments: int, plan: FramePlan) -> int:
    """Fragments times the lights that each stands for: the loop has one full-screen pass for each set."""
    if method != "loop" or not plan.lights:
        return fragments
    return fragments // len(plan.lights) * sum(map(len, plan.lights))


class _Draws:
    """What one method's draws took."""

    def __init__(self) -> None:
        self.by_variation: dict[int, list[float]] = {}
        self.passes: dict[str, list[float]] = {}
        self.shaded = 0

    @property
    def totals(self) -> list[float]:
        return [total for totals in self.by_variation.values() for total in totals]

    def add(self, variation: int, milliseconds: Mapping[str, float]) -> None:
        self.by_variation.setdefault(variation, []).append(sum(milliseconds.values()))
        for name, value in milliseconds.items():
            self.passes.setdefault(name, []).append(value)


def _row(name: str, draws: Mapping[str, _Draws], lights: int, pairs: int) -> dict[str, Any]:
    own, chosen = draws[name], draws[CHOSEN]
    # a GPU's clock may tell 0 for a frame with next to nothing in it
    ratios = [a / b for a, b in zip(own.totals, chosen.totals, strict=True) if b]
    return {
        "method": name,
        "lights": lights,
        "ms": statistics.median(own.totals),
        "spread": statistics.median(map(quartile_spread, own.by_variation.values())),
        "ratio": statistics.median(ratios) if ratios else None,
        "passes": {step: statistics.median(values) for step, values in own.passes.items()},
        "shaded": own.shaded,
        "pairs": pairs,
        "shaded_per_pair": own.shaded / pairs if pairs else None,
    }
