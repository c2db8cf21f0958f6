"""Act on the events of the window, and draw its frames; only `glfw_window` calls glfw."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path

from firefly_sample.capture.files import save_screenshot
from firefly_sample.errors import FireflyError
from firefly_sample.frame import Frame
from firefly_sample.gpu.presenter import Layer
from firefly_sample.renderer import Renderer
from firefly_sample.scene.lens_constants import LensConstants
from firefly_sample.scene.other_camera import SceneWithCamera
from firefly_sample.scene.parameter import KeyStep, Parameter
from firefly_sample.scene.scene import Scene
from firefly_sample.scenes.plugin import folder_name
from firefly_sample.viewer.buffer_pictures import Pixels
from firefly_sample.viewer.controls import Binding, help_plate, parameter_bindings
from firefly_sample.viewer.orbit import OrbitCamera
from firefly_sample.viewer.overlay import Rows, rows_plate, text_plate
from firefly_sample.viewer.performance import SECONDS, PerformanceResult, PerformanceTest, RateMeter
from firefly_sample.viewer.shown_scene import Clock, ShownScene
from firefly_sample.viewer.window_views import PICTURE, STRIP, DrawnView, draw_view, views_of

MARGIN = 10
"""Pixels between the window's edge and text, at scale 1."""
MESSAGE_SECONDS = 4.0
RESULT_SECONDS = 12.0
_KEYS = {
    "v": "next view: picture or buffers",
    "p": "pause or continue",
    "r": "back to the scene's camera",
    "s": "save a screenshot",
    "t": f"performance test: one turn, {SECONDS:g} s",
    "f1": "show or hide this help",
    "escape": "close",
}
"""The window's own keys, and their actions."""


