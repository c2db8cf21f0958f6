"""Times on this driver: of single choices in a shader or a draw, and of blending and reading by format.

Times on a shared machine mean little. What is compared is drawn in turn, and ratios are taken within a round.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack

import moderngl
import numpy as np

from firefly_sample.gpu.device import Device
from firefly_sample.gpu.images import make_texture
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.experiment import Experiment, Value
from firefly_sample.lab.measuring import quartile_spread
from firefly_sample.lab.probes.cost import FULLSCREEN, VOLUMES, Contender, contest
from firefly_sample.lab.probes.probe import kept_until, run
from firefly_sample.plan.targets import ACCUMULATION_FORMATS

Size = tuple[int, int]

SIZE = (400, 300)

# --- Choices in a shader or a draw ---

_HEAD = """#version 330 core
flat in int v_light;
uniform sampler2D u_texture;
out vec4 o_result;
vec4 shade(vec2 at)
{
    vec3 way = vec3(at, 0.2);
    float d2 = dot(way, way);
    return vec4(pow(max(way.z * inversesqrt(d2), 0.0), 20.0) / (1.0 + 0.7 * sqrt(d2) + 1.8 * d2));
}
vec2 from_light()
{
    return gl_FragCoord.xy / 200.0 - 2.0 * fract(float(v_light) * vec2(0.6180340, 0.7548777));
}
"""
_SHADE = "void main() { o_result = shade(from_light()); }\n"
_REACH = (
    "void main() {{ vec2 at = from_light(); if (dot(at, at) > 0.3) {{ {out} }} o_result = shade(at); }}\n"
)
_DEPTH = "void main() { o_result = shade(from_light()); gl_FragDepth = gl_FragCoord.z; }\n"
_READ = """void main()
{{
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 16; ++i) {{
        ivec2 texel = (ivec2(gl_FragCoord.xy) + ivec2(7 * i, 3 * i)) & 511;
        sum += {read};
    }}
    o_result = sum;
}}
"""
_SAMPLED = _READ.format(read="texture(u_texture, (vec2(texel) + 0.5) / 512.0)")
_FETCHED = _READ.format(read="texelFetch(u_texture, texel, 0)")


def _fullscreen(name: str, main: str, instances: int = 16, test: str = "", linear: bool = False) -> Contender:
    return Contender(name, _HEAD + main, FULLSCREEN, instances, depth_test=test, linear=linear)


def _volumes(name: str, main: str = _SHADE, calls: int = 1, test: str = "", radius: float = 0.2) -> Contender:
    return Contender(name, _HEAD + main, VOLUMES, 500, calls, test, radius)


PAIRS: dict[str, tuple[Contender, Contender]] = {
    "discard / return 0": (
        _volumes("discard", _REACH.format(out="discard;"), test=">="),
        _volumes("return", _REACH.format(out="o_result = vec4(0.0); return;"), test=">="),
    ),
    # all fragments lie behind the depth buffer's surface
    "gl_FragDepth written / not, hidden": (
        _fullscreen("written", _DEPTH, test="<"),
        _fullscreen("not", _SHADE, test="<"),
    ),
    "nearest / texelFetch": (_fullscreen("nearest", _SAMPLED, 2), _fullscreen("fetch", _FETCHED, 2)),
    "linear / texelFetch": (
        _fullscreen("linear", _SAMPLED, 2, linear=True),
        _fullscreen("fetch", _FETCHED, 2),
    ),
    "500 draws / one instanced": (
        _volumes("draws", calls=500, radius=0.03),
        _volumes("instanced", radius=0.03),
    ),
    "back faces untested / depth-tested": (_volumes("untested"), _volumes("tested", test=">=")),
}
"""Two methods of drawing each; the ratio is the first's time over the second's."""


def _cost(
    bench: ExperimentBench, pair: tuple[Contender, Contender], rounds: int, size: Size
) -> tuple[Value, ...]:
    times = contest(bench.device, pair, rounds, size)
    return *ratios_of(times), statistics.median(second for _, second in times)


def ratios_of(pairs: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Return the median of the first times over the second ones, and the spread of these ratios."""
    ratios = [first / second for first, second in pairs]
    return statistics.median(ratios), quartile_spread(ratios)


