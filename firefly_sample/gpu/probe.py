"""Numbers inside shaders, made visible: functions of the includes, evaluated on the driver at hand.

A picture shows only what is left of them at the end.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from typing import TypeVar

import moderngl
import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.blocks import binding, view_values
from firefly_sample.gpu.device import Device
from firefly_sample.gpu.programs import Programs
from firefly_sample.plan.frame_plan import View
from firefly_sample.plan.targets import FORMATS
from firefly_sample.plan.variants import NormalPacking, Variant

__all__ = ["probe_normals", "probe_rays"]

Float32 = NDArray[np.float32]

Made = TypeVar("Made", moderngl.Buffer, moderngl.Texture, moderngl.Framebuffer, moderngl.VertexArray)

WIDTH = 1024
"""Normals in a row."""


@dataclass(frozen=True)
class _LensVariant(Variant):
    orthographic: bool = False


@dataclass(frozen=True)
class _NormalVariant(Variant):
    normals: NormalPacking = "snorm16"
    colors: bool = False


def probe_rays(device: Device, view: View) -> Float32:
    """What shaders know of each pixel of a view.

    Returns
    -------
    ndarray of float32, shape (height, width, 4)
        NDC, right and up, and x and z of the way through the pixel's centre at y = 1 (orthographic: of the
        place); the first row on top.
    """
    with device, _Drawing(device) as drawing:
        block = drawing.keep(device.ctx.buffer(view_values(view).tobytes()))
        block.bind_to_uniform_block(binding("View"))
        target = drawing.image(view.size, "rgba32f")
        drawing.fill(target, "probe_lens", _LensVariant(not view.lens.perspective), {})
        rows = np.frombuffer(target.read(), dtype=np.float32).reshape(view.size[1], view.size[0], 4)
    return np.array(rows[::-1])


def probe_normals(device: Device, normals: Float32, packing: NormalPacking, format_name: str) -> Float32:
    """Normals as they come back from a target that they were stored in.

    Parameters
    ----------
    normals : ndarray of float32, shape (n, 3)
        Unit vectors.
    packing, format_name : str
        As `firefly_sample.plan.targets.NORMAL_FORMATS` has them.

    Returns
    -------
    ndarray of float32, shape (n, 3)
    """
    rows = np.zeros((-(-len(normals) // WIDTH) * WIDTH, 4), dtype=np.float32)
    rows[:] = 0.0, 0.0, 1.0, 0.0
    rows[: len(normals), :3] = normals
    size, variant = (WIDTH, len(rows) // WIDTH), _NormalVariant(packing)
    with device, _Drawing(device) as drawing:
        given = drawing.keep(device.ctx.texture(size, 4, rows.tobytes(), dtype="f4"))
        stored, result = drawing.image(size, format_name), drawing.image(size, "rgba32f")
        drawing.fill(stored, "probe_encode", variant, {"u_normals": given})
        drawing.fill(result, "probe_decode", variant, {"u_stored": stored})
        back = np.frombuffer(result.read(), dtype=np.float32).reshape(-1, 4)
    return np.array(back[: len(normals), :3])


class _Drawing(ExitStack):
    """What one evaluation makes; all of it is freed at the end."""

    def __init__(self, device: Device) -> None:
        super().__init__()
        self._device = device
        self._programs = Programs(device.ctx)
        self.callback(device.check, "a probe")
        self.callback(self._programs.release)

    def keep(self, made: Made) -> Made:
        """Free `made` at the end."""
        self.callback(made.release)
        return made

    def image(self, size: tuple[int, int], format_name: str) -> moderngl.Texture:
        """A target of a format."""
        form = FORMATS[format_name]
        return self.keep(
            self._device.ctx.texture(
                size,
                form.components,
                dtype=form.dtype,
                internal_format=form.gl_format,
            )
        )

    def fill(
        self, target: moderngl.Texture, stem: str, variant: Variant, textures: dict[str, moderngl.Texture]
    ) -> None:
        """Draw a shader over the whole of a target."""
        ctx = self._device.ctx
        program = self._programs.get(stem, variant, ("result",), "fullscreen")
        framebuffer = self.keep(ctx.framebuffer([target]))
        array = self.keep(ctx.vertex_array(program.mgl, []))
        framebuffer.use()
        ctx.enable_only(moderngl.NOTHING)
        program.use(None, textures)
        array.render(moderngl.TRIANGLES, vertices=3)
        self._device.unbind()
