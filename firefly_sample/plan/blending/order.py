"""The order in which blended things are drawn: back to front, exact wherever there is such an order.

Sorting by distance is not enough: a large tilted pane may be farther at its far end than a small one behind
its near end. So each pair that overlaps on the screen is compared where it does, and the order follows from
all pairs.

1. The start order is by the farthest point, the farthest first, and the given order among equals.
2. Pairs of polygons, and of a polygon and a disc, make edges: the one that is farther where they overlap is
   drawn first. Things in one plane are drawn in the given order. Discs are ordered by their distances alone.
3. If the start order obeys all edges and has few runs of one group, it is the result.
4. Otherwise things follow whose predecessors are all drawn: those of the group drawn last while there are
   any, so that draws are few, then those of the group whose first thing is earliest in the start order.
5. Where edges lead in a circle no order is right. Then edges of discs that polygons cut are dropped, and
   within each circle those of polygons that intersect or lie in one plane. If that does not open it, what
   is earliest in the start order comes first, and so on in the circles that are left; after `OPENINGS`
   such steps, or with more than `MANY_EDGES` edges, all that contradict the start order inside of circles are
   dropped.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.blending.candidates import Indices, Pairs, Sweep, ramps
from firefly_sample.plan.blending.graph import circles, taken
from firefly_sample.plan.blending.overlaps import (
    TOUCH,
    Order,
    Shapes,
    disc_boxes,
    disc_orders,
    polygon_orders,
)
from firefly_sample.plan.blending.polygons import Discs, Polygons

MOST_PAIRS = 4_000_000
"""Pairs that may overlap; with more, things are sorted by their farthest points instead."""
MOST_DISC_PAIRS = 1 << 18
"""Pairs of discs that may overlap; with more, discs that are near each other on the screen are ordered too,
whether they overlap or not, which takes fewer edges."""
OPENINGS = 16
"""Steps by which circles are opened one thing at a time."""
MANY_EDGES = 20_000
"""Edges inside of circles that are too many to open them so."""
LARGEST_TABLE = 1 << 26
"""Numbers of polygons times discs with which edges that follow from others are found and left out."""
FEW_RUNS = 64
"""Draws that are no reason to look for an order with fewer."""


@dataclass(frozen=True, eq=False)
class PaintOrder:
    """An order of n polygons and m discs, the first to be drawn first."""

    order: Indices  # (n + m,) rows of polygons, and n plus rows of discs
    runs: Indices  # (r + 1,) where each run of one group begins in `order`, and the end
    intersecting: int  # pairs of polygons that intersect
    cut_discs: int  # pairs of a polygon and a disc that intersect
    in_circles: int  # polygons that overlap in a circle: each would have to be drawn before the next
    discs_in_circles: int
    approximate: bool
    """True if there were too many pairs: the order is that of the farthest points, and nothing is counted."""


def paint_order(polygons: Polygons, discs: Discs) -> PaintOrder:
    """Return the order in which polygons and discs are drawn, back to front."""
    n = len(polygons)
    start = np.argsort(-np.concatenate((polygons.farthest, discs.distances)), kind="stable")
    groups = np.concatenate((polygons.groups, discs.groups))
    found = _polygon_edges(polygons, discs)
    if found is None:
        return _result(start, groups, None)
    rank = np.empty(len(start), dtype=np.intp)
    rank[start] = np.arange(len(start))
    edges = found.renamed(rank)
    few = _run_starts(groups[start]).size <= FEW_RUNS
    if (edges.before < edges.after).all() and few:
        return _result(start, groups, found)
    before, after = _disc_edges(discs)
    links = rank[n + before], rank[n + after]
    is_polygon = start < n
    in_circles = np.empty(0, dtype=np.intp)
    order = taken(len(start), *_thinned(edges, links, is_polygon), groups[start])
    if len(order) < len(start):
        # most circles are those of discs that a polygon cuts, whose order is of little weight
        edges = edges.without(edges.weak & ~(is_polygon[edges.before] & is_polygon[edges.after]))
        order = taken(len(start), *_thinned(edges, links, is_polygon), groups[start])
    if len(order) < len(start):
        order, in_circles = _opened(edges.joined(*links), groups[start])
    polygons_in_circles = int((start[in_circles] < n).sum())
    counts = polygons_in_circles, len(in_circles) - polygons_in_circles
    return _result(start[order], groups, found, *counts)


def order_warnings(order: PaintOrder) -> Iterator[str]:
    """Yield a line if blended surfaces are drawn in an order that cannot be right everywhere."""
    discs = f" with {order.discs_in_circles:,} particles and sprites" if order.discs_in_circles else ""
    faults = [
        text
        for count, text in (
            (order.intersecting, f"pairs that intersect: {order.intersecting:,}"),
            (order.in_circles, f"that overlap in circles: {order.in_circles:,}{discs}"),
            (order.approximate, f"more than {MOST_PAIRS:,} pairs may overlap, so that distances decide"),
        )
        if count
    ]
    if faults:
        yield (
            f"some blended triangles have no right order ({'; '.join(faults)}): transparency=exact needs none"
        )


class _Edges(NamedTuple):
    """Pairs of things of which one is drawn before the other."""

    before: Indices
    after: Indices
    weak: NDArray[np.bool_]  # the pair intersects, or lies in one plane
    intersecting: int
    cut_discs: int

    def renamed(self, names: Indices) -> _Edges:
        return self._replace(before=names[self.before], after=names[self.after])

    def without(self, some: NDArray[np.bool_]) -> _Edges:
        return self._replace(before=self.before[~some], after=self.after[~some], weak=self.weak[~some])

    def joined(self, before: Indices, after: Indices) -> _Edges:
        return self._replace(
            before=np.concatenate((self.before, before)),
            after=np.concatenate((self.after, after)),
            weak=np.concatenate((self.weak, np.zeros(len(before), dtype=np.bool_))),
        )


def _polygon_edges(polygons: Polygons, discs: Discs) -> _Edges | None:
    """Return the edges of polygons, and of polygons and discs; None if there are too many pairs."""
    n = len(polygons)
    shapes = Shapes(polygons)
    boxes = shapes.boxes()
    own, mixed = Sweep(boxes), Sweep(boxes, disc_boxes(discs))
    if own.count + mixed.count > MOST_PAIRS:
        return None
    orders = [order for pairs in own for order in polygon_orders(shapes, pairs)]
    intersecting = sum(int(order.cross.sum()) for order in orders)
    for pairs in mixed:
        orders += [order._replace(second=order.second + n) for order in disc_orders(shapes, discs, pairs)]
    crossing = sum(int(order.cross.sum()) for order in orders)
    none = np.empty(0, dtype=np.intp)
    empty = Order(none, none, none.astype(np.int8), none.astype(np.bool_))
    first, second, nearer, cross = (np.concatenate(column) for column in zip(empty, *orders, strict=True))
    # the farther one is drawn first; in one plane, the one that was given first
    swapped = (nearer > 0) | ((nearer == 0) & (first > second))
    before, after = np.where(swapped, second, first), np.where(swapped, first, second)
    return _Edges(before, after, cross | (nearer == 0), intersecting, crossing - intersecting)


def _disc_edges(discs: Discs) -> tuple[Indices, Indices]:
    """Return pairs of discs of which the first is drawn before the second."""
    none = np.empty(0, dtype=np.intp)
    if discs.adds.all():
        return none, none
    sweep = Sweep(disc_boxes(discs))
    if sweep.count > MOST_DISC_PAIRS:
        return _disc_chains(discs)
    parts = [(none, none)]
    for i, j in sweep:
        away = np.hypot(*(discs.centers[i] - discs.centers[j]).T)
        meet = (away < discs.radii[i] + discs.radii[j] - TOUCH) & ~(discs.adds[i] & discs.adds[j])
        parts.append((i[meet], j[meet]))
    i, j = (np.concatenate(column) for column in zip(*parts, strict=True))
    rank = _distance_ranks(discs)
    swapped = rank[i] > rank[j]
    return np.where(swapped, j, i), np.where(swapped, i, j)


def _distance_ranks(discs: Discs) -> Indices:
    rank = np.empty(len(discs), dtype=np.intp)
    rank[np.argsort(-discs.distances, kind="stable")] = np.arange(len(discs))
    return rank


def _disc_chains(discs: Discs) -> tuple[Indices, Indices]:
    """Return pairs of discs that follow each other in a square of the screen.

    Discs that overlap share a square, so that they are in order.
    """
    side = 1.0 * float(np.sqrt((discs.radii**2).mean()))
    low, high = disc_boxes(discs)
    corner = low.min(axis=0)
    first = np.floor((low - corner) / side).astype(np.intp)
    across, up = (np.floor((high - corner) / side).astype(np.intp) - first + 1).T
    thing = np.repeat(np.arange(len(discs)), across * up)
    place = ramps(across * up)
    columns = first[thing, 0] + place % across[thing]
    rows = first[thing, 1] + place // across[thing]
    by_square = np.lexsort((_distance_ranks(discs)[thing], columns, rows))
    thing, columns, rows = thing[by_square], columns[by_square], rows[by_square]
    same = (columns[1:] == columns[:-1]) & (rows[1:] == rows[:-1])
    pairs = np.unique(thing[:-1][same] * len(discs) + thing[1:][same])
    return pairs // len(discs), pairs % len(discs)


def _thinned(edges: _Edges, links: Pairs, is_polygon: NDArray[np.bool_]) -> Pairs:
    """Return edges and the links of discs, without edges that follow from others; there are n things.

    If a disc is linked to another one, and both are drawn before a polygon, the link and the edge of the
    second one are enough; likewise for two that are drawn after it.
    """
    n, (before, after) = len(is_polygon), links
    kept = np.ones(len(edges.before), dtype=np.bool_)
    following, previous = np.full(n, -1), np.full(n, -1)
    by_distance = np.argsort(before - after, kind="stable")  # the closest ones are set last, and stay
    following[before[by_distance]] = after[by_distance]
    previous[after[by_distance]] = before[by_distance]
    # a table of polygons by discs
    column = np.where(is_polygon, np.cumsum(is_polygon) - 1, np.cumsum(~is_polygon) - 1)
    rows = int(is_polygon.sum())
    size = rows * (n - rows)
    ways = ((edges.before, edges.after, following), (edges.after, edges.before, previous))
    for discs, polygons, neighbours in ways if size <= LARGEST_TABLE else ():
        mixed = np.flatnonzero(~is_polygon[discs] & is_polygon[polygons])
        neighbour, polygon = neighbours[discs[mixed]], column[polygons[mixed]]
        has_edge = np.zeros(size, dtype=np.bool_)
        has_edge[column[discs[mixed]] * rows + polygon] = True
        linked = neighbour >= 0
        kept[mixed[linked]] = ~has_edge[column[neighbour[linked]] * rows + polygon[linked]]
    return np.concatenate((edges.before[kept], before)), np.concatenate((edges.after[kept], after))


def _opened(edges: _Edges, groups: Indices) -> tuple[Indices, Indices]:
    """Return an order of n things whose edges lead in circles, and the things that are in them.

    Rows are the start order.
    """
    n, before, after = len(groups), edges.before, edges.after
    dropped = circles(n, before, after).inside & edges.weak
    labels, inside = circles(n, before[~dropped], after[~dropped])
    in_circles = np.flatnonzero(labels >= 0)
    inner = np.flatnonzero(~dropped)[inside]
    for _ in range(OPENINGS):
        if not len(inner) or len(inner) > MANY_EDGES:
            break
        nodes = np.flatnonzero(labels >= 0)
        is_first = np.zeros(n, dtype=np.bool_)
        is_first[nodes[np.unique(labels[nodes], return_index=True)[1]]] = True
        dropped[inner[is_first[after[inner]]]] = True
        inner = inner[~dropped[inner]]
        labels, inside = circles(n, before[inner], after[inner])
        inner = inner[inside]
    dropped[inner[before[inner] > after[inner]]] = True
    return taken(n, before[~dropped], after[~dropped], groups), in_circles


def _result(order: Indices, groups: Indices, edges: _Edges | None, *in_circles: int) -> PaintOrder:
    runs = np.append(_run_starts(groups[order]), len(order))
    if edges is None:
        return PaintOrder(order, runs, 0, 0, 0, 0, True)
    polygons, discs = in_circles or (0, 0)
    return PaintOrder(order, runs, edges.intersecting, edges.cut_discs, polygons, discs, False)


def _run_starts(groups: Indices) -> Indices:
    """Return where the runs of equal groups begin."""
    return np.flatnonzero(np.diff(groups, prepend=groups[:1] - 1))
