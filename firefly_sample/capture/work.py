"""The work of a capture: which of its frames are whole, and which have to be drawn."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

from firefly_sample.capture.files import hash_file, thread_count
from firefly_sample.capture.folder import CaptureFolder
from firefly_sample.capture.frames import FrameNumbers, asked_numbers
from firefly_sample.capture.job import Driver, Job, Task, differences, key_of
from firefly_sample.capture.names import FileNames
from firefly_sample.errors import FireflyError

_BATCH = 256
_CHANGED, _FAILED = "of other settings", "that failed before"
_LISTED = 4


class Part:
    """One job of a capture, with its description; a sweep has many.

    `place` is its number among the jobs that are asked for now, or None if it is of an earlier run.
    """

    def __init__(self, job: Job, driver: Driver, place: int | None) -> None:
        self.job, self.place = job, place
        self.description = job.description(driver)
        self.key = key_of(self.description)

    def expose(self, exposure: float) -> None:
        """Keep the measured exposure; raise a FireflyError if another one was measured before."""
        known = self.description["exposure"]
        if known is None:
            self.description = self.description | {"exposure": exposure}
        elif known != exposure:
            raise FireflyError(
                f"the exposure was measured as {known} and as {exposure}: give it as a number (--exposure)"
            )


class Survey(NamedTuple):
    """Counts of recorded frames: those that are whole, and the others by what is wrong with them.

    `changed` says how the settings differ, for example "exposure: 1.0, now 2.0".
    """

    whole: int
    wrong: Counter[str]
    changed: list[str]

    def __str__(self) -> str:
        text = f"{self.whole} frame{'s are' if self.whole != 1 else ' is'} whole already"
        if not self.wrong:
            return text
        listed = ", ".join(f"{count} {what}" for what, count in self.wrong.items())
        more = ["..."] if len(self.changed) > _LISTED else []
        changed = f" ({'; '.join(self.changed[:_LISTED] + more)})" if self.changed else ""
        return f"{text}; drawn again: {listed}{changed}"


class Share(NamedTuple):
    """A shard that is drawn, while others are not: its numbers of whole frames, and of those that failed."""

    whole: int
    failed: int


class Work:
    """The frames of a capture in a folder, as far as they are this process's.

    Parameters
    ----------
    folder : CaptureFolder
    parts : list of Part
        Those that are asked for, and those of earlier runs.
    frames : FrameNumbers or range
        The frames that are asked for.
    """

    def __init__(self, folder: CaptureFolder, parts: list[Part], frames: FrameNumbers | range) -> None:
        self._folder, self._parts, self._frames = folder, parts, frames
        self._again: dict[tuple[str, int], Task] = {}

    def check(self, everything: bool = False, retry: bool = False) -> Survey:
        """Read the files of recorded frames, and forget those that are not whole or were drawn otherwise.

        With `everything` also the frames of other shards are checked, with `retry` those that failed are
        forgotten too.
        """
        records = self._folder.records
        whole, wrong, changed = 0, Counter[str](), dict[str, None]()
        recorded = self._recorded(everything)
        with ThreadPoolExecutor(thread_count()) as pool:
            while batch := list(islice(recorded, _BATCH)):
                frames = [records.frame(part.job.folder, index) for part, index in batch]
                faults = pool.map(self._fault, [part for part, _ in batch], frames)
                for (part, index), frame, fault in zip(batch, frames, faults, strict=True):
                    if fault is None or (fault == _FAILED and not retry):
                        whole += fault is None
                        continue
                    wrong[fault] += 1
                    if fault == _CHANGED:
                        before = records.descriptions[frame["about"]]
                        changed |= dict.fromkeys(differences(before, part.description))
                    self._forget(part, index)
        return Survey(whole, wrong, list(changed))

    def _forget(self, part: Part, index: int) -> None:
        self._folder.records.forget(part.job.folder, index)
        asked = part.place is not None and index in self._frames
        if not (asked and self._is_mine(part, index)):
            self._again[part.job.folder, index] = Task(part.job, index)

    def _fault(self, part: Part, frame: Mapping[str, Any]) -> str | None:
        """Return what is wrong with a recorded frame, or None."""
        if frame["about"] != part.key:
            return _CHANGED
        return fault_of(self._folder.path, part.job.names, frame)

    def _recorded(self, everything: bool) -> Iterator[tuple[Part, int]]:
        for part in self._parts:
            for index in self._folder.records.indices(part.job.folder):
                if everything or self._is_mine(part, index):
                    yield part, index

    def _is_mine(self, part: Part, index: int) -> bool:
        shard = self._folder.shard
        if shard is None:
            return True
        if part.place is None or index not in self._frames:
            return shard.has(index)
        return shard.has(part.place * len(self._frames) + self._frames.index(index))

    def missing(self) -> Iterator[Task]:
        """Yield this process's frames that have to be drawn; each is looked up when it is asked for."""
        for part, index in self._asked():
            if self._is_mine(part, index) and not self._folder.records.has(part.job.folder, index):
                yield Task(part.job, index)
        for (folder, index), task in self._again.items():
            if not self._folder.records.has(folder, index):
                yield task

    def _asked(self) -> Iterator[tuple[Part, int]]:
        for part in self._parts:
            if part.place is not None:
                for index in self._frames:
                    yield part, index

    def count(self) -> tuple[int, int]:
        """Return how many of this process's frames have a record, and how many there are in all."""
        recorded = sum(1 for _ in self._recorded(False))
        return recorded, recorded + sum(1 for _ in self.missing())

    def count_forgotten(self) -> int:
        """Return how many frames an unfinished run was asked for that have no record, and are not asked for.

        Those of other shards are left out, and those of another number of views, which are other pictures.
        """
        if self._folder.shard is not None:
            return 0
        records = self._folder.records
        views = self._frames.views if isinstance(self._frames, FrameNumbers) else 1
        runs = [numbers for numbers in map(asked_numbers, records.asked) if numbers.views == views]
        earlier = {index for numbers in runs for index in numbers}.difference(self._frames)
        parts = [part for part in self._parts if part.place is not None]
        return sum(not records.has(part.job.folder, index) for part in parts for index in earlier)

    def share(self) -> Share:
        """Return the counts of this process's frames."""
        records = self._folder.records
        recorded, failed = 0, 0
        for part, index in self._recorded(False):
            recorded += 1
            failed += "error" in records.frame(part.job.folder, index)
        return Share(recorded - failed, failed)

    def count_others(self) -> int:
        """Return how many frames of all shards have no record, or one of other settings."""
        records = self._folder.records
        absent = sum(1 for part, index in self._asked() if not records.has(part.job.folder, index))
        recorded = self._recorded(everything=True)
        return absent + sum(
            1 for part, index in recorded if records.frame(part.job.folder, index)["about"] != part.key
        )


def fault_of(path: Path, names: FileNames, frame: Mapping[str, Any]) -> str | None:
    """Return what is wrong with a recorded frame, or None; its files are read and hashed.

    Parameters
    ----------
    path : Path
        The folder of the manifest.
    names : FileNames
        Those that its files must have.
    frame : mapping
    """
    if "error" in frame:
        return _FAILED
    digests: dict[str, str | None] = {}
    for output in dict.fromkeys((*names.encoding.outputs, *frame["files"])):
        name = names.path(names.key_of(output), frame["index"])
        if name not in digests:
            digests[name] = hash_file(path / name)
        if digests[name] is None:
            return "missing"
        if digests[name] != frame["file_sha256"].get(output) or name != frame["files"].get(output):
            return "damaged"
    return None
