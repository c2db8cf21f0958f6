"""Topological order of a graph in long runs of one group, and the circles for which there is none."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.blending.candidates import Indices, ramps


class Circles(NamedTuple):
    """The circles of a graph: sets of nodes of which each can be reached from each other one."""

    labels: Indices  # (n,) the circle that a node is in, or -1
    inside: NDArray[np.bool_]  # (e,) whether an edge leads from a circle into the same circle


class _Successors:
    """The edges of a graph with n nodes, by their first node."""

    def __init__(self, n: int, first: Indices, second: Indices) -> None:
        self._targets = second[np.argsort(first, kind="stable")]
        self._counts = np.bincount(first, minlength=n)
        self._starts = np.cumsum(self._counts) - self._counts

    def of(self, nodes: Indices) -> Indices:
        """Return the nodes that edges lead to from some nodes, as often as edges do."""
        counts = self._counts[nodes]
        return self._targets[np.repeat(self._starts[nodes], counts) + ramps(counts)]

    def lists(self) -> list[list[int]]:
        """Return the nodes that edges lead to from each node."""
        targets = self._targets.tolist()
        bounds = zip(self._starts.tolist(), (self._starts + self._counts).tolist(), strict=True)
        return [targets[start:end] for start, end in bounds]


def taken(n: int, first: Indices, second: Indices, groups: Indices) -> Indices:
    """Return nodes so that all edges lead onwards (Kahn's method); those in or behind a circle are missing.

    All nodes that are free and of the group in hand follow, in ascending order, and so on until none is; then
    comes the group with the lowest free node. Groups have the shape (n,).
    """
    successors = _Successors(n, first, second)
    waits = np.bincount(second, minlength=n)
    names = np.unique(groups, return_inverse=True)[1]
    several = bool(n) and bool(names.max() > 0)
    free: dict[int, list[Indices]] = {}
    result = [np.empty(0, dtype=np.intp)]
    new, name = np.flatnonzero(waits == 0), 0
    while len(new) or free:
        for part in _by_group(new, names) if several else (new,) * bool(len(new)):
            free.setdefault(int(names[part[0]]), []).append(part)
        if name not in free:
            name = min(free, key=lambda other: min(int(part[0]) for part in free[other]))
        parts = free.pop(name)
        nodes = parts[0] if len(parts) == 1 else np.sort(np.concatenate(parts))
        result.append(nodes)
        followers = successors.of(nodes)
        np.subtract.at(waits, followers, 1)
        new = np.unique(followers[waits[followers] == 0])
    return np.concatenate(result)


def _by_group(nodes: Indices, names: Indices) -> list[Indices]:
    if len(nodes) < 2:
        return [nodes] * len(nodes)
    own = names[nodes]
    by_name = np.argsort(own, kind="stable")
    return np.split(nodes[by_name], np.flatnonzero(np.diff(own[by_name])) + 1)


def circles(n: int, first: Indices, second: Indices) -> Circles:
    """Return the circles of a graph with n nodes, whose edges lead from `first` to `second`."""
    left = np.ones(n, dtype=np.bool_)
    one_group = np.zeros(n, dtype=np.intp)
    for a, b in ((first, second), (second, first)):  # only what cannot be taken from either end
        some = left[a] & left[b]
        left[taken(n, a[some], b[some], one_group)] = False
    labels = np.full(n, -1)
    nodes = np.flatnonzero(left)
    place = np.cumsum(left) - 1
    some = left[first] & left[second]
    labels[nodes] = _components(len(nodes), place[first[some]], place[second[some]])
    return Circles(labels, (labels[first] >= 0) & (labels[first] == labels[second]))


def _components(n: int, first: Indices, second: Indices) -> Indices:
    """Return the number of each node's strong component, or -1 if the node is alone in it.

    The method is Tarjan's, with a list in place of the recursion.
    """
    successors = _Successors(n, first, second).lists()
    labels = np.full(n, -1)
    found = [-1] * n  # when each node was reached
    lowest = [0] * n  # the earliest open node that can be reached from it
    is_open = [False] * n
    open_: list[int] = []
    clock = number = 0
    for root in range(n):
        path = [] if found[root] >= 0 else [root]
        while path:
            node = path[-1]
            if found[node] < 0:
                found[node] = lowest[node] = clock
                clock += 1
                is_open[node] = True
                open_.append(node)
            while successors[node]:
                follower = successors[node].pop()
                if found[follower] < 0:
                    path.append(follower)
                    break
                if is_open[follower]:
                    lowest[node] = min(lowest[node], found[follower])
            else:
                path.pop()
                if path:
                    lowest[path[-1]] = min(lowest[path[-1]], lowest[node])
                if lowest[node] == found[node]:
                    members: list[int] = []
                    while not members or members[-1] != node:
                        members.append(open_.pop())
                        is_open[members[-1]] = False
                    if len(members) > 1:
                        labels[members] = number
                        number += 1
    return labels
