"""The share of this machine that a process may use, and the number of workers that it has room for."""

from __future__ import annotations

import math
import os
from contextlib import suppress
from pathlib import Path
from typing import Literal

from firefly_sample.errors import OutputError
from firefly_sample.settings import to_whole

MEMORY = 2**30
"""The bytes that a worker is assumed to take: three times what one takes for the forest at 800x600."""
MOST_ON_A_GPU = 4
"""More processes would wait for each other on one GPU, and take its memory."""


def choose_workers(
    asked: int | Literal["auto"], frames: int, software: bool | None = None, root: Path = Path("/")
) -> int:
    """Return the number of workers for some frames: `asked`, or for "auto" one for each core.

    It is never above the number of frames. For "auto" it is at most what the memory allows, and
    `MOST_ON_A_GPU` if the driver is no software rasteriser. `root` is the folder that holds ``proc`` and
    ``sys``.

    Raises
    ------
    OutputError
        If `asked` is neither "auto" nor a whole number from 1.
    """
    if asked == "auto":
        room = min(usable_cores(root), usable_memory(root) // MEMORY)
        number = min(room, MOST_ON_A_GPU) if software is False else room
    else:
        whole = to_whole(asked)
        if whole is None or whole < 1:
            raise OutputError(f"workers must be 'auto' or a whole number from 1, got {asked!r}")
        number = whole
    return max(min(number, frames), 1)


def usable_cores(root: Path = Path("/")) -> int:
    """Return the number of cores that this process may use, by its affinity and its control group's quota."""
    cores = len(os.sched_getaffinity(0))
    quota, period = math.inf, 1.0
    with suppress(OSError, ValueError):
        quota, period = map(float, _text(root, "cpu.max").replace("max", "inf").split())
    with suppress(OSError, ValueError):
        quota = float(_text(root, "cpu/cpu.cfs_quota_us"))
        quota = quota if quota > 0.0 else math.inf
        period = float(_text(root, "cpu/cpu.cfs_period_us"))
    return int(min(max(math.ceil(quota / period), 1), cores)) if quota < math.inf else cores


def usable_memory(root: Path = Path("/")) -> int:
    """Return the bytes of memory that are free for this process, also by its control group's limit."""
    free = 2**63
    with suppress(OSError, ValueError, StopIteration):
        lines = (root / "proc/meminfo").read_text().splitlines()
        free = next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:"))
    for limit, used in (
        ("memory.max", "memory.current"),
        ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes"),
    ):
        with suppress(OSError, ValueError):  # "max" is no limit
            free = min(free, int(_text(root, limit)) - int(_text(root, used)))
    return max(free, 0)


def _text(root: Path, name: str) -> str:
    return (root / "sys/fs/cgroup" / name).read_text()
