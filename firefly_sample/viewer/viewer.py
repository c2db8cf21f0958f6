"""What keys and mouse do, and what is shown of it; knows nothing of glfw."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

from firefly_sample.errors import FireflyError
from firefly_sample.frame import Frame
from firefly_sample.gpu.presenter import Layer
from firefly_sample.lab.trade_bench import PICTURE
from firefly_sample.renderer import Renderer
from firefly_sample.scene.lens_constants import LensConstants
from firefly_sample.scene.parameter import KeyStep, Parameter
from firefly_sample.scene.scene import Scene
from firefly_sample.viewer.clock import Clock
from firefly_sample.viewer.controls import Binding, parameter_bindings
from firefly_sample.viewer.help import help_plate
from firefly_sample.viewer.orbit import OrbitCamera, SceneSeenBy
from firefly_sample.viewer.overlay import Rows, rows_plate, text_plate, title_plate
from firefly_sample.viewer.performance import SECONDS, PerformanceResult, PerformanceTest
from firefly_sample.viewer.screenshot import save_screenshot
from firefly_sample.viewer.stage import Stage
from firefly_sample.viewer.status import Meter, status_rows
from firefly_sample.viewer.views import STRIP, Drawn, draw_view, views_of

MARGIN = 10
"""Pixels between the window's edge and text, at scale 1."""
MESSAGE_SECONDS = 4.0
RESULT_SECONDS = 12.0


