"""Times on this driver: of single choices in a shader or a draw, and of blending and reading by format.

Times on a shared machine mean little. What is compared is drawn in turn, so that a busy machine slows all
alike, and ratios are taken within a round.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from functools import partial
from itertools import product

import moderngl
import numpy as np

from firefly_sample.gpu.proxies import proxy_mesh
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.experiment import Experiment, Figures
from firefly_sample.lab.measuring import quartile_spread
from firefly_sample.lab.probe import FULLSCREEN, Probe, Size, fragment_shader, open_probe
from firefly_sample.plan.targets import ACCUMULATION_FORMATS

SIZE = (400, 300)
TEXTURE = 512
"""Texels across and down."""
READS = 16
"""Reads per pixel."""


def ratios_of(pairs: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Return the median of the first times over the second ones, and the spread of these ratios."""
    ratios = [first / second for first, second in pairs]
    return statistics.median(ratios), quartile_spread(ratios)


_SPHERES = """#version 330 core
in vec3 in_position;
uniform int u_first;
uniform float u_radius;
flat out int v_instance;
void main()
{
    v_instance = gl_InstanceID + u_first;
    vec3 center = fract(float(v_instance) * vec3(0.6180340, 0.7548777, 0.5698403)) * 2.0 - 1.0;
    gl_Position = vec4(center + u_radius * in_position, 1.0);
}
"""
_LIGHT = """flat in int v_instance;
vec4 shade(vec2 at)
{
    vec3 to_light = vec3(at, 0.2);
    float d2 = dot(to_light, to_light);
    return vec4(pow(max(to_light.z * inversesqrt(d2), 0.0), 20.0) / (1.0 + 0.7 * sqrt(d2) + 1.8 * d2));
}
vec2 from_light()
{
    return gl_FragCoord.xy / 200.0 - 2.0 * fract(float(v_instance) * vec2(0.6180340, 0.7548777));
}
"""


def _noise(probe: Probe, format_name: str, linear: bool) -> moderngl.Texture:
    texture = probe.texture(format_name, (TEXTURE, TEXTURE))
    dtype = np.uint16 if format_name == "rgba16" else np.uint8
    noise = np.random.default_rng(9).integers(
        0, np.iinfo(dtype).max, (TEXTURE, TEXTURE, 4), dtype, endpoint=True
    )
    texture.write(noise.tobytes())
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR) if linear else (moderngl.NEAREST, moderngl.NEAREST)
    return texture


def _prepare(
    probe: Probe,
    body: str,
    instances: int,
    radius: float = 0.0,
    calls: int = 1,
    test: str = "",
    linear: bool = False,
    texture: str = "rgba8",
) -> Callable[[], None]:
    """Return a function that draws full-screen triangles, or spheres all over the view volume, blended.

    `body` is GLSL that sets ``vec4 result``, maybe from the sampler ``u_texture``: white noise, filtered if
    `linear`. The `radius` is the spheres', in the NDC of an orthographic lens; 0 for triangles. The
    `instances` are divided among `calls` of draw. A `test`, if any, is moderngl's comparison with a depth
    buffer that holds 1/2.
    """
    ctx, spheres = probe.device.ctx, radius > 0.0
    samplers = ["u_texture"] if "u_texture" in body else []
    textures = {name: _noise(probe, texture, linear) for name in samplers}
    fragment = fragment_shader(body, samplers=samplers, declared=_LIGHT)
    program = probe.program(fragment, vertex=_SPHERES if spheres else FULLSCREEN)
    mesh = probe.keep(ctx.buffer(np.ascontiguousarray(proxy_mesh("icosphere1")).tobytes()))
    array = probe.keep(ctx.vertex_array(program.mgl, [(mesh, "3f", "in_position")] if spheres else []))
    flags = moderngl.BLEND | (moderngl.CULL_FACE if spheres else 0)
    if test:
        flags |= moderngl.DEPTH_TEST
    each = instances // calls

    def draw() -> None:
        ctx.enable_only(flags)
        ctx.depth_func = test or "<"
        for call in range(calls):
            program.use({"u_first": call * each, "u_radius": radius} if spheres else {}, textures)
            array.render(moderngl.TRIANGLES, vertices=-1 if spheres else 3, instances=each)

    return draw


def _interleave(
    ctx: moderngl.Context, draws: Sequence[tuple[moderngl.Framebuffer, Callable[[], None]]], rounds: int
) -> list[list[float]]:
    """Return milliseconds by round and function that draws, after a first round that compiles."""
    ctx.blend_func = moderngl.ONE, moderngl.ONE
    ctx.cull_face = "front"
    times: list[list[float]] = [[] for _ in range(rounds + 1)]
    for row, (framebuffer, draw) in product(times, draws):
        framebuffer.use()
        framebuffer.depth_mask = True
        framebuffer.clear(depth=0.5)
        framebuffer.depth_mask = False
        ctx.finish()
        start = time.perf_counter()
        draw()
        ctx.finish()
        row.append((time.perf_counter() - start) * 1e3)
    ctx.depth_func = "<"
    ctx.cull_face = "back"
    ctx.enable_only(moderngl.NOTHING)
    return times[1:]


