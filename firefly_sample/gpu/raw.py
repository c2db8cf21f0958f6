"""The few OpenGL functions that moderngl has no call for, taken from the context's own loader."""

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
TIME_ELAPSED = 0x88BF
SAMPLES_PASSED = 0x8914
PIXEL_PACK_BUFFER = 0x88EB
STREAM_READ = 0x88E1
QUERY_RESULT = 0x8866

_KINDS = ("Buffer", "Framebuffer", "Program", "Query", "Sampler", "Shader", "Texture", "VertexArray")


class Pointer(NamedTuple):
    """An attribute in a row: location, how many 32-bit numbers, whole ones or floats, and where, in bytes."""

    location: int
    components: int
    whole: bool
    offset: int


class RawGL:
    """Raw calls of the context whose `backend` (a glcontext context) loads them; it must be current."""

    def __init__(self, backend: Any) -> None:
        self._backend = backend
        self._functions: dict[str, Any] = {}

    def _call(self, name: str, *arguments: Any, returns: Any = None) -> Any:
        """Call an OpenGL function: whole numbers go as 32 bits, None and references as pointers."""
        function = self._functions.get(name)
        if function is None:
            types = [ctypes.c_uint if isinstance(value, int) else ctypes.c_void_p for value in arguments]
            function = self._load(name, returns, *types)
        return function(*arguments)

    def _load(self, name: str, returns: Any, *types: Any) -> Any:
        pointer = self._backend.load_opengl_function(name)
        if not pointer:
            raise ValueError(f"this driver has no {name}")
        function = self._functions[name] = ctypes.CFUNCTYPE(returns, *types)(pointer)
        return function

    def set_clip_range(self, zero_to_one: bool) -> None:
        """Choose the clip-space depth range: [0, 1], or OpenGL's own [-1, 1]. Needs ARB_clip_control."""
        self._call("glClipControl", LOWER_LEFT, ZERO_TO_ONE if zero_to_one else NEGATIVE_ONE_TO_ONE)

    def allocate_depth(self, size: tuple[int, int], internal_format: int) -> None:
        """Give the depth texture that is bound to the active unit another internal format."""
        width, height = size
        self._call(
            "glTexImage2D", TEXTURE_2D, 0, internal_format, width, height, 0, DEPTH_COMPONENT, FLOAT, None
        )

    def upload_levels(self, texture: int, levels: Sequence[NDArray[np.uint16]]) -> None:
        """Give a texture all its levels, arrays of shape (height, width, 4) in C order, as RGBA16.

        Writing a level that is not there yet would need them all to be generated first, for nothing. The
        texture must have a filter between levels, so that the driver makes room for them; it does when the
        first level changes its size.
        """
        self._call("glBindTexture", TEXTURE_2D, texture)
        self._call("glTexImage2D", TEXTURE_2D, 0, RGBA16, 1, 1, 0, RGBA, UNSIGNED_SHORT, None)
        for number, level in enumerate(levels):
            height, width = level.shape[:2]
            texels = ctypes.c_void_p(level.ctypes.data)
            size = (width, height, 0)
            self._call("glTexImage2D", TEXTURE_2D, number, RGBA16, *size, RGBA, UNSIGNED_SHORT, texels)

    def point_attributes(
        self, array: int, buffer: int, pointers: Iterable[Pointer], stride: int, first: int
    ) -> None:
        """Let a vertex array object take attributes from a buffer of rows, from row `first` on."""
        self._call("glBindVertexArray", array)
        self._call("glBindBuffer", ARRAY_BUFFER, buffer)
        for pointer in pointers:
            start = ctypes.c_void_p(first * stride + pointer.offset)
            if pointer.whole:
                numbers = (pointer.location, pointer.components, UNSIGNED_INT, stride)
                self._call("glVertexAttribIPointer", *numbers, start)
            else:
                self._call(
                    "glVertexAttribPointer", pointer.location, pointer.components, FLOAT, 0, stride, start
                )

    def allocate_for_reading(self, buffer: int, size: int) -> None:
        """Give a buffer object `size` bytes anew, where the GPU writes once and the CPU reads."""
        self._call("glBindBuffer", PIXEL_PACK_BUFFER, buffer)
        # a pointer is as wide as the size is
        self._call("glBufferData", PIXEL_PACK_BUFFER, ctypes.c_void_p(size), None, STREAM_READ)
        self._call("glBindBuffer", PIXEL_PACK_BUFFER, 0)

    def copy_texels(self, source: int, texture: int, corner: tuple[int, int], size: tuple[int, int]) -> None:
        """Copy texels of a framebuffer object's image, from `corner` on, into a texture of this size."""
        self._call("glBindFramebuffer", READ_FRAMEBUFFER, source)
        self._call("glBindTexture", TEXTURE_2D, texture)
        self._call("glCopyTexSubImage2D", TEXTURE_2D, 0, 0, 0, *corner, *size)

    def copy_depth(self, source: int, destination: int, size: tuple[int, int]) -> None:
        """Copy a depth buffer between two framebuffer objects of the same size and depth format."""
        width, height = size
        self._call("glBindFramebuffer", READ_FRAMEBUFFER, source)
        self._call("glBindFramebuffer", DRAW_FRAMEBUFFER, destination)
        self._call("glBlitFramebuffer", 0, 0, width, height, 0, 0, width, height, DEPTH_BUFFER_BIT, NEAREST)

    def flush(self) -> None:
        """Let the driver begin with what it was given."""
        self._call("glFlush")

    def use_program(self, program: int) -> None:
        """Make a program current, or none with 0."""
        self._call("glUseProgram", program)

    def create_query(self) -> int:
        """A new query object."""
        name = ctypes.c_uint(0)
        self._call("glGenQueries", 1, ctypes.byref(name))
        return name.value

    def begin_query(self, kind: int, query: int) -> None:
        """Start a `TIME_ELAPSED` or `SAMPLES_PASSED` query."""
        self._call("glBeginQuery", kind, query)

    def end_query(self, kind: int) -> None:
        """End the running query of that kind."""
        self._call("glEndQuery", kind)

    def query_result(self, query: int) -> int:
        """The result of an ended query; waits for it."""
        result = ctypes.c_uint64(0)
        self._call("glGetQueryObjectui64v", query, QUERY_RESULT, ctypes.byref(result))
        return result.value

    def delete_query(self, query: int) -> None:
        """Free a query object."""
        self._call("glDeleteQueries", 1, ctypes.byref(ctypes.c_uint(query)))

    def count_objects(self, highest: int = 4096) -> dict[str, int]:
        """How many GL objects live among the names 1..`highest`, by kind; kinds without any are left out."""
        counts = {}
        for kind in _KINDS:
            name = f"glIs{kind}"
            exists = self._functions.get(name) or self._load(name, ctypes.c_bool, ctypes.c_uint)
            live = sum(map(exists, range(1, highest + 1)))
            if live:
                counts[kind] = live
        return counts
