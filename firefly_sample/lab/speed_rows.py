"""What draws of a frame come to: a row of medians, and how rows grow with their lights."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from firefly_sample.lab.trade_bench import quartile_spread

Row = dict[str, Any]


@dataclass(frozen=True)
class Draw:
    """One frame, drawn once.

    Attributes
    ----------
    passes : mapping of str to float
        Milliseconds of each pass.
    plan_ms : float
        Milliseconds that planning it took.
    host_ms : float
        Those of planning and drawing, less the passes': what Python took.
    """

    passes: Mapping[str, float]
    plan_ms: float
    host_ms: float

    @property
    def ms(self) -> float:
        """Milliseconds of all passes."""
        return sum(self.passes.values())


@dataclass
class Draws:
    """All draws of a frame by one method, with each seed, and what was counted of them.

    Attributes
    ----------
    by_seed : list of list of Draw
        In the order of rounds: so they are compared with another method's.
    shaded : int
        Summed over the seeds.
    draw_calls : int
    bytes_per_pixel : float
        Of the last seed's frame, as `draw_calls`.
    """

    by_seed: list[list[Draw]] = field(default_factory=list)
    shaded: int = 0
    draw_calls: int = 0
    bytes_per_pixel: float = 0.0

    @property
    def all(self) -> list[Draw]:
        """Those of every seed, one after the other."""
        return [draw for draws in self.by_seed for draw in draws]


def make_row(
    method: str, size: tuple[int, int], lights: int, own: Draws, chosen: Draws | None, pairs: int
) -> Row:
    """A row of `firefly_sample.lab.speed.measure_speed`, without "slope" and "growth".

    Parameters
    ----------
    own, chosen : Draws
        Of the method, and of the one that ratios refer to; there are no ratios where that was not drawn.
    """
    draws = own.all
    # a GPU's clock may tell 0 for a frame with next to nothing in it
    ratios = [a.ms / b.ms for a, b in zip(draws, chosen.all, strict=True) if b.ms] if chosen else []
    names = dict.fromkeys(name for draw in draws for name in draw.passes)
    passes = {name: [draw.passes[name] for draw in draws if name in draw.passes] for name in names}
    return {
        "size": list(size),
        "lights": lights,
        "method": method,
        "ms": statistics.median(draw.ms for draw in draws),
        "spread": statistics.median(quartile_spread([draw.ms for draw in seed]) for seed in own.by_seed),
        "ratio": statistics.median(ratios) if ratios else None,
        "passes": {name: statistics.median(values) for name, values in passes.items()},
        "host_ms": statistics.median(draw.host_ms for draw in draws),
        "plan_ms": statistics.median(draw.plan_ms for draw in draws),
        "draw_calls": own.draw_calls,
        "bytes_per_pixel": own.bytes_per_pixel,
        "shaded": own.shaded,
        "pairs": pairs,
        "shaded_per_pair": own.shaded / pairs if pairs else None,
    }


def with_slopes(rows: Sequence[Row]) -> list[Row]:
    """The rows, each with what it costs more than the one before it of the same size and method.

    "slope" is in microseconds a light: None where no row with fewer lights comes before. "growth" is the
    slope over the slope before, 1 where time is a straight line over lights: None where one of the two is
    missing, or the slope before is not above 0.
    """
    found, before = [], dict[tuple[Any, ...], Row]()
    for row in rows:
        key = (*row["size"], row["method"])
        last, slope, growth = before.get(key), None, None
        if last is not None and row["lights"] > last["lights"]:
            slope = 1e3 * (row["ms"] - last["ms"]) / (row["lights"] - last["lights"])
            if last["slope"] is not None and last["slope"] > 0.0:
                growth = slope / last["slope"]
        before[key] = {**row, "slope": slope, "growth": growth}
        found.append(before[key])
    return found
