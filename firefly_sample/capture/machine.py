"""The cores and the memory of this machine that this process may use. `root` holds ``proc`` and ``sys``."""

from __future__ import annotations

import math
import os
from contextlib import suppress
from pathlib import Path


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
