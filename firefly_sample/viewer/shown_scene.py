"""The scene on show and the values of its parameters, which keys change while it runs."""

from __future__ import annotations

from typing import Any

from firefly_sample.scene.parameter import KeyStep, Parameter
from firefly_sample.scene.scene import Scene, ScenePlugin
from firefly_sample.scenes import build_scene


class Stage:
    """A plugin's scene.

    Parameters
    ----------
    plugin : ScenePlugin
    values : dict of str to object
        Every parameter's value, checked.

    Attributes
    ----------
    scene : Scene
        Another one after a parameter has changed that is not live.
    """

    def __init__(self, plugin: ScenePlugin, values: dict[str, Any]) -> None:
        self.plugin = plugin
        self.values = values
        self.scene: Scene = build_scene(plugin, **values)
        self._undo: tuple[Parameter, Any] | None = None

    def step(self, parameter: Parameter, key: KeyStep) -> str:
        """Change a parameter by one press of a key; what came of it, for the user.

        Raises
        ------
        FireflyError
            If the scene refuses the new value; everything is as before then.
        """
        before = self.values[parameter.name]
        after = parameter.step(before, key)
        if after == before:
            return f"{parameter.name} stays at {value_text(parameter, before)} ({parameter.range_text()})"
        values = self.values | {parameter.name: after}
        self._undo = parameter, before
        if parameter.live:
            self.scene.set(parameter.name, after)
        else:
            self.scene = build_scene(self.plugin, **values)
        self.values = values
        return f"{parameter.name} {value_text(parameter, after)}"

    def take_back(self) -> bool:
        """Undo the last step, of which came a scene that cannot be drawn; False where there was none."""
        if self._undo is None:
            return False
        (parameter, before), self._undo = self._undo, None
        self.values = self.values | {parameter.name: before}
        if parameter.live:
            self.scene.set(parameter.name, before)
        else:
            self.scene = build_scene(self.plugin, **self.values)
        return True

    def drawn(self) -> None:
        """The scene could be drawn as it is now."""
        self._undo = None

    def drag(self, right: float, down: float) -> bool:
        """Let the scene answer a drag of the mouse, in heights of the window; whether it has."""
        changed = self.scene.drag(right, down)
        self.values = self.values | changed
        return bool(changed)


def value_text(parameter: Parameter, value: Any) -> str:
    """A parameter's value for people, with its unit."""
    if parameter.type is bool:
        return "on" if value else "off"
    text = f"{value:.4g}" if parameter.type is float else str(value)
    return f"{text} {parameter.unit}".rstrip()
