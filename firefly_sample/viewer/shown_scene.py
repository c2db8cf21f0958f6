"""The scene that the window shows, its time, the values of its parameters, and the text that lists them."""

from __future__ import annotations

from typing import Any

from firefly_sample.frame import Frame
from firefly_sample.scene.parameter import KeyStep, Parameter
from firefly_sample.scene.scene import Scene, ScenePlugin
from firefly_sample.scenes import build_scene
from firefly_sample.viewer.overlay import Rows

MOST_PARAMETERS = 8


class Clock:
    """Scene time in seconds, which follows the wall clock and can be paused.

    `now` is always the wall clock's time: seconds, monotonic, from any origin.
    """

    def __init__(self, start: float, now: float) -> None:
        self._time = start
        self._since: float | None = now

    @property
    def paused(self) -> bool:
        """True while time stands still."""
        return self._since is None

    def time(self, now: float) -> float:
        """Return the scene time."""
        return self._time if self._since is None else self._time + (now - self._since)

    def toggle(self, now: float) -> None:
        """Pause, or continue from the time of the pause."""
        self._time = self.time(now)
        self._since = now if self.paused else None


class ShownScene:
    """A plugin's scene, whose parameters keys change while it is shown.

    Attributes
    ----------
    values : dict of str to object
        Every parameter's value, checked.
    scene : Scene
        A new one after a parameter has changed that is not live.
    """

    def __init__(self, plugin: ScenePlugin, values: dict[str, Any]) -> None:
        self.plugin = plugin
        self.values = values
        self.scene: Scene = build_scene(plugin, **values)
        self._undo: tuple[Parameter, Any] | None = None

    def step(self, parameter: Parameter, key: KeyStep) -> str:
        """Change a parameter by one press of a key, and return a message for the user.

        Raises a FireflyError if the scene refuses the new value; nothing has changed then.
        """
        before = self.values[parameter.name]
        after = parameter.step(before, key)
        if after == before:
            return f"{parameter.name} stays at {value_text(parameter, before)} ({parameter.range_text()})"
        self._set(parameter, after)
        self._undo = parameter, before
        return f"{parameter.name} {value_text(parameter, after)}"

    def undo(self) -> bool:
        """Undo the last step, after which the scene could not be drawn; return False if there was none."""
        undo, self._undo = self._undo, None
        if undo is not None:
            self._set(*undo)
        return undo is not None

    def _set(self, parameter: Parameter, value: Any) -> None:
        values = self.values | {parameter.name: value}
        if parameter.live:
            self.scene.set(parameter.name, value)
        else:
            self.scene = build_scene(self.plugin, **values)
        self.values = values

    def was_drawn(self) -> None:
        """Note that the scene could be drawn with its present values."""
        self._undo = None

    def drag(self, right: float, down: float) -> bool:
        """Pass a drag of the mouse, in heights of the window, to the scene; return True if it used it."""
        changed = self.scene.drag(right, down)
        self.values = self.values | changed
        return bool(changed)

    def status_rows(self, frame: Frame, rate: str, paused: bool, test: str = "") -> Rows:
        """Return the names and values for the window's corner; `test` is a performance test's progress.

        A scene with more than `MOST_PARAMETERS` lists only those that differ from their defaults.
        """
        parameters = self.plugin.parameters
        if len(parameters) > MOST_PARAMETERS:
            parameters = tuple(p for p in parameters if self.values[p.name] != p.default)
        counts = frame.lights
        lights = f"{counts.in_view} in view of {counts.in_scene}"
        width, height = frame.size
        return (
            ("time", f"{frame.time:.1f} s{', paused' if paused else ''}"),
            ("lights", lights if not counts.dropped else f"{lights}, {counts.dropped} dropped"),
            ("frame", rate),
            *((("test", test),) if test else ()),
            ("picture", f"{width} x {height}"),
            *((p.name.replace("_", " "), value_text(p, self.values[p.name])) for p in parameters),
        )


def value_text(parameter: Parameter, value: Any) -> str:
    """Return a parameter's value with its unit, as text."""
    if parameter.type is bool:
        return "on" if value else "off"
    text = f"{value:.4g}" if parameter.type is float else str(value)
    return f"{text} {parameter.unit}".rstrip()
