"""The frames of a measurement of speed: which are drawn, by which methods, and which would take too long."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, NamedTuple

from firefly_sample.errors import SceneError, SettingsError, did_you_mean
from firefly_sample.frame import Frame
from firefly_sample.lab.reference.chunks import Steps
from firefly_sample.lab.reference.shade import count_pairs
from firefly_sample.lab.speed_report import Draw, Draws, make_row
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.renderer import Renderer
from firefly_sample.scene.parameter import Parameter, resolve_parameters
from firefly_sample.scene.scene import Scene, ScenePlugin
from firefly_sample.scenes import build_scene
from firefly_sample.scenes.plugin import lights_parameter
from firefly_sample.settings import Settings

METHODS: dict[str, dict[str, Any]] = {
    "volumes": {"light_method": "volumes", "volume_depth_test": True},
    "original": {"light_method": "volumes", "volume_depth_test": False},
    "clustered": {"light_method": "clustered"},
    "auto": {"light_method": "auto"},
    "fullscreen": {"light_method": "fullscreen"},
    "loop": {"light_method": "loop"},
}
"""The settings of each method: our light volumes; the original's, without a depth test; clusters; the cheaper
of volumes and clusters; a full-screen pass per light; one full-screen pass that loops over all lights."""
CHOSEN = "volumes"
"""The method that ratios refer to, if it is measured."""
COUNTS = (1, 4, 16, 64, 256, 500, 1000, 4000, 10_000)
"""The counts of lights that are measured by default."""
OUTPUTS = "color", "position"
NEXT_FRAME = 1.0 / 24.0
"""Seconds. The scene is put this far ahead before each draw: otherwise moving parts would cost nothing."""

Size = tuple[int, int]


def check_methods(given: Sequence[str] | None, base: Settings) -> list[str]:
    """Return the names of methods without repetitions; without any given, all that fit the settings.

    Raise a SettingsError if the list is empty, or a method does not exist or does not fit the settings.
    """
    if given is None:
        return [name for name, changes in METHODS.items() if _fits(base, changes)]
    for name in given:
        if name not in METHODS:
            raise SettingsError(
                f"there is no method {name!r}{did_you_mean(name, METHODS)}: choose from {', '.join(METHODS)}"
            )
        base.with_changes(**METHODS[name])
    if not given:
        raise SettingsError(f"the list of methods is empty: choose from {', '.join(METHODS)}")
    return list(dict.fromkeys(given))


def _fits(base: Settings, changes: dict[str, Any]) -> bool:
    try:
        base.with_changes(**changes)
    except SettingsError:
        return False
    return True


class Step(NamedTuple):
    """The frames with one count of lights: the scene's parameters, one dict per seed.

    The number of lights is 0 if the scene has no parameter for it.
    """

    lights: int
    variations: list[dict[str, Any]]


def steps_of(
    plugin: ScenePlugin, given: dict[str, Any], counts: Sequence[int] | None, seeds: Sequence[int] | None
) -> list[Step]:
    """Return a step for each count of lights, fewest first; `given` are the scene's other parameters.

    Raise a SceneError if a parameter is wrong, or the scene has none for counts or seeds that are given.
    """
    if seeds is not None and not any(parameter.name == "seed" for parameter in plugin.parameters):
        raise SceneError(f"scene {plugin.name!r} has no parameter 'seed': leave 'seeds' out")
    seeded = [given] if seeds is None else [{**given, "seed": seed} for seed in seeds]
    counted = lights_parameter(plugin)
    if counted is not None:
        steps = [
            Step(count, [{**parameters, counted.name: count} for parameters in seeded])
            for count in _counts(plugin, counted, given, counts)
        ]
    elif counts is None:
        steps = [Step(0, seeded)]
    else:
        raise SceneError(
            f"scene {plugin.name!r} has no parameter for its number of lights: leave 'counts' out"
        )
    for parameters in chain.from_iterable(step.variations for step in steps):
        resolve_parameters(plugin.name, plugin.parameters, parameters)
    return steps


def _counts(
    plugin: ScenePlugin, counted: Parameter, given: dict[str, Any], counts: Sequence[int] | None
) -> list[int]:
    if counts is None and counted.name in given:
        return [counted.check(given[counted.name], plugin.name)]
    if counts is None:
        low = 0 if counted.minimum is None else counted.minimum
        high = COUNTS[-1] if counted.maximum is None else counted.maximum
        return [count for count in COUNTS if low <= count <= high] or [counted.default]
    if counted.name in given:
        raise SceneError(
            f"scene {plugin.name!r}: {counted.name!r} and 'counts' both set the number of lights: give one "
            "of them"
        )
    if not counts:
        raise SceneError("the list of counts of lights is empty: give at least one, or leave 'counts' out")
    return sorted({counted.check(count, plugin.name) for count in counts})


def predict(known: Sequence[tuple[int, float]], lights: int) -> float | None:
    """Return the milliseconds of a frame on the line through the last two of (lights, milliseconds).

    A falling line counts as level. None if fewer than two are known.
    """
    if len(known) < 2:
        return None
    (fewer, quicker), (last, ms) = known[-2:]
    slope = max((ms - quicker) / (last - fewer), 0.0)
    return ms + slope * (lights - last)


class LeftOut:
    """The frames that are not drawn, because one may take longer than `longest` seconds, and the reasons.

    `rows` has "size", "lights", "method" and "because" of each.
    """

    def __init__(self, longest: float) -> None:
        self.longest = longest
        self.rows: list[dict[str, Any]] = []
        self._known: dict[tuple[Size, str], list[tuple[int, float]]] = {}
        self._stops: dict[str, list[tuple[Size, int]]] = {}

    def learn(self, size: Size, method: str, count: int, ms: float) -> None:
        """Record the milliseconds of the quickest frame with `count` lights; counts must rise."""
        self._known.setdefault((size, method), []).append((count, ms))

    def foresees(self, size: Size, method: str, count: int) -> bool:
        """Return whether a method is left out of a step before it is drawn, and record it."""
        for other, fewer in self._stops.get(method, []):
            if other[0] * other[1] <= size[0] * size[1] and fewer <= count:
                self._note(size, method, count, f"too long already with {fewer:,} at {other[0]}x{other[1]}")
                return True
        ms = predict(self._known.get((size, method), []), count)
        return ms is not None and self.is_too_long(size, method, count, ms, "would take about")

    def is_too_long(self, size: Size, method: str, count: int, ms: float, verb: str = "took") -> bool:
        """Return whether a method is left out of a step because a frame takes `ms`, and record it."""
        if ms <= 1e3 * self.longest:
            return False
        self._stops.setdefault(method, []).append((size, count))
        because = f"a frame {verb} {ms / 1e3:.3g} s, more than {self.longest:g} s"
        self._note(size, method, count, because)
        return True

    def _note(self, size: Size, method: str, count: int, because: str) -> None:
        self.rows.append({"size": list(size), "lights": count, "method": method, "because": because})


@dataclass
class Sweep:
    """Draws steps, each frame by all methods in turn.

    The renderer must not reuse a G-buffer: a reused one would take no time. `progress` also counts the draws
    that are left out.
    """

    plugin: ScenePlugin
    renderer: Renderer
    base: Settings
    time: float
    rounds: int
    methods: list[str]
    left_out: LeftOut
    progress: Steps

    @property
    def chosen(self) -> str:
        """The method that ratios refer to: `CHOSEN`, or the first measured one."""
        return CHOSEN if CHOSEN in self.methods else self.methods[0]

    def measure(self, size: Size, step: Step) -> list[dict[str, Any]]:
        """Return the rows of one step, drawn at the renderer's size."""
        until = self.progress.done + len(step.variations) * (self.rounds + 1) * len(self.methods)
        left_out, count = self.left_out, step.lights
        drawn = {name: Draws() for name in self.methods if not left_out.foresees(size, name, count)}
        pairs = lights = 0
        for index, parameters in enumerate(step.variations if drawn else []):
            built = build_scene(self.plugin, **parameters)
            counted: int | None = None
            for name in tuple(drawn):
                frame, plan, ms = self._first(built, name)
                if counted is None and plan.batches:
                    counted = count_pairs(self.renderer.surface(plan).position(), plan.lights)
                if index == 0:
                    if ms > 1e3 * left_out.longest:  # it compiled shaders: draw again
                        ms = self._draw(built, name)[2].ms
                    if left_out.is_too_long(size, name, count, ms):
                        del drawn[name]
                        continue
                own = drawn[name]
                own.shaded += shaded_by(frame, plan)
                own.draw_calls, own.bytes_per_pixel = frame.draw_calls, plan.bytes_per_pixel
                own.by_seed.append([])
                lights = frame.lights.in_scene
            pairs += counted or 0
            for _ in range(self.rounds):
                for name, own in drawn.items():
                    own.by_seed[-1].append(self._draw(built, name)[2])
                    self.progress.add()
        self.progress.to(until)
        chosen = drawn.get(self.chosen)
        for name, own in drawn.items():
            # the quickest draw: on a busy machine a line through two medians may point anywhere
            left_out.learn(size, name, count, min(draw.ms for draw in own.all))
        return [make_row(name, size, lights, own, chosen, pairs) for name, own in drawn.items()]

    def _first(self, built: Scene, name: str) -> tuple[Frame, FramePlan, float]:
        """Draw a frame that compiles shaders and counts fragments; also return its milliseconds."""
        self.renderer.count_fragments = True
        try:
            frame, plan, draw = self._draw(built, name)
        finally:
            self.renderer.count_fragments = False
        self.progress.add()
        return frame, plan, draw.ms

    def _draw(self, built: Scene, name: str) -> tuple[Frame, FramePlan, Draw]:
        renderer = self.renderer
        renderer.settings = self.base.with_changes(**METHODS[name])
        built.update(self.time + NEXT_FRAME)
        start = clock.perf_counter()
        plan = renderer.plan(built, self.time, OUTPUTS)
        planned = clock.perf_counter()
        frame = renderer.draw(plan, read=False)
        spent = 1e3 * (clock.perf_counter() - start)
        # the GPU's clock is a different one, so the difference may be below 0
        host = max(spent - sum(frame.milliseconds.values()), 0.0)
        return frame, plan, Draw(frame.milliseconds, 1e3 * (planned - start), host)


def shaded_by(frame: Frame, plan: FramePlan) -> int:
    """Return how many (fragment, light) pairs the lighting passes shaded."""
    shaded = frame.shaded or 0
    if plan.light_method.name != "loop":
        return shaded
    # the renderer counts fragments, each of which loops over all lights; a large set has several passes
    passes = sum(len(lights.parts()) for lights in plan.lights)
    return shaded // max(passes, 1) * sum(map(len, plan.lights))
