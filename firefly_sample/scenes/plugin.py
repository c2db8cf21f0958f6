"""What the scenes of this package have in common as plugins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from firefly_sample.errors import ParameterError
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scene.scene import Scene

__all__ = ["Plugin", "check_live"]


@dataclass(frozen=True)
class Plugin:
    """What an entry point names: see `firefly_sample.scene.scene.ScenePlugin`."""

    name: str
    summary: str
    parameters: tuple[Parameter, ...]
    build: Callable[..., Scene]


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
