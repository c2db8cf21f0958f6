"""The few OpenGL functions that moderngl does not offer, from the context's own loader."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

LOWER_LEFT = 0x8CA1
NEGATIVE_ONE_TO_ONE = 0x935E
ZERO_TO_ONE = 0x935F
DEPTH_CLAMP = 0x864F
FRAMEBUFFER_SRGB = 0x8DB9
TEXTURE_2D = 0x0DE1
DEPTH_COMPONENT = 0x1902
FLOAT = 0x1406
UNSIGNED_INT = 0x1405
UNSIGNED_SHORT = 0x1403
RGBA = 0x1908
RGBA16 = 0x805B
ARRAY_BUFFER = 0x8892
READ_FRAMEBUFFER = 0x8CA8
DRAW_FRAMEBUFFER = 0x8CA9
DEPTH_BUFFER_BIT = 0x0100
NEAREST = 0x2600
TEXTURE_WRAP_S, TEXTURE_WRAP_T = 0x2802, 0x2803
REPEAT, CLAMP_TO_EDGE, MIRRORED_REPEAT = 0x2901, 0x812F, 0x8370
TIME_ELAPSED = 0x88BF
SAMPLES_PASSED = 0x8914
PIXEL_PACK_BUFFER = 0x88EB
STREAM_READ = 0x88E1
QUERY_RESULT = 0x8866

_KINDS = ("Buffer", "Framebuffer", "Program", "Query", "Sampler", "Shader", "Texture", "VertexArray")


class Pointer(NamedTuple):
    """An attribute in a row: location, number of 32-bit components, integers or floats, offset in bytes."""

    location: int
    components: int
    whole: bool
    offset: int


class RawGL:
    """Calls of OpenGL functions that `backend` (a glcontext context) loads; it must be current."""

    def __init__(self, backend: Any) -> None:
        self._backend = backend
        self._functions: dict[str, Any] = {}

    def call(self, name: str, *arguments: Any) -> None:
        """Call an OpenGL function; ints are passed as 32 bits, None and references as pointers."""
        function = self._functions.get(name)
        if function is None:
            types = [ctypes.c_uint if isinstance(value, int) else ctypes.c_void_p for value in arguments]
            function = self._load(name, None, *types)
        function(*arguments)

    def _load(self, name: str, returns: Any, *types: Any) -> Any:
        pointer = self._backend.load_opengl_function(name)
        if not pointer:
            raise ValueError(f"this driver has no {name}")
        function = self._functions[name] = ctypes.CFUNCTYPE(returns, *types)(pointer)
        return function

    def set_clip_range(self, zero_to_one: bool) -> None:
        """Set the clip-space depth range to [0, 1] or OpenGL's own [-1, 1]; this needs ARB_clip_control."""
        self.call("glClipControl", LOWER_LEFT, ZERO_TO_ONE if zero_to_one else NEGATIVE_ONE_TO_ONE)

    def allocate_depth(self, size: tuple[int, int], internal_format: int) -> None:
        """Change the internal format of the depth texture that is bound to the active unit."""
        self.call("glTexImage2D", TEXTURE_2D, 0, internal_format, *size, 0, DEPTH_COMPONENT, FLOAT, None)

    def upload_levels(self, texture: int, levels: Sequence[NDArray[np.uint16]]) -> None:
        """Upload mipmap levels of a texture, arrays of shape (height, width, 4) in C order, as RGBA16.

        moderngl writes a level only after it has generated all of them, which would be wasted work. If there
        are several, the texture must have a filter between levels, so that the driver makes room for them; it
        does so when the first level changes its size.
        """
        self.call("glBindTexture", TEXTURE_2D, texture)
        self.call("glTexImage2D", TEXTURE_2D, 0, RGBA16, 1, 1, 0, RGBA, UNSIGNED_SHORT, None)
        for level, pixels in enumerate(levels):
            texels, size = ctypes.c_void_p(pixels.ctypes.data), pixels.shape[1::-1]
            self.call("glTexImage2D", TEXTURE_2D, level, RGBA16, *size, 0, RGBA, UNSIGNED_SHORT, texels)

    def set_wrap(self, texture: int, across: int, up: int) -> None:
        """Set how a texture goes on beyond its edges; moderngl cannot mirror."""
        self.call("glBindTexture", TEXTURE_2D, texture)
        self.call("glTexParameteri", TEXTURE_2D, TEXTURE_WRAP_S, across)
        self.call("glTexParameteri", TEXTURE_2D, TEXTURE_WRAP_T, up)

    def point_attributes(
        self, array: int, buffer: int, pointers: Iterable[Pointer], stride: int, first: int
    ) -> None:
        """Point a vertex array object's attributes to a buffer of rows, beginning with row `first`."""
        self.call("glBindVertexArray", array)
        self.call("glBindBuffer", ARRAY_BUFFER, buffer)
        for pointer in pointers:
            start = ctypes.c_void_p(first * stride + pointer.offset)
            which = pointer.location, pointer.components
            if pointer.whole:
                self.call("glVertexAttribIPointer", *which, UNSIGNED_INT, stride, start)
            else:
                self.call("glVertexAttribPointer", *which, FLOAT, 0, stride, start)

    def allocate_for_reading(self, buffer: int, size: int) -> None:
        """Reallocate a buffer object with `size` bytes that the GPU writes once and the CPU reads."""
        self.call("glBindBuffer", PIXEL_PACK_BUFFER, buffer)
        # glBufferData takes the size with the width of a pointer
        self.call("glBufferData", PIXEL_PACK_BUFFER, ctypes.c_void_p(size), None, STREAM_READ)
        self.call("glBindBuffer", PIXEL_PACK_BUFFER, 0)

    def copy_texels(self, source: int, texture: int, corner: tuple[int, int], size: tuple[int, int]) -> None:
        """Copy texels of a framebuffer object's image, starting at `corner`, into a texture of this size."""
        self.call("glBindFramebuffer", READ_FRAMEBUFFER, source)
        self.call("glBindTexture", TEXTURE_2D, texture)
        self.call("glCopyTexSubImage2D", TEXTURE_2D, 0, 0, 0, *corner, *size)

    def copy_depth(self, source: int, destination: int, size: tuple[int, int]) -> None:
        """Copy a depth buffer between two framebuffer objects of the same size and depth format."""
        self.call("glBindFramebuffer", READ_FRAMEBUFFER, source)
        self.call("glBindFramebuffer", DRAW_FRAMEBUFFER, destination)
        self.call("glBlitFramebuffer", 0, 0, *size, 0, 0, *size, DEPTH_BUFFER_BIT, NEAREST)

    def create_query(self) -> int:
        """Return a new query object."""
        name = ctypes.c_uint(0)
        self.call("glGenQueries", 1, ctypes.byref(name))
        return name.value

    def query_result(self, query: int) -> int:
        """Wait for the result of an ended query, and return it."""
        result = ctypes.c_uint64(0)
        self.call("glGetQueryObjectui64v", query, QUERY_RESULT, ctypes.byref(result))
        return result.value

    def delete_query(self, query: int) -> None:
        """Free a query object."""
        self.call("glDeleteQueries", 1, ctypes.byref(ctypes.c_uint(query)))

    def count_objects(self, highest: int = 4096) -> dict[str, int]:
        """Return the number of GL objects with the names 1..`highest` by kind, without empty kinds."""
        counts = {}
        for kind in _KINDS:
            name = f"glIs{kind}"
            exists = self._functions.get(name) or self._load(name, ctypes.c_bool, ctypes.c_uint)
            live = sum(map(exists, range(1, highest + 1)))
            if live:
                counts[kind] = live
        return counts
