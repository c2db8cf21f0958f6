"""Time of each pass and fragments shaded.

A GPU is asked with timer queries, whose results are read after the frame, when nobody waits for them. On
a software driver the CPU's own clock around a `finish` tells the time: llvmpipe's timer queries leave out
vertices and, in a frame of one pass, nearly everything. Queries are made by raw calls because moderngl
never frees its own.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from firefly_sample.gpu.device import Device
from firefly_sample.gpu.raw import SAMPLES_PASSED, TIME_ELAPSED

__all__ = ["Timers"]


class Timers:
    """Measures passes of one frame at a time."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._queries: dict[tuple[str, int], int] = {}
        self._clocked: dict[str, float] = {}
        self._timed: list[str] = []
        self._counted: list[str] = []

    def _query(self, name: str, kind: int) -> int:
        if (name, kind) not in self._queries:
            self._queries[name, kind] = self._device.raw.create_query()
        return self._queries[name, kind]

    @contextmanager
    def measure(self, name: str, count: bool = False) -> Iterator[None]:
        """Time what is drawn inside; with `count`, also count the fragments that pass the depth test."""
        raw, clocked = self._device.raw, self._device.software
        kinds = (() if clocked else (TIME_ELAPSED,)) + ((SAMPLES_PASSED,) if count else ())
        if clocked:
            self._device.ctx.finish()
        start = time.perf_counter()
        for kind in kinds:
            raw.begin_query(kind, self._query(name, kind))
        try:
            yield
        finally:
            for kind in kinds:
                raw.end_query(kind)
        if clocked:
            self._device.ctx.finish()
            self._clocked[name] = (time.perf_counter() - start) * 1e3
        self._timed.append(name)
        if count:
            self._counted.append(name)

    def collect(self) -> tuple[dict[str, float], int | None]:
        """Milliseconds of each pass since the last call, and the fragments counted (None if none was)."""
        times = {name: self._milliseconds(name) for name in self._timed}
        counts = [self._device.raw.query_result(self._query(name, SAMPLES_PASSED)) for name in self._counted]
        self._timed.clear()
        self._counted.clear()
        self._clocked.clear()
        return times, sum(counts) if counts else None

    def _milliseconds(self, name: str) -> float:
        if name in self._clocked:
            return self._clocked[name]
        return self._device.raw.query_result(self._query(name, TIME_ELAPSED)) / 1e6

    def release(self) -> None:
        """Free the queries."""
        for query in self._queries.values():
            self._device.raw.delete_query(query)
        self._queries.clear()
