"""Real schedulers and workers of dask on this machine, and jobs for them."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from firefly_sample.capture.drawn import Drawn, Failed
from firefly_sample.capture.engine import Engine, HereEngine
from firefly_sample.capture.job import Job, Task
from firefly_sample.settings import Settings
from tests.cli.command import GLADE, environment


def job_of(scene: str = GLADE, fps: float = 24.0, sources: dict[str, str] | None = None, **given: Any) -> Job:
    """A job of small pictures."""
    return Job(
        scene, given, Settings(), 1.0, (64, 48), ("color", "depth"), fps, 0.0, sources=dict(sources or {})
    )


def draw_all(engine: Engine, job: Job, indices: Iterable[int]) -> dict[int, Drawn | Failed]:
    """All results by index; each comes once."""
    results = [(task.index, result) for task, result in engine.draw(Task(job, index) for index in indices)]
    assert all(index == result.index for index, result in results)
    found = dict(results)
    assert len(found) == len(results)
    return found


def draw_here(job: Job, indices: Iterable[int]) -> dict[int, Drawn | Failed]:
    with HereEngine(job) as engine:
        return draw_all(engine, job, indices)


def wait_for(ready: Callable[[], object], seconds: float = 120.0) -> None:
    deadline = time.monotonic() + seconds
    while not ready():
        assert time.monotonic() < deadline
        time.sleep(0.05)


class Processes:
    """A scheduler and workers, each a process of its own in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.file = folder / "scheduler.json"
        self._all: dict[str, subprocess.Popen[bytes]] = {}
        self._start(
            "scheduler",
            "scheduler",
            "--host",
            "127.0.0.1",
            "--port",
            "0",
            "--dashboard-address",
            "127.0.0.1:0",
            env={},
        )

    def start_worker(self, name: str, threads: int = 1, **env: str) -> None:
        self._start(
            name,
            "worker",
            *("--nthreads", str(threads), "--no-nanny", "--no-dashboard", "--memory-limit", "0"),
            *("--name", name, "--host", "127.0.0.1", "--local-directory", str(self.folder)),
            env=env,
        )

    def _start(self, name: str, kind: str, *options: str, env: dict[str, str]) -> None:
        command = [sys.executable, "-m", f"distributed.cli.dask_{kind}", "--scheduler-file", str(self.file)]
        with (self.folder / f"{name}.log").open("wb") as log:
            self._all[name] = subprocess.Popen(
                [*command, *options],
                env=environment(**env) | env,
                cwd=self.folder,
                stdout=log,
                stderr=log,
            )

    def kill(self, name: str) -> None:
        process = self._all.pop(name)
        process.kill()
        process.wait()

    def close(self) -> None:
        for name in list(self._all):
            self.kill(name)


def without_package(folder: Path) -> dict[str, str]:
    """The environment of a Python that has no firefly_sample."""
    folder.mkdir()
    (folder / "sitecustomize.py").write_text("import sys\nsys.modules['firefly_sample'] = None\n")
    return {"PYTHONPATH": str(folder)}


def with_version(folder: Path, version: str) -> dict[str, str]:
    """The environment of a Python that has another version of firefly_sample."""
    info = folder / f"firefly_sample-{version}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: firefly_sample\nVersion: {version}\n")
    return {"PYTHONPATH": os.pathsep.join((str(folder), environment()["PYTHONPATH"]))}
