"""Frames drawn in processes: the bytes of one process, whatever happens to the others. With real kills."""

from __future__ import annotations

import os
import resource
import signal
import warnings

import pytest

from firefly_sample import SoftwareDriverWarning
from firefly_sample.capture import processes
from firefly_sample.capture.drawing import Artist
from firefly_sample.capture.drawn import Drawn, Failed
from firefly_sample.capture.engine import HereEngine
from firefly_sample.capture.job import Task
from firefly_sample.capture.processes import IN_FLIGHT, ProcessEngine
from firefly_sample.errors import FireflyError, GpuError, NoGpuError, SceneError
from tests.capture.hazards import job
from tests.cli.command import GLADE

HAZARDS = "tests.capture.hazards:hazards"


def pids(engine):
    return [worker._process.pid for worker in engine._workers]


def assert_gone(numbers):
    for number in numbers:
        with pytest.raises(ProcessLookupError):
            os.kill(number, 0)  # a zombie would be found


def test_the_same_bytes_with_a_worker_killed_in_between():
    glade, taken = job(GLADE, parameters={"glass": True}), []

    def tasks():
        for index in range(9):
            taken.append(index)
            yield Task(glade, index)

    with HereEngine(glade) as here:
        expected = {task.index: result for task, result in here.draw(tasks())}
    taken.clear()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with ProcessEngine(glade, 2) as engine:
            assert engine.driver == here.driver
            found, started = {}, pids(engine)
            for task, result in engine.draw(tasks()):
                assert taken == list(range(len(taken)))
                assert len(taken) <= len(found) + 3 * 2 + IN_FLIGHT * 2
                found[task.index] = result
                if len(found) == 1:
                    os.kill(started[0], signal.SIGINT)  # it ignores that
                    os.kill(started[1], signal.SIGKILL)
            assert pids(engine)[0] == started[0]
            assert pids(engine)[1] != started[1]
            started += pids(engine)
    assert_gone(started)
    assert found.keys() == expected.keys() == set(range(9))
    for index, result in found.items():
        one = expected[index]
        assert isinstance(result, Drawn)
        assert (result.files, result.sha256, result.file_sha256) == (one.files, one.sha256, one.file_sha256)
        assert (result.lights, result.warnings, result.exposure) == (one.lights, one.warnings, one.exposure)
    (said,) = [one for one in caught if one.category is SoftwareDriverWarning]
    with pytest.warns(SoftwareDriverWarning) as as_here, Artist(glade):
        pass
    assert str(said.message) == str(as_here[0].message)


def test_a_scene_that_ends_every_worker_is_an_error(monkeypatch):
    monkeypatch.setattr(processes, "MOST_DEATHS", 1)
    monkeypatch.setattr(processes, "MOST_LOST", 2)
    deadly = job(HAZARDS, parameters={"marker": "", "in_build": True})
    with ProcessEngine(deadly, 1) as engine:
        drawing = engine.draw(Task(deadly, index) for index in range(100))
        assert isinstance(next(drawing)[1], Failed)
        with pytest.raises(FireflyError, match=r"no worker has drawn a frame: frame 1 .*exit code 7"):
            next(drawing)


class Changed(ProcessEngine):
    """Its second worker, or the only one, has another environment."""

    changes: dict[str, str] = {}  # noqa: RUF012

    def environment(self, number):
        other = self.changes if number == len(self._workers) else {}
        return {**super().environment(number), **other}


def test_workers_that_cannot_start(monkeypatch, capfd):
    nowhere = job(GLADE, device=99)
    with pytest.raises(NoGpuError) as here:
        Artist(nowhere)
    with pytest.raises(NoGpuError) as there, ProcessEngine(nowhere, 1):
        pass
    assert str(there.value) == str(here.value)
    monkeypatch.setattr(Changed, "changes", {"PYTHONHOME": "/nowhere"})
    with (
        pytest.raises(FireflyError, match=r"^worker 1 ended 3 times before it could draw: exit code 1$"),
        Changed(job(GLADE), 1),
    ):
        pass
    capfd.readouterr()


def test_a_process_that_cannot_be_started():
    before, lowest = resource.getrlimit(resource.RLIMIT_NOFILE), os.dup(0)
    os.close(lowest)
    resource.setrlimit(resource.RLIMIT_NOFILE, (lowest, before[1]))  # no file can be opened any more
    try:
        with (
            pytest.warns(UserWarning, match=r"^worker 1 is left out: worker 1 cannot be started: "),
            pytest.raises(FireflyError, match=r"^worker 2 cannot be started: .*Too many open files"),
            ProcessEngine(job(GLADE), 2),
        ):
            pass
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, before)


def test_a_worker_with_another_driver_is_refused_by_name(monkeypatch):
    monkeypatch.setattr(Changed, "changes", {"GALLIUM_DRIVER": "softpipe"})
    glade = job(GLADE)
    with Changed(glade, 2) as engine:
        started = pids(engine)
        with pytest.raises(GpuError, match=r"^worker \d draws with another driver: ") as error:
            list(engine.draw(Task(glade, index) for index in range(10_000)))
    assert "softpipe" in str(error.value)
    assert "llvmpipe" in str(error.value)
    assert_gone(started)


def test_a_scene_of_the_program_that_runs_is_refused():
    with pytest.raises(SceneError, match="a module of its own"):
        ProcessEngine(job("__main__:scene"), 2)
