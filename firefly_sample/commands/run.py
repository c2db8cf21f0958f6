"""``firefly run``: the window."""

from __future__ import annotations

from typing import Any

from firefly_sample.commands.options import DEFAULT_SCENE, Flag, SceneName, Size, Time
from firefly_sample.settings import Settings

__all__ = ["run"]


def run(
    scene: SceneName = DEFAULT_SCENE,
    *,
    time: Time = 0.0,
    size: Size = (800, 600),
    require_gpu: Flag = False,
    settings: dict[str, Any],
    parameters: dict[str, Any],
) -> int:
    """Open a window on a scene; F1 shows the keys.

    Parameters
    ----------
    time
        Seconds to start at.
    require_gpu
        Fail rather than draw with a software driver.
    """
    from firefly_sample.viewer import window

    chosen = Settings().with_changes(**settings)
    window.run(scene, parameters=parameters, size=size, settings=chosen, time=time, require_gpu=require_gpu)
    return 0
