"""Draws triangles of view space through a lens on the real driver, and reads a target or the depth buffer."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.gpu.device import Device
from firefly_sample.gpu.images import make_texture
from firefly_sample.lab.probes.probe import bind_blocks, kept_until, make_program, run, stored_numbers

_LENS_VERTEX = """#version 330 core
#include "include/lens.glsl"
in vec3 in_view;
out vec3 v_view;
out vec4 v_clip;
void main()
{
    v_view = in_view;
    v_clip = gl_Position = view_to_clip(in_view);
}
"""
_TRIANGLE_FRAGMENT = """#version 330 core
#include "include/lens.glsl"
in vec3 v_view;
in vec4 v_clip;
out vec4 o_result;
void main()
{
    vec4 result = vec4(0.0);
    {BODY}
    o_result = result;
}
"""
_DEPTH_FRAGMENT = """#version 330 core
#include "include/lens.glsl"
uniform sampler2D u_depth;
out vec4 o_result;
void main()
{
    float depth = texelFetch(u_depth, ivec2(gl_FragCoord.xy), 0).r;
    vec4 result = vec4(0.0);
    {BODY}
    o_result = result;
}
"""


def rasterise(
    device: Device,
    corners: ArrayLike,
    view: NDArray[Any],
    size: tuple[int, int],
    body: str,
    target: str = "rgba32f",
    depth: str | None = None,
    reverse: bool = False,
    zero_to_one: bool = False,
) -> NDArray[np.float32]:
    """Draw triangles through a lens, by the vertex arithmetic of the geometry pass.

    Parameters
    ----------
    corners : array_like, shape (triangles, 3, 3)
        View space, cast to float32.
    view : ndarray
        Values of the block `View`: the lens, and the size.
    size : (int, int)
        Pixels.
    body : str
        GLSL that sets ``vec4 result``, with ``include/lens.glsl``. Without `depth` it runs where a triangle
        is drawn, and has its interpolated ``v_view`` and ``v_clip``. With `depth` it runs for all pixels
        afterwards, and has ``depth``, as a shader reads it from the buffer.
    target : str
        Format that the result is kept in.
    depth : str, optional
        Format of a depth buffer to draw into.
    reverse : bool
        Depth falls with the distance.
    zero_to_one : bool
        The clip range 0..1 in place of OpenGL's own.

    Returns
    -------
    ndarray of float32, shape (height, width, 4)
        The numbers of `target`; the first row is the lowest.

    Raises
    ------
    GpuError
        If the driver reports an error.
    """
    vertices = np.ascontiguousarray(np.asarray(corners, dtype=np.float32).reshape(-1, 3))
    ctx, defines, blocks = device.ctx, {"ORTHOGRAPHIC": 0}, {"View": view}
    with device, ExitStack() as held:
        kept = kept_until(held, make_texture(device, target, size))
        buffer = kept_until(held, make_texture(device, depth, size)) if depth else None
        program = make_program(
            device, held, _LENS_VERTEX, _TRIANGLE_FRAGMENT.replace("{BODY}", "" if depth else body), defines
        )
        points = kept_until(held, ctx.buffer(vertices.tobytes()))
        array = kept_until(held, ctx.vertex_array(program.mgl, [(points, "3f", "in_view")]))
        framebuffer = kept_until(held, ctx.framebuffer([kept], buffer))
        bind_blocks(device, blocks, held)
        if zero_to_one:
            device.raw.set_clip_range(True)
        framebuffer.use()
        framebuffer.clear(depth=0.0 if reverse else 1.0)
        ctx.enable_only(moderngl.DEPTH_TEST if depth else moderngl.NOTHING)
        ctx.depth_func = ">=" if reverse else "<="
        program.use()
        array.render(moderngl.TRIANGLES)
        ctx.depth_func = "<"
        ctx.enable_only(moderngl.NOTHING)
        if zero_to_one:
            device.raw.set_clip_range(False)
        if buffer is not None:
            fragment = _DEPTH_FRAGMENT.replace("{BODY}", body)
            run(device, held, fragment, kept, {"u_depth": buffer}, defines, blocks)
        result = stored_numbers(kept, target)
        device.unbind()
    device.check("a probe")
    return result.reshape(size[1], size[0], 4)
