"""Workers that differ: each is refused by its name, and the others draw the same bytes.

They take a minute: ``python -m pytest tests/capture/long_cluster*.py``. They share a cluster and follow each
other; the last ones end it.
"""

from __future__ import annotations

import hashlib
import logging
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from firefly_sample.capture.cluster import ClusterEngine
from firefly_sample.capture.drawn import Drawn
from firefly_sample.capture.job import Driver, Job, Task
from firefly_sample.errors import FireflyError, GpuError
from tests.capture.clusters import Processes, draw_all, draw_here, job_of, with_version, without_package
from tests.model.scene_files import box_file

distributed = pytest.importorskip("distributed")
pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")

FRAMES = range(6)
DEADLY = "tests.capture.deadly:deadly"


@pytest.fixture(scope="module")
def processes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Processes]:
    """A scheduler with two good workers, one of them with three threads, and three that differ."""
    folder = tmp_path_factory.mktemp("cluster")
    started = Processes(folder)
    try:
        started.start_worker("good", threads=3)
        started.start_worker("second", FIREFLY_TESTS_NO_PLUGIN="1")
        started.start_worker("narrow", GALLIUM_OVERRIDE_CPU_CAPS="sse4.1")
        started.start_worker("old", **with_version(folder / "old", "0.0.1"))
        started.start_worker("bare", **without_package(folder / "bare"))
        yield started
    finally:
        started.close()


@pytest.fixture(scope="module")
def address(processes: Processes) -> Callable[[str], str]:
    """``address(name)`` of a worker."""
    with distributed.Client(scheduler_file=str(processes.file), set_as_default=False) as client:
        client.wait_for_workers(5, timeout=120)
        workers = client.scheduler_info(n_workers=-1)["workers"]
    return {worker["name"]: address for address, worker in workers.items()}.__getitem__


def drawn_by(processes: Processes, job: Job, expected: Driver | None = None, indices=FRAMES):
    """The driver, the frames and the warnings of a capture."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with ClusterEngine(job, str(processes.file), expected=expected) as engine:
            driver, frames = engine.driver, draw_all(engine, job, indices)
    texts = [str(one.message) for one in caught if one.category is UserWarning]
    return driver, frames, texts


def test_workers_that_differ_are_refused_by_name(processes: Processes, address: Callable[[str], str]) -> None:
    driver, frames, said = drawn_by(processes, job_of())
    assert "256 bits" in driver.name
    assert frames == draw_here(job_of(), FRAMES)
    assert len(said) == 3
    (narrow,) = (text for text in said if address("narrow") in text)
    assert narrow.startswith(f"worker {address('narrow')} draws with 'llvmpipe (LLVM ")
    assert "128 bits" in narrow
    assert f"and the capture with {driver.name!r}, {driver.version!r}" in narrow
    (old,) = (text for text in said if address("old") in text)
    assert old.startswith(f"worker {address('old')} has firefly_sample 0.0.1, and the capture ")
    (bare,) = (text for text in said if address("bare") in text)
    assert bare.startswith(f"worker {address('bare')} cannot draw: ModuleNotFoundError: ")
    assert all("\n" not in text for text in said)


def test_a_capture_goes_on_with_its_own_driver(processes: Processes, address: Callable[[str], str]) -> None:
    """It is what a resumed capture asks for, although most workers have another one."""
    common, frames, said = drawn_by(processes, job_of(), indices=range(1))
    narrow = Driver(common.name.replace("256", "128"), common.version, True)
    driver, others, said = drawn_by(processes, job_of(), narrow, range(1))
    assert driver == narrow
    assert sum(" draws with " in text and "256 bits" in text for text in said) == 2
    assert isinstance(others[0], Drawn)
    assert others[0].sha256["depth"] != frames[0].sha256["depth"]

    with pytest.raises(GpuError, match=r"no worker is left: worker tcp://.* draws with .*\(and 4 more\)$"):
        drawn_by(processes, job_of(), Driver("none", "1", False))


def test_a_plugin_that_some_workers_cannot_import(
    processes: Processes, address: Callable[[str], str]
) -> None:
    job = job_of(DEADLY)
    _, frames, said = drawn_by(processes, job)
    assert all(isinstance(frame, Drawn) for frame in frames.values())
    (lacks,) = (text for text in said if address("second") in text)
    assert "cannot draw: scene 'tests.capture.deadly:deadly'" in lacks
    assert "this worker lacks a library" in lacks
    with pytest.raises(FireflyError, match=r"no worker is left: worker tcp://.*\(and 4 more\)$"):
        drawn_by(processes, job_of("not.to_be:found"))


def test_model_files_are_found_from_the_captures_folder(
    processes: Processes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their relative names are the same there, and their content must be, too."""
    monkeypatch.chdir(tmp_path)
    path = box_file().write(Path("box.glb"))
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    job = job_of("box.glb", sources={"box.glb": digest}, file="box.glb")
    _, frames, _ = drawn_by(processes, job, indices=range(2))
    assert frames == draw_here(job, range(2))

    wrong = job_of("box.glb", sources={"box.glb": 64 * "0"}, file="box.glb")
    with pytest.raises(FireflyError, match=r"model box\.glb: its content differs from the capture's file"):
        drawn_by(processes, wrong)
    missing = job_of("box.glb", sources={"none.glb": digest}, file="box.glb")
    with pytest.raises(FireflyError, match=r"model none\.glb: No such file"):
        drawn_by(processes, missing)


@pytest.mark.filterwarnings("ignore:worker")
def test_workers_come_and_go(processes: Processes, caplog: pytest.LogCaptureFixture) -> None:
    """With the last worker gone a capture waits: a new one goes on, and without one it ends."""
    job, drawn = job_of(), {}
    with caplog.at_level(logging.INFO, "firefly_sample"):
        with ClusterEngine(job, str(processes.file), patience=60.0) as engine:
            for task, frame in engine.draw(Task(job, index) for index in range(30)):
                drawn[task.index] = frame
                if len(drawn) == 3:
                    for name in ("good", "second", "narrow", "old", "bare"):
                        processes.kill(name)
                    processes.start_worker("late")
        assert "waiting for workers" in caplog.text
        assert drawn == draw_here(job, range(30))
        with ClusterEngine(job, str(processes.file), patience=2.0) as engine:
            frames = engine.draw(Task(job, index) for index in range(1_000_000))
            next(frames)
            processes.kill("late")
            with pytest.raises(FireflyError, match=r"there has been no worker for 2 s$"):
                list(frames)


def test_the_scheduler_dies(processes: Processes, capfd: pytest.CaptureFixture[str]) -> None:
    processes.start_worker("last")
    job = job_of()
    with ClusterEngine(job, str(processes.file)) as engine:
        frames = engine.draw(Task(job, index) for index in range(1_000_000))
        next(frames)
        processes.kill("scheduler")
        with pytest.raises(FireflyError, match=r"the connection with its scheduler is lost") as caught:
            list(frames)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")
