"""Runs GLSL over rows of numbers on the real driver, through a target of any format.

The results of a shader's function, and what a target's format keeps of them, can be compared with float64.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from typing import Any, Protocol, TypeVar

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.gpu.blocks import binding
from firefly_sample.gpu.device import Device
from firefly_sample.gpu.images import make_texture
from firefly_sample.gpu.programs import Program
from firefly_sample.gpu.shader_source import load_source, resolve_source
from firefly_sample.plan.targets import FORMATS, stored_dtype, stored_fractions

Float32 = NDArray[np.float32]


class _HasRelease(Protocol):
    def release(self) -> None: ...


Releasable = TypeVar("Releasable", bound=_HasRelease)

WIDTH = 1024
"""Pixels across of the target that rows are drawn into; row i is the pixel (i % WIDTH, i // WIDTH)."""
_PASSES_VERTEX = """#version 330 core
flat out int v_pass;
void main()
{
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    v_pass = gl_InstanceID;
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}
"""
_PASSES_FRAGMENT = """#version 330 core
uniform sampler2D u_inputs;
flat in int v_pass;
out vec4 o_result;
void main()
{
    ivec2 texel = ivec2(gl_FragCoord.xy) + ivec2(0, {HIGH} * (v_pass % {COUNT}));
    o_result = vec4(texelFetch(u_inputs, texel, 0).rgb, 0.0);
}
"""


def evaluate(
    device: Device,
    includes: Sequence[str],
    body: str,
    inputs: ArrayLike,
    defines: Mapping[str, int] | None = None,
    blocks: Mapping[str, NDArray[Any]] | None = None,
    more: ArrayLike | None = None,
    target: str = "rgba32f",
    then: str | None = None,
    encode: bool = False,
    levels: Sequence[NDArray[Any]] = (),
) -> Float32:
    """Run GLSL for each row, in a fragment of its own.

    Parameters
    ----------
    includes : sequence of str
        Stems of ``shaders/include/*.glsl``.
    body : str
        GLSL that sets ``vec4 result`` from ``vec4 a``, and ``vec4 b`` if there is `more`.
    inputs, more : array_like, shape (n, 4)
        Cast to float32.
    defines : mapping, optional
        Shader defines.
    blocks : mapping, optional
        Values of uniform blocks by name, as `firefly_sample.gpu.blocks` packs them.
    target : str
        The format of `firefly_sample.plan.targets.FORMATS` that keeps the result.
    then : str, optional
        GLSL that sets ``vec4 result`` from ``vec4 a``, which a shader reads back from the target. Without it
        the target's own numbers are returned.
    encode : bool
        Let the driver encode what is written to an sRGB target.
    levels : sequence of ndarray of uint8 or uint16, shape (height, width, 4)
        A texture with all its mipmap levels, the sampler ``u_texture``: trilinear, repeating.

    Returns
    -------
    ndarray of float32, shape (n, 4)
        0 in channels that the target does not have.

    Raises
    ------
    ShaderError
        If the GLSL does not compile.
    GpuError
        If the driver reports an error.
    """
    rows = np.asarray(inputs)
    with device, ExitStack() as held:
        given = row_texture(device, rows, held)
        textures = {"u_inputs": given}
        if more is not None:
            textures["u_more"] = row_texture(device, np.asarray(more), held)
        if levels:
            textures["u_texture"] = _mipmapped(device, levels, held)
        kept = kept_until(held, make_texture(device, target, given.size))
        fragment = _row_fragment(includes, body, tuple(textures))
        if encode:
            device.set_srgb_encoding(True)
        run(device, held, fragment, kept, textures, defines, blocks)
        if encode:
            device.set_srgb_encoding(False)
        if then is not None:
            last = kept_until(held, make_texture(device, "rgba32f", given.size))
            fragment = _row_fragment(includes, then, ("u_inputs",))
            run(device, held, fragment, last, {"u_inputs": kept}, defines, blocks)
            kept, target = last, "rgba32f"
        result = stored_numbers(kept, target)[: len(rows)]
        device.unbind()
    device.check("a probe")
    return result


def accumulate(device: Device, passes: ArrayLike, target: str, repeat: int = 1) -> Float32:
    """Add numbers up by blending, one instance of a draw after the other.

    Parameters
    ----------
    passes : array_like, shape (p, n, 3)
        The numbers that each pass adds to n pixels.
    target : str
        The format of the sums, which begin at 0.
    repeat : int
        How often all passes are drawn.

    Returns
    -------
    ndarray of float32, shape (n, 3)
        The sums.

    Raises
    ------
    GpuError
        If the driver reports an error.
    """
    values = np.asarray(passes, dtype=np.float32)
    count, pixels, _ = values.shape
    high = -(-pixels // WIDTH)
    rows = np.zeros((count, high * WIDTH, 4), dtype=np.float32)
    rows[:, :pixels, :3] = values
    fragment = _PASSES_FRAGMENT.replace("{HIGH}", str(high)).replace("{COUNT}", str(count))
    with device, ExitStack() as held:
        given = row_texture(device, rows.reshape(-1, 4), held)
        sums = kept_until(held, make_texture(device, target, (WIDTH, high)))
        run(
            device, held, fragment, sums, {"u_inputs": given}, vertex=_PASSES_VERTEX, instances=count * repeat
        )
        result = stored_numbers(sums, target)[:pixels, :3]
        device.unbind()
    device.check("a probe")
    return result


def run(
    device: Device,
    held: ExitStack,
    fragment: str,
    target: moderngl.Texture,
    textures: Mapping[str, moderngl.Texture],
    defines: Mapping[str, int] | None = None,
    blocks: Mapping[str, NDArray[Any]] | None = None,
    vertex: str | None = None,
    instances: int = 1,
) -> None:
    """Draw a full-screen triangle, additively, with a fragment shader that is given as text.

    Parameters
    ----------
    held : ExitStack
        Releases the GL objects that are made.
    target : moderngl.Texture
        Cleared first.
    vertex : str, optional
        A vertex shader's text in place of ``fullscreen.vert``.
    instances : int
        How often the triangle is drawn.
    """
    ctx = device.ctx
    program = make_program(device, held, vertex, fragment, defines or {})
    framebuffer = kept_until(held, ctx.framebuffer([target]))
    array = kept_until(held, ctx.vertex_array(program.mgl, []))
    bind_blocks(device, blocks or {}, held)
    framebuffer.use()
    framebuffer.clear()
    program.use({}, textures)
    if instances > 1:
        ctx.enable_only(moderngl.BLEND)
        ctx.blend_func = moderngl.ONE, moderngl.ONE
    else:
        ctx.enable_only(moderngl.NOTHING)
    array.render(moderngl.TRIANGLES, vertices=3, instances=instances)
    ctx.enable_only(moderngl.NOTHING)


def kept_until(held: ExitStack, made: Releasable) -> Releasable:
    """Return a GL object that is released with `held`."""
    held.callback(made.release)
    return made


def make_program(
    device: Device,
    held: ExitStack,
    vertex: str | None,
    fragment: str,
    defines: Mapping[str, int],
) -> Program:
    """Compile shaders that are given as text; without a vertex shader's, ``fullscreen.vert``."""
    given = dict(defines)
    sources = (
        resolve_source("probe.vert", vertex, given) if vertex else load_source("fullscreen.vert", given),
        resolve_source("probe.frag", fragment, given),
    )
    return kept_until(held, Program(device.ctx, *sources, ("result",)))


def bind_blocks(device: Device, blocks: Mapping[str, NDArray[Any]], held: ExitStack) -> None:
    """Bind uniform blocks of these values."""
    for name, values in blocks.items():
        kept_until(held, device.ctx.buffer(values.tobytes())).bind_to_uniform_block(binding(name))


def row_texture(device: Device, rows: NDArray[Any], held: ExitStack) -> moderngl.Texture:
    """Return rows (n, 4) as float32 texels; copies of the first row fill up the last line."""
    high = -(-len(rows) // WIDTH)
    texels = np.empty((high * WIDTH, 4), dtype=np.float32)
    texels[: len(rows)] = rows
    texels[len(rows) :] = rows[0]
    texture = kept_until(held, device.ctx.texture((WIDTH, high), 4, texels.tobytes(), dtype="f4"))
    texture.filter = moderngl.NEAREST, moderngl.NEAREST
    return texture


def stored_numbers(texture: moderngl.Texture, format_name: str) -> Float32:
    """Return the numbers stored in a target, shape (pixels, 4), 0 in channels that it does not have."""
    form = FORMATS[format_name]
    numbers = np.frombuffer(texture.read(), dtype=stored_dtype(form)).reshape(-1, form.components)
    result = np.zeros((len(numbers), 4), dtype=np.float32)
    result[:, : form.components] = stored_fractions(form, numbers)
    return result


def _mipmapped(device: Device, levels: Sequence[NDArray[Any]], held: ExitStack) -> moderngl.Texture:
    high, wide = levels[0].shape[:2]
    dtype = "f1" if levels[0].dtype == np.uint8 else "nu2"
    texture = kept_until(held, device.ctx.texture((wide, high), 4, levels[0].tobytes(), dtype=dtype))
    texture.build_mipmaps(max_level=len(levels) - 1)  # allocates the levels, which are overwritten
    for number, level in enumerate(levels):
        texture.write(np.ascontiguousarray(level).tobytes(), level=number)
    texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
    return texture


def _row_fragment(includes: Sequence[str], body: str, samplers: Sequence[str]) -> str:
    more = "    vec4 b = texelFetch(u_more, ivec2(gl_FragCoord.xy), 0);" if "u_more" in samplers else ""
    return "\n".join(
        [
            "#version 330 core",
            *(f'#include "include/{name}.glsl"' for name in includes),
            *(f"uniform sampler2D {name};" for name in samplers),
            "out vec4 o_result;",
            "void main() {",
            "    vec4 a = texelFetch(u_inputs, ivec2(gl_FragCoord.xy), 0);",
            more,
            "    vec4 result = vec4(0.0);",
            f"    {body}",
            "    o_result = result;",
            "}\n",
        ]
    )
