"""The journal of a capture: a line of JSON for each frame, appended when its files are on the disk.

A journal has four kinds of lines::

    {"run": 2, "frames": [0, 48, 1], ...}      a process begins; the number grows from run to run
    {"about": KEY, "is": {...}}                a `Job.description`, before the first frame of that job
    {"value": [...]}                           a long value, which frames name by its place in the file
    {"index": 12, "about": KEY, "time": ...}   a frame, whole or failed; its latest line counts

A line that was cut off, by a full disk or the end of the machine's power, is no line.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NotRequired, TypedDict

from firefly_sample.capture.job import key_of
from firefly_sample.errors import FireflyError

SHARED = ("warnings", "id_names", "categories")
"""The members of a frame that are often the same for many frames: they are written once."""


class Asked(TypedDict):
    """The frames that a run is to draw: see `firefly_sample.capture.frames.asked_numbers`.

    Attributes
    ----------
    frames : (int, int, int)
        The range of moments: first, end, step.
    views : int
        The number of views of each moment; 1 when absent.
    jobs : int
        How many combinations of a sweep there are.
    shard : str
        As "2/8"; empty if there are no shards.
    """

    frames: tuple[int, int, int]
    views: NotRequired[int]
    jobs: int
    shard: str


class Journal:
    """The journal that a process appends to. A context manager.

    Parameters
    ----------
    path : Path
        Made if need be.
    run : int
        The number of this run, greater than that of any earlier one.
    asked : mapping
        What is asked for in this run: see `Asked`.

    Raises
    ------
    FireflyError
        If it cannot be written, as do all methods.
    """

    def __init__(self, path: Path, run: int, asked: Asked) -> None:
        self.path = path
        self._described: set[tuple[str, Any]] = set()
        self._known: tuple[Mapping[str, Any], str] | None = None
        self._values: dict[str, tuple[Any, int]] = {}
        try:
            self._file = path.open("ab", buffering=0)
            if not _ends_a_line(path):  # the last writer was killed while it wrote
                self._file.write(b"\n")
        except OSError as error:
            raise self._failure(error) from error
        self._append({"run": run, **asked})

    def add(self, description: Mapping[str, Any], frame: Mapping[str, Any]) -> int:
        """Append a frame, and return the place of its line in the file.

        Parameters
        ----------
        description : mapping
            The job's `Job.description`.
        frame : mapping
            Its first member is "index".
        """
        key = self.key(description)
        if (key, description["exposure"]) not in self._described:
            self._append({"about": key, "is": description})
            self._described.add((key, description["exposure"]))
        line = dict(frame) | {"about": key}
        for name in SHARED:
            if name in line:
                line[name] = self._place_of(name, line[name])
        return self._append(line)

    def key(self, description: Mapping[str, Any]) -> str:
        """Return the `key_of` a description, made anew when it is a different object: views are long."""
        if self._known is None or self._known[0] is not description:
            self._known = description, key_of(description)
        return self._known[1]

    def _place_of(self, name: str, value: Any) -> int:
        """Return the place of a value in the file; it is appended unless the frame before had the same."""
        if name not in self._values or self._values[name][0] != value:
            self._values[name] = value, self._append({"value": value})
        return self._values[name][1]

    def _append(self, line: Mapping[str, Any]) -> int:
        data = (json.dumps(line, allow_nan=False) + "\n").encode()
        try:
            place = self._file.seek(0, os.SEEK_END)
            written = self._file.write(data)
            if written != len(data):
                self._file.write(data[written:])  # raises, because the disk is full
        except OSError as error:
            raise self._failure(error) from error
        return place

    def _failure(self, error: OSError) -> FireflyError:
        return FireflyError(f"cannot write {self.path}: {error.strerror or error}")

    def close(self) -> None:
        """Wait until all of it is on the disk."""
        with suppress(OSError):
            os.fsync(self._file.fileno())
        self._file.close()

    def __enter__(self) -> Journal:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _ends_a_line(path: Path) -> bool:
    with path.open("rb") as file:
        if file.seek(0, os.SEEK_END) == 0:
            return True
        file.seek(-1, os.SEEK_END)
        return file.read() == b"\n"
