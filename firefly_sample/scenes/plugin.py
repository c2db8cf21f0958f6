"""What the scenes of this package have in common as plugins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from firefly_sample.errors import ParameterError, SceneError
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scene.scene import Scene, ScenePlugin


@dataclass(frozen=True)
class Plugin:
    """What an entry point names: see `firefly_sample.scene.scene.ScenePlugin`.

    Attributes
    ----------
    lights_parameter : str, optional
        The parameter that says how many lights there are, where it is not called "lights"; any plugin may
        have this attribute. See the function of the same name.
    """

    name: str
    summary: str
    parameters: tuple[Parameter, ...]
    build: Callable[..., Scene]
    lights_parameter: str | None = None


def lights_parameter(plugin: ScenePlugin) -> Parameter | None:
    """The parameter that says how many lights a scene has.

    It is the one that the plugin's attribute ``lights_parameter`` names, or else a whole number called
    "lights"; None where there is neither.

    Raises
    ------
    SceneError
        If the attribute names no parameter that is a whole number.
    """
    named = getattr(plugin, "lights_parameter", None)
    for parameter in plugin.parameters:
        if parameter.name == (named or "lights") and parameter.type is int:
            return parameter
    if named is None:
        return None
    raise SceneError(
        f"scene {plugin.name!r}: lights_parameter must name a parameter that is a whole number, got {named!r}"
    )


def check_live(scene: str, parameters: tuple[Parameter, ...], name: str, value: Any) -> Any:
    """The new value of a live parameter of a running scene.

    Raises
    ------
    ParameterError
        If there is no such parameter, it is not live, or the value is wrong.
    """
    live = {parameter.name: parameter for parameter in parameters if parameter.live}
    if name not in live:
        all_live = len(live) == len(parameters)
        kind, others = ("parameter", "") if all_live else ("live parameter", "; the others need a new scene")
        raise ParameterError(f"scene {scene!r} has no {kind} {name!r}: it has {', '.join(live)}{others}")
    return live[name].check(value, scene)