# --- Choices in a shader or a draw ---

_SHADE = "result = shade(from_light());"
_IN_REACH = "vec2 at = from_light(); if (dot(at, at) > 0.3) {{ {out} }} result = shade(at);"
_READ = """for (int i = 0; i < 16; ++i) {{
        ivec2 texel = (ivec2(gl_FragCoord.xy) + ivec2(7 * i, 3 * i)) & 511;
        result += {read};
    }}"""
_SAMPLED = _READ.format(read="texture(u_texture, (vec2(texel) + 0.5) / 512.0)")
_FETCHED = _READ.format(read="texelFetch(u_texture, texel, 0)")


Method = Callable[[Probe], Callable[[], None]]
_spheres = partial(_prepare, body=_SHADE, instances=500, radius=0.2)
_triangles = partial(_prepare, instances=16, test="<")
_reads = partial(_prepare, instances=2)
PAIRS: dict[str, tuple[Method, Method]] = {
    "discard / return 0": (
        partial(_spheres, body=_IN_REACH.format(out="discard;"), test=">="),
        partial(_spheres, body=_IN_REACH.format(out="o_result = vec4(0.0); return;"), test=">="),
    ),
    # all fragments lie behind the depth buffer's surface
    "gl_FragDepth written / not, hidden": (
        partial(_triangles, body=f"{_SHADE} gl_FragDepth = gl_FragCoord.z;"),
        partial(_triangles, body=_SHADE),
    ),
    "nearest / texelFetch": (partial(_reads, body=_SAMPLED), partial(_reads, body=_FETCHED)),
    "linear / texelFetch": (partial(_reads, body=_SAMPLED, linear=True), partial(_reads, body=_FETCHED)),
    "500 draws / one instanced": (partial(_spheres, radius=0.03, calls=500), partial(_spheres, radius=0.03)),
    "back faces untested / depth-tested": (_spheres, partial(_spheres, test=">=")),
}
"""Two methods of drawing each; the ratio is the first's time over the second's."""


def _cost(bench: ExperimentBench, pair: tuple[Method, Method], rounds: int, size: Size) -> Figures:
    with open_probe(bench.device) as probe:
        color, depth = probe.texture("rgba32f", size), probe.texture("depth32f", size)
        framebuffer = probe.keep(bench.device.ctx.framebuffer([color], depth))
        draws = [(framebuffer, prepare(probe)) for prepare in pair]
        times = _interleave(bench.device.ctx, draws, rounds)
    return *ratios_of(times), statistics.median(second for _, second in times)


# --- Blending and reading, by format ---

_BLENDING = "result = gl_FragCoord * 1e-5;"
_READING = f"""for (int i = 0; i < {READS}; ++i) {{
        vec2 texel = gl_FragCoord.xy + vec2(7.25, 3.25) * float(i);
        result += texture(u_texture, fract(texel / {TEXTURE}.0));
    }}"""
_FORMATS = {"blending": tuple(ACCUMULATION_FORMATS.values()), "reading": ("rgba16", "srgb8_alpha8")}


def _rate(
    bench: ExperimentBench, row: tuple[str, str], rounds: int, size: Size, blended: int, read: int
) -> Figures:
    """Measure a format and, in turn, the first of its kind."""
    kind, name = row
    reading, first = kind == "reading", _FORMATS[kind][0]
    body, instances = (_READING, read) if reading else (_BLENDING, blended)
    draws = []
    with open_probe(bench.device) as probe:
        for key in dict.fromkeys((name, first)):
            target = probe.texture("rgba32f" if reading else key, size)
            draw = _prepare(probe, body, instances, linear=True, texture=key)
            draws.append((probe.keep(bench.device.ctx.framebuffer([target])), draw))
        times = [(found[0], found[-1]) for found in _interleave(bench.device.ctx, draws, rounds)]
    count = instances * size[0] * size[1] * (READS if reading else 1)
    return 1e6 * statistics.median(found for found, _ in times) / count, *ratios_of(times)


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
        {f"{kind}, {name}": (kind, name) for kind, names in _FORMATS.items() for name in names},
        ("what, format", "ns", "ratio", "spread"),
        "Nanoseconds per pixel that is blended and per read with linear filtering, by format; over the first "
        "row's of its kind, the median of {rounds} rounds; and the spread of that, its interquartile range "
        "over its median. They change from run to run.",
        {"rounds": 7, "size": SIZE, "blended": 200, "read": 12},
    ),
)
