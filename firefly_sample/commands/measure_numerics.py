"""``firefly measure numerics``: measure the figures that the defaults rest on."""

from __future__ import annotations

import textwrap
from typing import Annotated

from cyclopts import Parameter

from firefly_sample.columns import align
from firefly_sample.commands.options import Flag, Whole
from firefly_sample.commands.terminal import print_json, print_result, progress_bar


def numerics(
    *tables: Annotated[str, Parameter(metavar="TABLE", negative=())],
    device: Whole | None = None,
    require_gpu: Flag = False,
    json: Flag = False,
) -> int:
    """Measure the numerical errors of this driver: in depth buffers, targets, sums, powers and filters.

    Parameters
    ----------
    tables
        Names, separated by spaces or commas: depth, normals, highlights, albedo, conversions, accumulation,
        piles, cutoff, reach, proxies, depth_tests, depth_clamp, cones, powers, ndc, far_from_origin,
        filtering, cost, rates, frames, fragments, particle_shadows, particle_shadow_slices,
        particle_shadow_cost, particle_order. All if absent.
    device
        Which EGL device to draw with (see firefly doctor).
    require_gpu
        Fail rather than draw with a software driver.
    json
        Print JSON.
    """
    from firefly_sample.lab.experiments import measure_numerics

    chosen = [name.strip() for names in tables for name in names.split(",")]
    with progress_bar("tables") as progress:
        driver, measured = measure_numerics(chosen, device=device, require_gpu=require_gpu, progress=progress)
    if json:
        print_json({"driver": driver, "tables": [table.as_dict() for table in measured]})
        return 0
    lines = [driver]
    for table in measured:
        lines += ["", textwrap.fill(f"{table.name}: {table.about}", 110), align(table.as_text())]
    print_result("\n".join(lines))
    return 0
