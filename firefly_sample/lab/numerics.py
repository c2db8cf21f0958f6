"""The tables of figures that the defaults rest on, each measured again by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack

from firefly_sample.errors import SettingsError, did_you_mean
from firefly_sample.gpu.device import Device
from firefly_sample.lab.experiments.angles import cones, highlights
from firefly_sample.lab.experiments.cost import cost
from firefly_sample.lab.experiments.depth import depth
from firefly_sample.lab.experiments.depth_tests import depth_clamp, depth_tests
from firefly_sample.lab.experiments.filtering import filtering
from firefly_sample.lab.experiments.frames import fragments, frames
from firefly_sample.lab.experiments.gbuffer import albedo, conversions, normals
from firefly_sample.lab.experiments.lights import accumulation, cutoff, piles
from firefly_sample.lab.experiments.particle_tables import (
    particle_order,
    particle_shadow_cost,
    particle_shadow_slices,
    particle_shadows,
)
from firefly_sample.lab.experiments.proxies import proxies
from firefly_sample.lab.experiments.rates import rates
from firefly_sample.lab.experiments.reach import reach
from firefly_sample.lab.experiments.shading import far_from_origin, ndc, powers
from firefly_sample.lab.experiments.table import Table
from firefly_sample.renderer import Renderer

_NUMBERS: dict[str, Callable[[Device], Table]] = {
    "depth": depth,
    "normals": normals,
    "highlights": highlights,
    "albedo": albedo,
    "conversions": conversions,
    "accumulation": accumulation,
    "piles": piles,
    "cutoff": cutoff,
    "reach": reach,
    "proxies": proxies,
    "depth_tests": depth_tests,
    "depth_clamp": depth_clamp,
    "cones": cones,
    "powers": powers,
    "ndc": ndc,
    "far_from_origin": far_from_origin,
    "filtering": filtering,
    "cost": cost,
    "rates": rates,
}
"""Tables of what a driver does with numbers."""
_FRAMES: dict[str, Callable[[Renderer], Table]] = {
    "frames": frames,
    "fragments": fragments,
    "particle_shadows": particle_shadows,
    "particle_shadow_slices": particle_shadow_slices,
    "particle_shadow_cost": particle_shadow_cost,
    "particle_order": particle_order,
}
"""Tables of what the renderer draws."""

NAMES = (*_NUMBERS, *_FRAMES)
"""Of all tables, in the order of docs/numerics.md."""


def measure_numerics(
    names: Sequence[str] = (),
    *,
    device: int | None = None,
    require_gpu: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[str, list[Table]]:
    """Measure tables of `NAMES` on a driver.

    All but "cost", "rates" and "particle_shadow_cost", which are times, give the same figures again on the same
    machine.

    Parameters
    ----------
    names : sequence of str
        Of tables; none for all.
    device : int, optional
        EGL device index.
    require_gpu : bool
        Refuse a software driver.
    progress : callable, optional
        Called with (tables done, tables in all).

    Returns
    -------
    str, list of Table
        The GL renderer string, and the tables in the order asked for.

    Raises
    ------
    SettingsError
        If there is no table of a name.
    NoGpuError
        If there is no OpenGL 3.3 or, with `require_gpu`, only a software driver.
    """
    for name in names:
        if name not in NAMES:
            what = f"no table {name!r}{did_you_mean(name, NAMES)}" if name else "a table without a name"
            raise SettingsError(f"there is {what}: choose from {', '.join(NAMES)}")
    chosen = list(dict.fromkeys(names)) or list(NAMES)
    with ExitStack() as held:
        made = Device(device)
        held.callback(made.release)
        if require_gpu:
            made.require_gpu()
        if _FRAMES.keys() & set(chosen):
            renderer = held.enter_context(Renderer(device=device, count_fragments=True, reuse=False))
        tables = []
        for done, name in enumerate(chosen):
            if progress is not None:
                progress(done, len(chosen))
            tables.append(_FRAMES[name](renderer) if name in _FRAMES else _NUMBERS[name](made))
        if progress is not None:
            progress(len(chosen), len(chosen))
        return made.renderer, tables
