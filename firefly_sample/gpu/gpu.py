"""Everything a renderer keeps on the GPU, in one place with one lifetime."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

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
from firefly_sample.gpu.light_records import shadow_rows
from firefly_sample.gpu.pixel_buffers import PixelBuffers
from firefly_sample.gpu.programs import Program, Programs
from firefly_sample.gpu.raw import SAMPLES_PASSED
from firefly_sample.gpu.streams import Streams
from firefly_sample.gpu.timers import Timers
from firefly_sample.gpu.uploads import Uploads
from firefly_sample.plan.frame_plan import FramePlan

SQUARE = np.array([(-1, -1), (1, -1), (-1, 1), (1, 1)], dtype=np.float32)
"""Corners of a strip of two triangles."""


@dataclass
class Samples:
    """A number of samples, 0 until all are drawn."""

    number: int = 0


class Squares(NamedTuple):
    """Squares in a buffer, see `Gpu.squares`."""

    gpu: Gpu
    array: moderngl.VertexArray
    buffer: moderngl.Buffer
    program: Program
    dtype: np.dtype[Any]
    number: int

    def draw_all(self) -> None:
        """Draw all of them; the program is in use."""
        self.draw(0, self.number)

    def draw(self, first: int, count: int) -> None:
        """Draw some of them; the program is in use."""
        # OpenGL 3.3 has no draw call that begins with an instance other than 0: the attributes do
        pointers, stride = self.program.pointers(self.dtype), self.dtype.itemsize
        self.gpu.device.raw.point_attributes(self.array.glo, self.buffer.glo, pointers, stride, first)
        self.gpu.render(self.array, moderngl.TRIANGLE_STRIP, vertices=4, instances=count)


class Gpu:
    """A device and the caches over it. Release it before its device."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.ctx = device.ctx
        self.programs = Programs(device.ctx)
        self.streams = Streams(device.ctx)
        self.uploads = Uploads(device, self.streams)
        self.corners = CornerTables(device.ctx, self.streams)
        self.images = Images(device)
        self.timers = Timers(device)
        self.pixels = PixelBuffers(device)
        self._blocks = {name: device.ctx.buffer(reserve=block_dtype(name).itemsize) for name in BLOCKS}
        self.lights_drawn = 0
        self.draw_calls = 0
        self.reuse = True
        self._shadow_table: moderngl.Texture | None = None
        self._fixed: dict[str, moderngl.Buffer] = {}
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

    def reset_state(self, depth_func: str = "<") -> None:
        """Set the state that draws may change: every pass begins with it.

        Blending adds. The `depth_func` of passes is "<=", or ">=" for reversed depth: "<", with which OpenGL
        starts, would drop geometry whose depth rounds to the clear value.
        """
        self.ctx.blend_func = moderngl.ONE, moderngl.ONE
        self.ctx.depth_func = depth_func
        self.ctx.front_face = "ccw"
        self.ctx.cull_face = "back"
        self.ctx.polygon_offset = 0.0, 0.0
        self.ctx.wireframe = False

    def end(self) -> None:
        """Leave the context as OpenGL starts it, but for the blend function, and free what is gone."""
        self.reset_state()
        self.device.set_depth_clamp(False)
        if self.device.capabilities.clip_control:
            self.device.raw.set_clip_range(False)
        self.ctx.enable_only(moderngl.NOTHING)
        self.device.unbind()
        self.uploads.sweep()

    def fixed(self, name: str, rows: NDArray[Any]) -> moderngl.Buffer:
        """Return a buffer that is written once."""
        if name not in self._fixed:
            self._fixed[name] = self.ctx.buffer(np.ascontiguousarray(rows))
        return self._fixed[name]

    def array(self, name: str, program: Program, *content: tuple[Any, ...] | None) -> moderngl.VertexArray:
        """Return a vertex array over streams and fixed buffers, made again if one of them was."""
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
        self,
        array: moderngl.VertexArray,
        mode: int,
        *,
        vertices: int = -1,
        instances: int = -1,
        first: int = 0,
    ) -> None:
        """Draw a vertex array from its vertex `first` on; every draw call is made, and counted, here.

        -1 stands for all vertices of the array, and for the number of instances that it was made for.
        """
        array.render(mode, vertices, first=first, instances=instances)
        self.draw_calls += 1

    def draw_screen(self, program: Program) -> None:
        """Draw a triangle that covers the viewport: ``fullscreen.vert`` makes its corners."""
        self.render(self.array("fullscreen", program), moderngl.TRIANGLES, vertices=3)

    def draw_squares(self, program: Program, rows: NDArray[Any], dtype: np.dtype[Any]) -> None:
        """Draw a square for each row, with `program` in use; the arguments are those of `squares`."""
        self.squares(program, rows, dtype).draw_all()

    def squares(self, program: Program, rows: NDArray[Any], dtype: np.dtype[Any]) -> Squares:
        """Return squares for rows of float32, shape (n, k), to be drawn in parts.

        The fields of `dtype`, a row, are named as the attributes of instances. ``in_corner`` is -1 or 1,
        across and up.
        """
        corners = self.fixed("square", SQUARE), "2f", "in_corner"
        buffer = self.streams.buffer(program.name, rows)
        instances = program.attributes_of(buffer, dtype, per_instance=True)
        array = self.array(program.name, program, corners, instances)
        return Squares(self, array, buffer, program, dtype, len(rows))

    @contextmanager
    def samples(self) -> Iterator[Samples]:
        """Count the samples that pass what is drawn inside."""
        raw, counted = self.device.raw, Samples()
        query = raw.create_query()
        try:
            raw.call("glBeginQuery", SAMPLES_PASSED, query)
            yield counted
        finally:
            raw.call("glEndQuery", SAMPLES_PASSED)
            counted.number = raw.query_result(query)
            raw.delete_query(query)

    def shadow_table(self, plan: FramePlan) -> moderngl.Texture:
        """Return the constants that a frame's shadow maps are looked up with, a row of texels per map."""
        if self._shadow_table is None:
            self._shadow_table = self.streams.texture("shadow maps", shadow_rows(plan.shadows, plan.view))
        return self._shadow_table

    def release(self) -> None:
        """Free everything but the device."""
        for _, array in self._arrays.values():
            array.release()
        for buffer in (*self._fixed.values(), *self._blocks.values()):
            buffer.release()
        for part in (self.uploads, self.streams, self.images, self.programs, self.timers, self.pixels):
            part.release()
