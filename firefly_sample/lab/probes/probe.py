"""Runs pieces of GLSL over rows of numbers on the real driver, through a target of any format.

What a shader's function gives, and what a target's format leaves of it, can so be held against float64.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from typing import Any

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

WIDTH = 1024
"""Pixels across of what rows are drawn into; row i is the pixel (i % WIDTH, i // WIDTH)."""


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
    """Compute each row in a fragment of its own.

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
        GLSL that sets ``vec4 result`` from what a shader reads back from the target, ``vec4 a``. Without it
        the target's own numbers are given.
    encode : bool
        Let the driver encode what it writes into an sRGB target.
    levels : sequence of ndarray of uint8 or uint16, shape (height, width, 4)
        A texture with all its levels, the sampler ``u_texture``: trilinear, repeating.

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
        kept = _target(device, target, given.size, held)
        fragment = _fragment(includes, body, textures)
        if encode:
            device.set_srgb_encoding(True)
        run(device, held, fragment, kept, textures, defines, blocks)
        if encode:
            device.set_srgb_encoding(False)
        if then is not None:
            last = _target(device, "rgba32f", given.size, held)
            fragment = _fragment(includes, then, ("u_inputs",))
            run(device, held, fragment, last, {"u_inputs": kept}, defines, blocks)
            kept, target = last, "rgba32f"
        result = stored_numbers(kept, target)[: len(rows)]
        device.unbind()
    device.check("a probe")
    return result


def accumulate(device: Device, passes: ArrayLike, target: str, repeat: int = 1) -> Float32:
    """Add numbers up by blending, a draw's instance after the other.

    Parameters
    ----------
    passes : array_like, shape (p, n, 3)
        What each pass adds to n pixels.
    target : str
        The format that is added up in, from 0.
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
    vertex = (
        "#version 330 core\nflat out int v_pass;\nvoid main() {\n"
        "    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);\n    v_pass = gl_InstanceID;\n"
        "    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);\n}\n"
    )
    fragment = (
        "#version 330 core\nuniform sampler2D u_inputs;\nflat in int v_pass;\nout vec4 o_result;\n"
        "void main() {\n"
        f"    ivec2 texel = ivec2(gl_FragCoord.xy) + ivec2(0, {high} * (v_pass % {count}));\n"
        "    o_result = vec4(texelFetch(u_inputs, texel, 0).rgb, 0.0);\n}\n"
    )
    with device, ExitStack() as held:
        given = row_texture(device, rows.reshape(-1, 4), held)
        kept = _target(device, target, (WIDTH, high), held)
        run(device, held, fragment, kept, {"u_inputs": given}, vertex=vertex, instances=count * repeat)
        result = stored_numbers(kept, target)[:pixels, :3]
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
        What is made is released with it.
    target : moderngl.Texture
        Cleared first.
    vertex : str, optional
        A vertex shader's text in place of ``fullscreen.vert``.
    instances : int
        How often the triangle is drawn.
    """
    given = dict(defines or {})
    sources = (
        resolve_source("probe.vert", vertex, given) if vertex else load_source("fullscreen.vert", given),
        resolve_source("probe.frag", fragment, given),
    )
    ctx = device.ctx
    program = Program(ctx, *sources, ("result",))
    held.callback(program.release)
    framebuffer = ctx.framebuffer([target])
    held.callback(framebuffer.release)
    array = ctx.vertex_array(program.mgl, [])
    held.callback(array.release)
    bind_blocks(device, blocks, held)
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


def bind_blocks(device: Device, blocks: Mapping[str, NDArray[Any]] | None, held: ExitStack) -> None:
    """Make uniform blocks of these values current."""
    for name, values in (blocks or {}).items():
        buffer = device.ctx.buffer(values.tobytes())
        held.callback(buffer.release)
        buffer.bind_to_uniform_block(binding(name))


def row_texture(device: Device, rows: NDArray[Any], held: ExitStack) -> moderngl.Texture:
    """Rows (n, 4) as float32 texels; the first one fills the last line up: nothing odd is computed."""
    high = -(-len(rows) // WIDTH)
    texels = np.empty((high * WIDTH, 4), dtype=np.float32)
    texels[: len(rows)] = rows
    texels[len(rows) :] = rows[0]
    texture = device.ctx.texture((WIDTH, high), 4, texels.tobytes(), dtype="f4")
    held.callback(texture.release)
    texture.filter = moderngl.NEAREST, moderngl.NEAREST
    return texture


def stored_numbers(texture: moderngl.Texture, format_name: str) -> Float32:
    """The numbers of a target as they are stored, shape (pixels, 4), 0 in channels that it does not have."""
    form = FORMATS[format_name]
    numbers = np.frombuffer(texture.read(), dtype=stored_dtype(form)).reshape(-1, form.components)
    result = np.zeros((len(numbers), 4), dtype=np.float32)
    result[:, : form.components] = stored_fractions(form, numbers)
    return result


def _target(device: Device, format_name: str, size: tuple[int, int], held: ExitStack) -> moderngl.Texture:
    texture = make_texture(device, format_name, size)
    held.callback(texture.release)
    return texture


def _mipmapped(device: Device, levels: Sequence[NDArray[Any]], held: ExitStack) -> moderngl.Texture:
    high, wide = levels[0].shape[:2]
    dtype = "f1" if levels[0].dtype == np.uint8 else "nu2"
    texture = device.ctx.texture((wide, high), 4, levels[0].tobytes(), dtype=dtype)
    held.callback(texture.release)
    texture.build_mipmaps(max_level=len(levels) - 1)  # allocates what is written over
    for number, level in enumerate(levels):
        texture.write(np.ascontiguousarray(level).tobytes(), level=number)
    texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
    return texture


def _fragment(includes: Sequence[str], body: str, samplers: Sequence[str] | Mapping[str, Any]) -> str:
    heads = [f'#include "include/{name}.glsl"' for name in includes]
    uniforms = [f"uniform sampler2D {name};" for name in samplers]
    more = "    vec4 b = texelFetch(u_more, ivec2(gl_FragCoord.xy), 0);" if "u_more" in samplers else ""
    return "\n".join(
        [
            "#version 330 core",
            *heads,
            *uniforms,
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