class Viewer:
    """A scene, a camera and a clock, drawn on a window whose events it receives.

    Parameters
    ----------
    renderer : Renderer
        Made with ``window=True``.
    folder : Path
        For screenshots.
    report : callable
        Is given the result of each performance test.

    Attributes
    ----------
    bindings : dict of str to Binding
        The action of each key; see `parameter_bindings`.
    status : tuple of (str, str)
        The rows of text in the window's corner.
    closed : bool
        True after the user has asked to close the window.
    """

    def __init__(
        self,
        shown: ShownScene,
        renderer: Renderer,
        clock: Clock,
        folder: Path,
        report: Callable[[PerformanceResult], None],
    ) -> None:
        self._shown, self._renderer, self._clock, self._folder = shown, renderer, clock, folder
        self._report = report
        self._test: PerformanceTest | None = None
        self._close_after_test = False
        self._orbit: OrbitCamera | None = None
        self._frame: Frame | None = None
        self._lens: LensConstants | None = None  # of that frame
        self._views = views_of(renderer.settings.look)
        self._view = PICTURE
        self._help = False
        self._screenshot_wanted = False
        self._message = ""
        self._message_until = 0.0
        self._meter = RateMeter()
        self.status: Rows = ()
        self._status_stale = True
        self._warned: set[str] = set()
        self._now = 0.0
        self._stale = True
        self.closed = False
        self._own_keys = [Binding(key, action, partial(self._act, key)) for key, action in _KEYS.items()]
        plugin = shown.plugin
        self._scene_keys = parameter_bindings(plugin.name, plugin.parameters, self._own_keys, self._step)
        self.bindings = {binding.key: binding for binding in (*self._scene_keys, *self._own_keys)}

    @property
    def title(self) -> str:
        """The window's title."""
        view = "" if self._view == PICTURE else f", {self._view}"
        return f"{self._shown.plugin.name}{view} - firefly"

    @property
    def testing(self) -> bool:
        """True while a performance test runs."""
        return self._test is not None

    # --- Events of the window ---

    def key(self, name: str, repeated: bool) -> None:
        """Act on a key: a letter, a digit, or up, down, left, right, escape, f1."""
        self._stale = True
        binding = self.bindings.get(name)
        if binding is not None and (binding.repeats or not repeated):
            self._status_stale = True
            binding.act()

    def drag(self, button: str, right: float, down: float) -> None:
        """Turn or pan the camera, or let the scene use the right button.

        Parameters
        ----------
        button : {"left", "right", "middle"}
        right, down : float
            How far the mouse has moved, in heights of the window.
        """
        self._stale = True
        if button == "right" and self._shown.drag(right, down):
            self._status_stale = True
        elif button == "left":
            self._own_camera().turn(right, down)
        elif self._lens is not None:
            self._own_camera().pan(right, down, self._lens)

    def scroll(self, steps: float) -> None:
        """Zoom; steps above 0 turn the wheel away from the user."""
        self._stale = True
        self._own_camera().zoom(steps)

    def _step(self, parameter: Parameter, key: KeyStep) -> None:
        try:
            self._say(self._shown.step(parameter, key))
        except FireflyError as error:
            self._say(str(error))

    def _act(self, key: str) -> None:
        """Do the action of one of the window's own keys.

        Esc closes the help, or else ends the performance test, or else closes the window.
        """
        match key:
            case "v":
                self._view = self._views[(self._views.index(self._view) + 1) % len(self._views)]
            case "p":
                self._clock.toggle(self._now)
            case "r":
                self._orbit = None
            case "s":
                self._screenshot_wanted = True
            case "f1":
                self._help = not self._help
            case "escape" if self._help:
                self._help = False
            case "t" | "escape" if self.testing:
                self.end_test()
            case "t":
                self.start_test()
            case "escape":
                self.closed = True

    def _own_camera(self) -> OrbitCamera:
        if self._orbit is None:
            self._orbit = OrbitCamera(self._shown.scene)
        return self._orbit

    def _say(self, text: str, seconds: float = MESSAGE_SECONDS) -> None:
        self._message, self._message_until = text, self._now + seconds

    # --- The performance test ---

    def start_test(self, seconds: float = SECONDS, then_close: bool = False) -> None:
        """Turn the camera from the present view, and count frames; with `then_close`, close at the end."""
        self._test, self._close_after_test = PerformanceTest(seconds), then_close

    def end_test(self) -> None:
        """Report the results of the running test so far, if there is one."""
        test, self._test = self._test, None
        if test is None:
            return
        self.closed |= self._close_after_test
        self._status_stale = True
        if self._frame is not None:
            shown = self._shown
            result = test.result(shown.plugin.name, shown.values, self._renderer.settings, self._frame)
            self._report(result)
            self._say(result.line(), RESULT_SECONDS)

    def hide(self) -> None:
        """End a test that has begun, because the window is hidden and draws no frames."""
        if self._test is not None and self._test.began:
            self.end_test()

    # --- Drawing ---

    def due(self, now: float) -> bool:
        """Return True if a frame of the same size at `now` (the clock's seconds) may differ from the last."""
        self._stale |= self._now < self._message_until <= now
        self._now = now
        return self._stale or self.testing or not self._clock.paused

    def draw(self, size: tuple[int, int], scale: float, now: float) -> None:
        """Draw a frame on the window at `now` (the clock's seconds).

        Parameters
        ----------
        size : (int, int)
            Of the window's framebuffer, in pixels.
        scale : float
            Scale of text; 1 on an ordinary screen.
        """
        self._now = now
        if self._test is not None and self._frame is not None:
            # the last frame is on the window now
            self._test.advance(now, self._frame, self._own_camera())
            if self._test.done:
                self.end_test()
        if size != self._renderer.size:
            self._renderer.resize(size)
        drawn = self._draw_or_undo(self._clock.time(now), scale)
        if self._screenshot_wanted:
            self._save(drawn.picture())
        self._frame, self._lens = drawn.frame, drawn.plan.view.lens
        for text in drawn.frame.warnings:
            if text not in self._warned:
                self._warned.add(text)
                self._say(text)
                warnings.warn(text, stacklevel=2)
        if self._meter.add(now, drawn.milliseconds) or self._status_stale:
            test = "" if self._test is None else self._test.progress
            self.status = self._shown.status_rows(drawn.frame, self._meter.text, self._clock.paused, test)
            self._status_stale = False
        self._renderer.present(drawn.plan, self._layers(drawn, size, scale))
        self._stale = False

    def _draw_or_undo(self, time: float, scale: float) -> DrawnView:
        """Draw the view; if the last change of a parameter prevents it, say why and undo that change."""
        try:
            drawn = self._draw_view(time, scale)
        except FireflyError as error:
            if not self._shown.undo():
                raise
            self._say(str(error))
            self._status_stale = True
            drawn = self._draw_view(time, scale)
        self._shown.was_drawn()
        return drawn

    def _draw_view(self, time: float, scale: float) -> DrawnView:
        scene: Scene = self._shown.scene
        if self._orbit is not None:
            scene = SceneWithCamera(scene, self._orbit.path)
        return draw_view(self._renderer, scene, time, self._view, scale, read=self._screenshot_wanted)

    def _save(self, picture: Pixels) -> None:
        self._screenshot_wanted = False
        try:
            self._say(f"saved {save_screenshot(self._folder, folder_name(self._shown.plugin), picture)}")
        except FireflyError as error:
            self._say(str(error))

    def _layers(self, drawn: DrawnView, size: tuple[int, int], scale: float) -> list[Layer]:
        """Return the images over the picture, lowest first."""
        width, height = size
        margin = round(MARGIN * scale)
        plugin = self._shown.plugin
        layers = [] if drawn.image is None else [drawn.image]
        if not self._help:
            status = rows_plate(plugin.name, self.status, "F1 shows the keys", scale)
            layers.append(Layer(status, (margin, margin)))
        bottom = height - margin
        if drawn.image is not None and self._view == STRIP:
            bottom -= drawn.image.pixels.shape[0]
        if drawn.note:
            plate = text_plate(drawn.note, scale, width - 2 * margin, title=self._view)
            bottom -= plate.shape[0]
            layers.append(Layer(plate, (margin, bottom)))
            bottom -= margin
        if self._help:
            driver = f"{self._renderer.driver}{' (software, slow)' if self._renderer.software else ''}"
            drag_help = self._shown.scene.drag_help
            plate = help_plate(plugin.name, self._scene_keys, self._own_keys, driver, size, scale, drag_help)
            corner = (width - plate.shape[1]) // 2, (height - plate.shape[0]) // 2
            layers.append(Layer(plate, corner))
        if self._now < self._message_until:
            plate = text_plate(self._message, scale, width - 2 * margin)
            layers.append(Layer(plate, ((width - plate.shape[1]) // 2, bottom - plate.shape[0])))
        return layers
