"""The processor time and the memory of this process and of those that it has started, from ``/proc``."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

_PROC = Path("/proc")


def descendants() -> list[int]:
    """Return the numbers of the living processes that this one has started, and theirs, in no order."""
    children: dict[int, list[int]] = {}
    for entry in os.scandir(_PROC):
        if entry.name.isdigit():
            with suppress(OSError):
                children.setdefault(int(_fields(int(entry.name))[1]), []).append(int(entry.name))
    found = [os.getpid()]
    for number in found:  # it grows
        found += children.get(number, [])
    return found[1:]


def tree_seconds() -> float:
    """Return the seconds of processor time that this process and its living descendants have taken."""
    ticks = 0
    for number in (os.getpid(), *descendants()):
        with suppress(OSError):
            ticks += sum(map(int, _fields(number)[11:13]))
    return ticks / os.sysconf("SC_CLK_TCK")


def memory(number: int | None = None) -> int:
    """Return the proportional set size of a process in bytes, this one's when absent.

    A page of memory counts for each process by its share: the sizes of all processes add up to what is used.
    """
    return _rollup(number or os.getpid(), "Pss")


def own_memory() -> int:
    """Return the bytes of this process's memory that are no part of a file: libraries do not count.

    It does not depend on other processes, as `memory` does: a page counts more there when others end.
    """
    return _rollup(os.getpid(), "Anonymous")


def _rollup(number: int, name: str) -> int:
    lines = (_PROC / str(number) / "smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith(f"{name}:"))


def memory_of_descendants() -> list[int]:
    """Return `memory` of each living descendant, the largest first."""
    sizes = []
    for number in descendants():
        with suppress(OSError, StopIteration):  # it ended, and has no memory any more
            sizes.append(memory(number))
    return sorted(sizes, reverse=True)


def _fields(number: int) -> list[str]:
    """Return the fields of a process's ``stat`` after its name: state, parent, ..., see proc(5)."""
    return (_PROC / str(number) / "stat").read_text().rpartition(")")[2].split()
