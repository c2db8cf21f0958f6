"""Measure the time of each pass and the number of fragments shaded.

On a GPU this takes timer queries, whose results are read after the frame, or the next one, is drawn, so that
nothing waits for them. On a software driver it takes the CPU's clock and `finish`: llvmpipe's timer queries
omit vertices and, in a frame of one pass, nearly everything. Queries are made by raw calls because moderngl
never frees its own.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from firefly_sample.gpu.device import Device
from firefly_sample.gpu.raw import SAMPLES_PASSED, TIME_ELAPSED


@dataclass(eq=False)
class Measured:
    """The measurements of one frame.

    `clocked` are milliseconds by pass if the CPU's clock measures them, `timed` the queries by pass
    otherwise, `counted` the queries of the number of fragments shaded.
    """

    clocked: dict[str, float] = field(default_factory=dict)
    timed: dict[str, int] = field(default_factory=dict)
    counted: list[int] = field(default_factory=list)


class Timers:
    """Measures passes. A frame keeps its queries until they are collected or given back."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._queries: list[int] = []
        self._idle: dict[int, list[int]] = {TIME_ELAPSED: [], SAMPLES_PASSED: []}
        self._frame = Measured()

    def _query(self, kind: int) -> int:
        if not self._idle[kind]:
            self._queries.append(self._device.raw.create_query())
            return self._queries[-1]
        return self._idle[kind].pop()

    @contextmanager
    def measure(self, name: str, count: bool = False) -> Iterator[None]:
        """Time what is drawn inside; with `count`, also count the fragments that pass the depth test."""
        raw, clocked = self._device.raw, self._device.software
        queries = {}
        if count:
            queries[SAMPLES_PASSED] = self._query(SAMPLES_PASSED)
            self._frame.counted.append(queries[SAMPLES_PASSED])
        if clocked:
            self._device.ctx.finish()
        else:
            queries[TIME_ELAPSED] = self._frame.timed[name] = self._query(TIME_ELAPSED)
        start = time.perf_counter()
        for kind, query in queries.items():
            raw.call("glBeginQuery", kind, query)
        try:
            yield
        finally:
            for kind in queries:
                raw.call("glEndQuery", kind)
        if clocked:
            self._device.ctx.finish()
            self._frame.clocked[name] = (time.perf_counter() - start) * 1e3

    def end(self) -> Measured:
        """Return the measurements since the last call, without waiting for them."""
        measured, self._frame = self._frame, Measured()
        return measured

    def collect(self, measured: Measured) -> tuple[dict[str, float], int | None]:
        """Wait for a frame's measurements; return milliseconds by pass and fragments, None if not counted."""
        result = self._device.raw.query_result
        times = measured.clocked | {name: result(query) / 1e6 for name, query in measured.timed.items()}
        counts = [result(query) for query in measured.counted]
        self.give_back(measured)
        return times, sum(counts) if counts else None

    def give_back(self, measured: Measured) -> None:
        """Make a frame's queries available to later frames, without collecting them."""
        self._idle[TIME_ELAPSED] += measured.timed.values()
        self._idle[SAMPLES_PASSED] += measured.counted
        measured.timed.clear()
        measured.counted.clear()

    def release(self) -> None:
        """Free the queries."""
        for query in self._queries:
            self._device.raw.delete_query(query)
        self._queries.clear()
