"""Runs a function of a GLSL include over rows of numbers, on the real driver, through a one-row target."""

from __future__ import annotations

import tempfile
from pathlib import Path

import moderngl
import numpy as np

from firefly_sample.assets import asset_dir
from firefly_sample.gpu.blocks import binding
from firefly_sample.gpu.device import Device
from firefly_sample.gpu.shader_source import load_source
from firefly_sample.plan.targets import FORMATS

_VERTEX = """#version 330 core
void main()
{
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}
"""
WIDTH = 1024
DTYPES = {
    "f4": (np.float32, 1),
    "f2": (np.float16, 1),
    "f1": (np.uint8, 255),
    "nu2": (np.uint16, 65535),
    "ni2": (np.int16, 32767),
}
"""How the numbers of a target are read, and which stands for 1."""


def _padded(inputs):
    rows = np.zeros((-(-len(inputs) // WIDTH) * WIDTH, 4), dtype=np.float32)
    rows[: len(inputs)] = inputs
    rows[len(inputs) :] = inputs[0]
    return rows


def evaluate(
    device: Device, includes, body: str, inputs, defines=None, blocks=None, more=None, target="rgba32f"
):
    """`body` sets ``vec4 result`` from ``vec4 a`` (and ``vec4 b``, if there is more).

    `inputs` and `more` (n, 4) give float32 results (n, 4), as the format `target` keeps them.
    """
    rows = _padded(inputs)
    size = (WIDTH, len(rows) // WIDTH)
    second = "" if more is None else "vec4 b = texelFetch(u_more, ivec2(gl_FragCoord.xy), 0);"
    heads = "\n".join(f'#include "include/{name}.glsl"' for name in includes)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "include").symlink_to(asset_dir("shaders") / "include")
        (Path(folder) / "test.frag").write_text(
            f"#version 330 core\n{heads}\nuniform sampler2D u_inputs;\nuniform sampler2D u_more;\n"
            "out vec4 o_result;\n"
            "void main() {\n    vec4 a = texelFetch(u_inputs, ivec2(gl_FragCoord.xy), 0);\n"
            f"    {second} vec4 result = vec4(0.0);\n"
            f"    {body}\n    o_result = result;\n}}\n"
        )
        source = load_source("test.frag", defines or {}, Path(folder))
    with device:
        ctx = device.ctx
        program = ctx.program(vertex_shader=_VERTEX, fragment_shader=source.text)
        texture = ctx.texture(size, 4, rows.tobytes(), dtype="f4")
        held = []
        if more is not None:
            held.append(ctx.texture(size, 4, _padded(more).tobytes(), dtype="f4"))
            held[0].use(1)
            if "u_more" in program:  # what nothing depends on is left out
                program["u_more"] = 1
        form = FORMATS[target]
        target = ctx.texture(size, form.components, dtype=form.dtype, internal_format=form.gl_format)
        framebuffer = ctx.framebuffer([target])
        for name, values in (blocks or {}).items():
            buffer = ctx.buffer(values.tobytes())
            program[name].binding = binding(name)
            buffer.bind_to_uniform_block(binding(name))
            held.append(buffer)
        array = ctx.vertex_array(program, [])
        framebuffer.use()
        ctx.enable_only(moderngl.NOTHING)
        texture.use(0)
        array.render(moderngl.TRIANGLES, vertices=3)
        result = np.zeros((len(inputs), 4), dtype=np.float32)
        numbers = np.frombuffer(target.read(), dtype=DTYPES[form.dtype][0]).reshape(
            len(rows), form.components
        )
        result[:, : form.components] = numbers[: len(inputs)] / np.float64(DTYPES[form.dtype][1])
        if form.name == "rgb10_a2":
            result = (np.round(result.astype(np.float64) * 1023) / 1023).astype(np.float32)
        device.unbind()
        for thing in (array, framebuffer, texture, target, program, *held):
            thing.release()
        device.check("the GLSL harness")
    return result
