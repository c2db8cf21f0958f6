"""Everything a renderer keeps on the GPU, in one place with one lifetime."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.blocks import (
    BLOCKS,
    binding,
    block_dtype,
    particle_shadow_values,
    shading_values,
    view_values,
)
from firefly_sample.gpu.corner_tables import CornerTables
from firefly_sample.gpu.device import Device
from firefly_sample.gpu.images import Images
from firefly_sample.gpu.light_rows import shadow_rows
from firefly_sample.gpu.pixel_buffers import PixelBuffers
from firefly_sample.gpu.programs import Program, Programs
from firefly_sample.gpu.tables import Tables
from firefly_sample.gpu.timers import Timers
from firefly_sample.gpu.uploads import Uploads
from firefly_sample.plan.frame_plan import FramePlan


class Gpu:
    """A device and the caches over it. Release it before its device."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.ctx = device.ctx
        self.programs = Programs(device.ctx)
        self.uploads = Uploads(device)
        self.corners = CornerTables(device.ctx)
        self.tables = Tables(device.ctx)
        self.images = Images(device)
        self.timers = Timers(device)
        self.pixels = PixelBuffers(device)
        self._blocks = {name: device.ctx.buffer(reserve=block_dtype(name).itemsize) for name in BLOCKS}
        self.lights_drawn = 0
        self.draw_calls = 0
        self.reuse = True
        self._shadow_table: moderngl.Texture | None = None
        self._streams: dict[str, moderngl.Buffer] = {}
        self._arrays: dict[tuple[str, Program], tuple[tuple[moderngl.Buffer, ...], moderngl.VertexArray]] = {}

    def begin(self, plan: FramePlan) -> None:
        """Bring targets and uniform blocks up to date for a frame."""
        self.lights_drawn = 0
        self.timers.give_back(self.timers.end())  # of a frame that failed
        self.draw_calls = 0
        self._shadow_table = None
        self.images.prepare(plan)
        blocks = {"View": view_values(plan.view), "Shading": shading_values(plan)}
        if plan.particle_shadow is not None:
            blocks["ParticleShadow"] = particle_shadow_values(plan.particle_shadow, plan.view)
        for name, values in blocks.items():
            self._blocks[name].write(values.tobytes())
            self._blocks[name].bind_to_uniform_block(binding(name))
        if self.device.capabilities.clip_control:
            self.device.raw.set_clip_range(plan.view.reverse)

    def end(self) -> None:
        """Leave the context as OpenGL starts it, and free what is gone."""
        if self.device.capabilities.clip_control:
            self.device.raw.set_clip_range(False)
        self.ctx.enable_only(moderngl.NOTHING)
        self.device.unbind()
        self.uploads.sweep()

    def stream(self, name: str, rows: NDArray[Any]) -> moderngl.Buffer:
        """A buffer whose content changes from frame to frame; it grows and never shrinks."""
        data = np.ascontiguousarray(rows)
        buffer = self._streams.get(name)
        if buffer is None or buffer.size < data.nbytes:
            if buffer is not None:
                buffer.release()
            buffer = self._streams[name] = self.ctx.buffer(reserve=max(64, 2 * data.nbytes), dynamic=True)
        if data.nbytes:
            buffer.write(data.tobytes())
        return buffer

    def fixed(self, name: str, rows: NDArray[Any]) -> moderngl.Buffer:
        """A buffer that is written once."""
        if name not in self._streams:
            self._streams[name] = self.ctx.buffer(np.ascontiguousarray(rows).tobytes())
        return self._streams[name]

    def array(self, name: str, program: Program, *content: tuple[Any, ...] | None) -> moderngl.VertexArray:
        """A vertex array over streams and fixed buffers, remade when one of them was."""
        used = [entry for entry in content if entry is not None]
        buffers = tuple(entry[0] for entry in used)
        kept = self._arrays.get((name, program))
        if kept is None or kept[0] != buffers:
            if kept is not None:
                kept[1].release()
            kept = (buffers, self.ctx.vertex_array(program.mgl, used))
            self._arrays[(name, program)] = kept
        return kept[1]

    def render(
        self, array: moderngl.VertexArray, mode: int, *, vertices: int = -1, instances: int = -1
    ) -> None:
        """Draw a vertex array; every draw call of a frame is made, and counted, here.

        -1 is all that the array has of vertices, and as many instances as it was made for.
        """
        array.render(mode, vertices, instances=instances)
        self.draw_calls += 1

    def shadow_table(self, plan: FramePlan) -> moderngl.Texture:
        """What shaders need to look up a frame's shadow maps, a row of texels a map; written once a frame."""
        if self._shadow_table is None:
            self._shadow_table = self.tables.write("shadow maps", shadow_rows(plan.shadows, plan.view))
        return self._shadow_table

    def release(self) -> None:
        """Free everything but the device."""
        for _, array in self._arrays.values():
            array.release()
        for buffer in (*self._streams.values(), *self._blocks.values()):
            buffer.release()
        self._arrays.clear()
        self._streams.clear()
        self._blocks.clear()
        for part in (
            self.uploads,
            self.corners,
            self.tables,
            self.images,
            self.programs,
            self.timers,
            self.pixels,
        ):
            part.release()
