"""The number of workers: by cores, memory, frames and driver."""

from __future__ import annotations

import os

import pytest

from firefly_sample.capture.machine import usable_cores, usable_memory
from firefly_sample.capture.processes import WORKER_MEMORY, choose_workers
from firefly_sample.errors import OutputError

GIB = 2**30


@pytest.fixture
def machine(tmp_path, monkeypatch):
    """A function that writes what Linux says of a machine: 16 cores, 64 GiB free, and other files."""

    def make(**files):
        monkeypatch.setattr(os, "sched_getaffinity", lambda process: set(range(16)))
        (tmp_path / "proc").mkdir(exist_ok=True)
        (tmp_path / "proc/meminfo").write_text(f"MemTotal: 1 kB\nMemAvailable:  {64 * GIB // 1024} kB\n")
        for name, text in files.items():
            path = tmp_path / "sys/fs/cgroup" / name.replace("__", "/").replace("_DOT_", ".")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(f"{text}\n")
        return tmp_path

    return make


@pytest.mark.parametrize(
    ("files", "cores", "memory"),
    [
        ({}, 16, 64),
        ({"cpu_DOT_max": "max 100000", "memory_DOT_max": "max", "memory_DOT_current": "5"}, 16, 64),
        ({"cpu_DOT_max": "350000 100000"}, 4, 64),
        ({"cpu_DOT_max": "10000 100000"}, 1, 64),
        ({"cpu_DOT_max": "9900000 100000"}, 16, 64),
        ({"cpu__cpu_DOT_cfs_quota_us": "-1", "cpu__cpu_DOT_cfs_period_us": "100000"}, 16, 64),
        ({"cpu__cpu_DOT_cfs_quota_us": "200000", "cpu__cpu_DOT_cfs_period_us": "100000"}, 2, 64),
        ({"memory_DOT_max": str(8 * GIB), "memory_DOT_current": str(3 * GIB)}, 16, 5),
        ({"memory_DOT_max": str(8 * GIB), "memory_DOT_current": str(9 * GIB)}, 16, 0),
        (
            {
                "memory__memory_DOT_limit_in_bytes": str(4 * GIB),
                "memory__memory_DOT_usage_in_bytes": str(GIB),
            },
            16,
            3,
        ),
    ],
)
def test_the_share_of_a_machine(machine, files, cores, memory):
    root = machine(**files)
    assert (usable_cores(root), usable_memory(root)) == (cores, memory * GIB)
    expected = max(min(cores, memory * GIB // WORKER_MEMORY), 1)
    assert choose_workers("auto", 1000, root) == expected
    assert choose_workers("auto", 2, root) == min(expected, 2)
    assert choose_workers(40, 1000, root) == 40


def test_this_machine():
    assert 1 <= usable_cores() <= len(os.sched_getaffinity(0))
    assert 0 < usable_memory() < 2**63
    assert choose_workers("auto", 1) == choose_workers(3, 1) == 1


@pytest.mark.parametrize("asked", [0, -1, 1.5, "many", True, None])
def test_wrong_numbers(asked):
    with pytest.raises(OutputError, match="workers must be 'auto' or a whole number from 1, got"):
        choose_workers(asked, 10)
