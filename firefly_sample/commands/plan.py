"""``firefly plan``: what a frame requires, and why."""

from __future__ import annotations

from typing import Annotated, Any

from cyclopts import Group, Parameter
from cyclopts.validators import mutually_exclusive

from firefly_sample.capture.sequence import capture_settings
from firefly_sample.commands.options import DEFAULT_SCENE, Flag, Outputs, SceneName, Size, StartTime
from firefly_sample.commands.terminal import print_json, print_result

_ONE_FORM = "Options", Group(validator=mutually_exclusive)


def plan(
    scene: SceneName = DEFAULT_SCENE,
    *,
    time: StartTime = None,
    size: Size = (800, 600),
    outputs: Outputs = ("color",),
    json: Annotated[Flag, Parameter(group=_ONE_FORM)] = False,
    dot: Annotated[Flag, Parameter(group=_ONE_FORM)] = False,
    settings: dict[str, Any],
    parameters: dict[str, Any],
) -> int:
    """Show the passes and targets of one frame, and why each is needed.

    Nothing is drawn and no driver is needed; a driver with all capabilities is assumed.

    Parameters
    ----------
    time
        The time of the frame.
    json
        Print JSON.
    dot
        Print a Graphviz graph.
    """
    from firefly_sample.pipeline import build_plan
    from firefly_sample.plan.report import plan_as_dict, plan_as_dot, plan_as_text
    from firefly_sample.scenes import build_scene, find_scene
    from firefly_sample.scenes.plugin import start_time

    chosen = capture_settings(outputs, **settings)
    plugin = find_scene(scene)
    at = start_time(plugin) if time is None else time
    frame = build_plan(build_scene(plugin, **parameters), chosen, size, outputs, at)
    if json:
        print_json(plan_as_dict(frame))
    else:
        print_result(plan_as_dot(frame) if dot else plan_as_text(frame))
    return 0
