"""Pixel buffers, through which a frame's textures are read back while the next frame is drawn.

A texture that is read straight into memory makes the CPU wait until the GPU has drawn it, and then the GPU
wait for the next frame. A copy of it in a buffer on the GPU can be read while the next frame is drawn.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import moderngl

from firefly_sample.errors import GpuError
from firefly_sample.gpu.device import Device

_ALIGNMENT = 16
"""In bytes: copies must start at a multiple of the size of their numbers, which is at most 16."""


@dataclass(frozen=True, eq=False)
class Copies:
    """Textures that were copied into a buffer: the range of each, (offset, size) in bytes, by name."""

    buffer: moderngl.Buffer
    ranges: Mapping[str, tuple[int, int]]

    def read(self, name: str) -> bytes:
        """Wait for the copy of one texture, and return its bytes, first row at the bottom."""
        offset, size = self.ranges[name]
        return bytes(self.buffer.read(size, offset=offset))


class PixelBuffers:
    """Buffers that are lent to one frame each and reused for later ones.

    There are as many as frames are in flight at once; a buffer that is too small is replaced.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._made: list[moderngl.Buffer] = []
        self._idle: list[moderngl.Buffer] = []

    def copy(self, textures: Mapping[str, moderngl.Texture]) -> Copies:
        """Start to copy textures into a buffer, which is lent until `give_back`.

        It raises `GpuError` if the driver has no room for the buffer, or reports another error.
        """
        ranges, total = {}, 0
        for name, texture in textures.items():
            size = math.prod(texture.size) * texture.components * int(texture.dtype[-1])
            ranges[name] = total, size
            total += math.ceil(size / _ALIGNMENT) * _ALIGNMENT
        buffer = self._buffer(max(total, _ALIGNMENT))
        copies = Copies(buffer, ranges)
        try:
            for name, texture in textures.items():
                texture.read_into(buffer, write_offset=ranges[name][0])
            self._device.check("copying pixels to be read back")
        except Exception:
            self.give_back(copies)
            raise
        return copies

    def _buffer(self, size: int) -> moderngl.Buffer:
        """Return an idle buffer of at least `size` bytes."""
        if self._idle:
            buffer = self._idle.pop()
            if buffer.size >= size:
                return buffer
            self._made.remove(buffer)
            buffer.release()
        no_memory = GpuError(
            f"the driver has no room for {size / 2**20:,.0f} MiB of pixels to be read back: "
            "choose a smaller size, or fewer outputs"
        )
        try:
            buffer = self._device.ctx.buffer(reserve=size)
        except moderngl.Error as error:
            raise no_memory from error
        self._device.raw.allocate_for_reading(buffer.glo, size)
        if self._device.ctx.error != "GL_NO_ERROR":
            buffer.release()
            raise no_memory
        self._made.append(buffer)
        return buffer

    def give_back(self, copies: Copies) -> None:
        """Make the buffer available to later frames."""
        self._idle.append(copies.buffer)

    def release(self) -> None:
        """Free the buffers, lent ones too."""
        for buffer in self._made:
            buffer.release()
        self._made.clear()
        self._idle.clear()
