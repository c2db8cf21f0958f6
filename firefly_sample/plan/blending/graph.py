"""Topological order of a graph in long runs of one group, and the circles for which there is none."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.blending.candidates import Indices


class Circles(NamedTuple):
    """The circles of a graph: sets of nodes of which each can be reached from each other one."""

    labels: Indices  # (n,) the circle that a node is in, or -1
    inside: NDArray[np.bool_]  # (e,) whether an edge leads from a circle into the same circle


def _successors(n: int, first: Indices, second: Indices) -> list[list[int]]:
    """Return the nodes that edges lead to from each of n nodes."""
    targets = second[np.argsort(first, kind="stable")].tolist()
    ends = np.cumsum(np.bincount(first, minlength=n)).tolist()
    return [targets[start:end] for start, end in zip([0, *ends], ends, strict=False)]


def taken(n: int, first: Indices, second: Indices, groups: Indices) -> Indices:
    """Return nodes so that all edges lead onwards (Kahn's method); those in or behind a circle are missing.

    All nodes that are free and of the group in hand follow, in ascending order, and so on until none is; then
    comes the group with the lowest free node. Groups have the shape (n,).
    """
    # plain lists: chains of thousands of nodes are usual, and NumPy is slow one node at a time
    successors = _successors(n, first, second)
    waits: list[int] = np.bincount(second, minlength=n).tolist()
    names: list[int] = np.unique(groups, return_inverse=True)[1].tolist()
    free: dict[int, list[int]] = {}
    for node in range(n):
        if not waits[node]:
            free.setdefault(names[node], []).append(node)
    result: list[int] = []
    name = -1
    while free:
        if name not in free:
            name = min(free, key=lambda other: min(free[other])) if len(free) > 1 else next(iter(free))
        nodes = sorted(free.pop(name))
        result += nodes
        for node in nodes:
            for follower in successors[node]:
                waits[follower] -= 1
                if not waits[follower]:
                    free.setdefault(names[follower], []).append(follower)
    return np.array(result, dtype=np.intp)


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
    successors = _successors(n, first, second)
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
