"""Times different methods of drawing, in turn in each round, so that a busy machine slows all alike."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass

import moderngl
import numpy as np

from firefly_sample.gpu.device import Device
from firefly_sample.gpu.images import make_texture
from firefly_sample.gpu.programs import Program
from firefly_sample.gpu.proxies import proxy_mesh
from firefly_sample.lab.probes.probe import kept_until, make_program

FULLSCREEN = """#version 330 core
flat out int v_light;
void main()
{
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    v_light = gl_InstanceID;
    gl_Position = vec4(corner * 2.0 - 1.0, 0.5, 1.0);
}
"""
VOLUMES = """#version 330 core
in vec3 in_position;
uniform int u_first;
uniform float u_radius;
flat out int v_light;
void main()
{
    v_light = gl_InstanceID + u_first;
    vec3 place = fract(float(v_light) * vec3(0.6180340, 0.7548777, 0.5698403)) * 2.0 - 1.0;
    gl_Position = vec4(place + u_radius * in_position, 1.0);
}
"""
"""Vertex shader of spheres all over the view volume, seen by an orthographic lens."""
TEXTURE = 512


@dataclass(frozen=True)
class Contender:
    """A method of drawing.

    Attributes
    ----------
    name : str
    fragment : str
        A shader that sets ``o_result``; it may use the sampler ``u_texture``.
    vertex : str
        `FULLSCREEN` or `VOLUMES`.
    instances : int
        The number of triangles, or spheres.
    calls : int
        The number of draw calls.
    depth_test : str
        "" for none; otherwise moderngl's comparison with a depth buffer that holds 1/2.
    radius : float
        The spheres', in NDC.
    linear : bool
        Filter the texture.
    """

    name: str
    fragment: str
    vertex: str = FULLSCREEN
    instances: int = 1
    calls: int = 1
    depth_test: str = ""
    radius: float = 0.1
    linear: bool = False


def contest(
    device: Device, contenders: Sequence[Contender], rounds: int, size: tuple[int, int]
) -> list[list[float]]:
    """Draw with each contender in turn, after a first round that compiles.

    Returns
    -------
    list of list of float
        Milliseconds by round and contender.

    Raises
    ------
    GpuError
        If the driver reports an error.
    """
    ctx = device.ctx
    times: list[list[float]] = []
    with device, ExitStack() as held:
        color, depth = (
            kept_until(held, make_texture(device, name, size)) for name in ("rgba32f", "depth32f")
        )
        framebuffer = kept_until(held, ctx.framebuffer([color], depth))
        rng = np.random.Generator(np.random.PCG64(9))
        noise = rng.integers(0, 256, (TEXTURE, TEXTURE, 4), dtype=np.uint8)
        texture = kept_until(held, ctx.texture((TEXTURE, TEXTURE), 4, noise.tobytes()))
        mesh = kept_until(held, ctx.buffer(np.ascontiguousarray(proxy_mesh("icosphere1")).tobytes()))
        drawn = [_prepare(device, contender, mesh, held) for contender in contenders]
        framebuffer.use()
        ctx.blend_func = moderngl.ONE, moderngl.ONE
        for _ in range(rounds + 1):
            row = []
            for contender, (program, array) in zip(contenders, drawn, strict=True):
                framebuffer.depth_mask = True
                framebuffer.clear(depth=0.5)
                framebuffer.depth_mask = False
                row.append(_time(device, contender, program, array, texture))
            times.append(row)
        ctx.depth_func = "<"
        ctx.cull_face = "back"
        ctx.enable_only(moderngl.NOTHING)
        device.unbind()
    device.check("a probe")
    return times[1:]


def _prepare(
    device: Device, contender: Contender, mesh: moderngl.Buffer, held: ExitStack
) -> tuple[Program, moderngl.VertexArray]:
    program = make_program(device, held, contender.vertex, contender.fragment, {})
    content = [(mesh, "3f", "in_position")] if contender.vertex == VOLUMES else []
    return program, kept_until(held, device.ctx.vertex_array(program.mgl, content))


def _time(
    device: Device,
    contender: Contender,
    program: Program,
    array: moderngl.VertexArray,
    texture: moderngl.Texture,
) -> float:
    ctx = device.ctx
    volumes = contender.vertex == VOLUMES
    flags = moderngl.BLEND | (moderngl.CULL_FACE if volumes else 0)
    if contender.depth_test:
        flags |= moderngl.DEPTH_TEST
        ctx.depth_func = contender.depth_test
    ctx.enable_only(flags)
    ctx.cull_face = "front"
    choice = moderngl.LINEAR if contender.linear else moderngl.NEAREST
    texture.filter = choice, choice
    textures = {"u_texture": texture} if "u_texture" in contender.fragment else {}
    each = contender.instances // contender.calls
    ctx.finish()
    start = time.perf_counter()
    for call in range(contender.calls):
        program.use({"u_first": call * each, "u_radius": contender.radius} if volumes else {}, textures)
        array.render(moderngl.TRIANGLES, vertices=-1 if volumes else 3, instances=each)
    ctx.finish()
    return (time.perf_counter() - start) * 1e3
