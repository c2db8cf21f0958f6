"""Pairs of boxes that overlap on the screen, by horizontal strips and a sweep within each, vectorised.

A box is entered into every strip that it reaches. Within a strip, entries are sorted by their left sides, so
that the boxes that begin within another one's width follow each other. A pair is reported in the first strip
that both reach. Strips are as high as boxes are on average, which makes about two entries a box.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.arrays import Float64

Indices = NDArray[np.intp]
Pairs = tuple[Indices, Indices]

CHUNK = 1 << 17
"""Pairs that are looked at together, about, which bounds the memory."""


class Boxes(NamedTuple):
    """Boxes on the screen: lower left and upper right corners, shape (n, 2)."""

    low: Float64
    high: Float64


class Sweep:
    """The pairs that overlap among one set of boxes, or between two; `count` bounds their number."""

    def __init__(self, first: Boxes, second: Boxes | None = None) -> None:
        both = [first] if second is None else [first, second]
        low = min((float(boxes.low[:, 1].min(initial=np.inf)) for boxes in both), default=0.0)
        high = max((float(boxes.high[:, 1].max(initial=-np.inf)) for boxes in both), default=0.0)
        sets: list[_Strips] = []
        self._searches: list[tuple[_Strips, _Strips, Indices, Indices, bool]] = []
        self.count = 0
        if any(not len(boxes.low) for boxes in both):
            return
        heights = np.concatenate([boxes.high[:, 1] - boxes.low[:, 1] for boxes in both])
        strips = int(np.clip((high - low) / max(heights.mean(), 1e-12), 1, len(heights)))
        sets = [_Strips(boxes, low, strips / max(high - low, 1e-300), strips) for boxes in both]
        if second is None:
            self._search(sets[0], sets[0], np.arange(1, len(first.low) + 1), swapped=False)
        else:
            # of two boxes, the one that begins farther to the right begins within the other
            for a, b, side in ((sets[0], sets[1], "left"), (sets[1], sets[0], "right")):
                begins = np.searchsorted(b.left, a.left, side=side)  # type: ignore[call-overload]
                self._search(a, b, begins, swapped=side == "right")

    def _search(self, a: _Strips, b: _Strips, begins: Indices, swapped: bool) -> None:
        """Find the entries of `b` that begin within each entry of `a`, from each box's first in `begins`."""
        row = a.strip * len(b.left)
        ends = np.searchsorted(b.left, a.right)
        start = np.searchsorted(b.keys, row + begins[a.thing])
        counts = np.maximum(np.searchsorted(b.keys, row + ends[a.thing]) - start, 0)
        self.count += int(counts.sum())
        self._searches.append((a, b, start, counts, swapped))

    def __iter__(self) -> Iterator[Pairs]:
        """Yield pairs in chunks, as rows of the first and the second set."""
        for a, b, start, counts, swapped in self._searches:
            total = np.cumsum(counts)
            cuts = np.searchsorted(total, np.arange(CHUNK, int(total[-1]) + CHUNK, CHUNK), side="left") + 1
            begin = 0
            for end in np.minimum(cuts, len(counts)).tolist():
                if end > begin:
                    i, j = _pairs(a, b, start, counts, slice(begin, end))
                    yield (j, i) if swapped else (i, j)
                begin = max(begin, end)


class _Strips:
    """A set of boxes, sorted by their left sides, with their entries strip by strip."""

    def __init__(self, boxes: Boxes, low: float, per_unit: float, strips: int) -> None:
        self.order = np.argsort(boxes.low[:, 0], kind="stable")
        low_sorted, high_sorted = boxes.low[self.order], boxes.high[self.order]
        self.left, self.right = low_sorted[:, 0].copy(), high_sorted[:, 0].copy()
        self.bottom, self.top = low_sorted[:, 1].copy(), high_sorted[:, 1].copy()
        last = strips - 1
        self.lowest = np.clip((self.bottom - low) * per_unit, 0, last).astype(np.intp)
        highest = np.clip((self.top - low) * per_unit, 0, last).astype(np.intp)
        reached = np.maximum(highest - self.lowest + 1, 1)
        thing = np.repeat(np.arange(len(self.left)), reached)
        strip = self.lowest[thing] + ramps(reached)
        by_strip = np.argsort(strip, kind="stable")
        self.thing, self.strip = thing[by_strip], strip[by_strip]
        self.keys = self.strip * len(self.left) + self.thing


def ramps(counts: Indices) -> Indices:
    """Return 0, 1, ... up to each count, one after the other."""
    ends = np.cumsum(counts)
    return np.arange(int(ends[-1]) if len(ends) else 0) - np.repeat(ends - counts, counts)


def _pairs(a: _Strips, b: _Strips, start: Indices, counts: Indices, part: slice) -> Pairs:
    counts = counts[part]
    i = np.repeat(a.thing[part], counts)
    j = b.thing[np.repeat(start[part], counts) + ramps(counts)]
    strip = np.repeat(a.strip[part], counts)
    meet = (a.bottom[i] < b.top[j]) & (b.bottom[j] < a.top[i])
    meet &= np.maximum(a.lowest[i], b.lowest[j]) == strip
    return a.order[i[meet]], b.order[j[meet]]
