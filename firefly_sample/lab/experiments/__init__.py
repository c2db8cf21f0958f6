"""The experiments of ``firefly measure numerics`` and ``firefly measure stability``, by subject."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module

from firefly_sample.errors import SettingsError, did_you_mean
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.experiment import Experiment, Table

_SUBJECTS = """
    depth lenses coordinates proxies volumes reach lights gbuffer shading driver times particles pictures
    limits
"""
_EXPERIMENTS: list[Experiment] = [
    experiment
    for subject in _SUBJECTS.split()
    for experiment in import_module(f"{__name__}.{subject}").EXPERIMENTS
]
CASES = tuple(experiment for experiment in _EXPERIMENTS if experiment.bound is not None)
"""Experiments with a bound, in the order in which they are measured and shown."""
_TABLES = {experiment.name: experiment for experiment in _EXPERIMENTS if experiment.bound is None}
_ORDER = """
    depth normals highlights albedo conversions accumulation piles cutoff reach proxies depth_tests
    depth_clamp cones powers ndc far_from_origin filtering cost rates frames fragments
    particle_shadows particle_shadow_slices particle_shadow_cost particle_order
"""
TABLES = {name: _TABLES[name] for name in _ORDER.split()}
"""Experiments that are shown as tables, by name, in the order of docs/numerics.md."""


def measure_numerics(
    names: Sequence[str] = (),
    *,
    device: int | None = None,
    require_gpu: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[str, list[Table]]:
    """Measure tables of `TABLES` on a driver, or all of them if no name is given.

    All tables but those of times ("cost", "rates" and "particle_shadow_cost") give the same figures again on
    the same machine.

    Parameters
    ----------
    device, require_gpu : see `firefly_sample.Renderer`
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
    report = progress or (lambda done, count: None)
    with ExperimentBench(device, require_gpu) as bench:
        driver_name = bench.device.renderer
        tables: list[Table] = []
        for name in chosen:
            report(len(tables), len(chosen))
            tables.append(TABLES[name].table(bench))
        report(len(chosen), len(chosen))
        return driver_name, tables
