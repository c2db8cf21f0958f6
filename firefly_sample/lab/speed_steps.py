"""Which frames are measured: counts of lights, fewest first, and the scene's parameters for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from firefly_sample.errors import SceneError
from firefly_sample.scene.parameter import Parameter, resolve_parameters
from firefly_sample.scene.scene import ScenePlugin
from firefly_sample.scenes.plugin import lights_parameter

LIGHTS = (1, 4, 16, 64, 256, 500, 1000, 4000, 10_000)
"""What is measured when nothing is said."""


@dataclass(frozen=True)
class Step:
    """What is drawn in turn.

    Attributes
    ----------
    count : int
        The parameter that counts the scene's lights; 0 where it has none.
    variations : list of dict
        The scene's parameters, with each seed.
    """

    count: int
    variations: list[dict[str, Any]]


def steps_of(
    plugin: ScenePlugin, given: dict[str, Any], lights: Sequence[int] | None, seeds: Sequence[int] | None
) -> list[Step]:
    """A step for each count of lights; `given` are the scene's other parameters.

    Raises
    ------
    SceneError
        If there is nothing to count, or no seed, in this scene; or a parameter is wrong.
    """
    if seeds is not None and not any(parameter.name == "seed" for parameter in plugin.parameters):
        raise SceneError(f"scene {plugin.name!r} has no parameter 'seed': leave the seeds out")
    seeded = [given] if seeds is None else [{**given, "seed": seed} for seed in seeds]
    counted = lights_parameter(plugin)
    if counted is None:
        if lights is not None:
            raise SceneError(
                f"scene {plugin.name!r} has no parameter for how many lights it has: leave the lights out"
            )
        steps = [Step(0, seeded)]
    else:
        steps = [
            Step(count, [{**parameters, counted.name: count} for parameters in seeded])
            for count in _counts(plugin, counted, given, lights)
        ]
    for step in steps:
        for parameters in step.variations:
            resolve_parameters(plugin.name, plugin.parameters, parameters)
    return steps


def _counts(
    plugin: ScenePlugin, counted: Parameter, given: dict[str, Any], lights: Sequence[int] | None
) -> list[int]:
    if lights is None and counted.name in given:
        return [counted.check(given[counted.name], plugin.name)]
    if lights is None:
        low = 0 if counted.minimum is None else counted.minimum
        high = LIGHTS[-1] if counted.maximum is None else counted.maximum
        return [count for count in LIGHTS if low <= count <= high] or [counted.default]
    if counted.name in given:
        raise SceneError(
            f"scene {plugin.name!r}: {counted.name} and the lights to measure say the same: give one of them"
        )
    if not lights:
        raise SceneError("no counts of lights were given: give at least one, or leave them out")
    return sorted({counted.check(count, plugin.name) for count in lights})
