"""What a pixel of blending and a texture read cost on this driver, by format.

Each is drawn few and many times, and the difference is what counts: making a shader takes longer than a draw.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Mapping
from contextlib import ExitStack
from typing import Any

import numpy as np

from firefly_sample.gpu.device import Device
from firefly_sample.gpu.images import make_texture
from firefly_sample.lab.measuring import quartile_spread
from firefly_sample.lab.numerics_table import Table, Value
from firefly_sample.lab.probes.probe import run
from firefly_sample.plan.targets import ACCUMULATION_FORMATS

TEXTURE = 512
READS = 16
TEXTURES = ("rgba16", "srgb8_alpha8")
_BLEND = """#version 330 core
out vec4 o_result;
void main() { o_result = gl_FragCoord * 1e-5; }
"""
_READ = f"""#version 330 core
uniform sampler2D u_texture;
out vec4 o_result;
void main()
{{
    vec4 sum = vec4(0.0);
    for (int i = 0; i < {READS}; ++i) {{
        vec2 texel = gl_FragCoord.xy + vec2(7.25, 3.25) * float(i);
        sum += texture(u_texture, fract(texel / {TEXTURE}.0));
    }}
    o_result = sum;
}}
"""


def rates(
    device: Device, rounds: int = 7, size: tuple[int, int] = (400, 300), blended: int = 200, read: int = 12
) -> Table:
    """Nanoseconds of one pixel of additive blending, and of one filtered read.

    Parameters
    ----------
    rounds : int
        How often each is measured, in turn.
    size : (int, int)
        Pixels.
    blended, read : int
        How many draws of blending and of reading are timed at once.
    """
    rows: list[tuple[Value, ...]] = []
    for what, names, fragment, draws, each in (
        ("blending", tuple(ACCUMULATION_FORMATS.values()), _BLEND, blended, 1),
        ("reading", TEXTURES, _READ, read, READS),
    ):
        times = _measured(device, what == "reading", names, fragment, draws, rounds, size)
        for name, own in times.items():
            ratios = [a / b for a, b in zip(own, times[names[0]], strict=True)]
            nanoseconds = statistics.median(own) / (each * size[0] * size[1])
            rows.append((f"{what}, {name}", nanoseconds, statistics.median(ratios), quartile_spread(ratios)))
    about = (
        "Nanoseconds of one pixel that is blended and of one read with linear filtering, by format; over the "
        f"first row's of its kind, the median of {rounds} rounds; and the spread of that, its interquartile "
        "range over its median. They change from run to run."
    )
    return Table("rates", about, ("what, format", "ns", "ratio", "spread"), rows)


def _measured(
    device: Device,
    reading: bool,
    names: tuple[str, ...],
    fragment: str,
    draws: int,
    rounds: int,
    size: tuple[int, int],
) -> dict[str, list[float]]:
    """Nanoseconds of a draw in each round, by format."""
    times: dict[str, list[float]] = {name: [] for name in names}
    with device, ExitStack() as held:
        textures = {name: _noise(device, name, held) for name in names} if reading else {}
        targets = {name: make_texture(device, "rgba32f" if reading else name, size) for name in names}
        for made in targets.values():
            held.callback(made.release)
        for _ in range(rounds):
            for name in names:
                given = {"u_texture": textures[name]} if reading else {}
                few, many = (_time(device, fragment, targets[name], given, count) for count in (2, 2 + draws))
                times[name].append((many - few) / draws)
    device.check("a probe")
    return times


def _time(device: Device, fragment: str, target: Any, textures: Mapping[str, Any], draws: int) -> int:
    with ExitStack() as held:
        start = time.perf_counter_ns()
        run(device, held, fragment, target, textures, instances=draws)
        device.ctx.finish()
        end = time.perf_counter_ns()
        device.unbind()
    return end - start


def _noise(device: Device, format_name: str, held: ExitStack) -> Any:
    texture = make_texture(device, format_name, (TEXTURE, TEXTURE))
    held.callback(texture.release)
    dtype = np.uint16 if format_name == "rgba16" else np.uint8
    rng = np.random.Generator(np.random.PCG64(9))
    largest = np.iinfo(dtype).max
    texture.write(rng.integers(0, largest, (TEXTURE, TEXTURE, 4), dtype, endpoint=True).tobytes())
    texture.filter = device.ctx.LINEAR, device.ctx.LINEAR
    return texture
