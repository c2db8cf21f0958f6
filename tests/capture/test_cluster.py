"""Processes on this machine as a cluster: the same bytes, whatever dies, and nothing left behind."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import pytest

from firefly_sample.capture.cluster import ClusterEngine
from firefly_sample.capture.cluster_client import close
from firefly_sample.capture.drawn import Drawn
from firefly_sample.capture.job import Task
from firefly_sample.errors import FireflyError, MissingPackageError
from tests.capture.clusters import draw_all, draw_here, job_of, wait_for

psutil = pytest.importorskip("psutil")
pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")


@pytest.fixture(scope="module")
def engine() -> Iterator[ClusterEngine]:
    _OTHERS.update(process.pid for process in psutil.Process().children(recursive=True))
    with ClusterEngine(job_of(), "local", workers=2) as entered:
        yield entered
    assert worker_processes() == []


_OTHERS: set[int] = set()
"""The processes of earlier tests."""


def worker_processes() -> list[psutil.Process]:
    return [
        process
        for process in psutil.Process().children(recursive=True)
        if process.pid not in _OTHERS and "spawn_main" in " ".join(process.cmdline())
    ]


def test_the_same_bytes_when_a_worker_is_killed(engine: ClusterEngine) -> None:
    job, number, taken, drawn = job_of(), 40, [], {}

    def tasks() -> Iterator[Task]:
        for index in range(number):
            taken.append(index)
            yield Task(job, index)

    for task, result in engine.draw(tasks()):
        drawn[task.index] = result
        assert len(taken) <= len(drawn) + 2 * 4  # two for each thread, and as many that are being fetched
        if len(drawn) == 5:
            before = {process.pid for process in worker_processes()}
            worker_processes()[0].kill()
    assert len(before) == 2
    assert drawn == draw_here(job, range(number))
    wait_for(lambda: len(worker_processes()) == 2)


def test_frames_can_be_left_in_the_middle(engine: ClusterEngine) -> None:
    job = job_of(seed=8)
    frames = engine.draw(Task(job, index) for index in range(1_000_000))
    task, result = next(frames)
    frames.close()
    assert isinstance(result, Drawn)
    assert draw_all(engine, job, [task.index]) == {task.index: result}


def test_without_dask_the_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingPackageError, match=r"^a cluster needs distributed .*: run .* -m pip install "):
        ClusterEngine(job_of(), "local").__enter__()


def test_no_scheduler_and_a_number_of_workers_elsewhere() -> None:
    with pytest.raises(FireflyError, match="a number of workers goes with the cluster 'local' only"):
        ClusterEngine(job_of(), "tcp://127.0.0.1:1", workers=2).__enter__()
    with pytest.raises(FireflyError, match=r"^cluster no_such\.json: it must be tcp://host:port, "):
        ClusterEngine(job_of(), "no_such.json").__enter__()


def test_a_cluster_that_is_slow_to_close_is_left(caplog: pytest.LogCaptureFixture) -> None:
    """Which happens while it starts a process in place of one that died."""

    class Slow:
        def close(self, timeout: float) -> None:
            raise TimeoutError(f"timed out after {timeout:g} s.")

        def __str__(self) -> str:
            return "the cluster"

    with caplog.at_level("INFO", logger="firefly_sample"):
        close(Slow())
    assert caplog.messages == ["the cluster is not closed after 10 s (timed out after 10 s.)"]