class Viewer:
    """A stage, a camera and a clock, shown by a renderer that draws on a window.

    Parameters
    ----------
    stage : Stage
    renderer : Renderer
        Made with ``window=True``.
    clock : Clock
    folder : Path
        For screenshots.
    report : callable
        Is given the result of each performance test.

    Attributes
    ----------
    closed : bool
        True when the user wants to leave.

    Raises
    ------
    SceneError
        If a parameter wants a key that it cannot have.
    """

    def __init__(
        self,
        stage: Stage,
        renderer: Renderer,
        clock: Clock,
        folder: Path,
        report: Callable[[PerformanceResult], None],
    ) -> None:
        self._stage, self._renderer, self._clock, self._folder = stage, renderer, clock, folder
        self._report = report
        self._test: PerformanceTest | None = None
        self._leave_after_test = False
        self._orbit: OrbitCamera | None = None
        self._frame: Frame | None = None
        self._lens: LensConstants | None = None  # of that frame
        self._views = views_of(renderer.settings.look)
        self._view = PICTURE
        self._help = False
        self._shot = False
        self._message = ""
        self._message_until = 0.0
        self._meter = Meter()
        self._rows: Rows = ()
        self._rows_stale = True
        self._told: set[str] = set()
        self._now = 0.0
        self._stale = True
        self.closed = False
        plugin = stage.plugin
        self._own = self._own_bindings()
        self._scene_keys = parameter_bindings(plugin.name, plugin.parameters, self._own, self._step)
        self._bindings = {binding.key: binding for binding in (*self._scene_keys, *self._own)}

    @property
    def title(self) -> str:
        """For the window's frame."""
        view = "" if self._view == PICTURE else f", {self._view}"
        return f"{self._stage.plugin.name}{view} - firefly"

    @property
    def testing(self) -> bool:
        """Whether a performance test runs."""
        return self._test is not None

    # --- What the window reports ---

    def key(self, name: str, repeated: bool) -> None:
        """A key is pressed, or held down so long that it repeats."""
        self._stale = True
        binding = self._bindings.get(name)
        if binding is not None and (binding.repeats or not repeated):
            self._rows_stale = True
            binding.act()

    def drag(self, button: str, right: float, down: float) -> None:
        """The mouse moves with a button held ("left", "right", "middle"), in heights of the window."""
        self._stale = True
        if button == "right" and self._stage.drag(right, down):
            self._rows_stale = True
        elif button == "left":
            self._own_camera().turn(right, down)
        else:
            self._pan(right, down)

    def _pan(self, right: float, down: float) -> None:
        if self._lens is not None:
            self._own_camera().pan(right, down, self._lens)

    def scroll(self, steps: float) -> None:
        """The wheel turns; steps above 0 are away from the user."""
        self._stale = True
        self._own_camera().zoom(steps)

    # --- What comes of it ---

    def _own_bindings(self) -> list[Binding]:
        return [
            Binding("v", "next view: buffers", self._next_view),
            Binding("p", "pause, go on", self._pause),
            Binding("r", "the scene's own camera", self._reset_camera),
            Binding("s", "save a screenshot", self._take_shot),
            Binding("t", f"performance test: one turn, {SECONDS:g} s", self._toggle_test),
            Binding("f1", "show or hide this help", self._toggle_help),
            Binding("escape", "leave", self._leave),
        ]

    def _step(self, parameter: Parameter, key: KeyStep) -> None:
        try:
            self._say(self._stage.step(parameter, key))
        except FireflyError as error:
            self._say(str(error))

    def _next_view(self) -> None:
        self._view = self._views[(self._views.index(self._view) + 1) % len(self._views)]

    def _pause(self) -> None:
        self._clock.toggle(self._now)

    def _reset_camera(self) -> None:
        self._orbit = None

    def _take_shot(self) -> None:
        self._shot = True

    def _toggle_help(self) -> None:
        self._help = not self._help

    def _leave(self) -> None:
        """What was opened last goes first."""
        if self._help:
            self._help = False
        elif self.testing:
            self.end_test()
        else:
            self.closed = True

    def _own_camera(self) -> OrbitCamera:
        if self._orbit is None:
            self._orbit = OrbitCamera(self._stage.scene)
        return self._orbit

    def _say(self, text: str, seconds: float = MESSAGE_SECONDS) -> None:
        self._message, self._message_until = text, self._now + seconds

    # --- The performance test ---

    def start_test(self, seconds: float = SECONDS, then_leave: bool = False) -> None:
        """Turn the camera from where the view is, and count frames; with `then_leave`, close at the end."""
        self._test, self._leave_after_test = PerformanceTest(seconds), then_leave

    def end_test(self) -> None:
        """Report what a test has measured so far, if one runs."""
        test, self._test = self._test, None
        if test is None:
            return
        self.closed |= self._leave_after_test
        self._rows_stale = True
        if self._frame is not None:
            stage = self._stage
            result = test.result(stage.plugin.name, stage.values, self._renderer.settings, self._frame)
            self._report(result)
            self._say(result.line(), RESULT_SECONDS)

    def hide(self) -> None:
        """The window cannot be seen: a test that has begun would only count time."""
        if self._test is not None and self._test.began:
            self.end_test()

    def _toggle_test(self) -> None:
        if self.testing:
            self.end_test()
        else:
            self.start_test()

    def _advance_test(self) -> None:
        """Count the frame that is on the window now."""
        if self._test is not None and self._frame is not None:
            self._test.advance(self._now, self._frame, self._own_camera())
            if self._test.done:
                self.end_test()

    # --- What is shown ---

    def due(self, now: float) -> bool:
        """Return whether a frame of the same size at `now` (the clock's seconds) may differ from the last."""
        self._stale |= self._now < self._message_until <= now
        self._now = now
        return self._stale or self.testing or not self._clock.paused

    def draw(self, size: tuple[int, int], scale: float, now: float) -> None:
        """Draw a frame on the window.

        Parameters
        ----------
        size : (int, int)
            Of the window's framebuffer, in pixels.
        scale : float
            Of text; 1 on an ordinary screen.
        now : float
            The clock's seconds.
        """
        self._now = now
        self._advance_test()
        if size != self._renderer.size:
            self._renderer.resize(size)
        time = self._clock.time(now)
        drawn = self._draw_or_take_back(time, scale)
        if self._shot:
            self._save(drawn)
        self._frame, self._lens = drawn.frame, drawn.plan.view.lens
        self._warn(drawn.frame.warnings)
        if self._meter.add(now, drawn.milliseconds) or self._rows_stale:
            test = "" if self._test is None else self._test.text
            self._rows = status_rows(self._stage, drawn.frame, self._meter.text, self._clock.paused, test)
            self._rows_stale = False
        self._renderer.present(drawn.plan, self._layers(drawn, size, scale))
        self._stale = False

    def _draw_or_take_back(self, time: float, scale: float) -> Drawn:
        """Draw the view; where a key has just made that impossible, say why, and undo what it did."""
        try:
            drawn = draw_view(self._renderer, self._seen_scene(), time, self._view, scale, read=self._shot)
        except FireflyError as error:
            if not self._stage.take_back():
                raise
            self._say(str(error))
            self._rows_stale = True
            drawn = draw_view(self._renderer, self._seen_scene(), time, self._view, scale, read=self._shot)
        self._stage.drawn()
        return drawn

    def _seen_scene(self) -> Scene:
        scene = self._stage.scene
        return scene if self._orbit is None else SceneSeenBy(scene, self._orbit.path)

    def _save(self, drawn: Drawn) -> None:
        self._shot = False
        try:
            self._say(f"saved {save_screenshot(self._folder, self._stage.plugin.name, drawn.picture())}")
        except FireflyError as error:
            self._say(str(error))

    def _warn(self, texts: tuple[str, ...]) -> None:
        """Pass a plan's warnings on, each once."""
        for text in texts:
            if text not in self._told:
                self._told.add(text)
                self._say(text)
                warnings.warn(text, stacklevel=2)

    def _layers(self, drawn: Drawn, size: tuple[int, int], scale: float) -> list[Layer]:
        """Everything over the picture, lowest first."""
        width, height = size
        margin = round(MARGIN * scale)
        layers = [] if drawn.image is None else [drawn.image]
        status = rows_plate(self._stage.plugin.name, self._rows, "F1 shows the keys", scale)
        if not self._help:
            layers.append(Layer(status, (margin, margin)))
        bottom = height - margin
        if drawn.image is not None and self._view == STRIP:
            bottom -= drawn.image.pixels.shape[0]
        if drawn.note:
            plate = title_plate(self._view, drawn.note, scale, width - 2 * margin)
            bottom -= plate.shape[0]
            layers.append(Layer(plate, (margin, bottom)))
            bottom -= margin
        if self._help:
            renderer = self._renderer
            driver = f"{renderer.driver}{' (software, slow)' if renderer.software else ''}"
            name = self._stage.plugin.name
            plate = help_plate(
                name, self._scene_keys, self._own, driver, size, scale, self._stage.scene.drag_help
            )
            corner = (width - plate.shape[1]) // 2, (height - plate.shape[0]) // 2
            layers.append(Layer(plate, corner))
        if self._now < self._message_until:
            plate = text_plate(self._message, scale, width - 2 * margin)
            layers.append(Layer(plate, ((width - plate.shape[1]) // 2, bottom - plate.shape[0])))
        return layers
