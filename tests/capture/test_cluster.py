"""Processes on this machine as a cluster: the same bytes, whatever dies, and nothing left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from firefly_sample.capture.cluster import ClusterEngine
from firefly_sample.capture.cluster_client import close
from firefly_sample.capture.drawing import Drawn, Failed
from firefly_sample.capture.job import Task
from firefly_sample.errors import FireflyError, MissingPackageError
from tests.capture.clusters import draw_all, draw_here, job_of, wait_for
from tests.cli.command import environment

psutil = pytest.importorskip("psutil")
pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")


@pytest.fixture(scope="module")
def engine() -> Iterator[ClusterEngine]:
    with ClusterEngine(job_of(), "local", workers=2) as entered:
        yield entered
    assert worker_processes() == []


def worker_processes() -> list[psutil.Process]:
    return [
        process
        for process in psutil.Process().children(recursive=True)
        if "spawn_main" in " ".join(process.cmdline())
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


def test_a_frame_that_kills_each_worker_fails_and_others_do_not(engine: ClusterEngine) -> None:
    job = job_of("tests.capture.deadly:deadly", fps=1.0)
    drawn = draw_all(engine, job, range(8))
    failed = {index: str(result.error) for index, result in drawn.items() if isinstance(result, Failed)}
    assert failed.keys() == {3, 4}
    assert failed[3].startswith("frame 3 ended each worker that drew it")
    assert failed[4] == "no frame 4"
    assert all(isinstance(drawn[index], Drawn) for index in (0, 1, 2, 5, 6, 7))


def test_frames_can_be_left_in_the_middle(engine: ClusterEngine) -> None:
    job = job_of(seed=8)
    frames = engine.draw(Task(job, index) for index in range(1_000_000))
    task, result = next(frames)
    frames.close()
    assert isinstance(result, Drawn)
    assert draw_all(engine, job, [task.index]) == {task.index: result}


SCRIPT = """
import sys
from firefly_sample.capture.cluster import ClusterEngine
from firefly_sample.capture.cluster_client import close
from firefly_sample.capture.job import Task
from tests.capture.clusters import job_of

def main():
    try:
        with ClusterEngine(job_of(), "local", workers=1) as engine:
            for _ in engine.draw(Task(job_of(), index) for index in range(1_000_000)):
                print("drawn", flush=True)
    except KeyboardInterrupt:
        sys.exit(130)
    except Exception as error:
        sys.exit(f"error: {error}")

GUARD
    main()
"""


@pytest.mark.parametrize("death", [signal.SIGINT, signal.SIGKILL])
def test_no_process_is_left(tmp_path: Path, death: signal.Signals) -> None:
    """Ctrl-C goes to all processes of the terminal; a killed parent can tell nobody."""
    script = tmp_path / "guarded.py"
    script.write_text(SCRIPT.replace("GUARD", "if __name__ == '__main__':"))
    with subprocess.Popen(
        [sys.executable, "-W", "ignore::UserWarning", script],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "drawn\n"
        family = psutil.Process(process.pid).children(recursive=True)
        assert len(family) >= 1
        (os.killpg if death == signal.SIGINT else os.kill)(process.pid, death)
        _, said = process.communicate(timeout=60)
    assert process.returncode == (130 if death == signal.SIGINT else -death)
    assert said == ""
    _, alive = psutil.wait_procs(family, timeout=10)
    assert alive == []


def test_a_script_without_a_guard_is_told_so(tmp_path: Path) -> None:
    script = tmp_path / "unguarded.py"
    script.write_text(SCRIPT.replace("GUARD", "if True:"))
    done = subprocess.run(
        [sys.executable, script], env=environment(), capture_output=True, text=True, timeout=120, check=False
    )
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith("error: cluster local: ")
    assert done.stderr.endswith("below the line: if __name__ == '__main__':\n")
    assert done.stderr.count("\n") == 1


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
