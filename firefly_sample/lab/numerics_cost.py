"""What single choices in a shader or a draw cost on this driver, as ratios of times of small shaders.

Times on a shared machine mean little. Each pair is drawn in turn, and the ratios are taken within a round.
"""

from __future__ import annotations

import statistics

from firefly_sample.gpu.device import Device
from firefly_sample.lab.measuring import quartile_spread
from firefly_sample.lab.numerics_table import Table, Value
from firefly_sample.lab.probes.cost import FULLSCREEN, VOLUMES, Contender, contest

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
_SAMPLED = "texture(u_texture, (vec2(texel) + 0.5) / 512.0)"


def _fullscreen(name: str, main: str, instances: int = 16, test: str = "", linear: bool = False) -> Contender:
    return Contender(name, _HEAD + main, FULLSCREEN, instances, depth_test=test, linear=linear)


def _volumes(name: str, main: str = _SHADE, calls: int = 1, test: str = "", radius: float = 0.2) -> Contender:
    return Contender(name, _HEAD + main, VOLUMES, 500, calls, test, radius)


PAIRS: dict[str, tuple[Contender, Contender]] = {
    "discard / return 0": (
        _volumes("discard", _REACH.format(out="discard;"), test=">="),
        _volumes("return", _REACH.format(out="o_result = vec4(0.0); return;"), test=">="),
    ),
    # what is drawn lies behind what is there
    "gl_FragDepth written / not, hidden": (
        _fullscreen("written", _DEPTH, test="<"),
        _fullscreen("not", _SHADE, test="<"),
    ),
    "nearest / texelFetch": (
        _fullscreen("nearest", _READ.format(read=_SAMPLED), 2),
        _fullscreen("fetch", _READ.format(read="texelFetch(u_texture, texel, 0)"), 2),
    ),
    "linear / texelFetch": (
        _fullscreen("linear", _READ.format(read=_SAMPLED), 2, linear=True),
        _fullscreen("fetch", _READ.format(read="texelFetch(u_texture, texel, 0)"), 2),
    ),
    "500 draws / one instanced": (
        _volumes("draws", calls=500, radius=0.03),
        _volumes("instanced", radius=0.03),
    ),
    "back faces untested / depth-tested": (_volumes("untested"), _volumes("tested", test=">=")),
}
"""Two ways of drawing each; the ratio is the first's time over the second's."""


def cost(device: Device, rounds: int = 15, size: tuple[int, int] = (400, 300)) -> Table:
    """Ratios of the times of `PAIRS`.

    Parameters
    ----------
    rounds : int
        How often each pair is drawn.
    size : (int, int)
        Pixels.
    """
    rows: list[tuple[Value, ...]] = []
    for name, pair in PAIRS.items():
        times = contest(device, pair, rounds, size)
        ratios = [first / second for first, second in times]
        own = statistics.median(second for _, second in times)
        rows.append((name, statistics.median(ratios), quartile_spread(ratios), own))
    about = (
        f"Time of one way of drawing over another's. ratio: median of {rounds} interleaved rounds; spread: "
        "interquartile range over median; ms: time of the second way. They change from run to run."
    )
    return Table("cost", about, ("first / second", "ratio", "spread", "ms"), rows)
