"""Functions that run on the workers of a dask cluster, in each process with one `Artist`."""

from __future__ import annotations

import contextlib
import hashlib
import os
import threading
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

from firefly_sample import __version__
from firefly_sample.capture.drawing import Artist
from firefly_sample.capture.drawn import Drawn, Failed
from firefly_sample.capture.job import Driver, Job, Task
from firefly_sample.errors import FireflyError, ModelError, SoftwareDriverWarning

VERSION: str = __version__
"""The version of firefly_sample. Workers are asked for it before they get a function of this module."""
Answer = tuple[str, "Driver | str", tuple[str, ...]]
"""A worker's address; its driver, or why it cannot draw; and what was warned of."""


@dataclass(frozen=True)
class Refused:
    """A frame that a worker must not draw, and why."""

    address: str
    reason: str


class _Kind(NamedTuple):
    """The properties of a job for which its `Artist` was made; another job with the same ones can use it."""

    size: tuple[int, int]
    device: int | None
    require_gpu: bool


class _Studio:
    """The artist of this process; the threads of a worker take turns.

    One artist for all threads, because a driver that draws on the CPU has threads of its own, and because
    warnings are caught for a whole process.
    """

    def __init__(self) -> None:
        self.turn = threading.Lock()
        self._artist: Artist | None = None
        self._kind: _Kind | None = None
        self._checked: Job | None = None

    def artist(self, job: Job) -> Artist:
        """Return the artist for a job, and free the one before if it cannot be used."""
        kind = _Kind(job.size, job.device, job.require_gpu)
        if self._artist is None or kind != self._kind:
            self.free()
            self._artist, self._kind = Artist(job), kind
        return self._artist

    def check(self, job: Job) -> None:
        """Raise a FireflyError if the scene's plugin or a file is missing, or a file has another content."""
        from firefly_sample.scenes import find_scene

        if self._checked is None or job != self._checked:
            _check_sources(job)
            find_scene(job.scene)
            self._checked = job

    def free(self) -> None:
        """Free the artist."""
        artist, self._artist, self._checked = self._artist, None, None
        if artist is not None:
            artist.close()


_studio = _Studio()


def examine(job: Job, folder: str) -> Answer:
    """Return whether this worker can draw a job; `folder` is the capture's working folder."""
    with _studio.turn, _in_folder(folder), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", SoftwareDriverWarning)
        try:
            _studio.check(job)
            driver = _studio.artist(job).driver
        except FireflyError as error:
            return _address(), f"cannot draw: {error}", ()
    return _address(), driver, tuple(str(one.message) for one in caught)


def draw(task: Task, driver: Driver, folder: str) -> Drawn | Failed | Refused:
    """Draw a frame, if this worker's driver is the capture's and all files of the scene are here."""
    with _studio.turn, _in_folder(folder):
        try:
            _studio.check(task.job)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # `examine` has told of them
                artist = _studio.artist(task.job)
        except FireflyError as error:
            return Refused(_address(), f"cannot draw: {error}")
        if reason := other_driver(artist.driver, driver):
            return Refused(_address(), reason)
        drawn = artist.draw_one(task)
    return replace(drawn, error=_plain(drawn.error)) if isinstance(drawn, Failed) else drawn


def free() -> None:
    """Free the renderer of this process."""
    with _studio.turn:
        _studio.free()


def other_driver(own: Driver, driver: Driver) -> str:
    """Return how a worker's driver differs from the capture's; "" if both draw the same bytes."""
    if own[:2] == driver[:2]:
        return ""
    return (
        f"draws with {own.name!r}, {own.version!r}, and the capture with {driver.name!r}, {driver.version!r}"
    )


def _address() -> str:
    from distributed import get_worker

    return str(get_worker().address)


def _plain(error: FireflyError) -> FireflyError:
    """Return an error that can be unpickled without the plugin that may have raised it."""
    kind = next(kind for kind in type(error).__mro__ if kind.__module__ == FireflyError.__module__)
    plain: FireflyError = kind(str(error))
    return plain


@contextlib.contextmanager
def _in_folder(folder: str) -> Iterator[None]:
    """Work in the capture's folder if it exists here, so that the relative names of files are the same."""
    if not os.path.isdir(folder) or os.path.samefile(folder, os.curdir):
        yield
        return
    with contextlib.chdir(folder):
        yield


def _check_sources(job: Job) -> None:
    for name, digest in job.sources.items():
        try:
            with open(name, "rb") as file:
                found = hashlib.file_digest(file, "sha256").hexdigest()
        except OSError as error:
            raise ModelError(f"model {name}: {error.strerror or error}") from None
        if found != digest:
            raise ModelError(f"model {name}: its content differs from the capture's file")
