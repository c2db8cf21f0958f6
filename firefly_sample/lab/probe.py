"""Runs GLSL over rows of numbers and over triangles on the real driver, through targets of any format.

The results of a shader's function, and the numbers that a format keeps, can be compared with float64.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import moderngl
import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.gpu.blocks import binding, view_values
from firefly_sample.gpu.device import Device
from firefly_sample.gpu.images import make_texture
from firefly_sample.gpu.programs import Program
from firefly_sample.gpu.shader_source import resolve_source
from firefly_sample.plan.targets import FORMATS, stored_dtype, stored_fractions
from firefly_sample.plan.view import View

Float32 = NDArray[np.float32]
Size = tuple[int, int]


_Kept = TypeVar(
    "_Kept", moderngl.Buffer, moderngl.Framebuffer, moderngl.Texture, moderngl.VertexArray, Program
)

WIDTH = 1024
"""Pixels across of the target that rows are drawn into; row i is the pixel (i % WIDTH, i // WIDTH)."""
FULLSCREEN = """#version 330 core
flat out int v_instance;
void main()
{
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    v_instance = gl_InstanceID;
    gl_Position = vec4(corner * 2.0 - 1.0, 0.5, 1.0);
}
"""
_THROUGH_LENS = """#version 330 core
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


@dataclass(frozen=True)
class Probe:
    """A device's current context, in which small programs are drawn, and the GL objects to release."""

    device: Device
    held: ExitStack

    def keep(self, made: _Kept) -> _Kept:
        """Return a GL object that is released at the end."""
        self.held.callback(made.release)
        return made

    def texture(self, format_name: str, size: Size) -> moderngl.Texture:
        """Return an empty texture of a format of `firefly_sample.plan.targets.FORMATS`."""
        return self.keep(make_texture(self.device, format_name, size))

    def row_texture(self, rows: ArrayLike) -> moderngl.Texture:
        """Return rows (n, up to 4) as float32 texels; copies of the first row fill up the last line."""
        values = np.asarray(rows)
        high = -(-len(values) // WIDTH)
        texels = np.zeros((high * WIDTH, 4), dtype=np.float32)
        texels[:, : values.shape[1]] = values[0]
        texels[: len(values), : values.shape[1]] = values
        texture = self.keep(self.device.ctx.texture((WIDTH, high), 4, texels.tobytes(), dtype="f4"))
        texture.filter = moderngl.NEAREST, moderngl.NEAREST
        return texture

    def mipmapped(self, levels: Sequence[NDArray[Any]]) -> moderngl.Texture:
        """Return a texture of these levels, uint8 or uint16 (height, width, 4), with trilinear filtering."""
        high, wide = levels[0].shape[:2]
        dtype = "f1" if levels[0].dtype == np.uint8 else "nu2"
        texture = self.keep(self.device.ctx.texture((wide, high), 4, levels[0].tobytes(), dtype=dtype))
        texture.build_mipmaps(max_level=len(levels) - 1)  # allocates the levels, which are overwritten
        for number, level in enumerate(levels):
            texture.write(np.ascontiguousarray(level).tobytes(), level=number)
        texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
        return texture

    def program(
        self, fragment: str, defines: Mapping[str, int] | None = None, vertex: str = FULLSCREEN
    ) -> Program:
        """Compile the texts of two shaders."""
        known = dict(defines or {})
        sources = resolve_source("probe.vert", vertex, known), resolve_source("probe.frag", fragment, known)
        return self.keep(Program(self.device.ctx, *sources, ("result",)))

    def bind(self, blocks: Mapping[str, NDArray[Any]] | None) -> None:
        """Bind the values of uniform blocks, by name."""
        for name, values in (blocks or {}).items():
            self.keep(self.device.ctx.buffer(values.tobytes())).bind_to_uniform_block(binding(name))

    def draw(
        self,
        fragment: str,
        target: moderngl.Texture,
        textures: Mapping[str, moderngl.Texture],
        defines: Mapping[str, int] | None = None,
        blocks: Mapping[str, NDArray[Any]] | None = None,
        instances: int = 1,
    ) -> None:
        """Clear a target, and draw full-screen triangles into it: more than one are added up by blending."""
        ctx = self.device.ctx
        program = self.program(fragment, defines)
        framebuffer = self.keep(ctx.framebuffer([target]))
        array = self.keep(ctx.vertex_array(program.mgl, []))
        self.bind(blocks)
        framebuffer.use()
        framebuffer.clear()
        program.use({}, textures)
        ctx.enable_only(moderngl.BLEND if instances > 1 else moderngl.NOTHING)
        ctx.blend_func = moderngl.ONE, moderngl.ONE
        array.render(moderngl.TRIANGLES, vertices=3, instances=instances)
        ctx.enable_only(moderngl.NOTHING)


@contextmanager
def open_probe(device: Device) -> Iterator[Probe]:
    """Make a device's context current for a probe. Raises `GpuError` if the driver reports an error."""
    with device, ExitStack() as held:
        yield Probe(device, held)
        device.unbind()
    device.check("a probe")


def fragment_shader(
    body: str, includes: Sequence[str] = (), samplers: Sequence[str] = (), declared: str = ""
) -> str:
    """Return a fragment shader around GLSL that sets ``vec4 result``.

    It reads the pixel's texel of a sampler ``u_a`` or ``u_b`` into ``vec4 a`` or ``vec4 b``.
    """
    fetched = {"u_a", "u_b"}.intersection(samplers)
    return "\n".join(
        [
            "#version 330 core",
            *(f'#include "include/{name}.glsl"' for name in includes),
            *(f"uniform sampler2D {name};" for name in samplers),
            declared,
            "out vec4 o_result;",
            "void main() {",
            *(f"    vec4 {name[2:]} = texelFetch({name}, ivec2(gl_FragCoord.xy), 0);" for name in fetched),
            "    vec4 result = vec4(0.0);",
            f"    {body}",
            "    o_result = result;",
            "}\n",
        ]
    )


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
    """Return the results of GLSL for each row, in a fragment of its own: float32, shape (n, 4).

    They are 0 in channels that the target does not have. Raises `ShaderError` if the GLSL does not compile,
    and `GpuError` if the driver reports an error.

    Parameters
    ----------
    includes : sequence of str
        Stems of ``shaders/include/*.glsl``.
    body : str
        GLSL that sets ``vec4 result`` from ``vec4 a``, and ``vec4 b`` if there is `more`.
    inputs, more : array_like, shape (n, up to 4)
        Cast to float32; 0 in the channels that are left out.
    blocks : mapping, optional
        Values of uniform blocks by name, as `firefly_sample.gpu.blocks` packs them.
    target : str
        The format of `firefly_sample.plan.targets.FORMATS` that keeps the result.
    then : str, optional
        GLSL that sets ``vec4 result`` from ``vec4 a``, which a shader reads back from the target. Without it,
        the target's own numbers are returned.
    encode : bool
        Let the driver encode the numbers that are written to an sRGB target.
    levels : sequence of ndarray of uint8 or uint16, shape (height, width, 4)
        All mipmap levels of the sampler ``u_texture``, with trilinear filtering, repeating.
    """
    rows = np.asarray(inputs)
    with open_probe(device) as probe:
        textures = {"u_a": probe.row_texture(rows)}
        if more is not None:
            textures["u_b"] = probe.row_texture(more)
        if levels:
            textures["u_texture"] = probe.mipmapped(levels)
        size = textures["u_a"].size
        kept = probe.texture(target, size)
        if encode:
            device.set_srgb_encoding(True)
        probe.draw(fragment_shader(body, includes, tuple(textures)), kept, textures, defines, blocks)
        if encode:
            device.set_srgb_encoding(False)
        if then is not None:
            stored, kept, target = kept, probe.texture("rgba32f", size), "rgba32f"
            probe.draw(fragment_shader(then, includes, ["u_a"]), kept, {"u_a": stored}, defines, blocks)
        return _stored_numbers(kept, target)[: len(rows)]


def accumulate(device: Device, passes: ArrayLike, target: str, repeat: int = 1) -> Float32:
    """Return sums of passes (p, n, up to 3) over n pixels, drawn `repeat` times and added by blending.

    The sums begin at 0 in a `target` of `firefly_sample.plan.targets.FORMATS`.
    """
    values = np.asarray(passes, dtype=np.float32)
    count, pixels, channels = values.shape
    high = -(-pixels // WIDTH)
    rows = np.zeros((count, high * WIDTH, channels), dtype=np.float32)
    rows[:, :pixels] = values
    texel = f"ivec2(gl_FragCoord.xy) + ivec2(0, {high} * (v_instance % {count}))"
    body = f"result.rgb = texelFetch(u_passes, {texel}, 0).rgb;"
    fragment = fragment_shader(body, samplers=["u_passes"], declared="flat in int v_instance;")
    with open_probe(device) as probe:
        textures = {"u_passes": probe.row_texture(rows.reshape(-1, channels))}
        sums = probe.texture(target, (WIDTH, high))
        probe.draw(fragment, sums, textures, instances=count * repeat)
        return _stored_numbers(sums, target)[:pixels, :channels]


def rasterise(
    device: Device,
    view: View,
    corners: ArrayLike,
    body: str,
    target: str = "rgba32f",
    depth: str | None = None,
) -> Float32:
    """Draw triangles (n, 3, 3) of view space through a perspective lens, with the geometry pass's arithmetic.

    `body` is GLSL that sets ``vec4 result``, with ``include/lens.glsl``. Without `depth` it runs where a
    triangle is drawn, and has its interpolated ``v_view`` and ``v_clip``. With `depth`, the format of a depth
    buffer, it runs for all pixels afterwards, and ``a.r`` is the depth as a shader reads it from the buffer.

    Returns
    -------
    ndarray of float32, shape (height, width, 4)
        The numbers of `target`, a format of `firefly_sample.plan.targets.FORMATS`, lowest row first.
    """
    vertices = np.asarray(corners, dtype=np.float32)
    ctx, defines, blocks = device.ctx, {"ORTHOGRAPHIC": 0}, {"View": view_values(view)}
    zero_to_one = view.lens.depth_offset == 0.0
    fragment = fragment_shader("" if depth else body, ["lens"], declared="in vec3 v_view;\nin vec4 v_clip;")
    with open_probe(device) as probe:
        kept = probe.texture(target, view.size)
        buffer = probe.texture(depth, view.size) if depth else None
        program = probe.program(fragment, defines, _THROUGH_LENS)
        points = probe.keep(ctx.buffer(vertices.tobytes()))
        array = probe.keep(ctx.vertex_array(program.mgl, [(points, "3f", "in_view")]))
        framebuffer = probe.keep(ctx.framebuffer([kept], buffer))
        probe.bind(blocks)
        if zero_to_one:
            device.raw.set_clip_range(True)
        framebuffer.use()
        framebuffer.clear(depth=0.0 if view.reverse else 1.0)
        ctx.enable_only(moderngl.DEPTH_TEST if depth else moderngl.NOTHING)
        ctx.depth_func = ">=" if view.reverse else "<="
        program.use()
        array.render(moderngl.TRIANGLES)
        ctx.depth_func = "<"
        ctx.enable_only(moderngl.NOTHING)
        if zero_to_one:
            device.raw.set_clip_range(False)
        if buffer is not None:
            probe.draw(fragment_shader(body, ["lens"], ["u_a"]), kept, {"u_a": buffer}, defines, blocks)
        return _stored_numbers(kept, target).reshape(view.size[1], view.size[0], 4)


def _stored_numbers(texture: moderngl.Texture, format_name: str) -> Float32:
    """Return the numbers stored in a target, shape (pixels, 4), 0 in channels that it does not have."""
    form = FORMATS[format_name]
    numbers = np.frombuffer(texture.read(), dtype=stored_dtype(form)).reshape(-1, form.components)
    result = np.zeros((len(numbers), 4), dtype=np.float32)
    result[:, : form.components] = stored_fractions(form, numbers)
    return result