# --- Blending and reading, by format ---

TEXTURE = 512
"""Texels across and down."""
READS = 16
"""Reads per pixel."""
_BLENDING = """#version 330 core
out vec4 o_result;
void main() { o_result = gl_FragCoord * 1e-5; }
"""
_READING = f"""#version 330 core
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
_RATES = {
    f"{kind}, {name}": (kind == "reading", name, names[0])
    for kind, names in (
        ("blending", tuple(ACCUMULATION_FORMATS.values())),
        ("reading", ("rgba16", "srgb8_alpha8")),
    )
    for name in names
}


def _rate(
    bench: ExperimentBench, row: tuple[bool, str, str], rounds: int, size: Size, blended: int, read: int
) -> tuple[Value, ...]:
    """Measure a format and, in turn, the first of its kind.

    Each is drawn few and many times, and the difference counts: to make a shader takes longer than a draw.
    """
    reading, name, first = row
    device = bench.device
    times = []
    with device, ExitStack() as held:
        drawn = {
            key: (
                kept_until(held, make_texture(device, "rgba32f" if reading else key, size)),
                {"u_texture": _noise(device, key, held)} if reading else {},
            )
            for key in dict.fromkeys((name, first))
        }
        draws = read if reading else blended
        for _ in range(rounds):
            took = {key: _time_of_a_draw(device, reading, *given, draws) for key, given in drawn.items()}
            times.append((took[name], took[first]))
    device.check("a probe")
    reads = READS if reading else 1
    return statistics.median(own for own, _ in times) / (reads * size[0] * size[1]), *ratios_of(times)


def _time_of_a_draw(
    device: Device,
    reading: bool,
    target: moderngl.Texture,
    textures: Mapping[str, moderngl.Texture],
    draws: int,
) -> float:
    """Return nanoseconds."""
    times = []
    for count in (2, 2 + draws):
        with ExitStack() as held:
            start = time.perf_counter_ns()
            run(device, held, _READING if reading else _BLENDING, target, textures, instances=count)
            device.ctx.finish()
            times.append(time.perf_counter_ns() - start)
            device.unbind()
    return (times[1] - times[0]) / draws


def _noise(device: Device, format_name: str, held: ExitStack) -> moderngl.Texture:
    texture = kept_until(held, make_texture(device, format_name, (TEXTURE, TEXTURE)))
    dtype = np.uint16 if format_name == "rgba16" else np.uint8
    rng = np.random.Generator(np.random.PCG64(9))
    largest = np.iinfo(dtype).max
    texture.write(rng.integers(0, largest, (TEXTURE, TEXTURE, 4), dtype, endpoint=True).tobytes())
    texture.filter = moderngl.LINEAR, moderngl.LINEAR
    return texture


EXPERIMENTS = (
    Experiment(
        "cost",
        _cost,
        PAIRS,
        ("first / second", "ratio", "spread", "ms"),
        "Time of one method of drawing over another's. ratio: median of {rounds} interleaved rounds; spread: "
        "interquartile range over median; ms: time of the second method. They change from run to run.",
        {"rounds": 15, "size": SIZE},
    ),
    Experiment(
        "rates",
        _rate,
        _RATES,
        ("what, format", "ns", "ratio", "spread"),
        "Nanoseconds per pixel that is blended and per read with linear filtering, by format; over the first "
        "row's of its kind, the median of {rounds} rounds; and the spread of that, its interquartile range "
        "over its median. They change from run to run.",
        {"rounds": 7, "size": SIZE, "blended": 200, "read": 12},
    ),
)
