"""``firefly run``: the window, and the performance test without it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from firefly_sample.commands.choosing import BudgetMs, MaxCodes, MaxError, settings_within
from firefly_sample.commands.options import DEFAULT_SCENE, Flag, RequireGpu, SceneName, Size, Time
from firefly_sample.commands.terminal import json_text, print_result, progress_bar
from firefly_sample.errors import SettingsError
from firefly_sample.settings import Settings

if TYPE_CHECKING:
    from firefly_sample.viewer.performance import PerformanceResult


def run(
    scene: SceneName = DEFAULT_SCENE,
    *,
    time: Time = 0.0,
    size: Size = (800, 600),
    performance_test: Annotated[float | None, Parameter(metavar="SECONDS")] = None,
    headless: Flag = False,
    json: Flag = False,
    require_gpu: RequireGpu = False,
    max_error: MaxError = None,
    max_codes: MaxCodes = None,
    budget_ms: BudgetMs = None,
    settings: dict[str, Any],
    parameters: dict[str, Any],
) -> int:
    """Open a window on a scene; F1 shows the keys.

    Parameters
    ----------
    time
        The time at the start.
    performance_test
        Turn the camera around the scene for this long, print how many frames
        were drawn, and close. Ctrl-C, T or Esc end it early.
    headless
        Run the performance test without a window or a display.
    json
        Print the results of performance tests as JSON.
    """

    def report(result: PerformanceResult) -> None:
        text = json_text(result.as_dict()) if json else result.line()
        if performance_test is not None:
            print_result(text)
        else:  # the window stays open even if stdout is closed or full
            print(text, flush=True)

    if headless and performance_test is None:
        raise SettingsError(
            "--headless is for performance tests: add --performance-test SECONDS, or leave --headless out "
            "for a window; 'firefly capture' draws pictures without one"
        )
    settings = settings_within(
        scene,
        settings,
        max_error=max_error,
        max_codes=max_codes,
        budget_ms=budget_ms,
        parameters=parameters,
        size=size,
        times=tuple(time + later for later in (0.0, 5.0, 15.0, 35.0)),
        require_gpu=require_gpu,
    )
    options: dict[str, Any] = {
        "parameters": parameters,
        "size": size,
        "settings": Settings().with_changes(**settings),
        "time": time,
        "require_gpu": require_gpu,
        "report": report,
    }
    from firefly_sample.viewer import main_loop

    if headless:
        assert performance_test is not None
        with progress_bar("seconds") as progress:
            main_loop.run_headless(scene, performance_test, **options, progress=progress)
    else:
        main_loop.run(scene, **options, performance_test=performance_test)
    return 0
