"""Pack square tiles into one texture."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple


class Tile(NamedTuple):
    """A square of texels: its lower left corner and its side."""

    x: int
    y: int
    size: int


@lru_cache(maxsize=8)
def pack_atlas(sizes: tuple[int, ...], largest: int) -> tuple[tuple[int, int], tuple[Tile, ...]] | None:
    """Lay squares out on shelves, the largest first; return the atlas's size and the tiles.

    Parameters
    ----------
    sizes : tuple of int
        Sides of the squares, 1 or more.
    largest : int
        Greatest width and height of the atlas.

    Returns
    -------
    (width, height), tuple of Tile
        The smallest atlas among those as wide as 1, 2, 3 ... of the largest square, and the tiles in the
        order of `sizes`; None if they do not fit.
    """
    if not sizes:
        return (0, 0), ()
    widest = max(sizes)
    total = sum(size * size for size in sizes)
    order = sorted(range(len(sizes)), key=lambda index: -sizes[index])
    best: tuple[tuple[int, int], tuple[Tile, ...]] | None = None
    for width in range(widest, min(largest, widest * len(sizes)) + 1, widest):
        if best is not None and width * widest > best[0][0] * best[0][1]:
            break
        if width * largest < total:
            continue
        height, tiles = _shelves(sizes, order, width)
        if height <= largest and (best is None or _badness(width, height) < _badness(*best[0])):
            best = (width, height), tiles
    return best


def _badness(width: int, height: int) -> tuple[int, int]:
    """Return a sort key: fewer texels are better, then the squarer shape."""
    return width * height, abs(width - height)


def _shelves(sizes: Sequence[int], order: Sequence[int], width: int) -> tuple[int, tuple[Tile, ...]]:
    """Return the height that a width needs, and the tiles; `order` is the largest first."""
    tiles: dict[int, Tile] = {}
    x = y = shelf = 0
    for index in order:
        size = sizes[index]
        if x + size > width:
            x, y, shelf = 0, y + shelf, 0
        tiles[index] = Tile(x, y, size)
        x += size
        shelf = max(shelf, size)
    return y + shelf, tuple(tiles[index] for index in range(len(sizes)))
