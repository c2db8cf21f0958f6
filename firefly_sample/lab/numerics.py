"""The tables of ``firefly measure numerics``, each measured by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from firefly_sample.errors import SettingsError, did_you_mean
from firefly_sample.lab.experiments import TABLES
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.experiment import Table


def measure_numerics(
    names: Sequence[str] = (),
    *,
    device: int | None = None,
    require_gpu: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[str, list[Table]]:
    """Measure tables of `firefly_sample.lab.experiments.TABLES` on a driver.

    All tables but those of times ("cost", "rates" and "particle_shadow_cost") give the same figures again on
    the same machine.

    Parameters
    ----------
    names : sequence of str
        Tables; all if there is none.
    device : int, optional
        EGL device index.
    require_gpu : bool
        Refuse a software driver.
    progress : callable, optional
        Called with (tables done, tables in all).

    Returns
    -------
    str, list of Table
        The GL renderer string, and the tables in the order of `names`.

    Raises
    ------
    SettingsError
        If there is no table of a name.
    NoGpuError
        If there is no OpenGL 3.3 or, with `require_gpu`, only a software driver.
    """
    for name in names:
        if name not in TABLES:
            wrong = f"no table {name!r}{did_you_mean(name, TABLES)}" if name else "a table without a name"
            raise SettingsError(f"there is {wrong}: choose from {', '.join(TABLES)}")
    chosen = list(dict.fromkeys(names)) or list(TABLES)
    with ExperimentBench(device, require_gpu) as bench:
        driver = bench.device.renderer
        tables = []
        for done, name in enumerate(chosen):
            if progress is not None:
                progress(done, len(chosen))
            tables.append(TABLES[name].table(bench))
        if progress is not None:
            progress(len(chosen), len(chosen))
        return driver, tables
