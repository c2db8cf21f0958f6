"""GPU time of each pass and fragments shaded, by queries by raw calls (moderngl never frees its own)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from firefly_sample.gpu.raw import SAMPLES_PASSED, TIME_ELAPSED, RawGL

__all__ = ["Timers"]


class Timers:
    """One query a pass; results are read after the frame, when they no longer make the GPU wait."""

    def __init__(self, raw: RawGL) -> None:
        self._raw = raw
        self._queries: dict[tuple[str, int], int] = {}
        self._timed: list[str] = []
        self._counted: list[str] = []

    def _query(self, name: str, kind: int) -> int:
        if (name, kind) not in self._queries:
            self._queries[name, kind] = self._raw.create_query()
        return self._queries[name, kind]

    @contextmanager
    def measure(self, name: str, count: bool = False) -> Iterator[None]:
        """Time what is drawn inside; with `count`, also count the fragments that pass the depth test."""
        kinds = (TIME_ELAPSED, SAMPLES_PASSED) if count else (TIME_ELAPSED,)
        for kind in kinds:
            self._raw.begin_query(kind, self._query(name, kind))
        try:
            yield
        finally:
            for kind in kinds:
                self._raw.end_query(kind)
        self._timed.append(name)
        if count:
            self._counted.append(name)

    def collect(self) -> tuple[dict[str, float], int | None]:
        """Milliseconds of each pass since the last call, and the fragments counted (None if none was)."""
        times = {
            name: self._raw.query_result(self._queries[name, TIME_ELAPSED]) / 1e6 for name in self._timed
        }
        counts = [self._raw.query_result(self._queries[name, SAMPLES_PASSED]) for name in self._counted]
        self._timed.clear()
        self._counted.clear()
        return times, sum(counts) if counts else None

    def release(self) -> None:
        """Free the queries."""
        for query in self._queries.values():
            self._raw.delete_query(query)
        self._queries.clear()
