"""Animations of a model as functions of time: the values of all their channels, in float64.

The formulas are those of the glTF 2.0 specification, appendix C "Animation sampler interpolation modes".
A channel keeps its first value before its first key, and its last value after its last key.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.model.data import AnimationData, ChannelData
from firefly_sample.scene.arrays import Float64

Target = tuple[int, str]
"""The index of a node, and the path of one of its properties: see `ChannelData`."""


class Clip:
    """An animation that is ready to be evaluated; it never changes, so copies of models share it.

    Attributes
    ----------
    name : str
    duration : float
        Seconds until the animation starts again: the largest last key of its channels. 0 if it stands still.
    targets : tuple of (int, str)
        The node and the path of each channel that has keys, in the order of `evaluate`.
    """

    def __init__(self, data: AnimationData, name: str | None = None) -> None:
        self.name = data.name if name is None else name
        channels = [channel for channel in data.channels if len(channel.times)]
        tracks: dict[bytes, int] = {}  # channels that share their keys are searched once
        self._times: list[list[float]] = []
        for channel in channels:
            times = np.asarray(channel.times, dtype=np.float64)
            if tracks.setdefault(times.tobytes(), len(tracks)) == len(self._times):
                self._times.append(times.tolist())
        self.duration: float = max((times[-1] for times in self._times), default=0.0)
        kinds: dict[tuple[Any, ...], list[ChannelData]] = {}
        for channel in channels:
            values = np.asarray(channel.values)
            kinds.setdefault((channel.interpolation, channel.path, values.shape[-1]), []).append(channel)
        self._batches = [_Batch(alike, tracks) for alike in kinds.values()]
        self.targets: tuple[Target, ...] = tuple(
            (channel.node, channel.path) for alike in kinds.values() for channel in alike
        )

    def __copy__(self) -> Clip:
        return self

    def __deepcopy__(self, _: dict[int, Any]) -> Clip:
        return self

    def evaluate(self, time: float) -> list[list[float]]:
        """Return the value of each target at `time` seconds, which may be negative; the animation loops.

        Rotations are unit quaternions (w, x, y, z). No value is -0.0, so equal values have equal bytes.
        """
        now = wrapped(time, self.duration)
        spans = [_span(times, now) for times in self._times]
        before = np.array([span[0] for span in spans], dtype=np.int64)
        after = np.array([span[1] for span in spans], dtype=np.int64)
        length = np.array([span[2] for span in spans])
        share = np.array([span[3] for span in spans])
        values: list[list[float]] = []
        with np.errstate(
            over="ignore", invalid="ignore"
        ):  # the node or geom that is not finite is named later
            for batch in self._batches:
                track = batch.track
                rows = batch.evaluate(before[track], after[track], length[track], share[track])
                values.extend((rows + 0.0).tolist())
        return values


def wrapped(time: float, duration: float) -> float:
    """Return the time since the last start of an animation that loops, at least 0 and below `duration`."""
    if duration <= 0.0:
        return 0.0
    rest = time % duration
    return rest if rest < duration else 0.0  # of tiny negative times, the remainder is rounded to `duration`


def _span(times: list[float], time: float) -> tuple[int, int, float, float]:
    """Return the keys before and after a time, the seconds between them, and the share of those passed."""
    last = len(times) - 1
    before = max(bisect_right(times, time) - 1, 0)
    after = min(before + 1, last)
    length = times[after] - times[before]
    if length <= 0.0 or time <= times[before]:
        return before, after, length, 0.0
    return before, after, length, (time - times[before]) / length


class _Batch:
    """Channels of one kind, whose values stand in one array."""

    def __init__(self, channels: Sequence[ChannelData], tracks: dict[bytes, int]) -> None:
        self.interpolation = channels[0].interpolation
        self.is_rotation = channels[0].path == "rotation"
        self.track = np.array(
            [tracks[np.asarray(channel.times, dtype=np.float64).tobytes()] for channel in channels]
        )
        counts = [len(channel.times) for channel in channels]
        self.start: NDArray[np.int64] = np.cumsum([0, *counts[:-1]])
        values = np.concatenate([np.asarray(channel.values, dtype=np.float64) for channel in channels])
        if self.is_rotation and self.interpolation != "CUBICSPLINE":
            values = unit_quats(values)
        self.values: Float64 = values

    def evaluate(
        self, before: NDArray[np.int64], after: NDArray[np.int64], length: Float64, share: Float64
    ) -> Float64:
        """Return the value of each channel, shape (channels, width)."""
        start, end = self.values[self.start + before], self.values[self.start + after]
        if self.interpolation == "STEP":
            return np.asarray(start)
        if self.interpolation == "CUBICSPLINE":
            result = cubic(start[:, 1], start[:, 2], end[:, 0], end[:, 1], length[:, None], share[:, None])
            return unit_quats(result) if self.is_rotation else result
        if self.is_rotation:
            return slerp(start, end, share[:, None])
        return np.asarray((1.0 - share[:, None]) * start + share[:, None] * end)


def cubic(
    start: Float64, out_tangent: Float64, in_tangent: Float64, end: Float64, length: Float64, share: Float64
) -> Float64:
    """Return points of cubic Hermite splines, whose tangents are per second, at a share of their `length`."""
    t, t2, t3 = share, share * share, share * share * share
    return np.asarray(
        (2.0 * t3 - 3.0 * t2 + 1.0) * start
        + length * (t3 - 2.0 * t2 + t) * out_tangent
        + (3.0 * t2 - 2.0 * t3) * end
        + length * (t3 - t2) * in_tangent
    )


def slerp(start: Float64, end: Float64, share: Float64) -> Float64:
    """Return unit quaternions (n, 4) at a share (n, 1) of the shorter arc between unit quaternions."""
    end = np.where((start * end).sum(axis=1, keepdims=True) < 0.0, -end, end)  # the same rotation, nearer
    # an arc cosine would lose half of the digits of a small angle
    angle = 2.0 * np.arctan2(_length(end - start), _length(end + start))
    sine = np.sin(angle)
    straight = sine < 1e-9  # then the arc differs from its chord by less than a rounding
    divisor = np.where(straight, 1.0, sine)
    first = np.where(straight, 1.0 - share, np.sin((1.0 - share) * angle) / divisor)
    second = np.where(straight, share, np.sin(share * angle) / divisor)
    return unit_quats(first * start + second * end)


def unit_quats(quats: Float64) -> Float64:
    """Return quaternions (n, 4) of length 1; the identity for zeros."""
    largest = np.abs(quats).max(
        axis=1, initial=0.0, keepdims=True
    )  # so that squares neither over- nor underflow
    scaled = quats / np.where(largest > 0.0, largest, 1.0)
    length = _length(scaled)
    return np.where(length > 0.0, scaled / np.where(length > 0.0, length, 1.0), [1.0, 0.0, 0.0, 0.0])


def _length(rows: Float64) -> Float64:
    return np.asarray(np.sqrt((rows * rows).sum(axis=1, keepdims=True)))
