"""Pixel buffers: the bytes of a frame's targets on their way to the CPU, without anybody waiting for them.

A texture that is read straight into memory makes the CPU wait until the GPU has drawn it, and the GPU wait
for the next frame then. Copied into a buffer of the GPU, it is read when the next frame is on its way.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import moderngl

from firefly_sample.errors import GpuError
from firefly_sample.gpu.device import Device

_ALIGNMENT = 16
"""Bytes: copies start at a multiple of their numbers' size, which is at most that."""


@dataclass(frozen=True, eq=False)
class Copies:
    """Textures that were copied into a buffer: the offset and the size of each in bytes, by name."""

    buffer: moderngl.Buffer
    places: Mapping[str, tuple[int, int]]

    def read(self, name: str) -> bytes:
        """The bytes of one texture, first row at the bottom; waits until the copy is made."""
        offset, size = self.places[name]
        return bytes(self.buffer.read(size, offset=offset))


class PixelBuffers:
    """Buffers that are lent to one frame each, and used again by later ones.

    There are as many as frames are under way at once; one that is too small is replaced.
    """

    def __init__(self, device: Device) -> None:
        self._device = device
        self._made: list[moderngl.Buffer] = []
        self._idle: list[moderngl.Buffer] = []

    def copy(self, textures: Mapping[str, moderngl.Texture]) -> Copies:
        """Start to copy textures into a buffer, which is lent until it is given back.

        Raises
        ------
        GpuError
            If the driver has no room for the buffer, or reports another error.
        """
        places, total = {}, 0
        for name, texture in textures.items():
            size = math.prod(texture.size) * texture.components * int(texture.dtype[-1])
            places[name] = total, size
            total += math.ceil(size / _ALIGNMENT) * _ALIGNMENT
        buffer = self._buffer(max(total, _ALIGNMENT))
        copies = Copies(buffer, places)
        try:
            for name, texture in textures.items():
                texture.read_into(buffer, write_offset=places[name][0])
            self._device.check("copying pixels to be read back")
        except Exception:
            self.give_back(copies)
            raise
        return copies

    def _buffer(self, size: int) -> moderngl.Buffer:
        """An idle buffer of at least `size` bytes."""
        if self._idle:
            buffer = self._idle.pop()
            if buffer.size >= size:
                return buffer
            self._made.remove(buffer)
            buffer.release()
        try:
            buffer = self._device.ctx.buffer(reserve=size)
        except moderngl.Error as error:
            raise self._no_memory(size) from error
        self._device.raw.allocate_for_reading(buffer.glo, size)
        if self._device.ctx.error != "GL_NO_ERROR":
            buffer.release()
            raise self._no_memory(size)
        self._made.append(buffer)
        return buffer

    def _no_memory(self, size: int) -> GpuError:
        return GpuError(
            f"the driver has no room for {size / 2**20:,.0f} MiB of pixels to be read back: "
            "choose a smaller size, or fewer outputs"
        )

    def give_back(self, copies: Copies) -> None:
        """Let a later frame have the buffer."""
        self._idle.append(copies.buffer)

    def release(self) -> None:
        """Free the buffers, lent ones too."""
        for buffer in self._made:
            buffer.release()
        self._made.clear()
        self._idle.clear()
