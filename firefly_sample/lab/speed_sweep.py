"""Draws the frames of a measurement of speed, each by all methods in turn."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from firefly_sample.frame import Frame
from firefly_sample.lab.reference.shade import count_pairs
from firefly_sample.lab.speed_limit import LeftOut
from firefly_sample.lab.speed_methods import CHOSEN, METHODS, shaded_by
from firefly_sample.lab.speed_rows import Draw, Draws, make_row
from firefly_sample.lab.speed_steps import Step
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene, ScenePlugin
from firefly_sample.scenes import build_scene
from firefly_sample.settings import Settings

OUTPUTS = "color", "position"
NEXT_FRAME = 1.0 / 24.0
"""Seconds. Each draw comes after the scene was there: else what moves would stand still, and cost nothing."""

Size = tuple[int, int]


@dataclass
class Sweep:
    """Draws steps; the renderer reuses no G-buffer, which would have no time.

    Attributes
    ----------
    draws, done : int
        In all; and so far, with those that were left out.
    """

    plugin: ScenePlugin
    renderer: Renderer
    base: Settings
    time: float
    rounds: int
    methods: list[str]
    left_out: LeftOut
    draws: int
    progress: Callable[[int, int], None] | None
    done: int = field(default=0, init=False)

    @property
    def chosen(self) -> str:
        """The method that ratios refer to: `CHOSEN`, or the first of those that are measured."""
        return CHOSEN if CHOSEN in self.methods else self.methods[0]

    def measure(self, size: Size, step: Step) -> list[dict[str, Any]]:
        """The rows of one step, at the renderer's size."""
        until = self.done + len(step.variations) * (self.rounds + 1) * len(self.methods)
        drawn = {name: Draws() for name in self.methods if not self.left_out.foresees(size, name, step.count)}
        pairs = lights = 0
        for index, parameters in enumerate(step.variations if drawn else []):
            built = build_scene(self.plugin, **parameters)
            counted: int | None = None
            for name in tuple(drawn):
                frame, plan, ms = self._first(built, name)
                if counted is None and plan.batches:
                    counted = count_pairs(self.renderer.surface(plan).position(), plan.lights)
                if index == 0 and self._is_too_long(size, name, step.count, built, ms):
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
                    own.by_seed[-1].append(self._timed(built, name))
        self._tell(until - self.done)
        chosen = drawn.get(self.chosen)
        for name, own in drawn.items():
            # the quickest: on a busy machine a line through two medians points anywhere
            self.left_out.learn(size, name, step.count, min(draw.ms for draw in own.all))
        return [make_row(name, size, lights, own, chosen, pairs) for name, own in drawn.items()]

    def _first(self, built: Scene, name: str) -> tuple[Frame, FramePlan, float]:
        """A frame that compiles and counts, and its milliseconds."""
        self.renderer.count_fragments = True
        try:
            frame, plan, _ = self._draw(built, name)
        finally:
            self.renderer.count_fragments = False
        self._tell()
        return frame, plan, sum(frame.milliseconds.values())

    def _is_too_long(self, size: Size, name: str, count: int, built: Scene, ms: float) -> bool:
        """Whether a first frame took too long, and not because it compiled: it is drawn once more to see."""
        if ms > 1e3 * self.left_out.longest:
            frame, *_ = self._draw(built, name)
            ms = sum(frame.milliseconds.values())
        return self.left_out.is_too_long(size, name, count, ms)

    def _timed(self, built: Scene, name: str) -> Draw:
        *_, draw = self._draw(built, name)
        self._tell()
        return draw

    def _draw(self, built: Scene, name: str) -> tuple[Frame, FramePlan, Draw]:
        renderer = self.renderer
        renderer.settings = self.base.with_changes(**METHODS[name])
        built.update(self.time + NEXT_FRAME)
        start = clock.perf_counter()
        plan = renderer.plan(built, self.time, OUTPUTS)
        planned = clock.perf_counter()
        frame = renderer.draw(plan, read=False)
        spent = 1e3 * (clock.perf_counter() - start)
        # a GPU's clock is not this one
        host = max(spent - sum(frame.milliseconds.values()), 0.0)
        return frame, plan, Draw(frame.milliseconds, 1e3 * (planned - start), host)

    def _tell(self, draws: int = 1) -> None:
        if draws:
            self.done += draws
            if self.progress is not None:
                self.progress(self.done, self.draws)
