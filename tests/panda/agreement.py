"""How two pictures of one scene agree, Panda3D's own and ours."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tests.panda.oracle import Picture


class Agreement(NamedTuple):
    """How a picture of ours agrees with Panda3D's.

    Attributes
    ----------
    covered : float
        The share of the picture that both cover.
    strays : int
        Pixels that only one of them covers and that are not on an edge of either.
    edges : int
        Pixels that only one of them covers.
    mean, largest : float
        Difference of codes where both cover, without edges.
    """

    covered: float
    strays: int
    edges: int
    mean: float
    largest: float


def agreement(theirs: Picture, ours) -> Agreement:
    """Compare Panda3D's picture with a Frame."""
    drawn = np.isfinite(ours.depth)
    alpha = getattr(ours, "images", {}).get("color_alpha")
    if alpha is not None:  # what is blended has no depth
        drawn |= alpha[..., 3] > 0
    both = drawn & theirs.covered
    one = drawn != theirs.covered
    edges = near_edge(drawn) | near_edge(theirs.covered)
    inner = both & ~edges
    codes = np.abs(theirs.color[..., :3].astype(int) - ours.color.astype(int))[inner]
    return Agreement(
        covered=float(both.mean()),
        strays=int((one & ~edges).sum()),
        edges=int(one.sum()),
        mean=float(codes.mean()) if codes.size else 0.0,
        largest=float(codes.max(initial=0)),
    )


def near_edge(covered: np.ndarray) -> np.ndarray:
    """Pixels at the edge of what is covered, on either side."""
    edge = np.zeros_like(covered)
    padded = np.pad(covered, 1, mode="edge")
    height, width = covered.shape
    for row in range(3):
        for column in range(3):
            edge |= padded[row : row + height, column : column + width] != covered
    return edge
