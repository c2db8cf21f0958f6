"""Tables as plain text."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

_NARROWEST = 20
"""The last column is never wrapped to fewer characters than this."""


def align(rows: Sequence[Sequence[str]], width: int | None = None) -> str:
    """Return one or more rows with the same number of cells as lines, with columns two spaces apart.

    The last column is wrapped so that no line has more than `width` characters; not at all when absent.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    before = sum(widths[:-1]) + 2 * len(widths[:-1])
    lines = []
    for *cells, last in rows:
        start = "".join(cell.ljust(size + 2) for cell, size in zip(cells, widths, strict=False))
        parts = [last] if width is None else textwrap.wrap(last, max(width - before, _NARROWEST))
        lines += [f"{start}{part}".rstrip() for part in parts[:1] or [""]]
        lines += [" " * before + part for part in parts[1:]]
    return "\n".join(lines)
