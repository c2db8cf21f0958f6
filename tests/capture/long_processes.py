"""Tests of worker processes that take long: ``python -m pytest tests/capture/long_processes.py``."""

from __future__ import annotations

import signal

from firefly_sample.capture.drawn import Drawn
from firefly_sample.capture.job import Task
from firefly_sample.capture.processes import MOST_DEATHS, ProcessEngine
from tests.capture.hazards import job
from tests.capture.test_process_parents import check_parent, check_script
from tests.capture.test_processes import HAZARDS


def test_a_script_on_stdin_needs_no_guard(tmp_path):
    check_script(tmp_path, "stdin")


def test_workers_end_with_a_parent_that_is_interrupted():
    check_parent(signal.SIGINT)


def test_frames_that_end_their_worker(tmp_path, capfd):
    """One that does so once is drawn, one that always does fails. The draw after one that was left works."""
    dangerous = job(HAZARDS, parameters={"marker": str(tmp_path / "marker"), "in_build": False})
    with ProcessEngine(dangerous, 1) as engine:
        drawing = engine.draw(Task(dangerous, index) for index in range(100))
        next(drawing)
        drawing.close()
        found = {task.index: result for task, result in engine.draw(Task(dangerous, i) for i in range(1, 6))}
    assert sorted(index for index, result in found.items() if isinstance(result, Drawn)) == [1, 3, 5]
    texts = [str(found[index].error) for index in (2, 4)]
    assert texts == [
        "frame 2 ended its worker process 3 times: killed by signal 9 (SIGKILL)",
        "OddError: onetwo",
    ]
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("second 3\n") == 2
    assert err.count("second 2\n") == err.count("shell 2\n") == MOST_DEATHS
