"""A vertex buffer whose content changes from frame to frame."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray


class GrowingBuffer:
    """A buffer that grows and never shrinks, so that most frames make no new one."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._buffer: moderngl.Buffer | None = None

    def write(self, rows: NDArray[Any]) -> moderngl.Buffer:
        """Write rows, and return the buffer: a new one, twice as large as needed, if it had to grow."""
        data = np.ascontiguousarray(rows)
        if self._buffer is None or self._buffer.size < data.nbytes:
            self.release()
            self._buffer = self._ctx.buffer(reserve=2 * max(data.nbytes, 64), dynamic=True)
        if data.nbytes:
            self._buffer.write(data)
        return self._buffer

    def release(self) -> None:
        """Free the buffer."""
        if self._buffer is not None:
            self._buffer.release()
            self._buffer = None
