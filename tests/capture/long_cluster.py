"""Tests of local clusters that take minutes: ``python -m pytest tests/capture/long_cluster*.py``."""

# ruff: noqa: F811 (fixtures are imported, and are parameters)

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from firefly_sample.capture.cluster import ClusterEngine
from firefly_sample.capture.drawn import Drawn, Failed
from tests.capture.clusters import draw_all, job_of
from tests.capture.test_cluster import engine, psutil  # noqa: F401 (a fixture)
from tests.cli.command import environment

pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")


def test_a_frame_that_kills_each_worker_fails_and_others_do_not(engine: ClusterEngine) -> None:
    job = job_of("tests.capture.deadly:deadly", fps=1.0)
    drawn = draw_all(engine, job, range(8))
    failed = {index: str(result.error) for index, result in drawn.items() if isinstance(result, Failed)}
    assert failed.keys() == {3, 4}
    assert failed[3].startswith("frame 3 ended each worker that drew it")
    assert failed[4] == "no frame 4"
    assert all(isinstance(drawn[index], Drawn) for index in (0, 1, 2, 5, 6, 7))


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
