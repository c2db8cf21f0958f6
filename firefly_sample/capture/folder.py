"""The folder of a capture: its lock, its records, its files, and at the end its manifest.

While a capture is under way there is a journal in its folder (see `firefly_sample.capture.journal`), and when
it is finished a manifest and no journal. An earlier manifest is put aside as ``manifest.previous.json`` until
then, because it would describe files that change.
"""

from __future__ import annotations

import logging
import os
import re
import warnings
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from itertools import groupby
from pathlib import Path
from typing import Any

from firefly_sample.capture.datasets import DATASETS
from firefly_sample.capture.files import output_folder, remove_unfinished, sync_folder
from firefly_sample.capture.frames import Shard
from firefly_sample.capture.journal import Asked, Journal
from firefly_sample.capture.layout import LAYOUTS, Layout, layout_of, names_in
from firefly_sample.capture.lock import Lock
from firefly_sample.capture.manifest import MANIFEST
from firefly_sample.capture.records import Records
from firefly_sample.errors import FireflyError, OutputError
from firefly_sample.settings import SETTINGS

PREVIOUS = "manifest.previous.json"
_LOCK = ".firefly"
_JOURNAL = re.compile(r"journal(-\d+-of-\d+)?\.jsonl")
_LISTED = 3

log = logging.getLogger(__name__)


def journal_name(shard: Shard | None = None) -> str:
    """Return the name of a journal: each shard has its own."""
    return "journal.jsonl" if shard is None else f"journal-{shard.label}.jsonl"


def journals(folder: Path) -> list[Path]:
    """Return the journals in a folder, and no other file that is only called like them."""
    return sorted(path for path in folder.glob("journal*.jsonl") if _JOURNAL.fullmatch(path.name))


def read_records(folder: Path) -> Records:
    """Return what is known of the frames in a folder."""
    return Records([folder / PREVIOUS, folder / MANIFEST], journals(folder))


def holds_capture(folder: Path) -> bool:
    """Return whether there is a capture in a folder, finished or not."""
    return bool(journals(folder)) or any((folder / name).exists() for name in (MANIFEST, PREVIOUS))


def recorded_settings(folder: Path) -> dict[str, Any] | None:
    """Return the settings that frames in a folder were drawn with; None if none can be read."""
    with suppress(FireflyError), read_records(folder) as records:
        for description in reversed(records.descriptions.values()):
            if isinstance(settings := description.get("settings"), dict):
                return {name: value for name, value in settings.items() if name in SETTINGS}
    return None


class CaptureFolder:
    """A folder that this process captures into. A context manager, which makes, locks and leaves it.

    Parameters
    ----------
    path : Path
    shard : Shard, optional
        The share that this process draws; other processes draw the others at the same time.
    asked : Asked
        What the journal says of this run.
    overwrite : bool
        Remove the capture that is there when the first frame is added; until then it has no records.
    dataset : str, optional
        The data set that the capture is to be.

    Attributes
    ----------
    records : Records
        Of the frames of all processes up to the last `reread`.

    Raises
    ------
    FireflyError
        If it cannot be written, or another process captures into it.
    """

    def __init__(
        self,
        path: Path,
        asked: Asked,
        shard: Shard | None = None,
        overwrite: bool = False,
        dataset: str | None = None,
    ) -> None:
        self.path, self.shard = path, shard
        self._asked, self._dataset = asked, dataset
        self._outdated: list[Path] = []
        self._overwrite = overwrite
        self._stack = ExitStack()
        self._journal: Journal | None = None
        self._is_unused = False
        self._own_lock: Path | None = None

    def __enter__(self) -> CaptureFolder:
        with ExitStack() as stack:
            stack.enter_context(output_folder(self.path))
            self._lock_all(stack)
            if self.shard is None:
                self._remove_unfinished()
            self.records = Records([], []) if self._overwrite else self._read()
            stack.callback(lambda: self.records.close())
            self._stack = stack.pop_all()
        return self

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        if self._journal is not None:
            self._journal.close()
            if self._is_unused:
                self._undo_begin()
        self._stack.__exit__(kind, error, trace)

    def _undo_begin(self) -> None:
        """Leave the folder as it was, because no file was written, for example on a full disk."""
        with suppress(OSError):
            (self.path / journal_name(self.shard)).unlink()
            if self.shard is None and not (self.path / MANIFEST).exists():
                os.replace(self.path / PREVIOUS, self.path / MANIFEST)

    def _read(self) -> Records:
        try:
            return read_records(self.path)
        except FireflyError as error:
            raise OutputError(
                f"{error}: use --overwrite to replace the capture, or another folder"
            ) from error

    def _lock_all(self, stack: ExitStack) -> None:
        busy = f"another capture is writing into {self.path}"
        try:
            self._lock = Lock(self.path / f"{_LOCK}.lock", busy, shared=self.shard is not None)
            stack.callback(self._lock.release)
            if self.shard is not None:
                self._own_lock = self.path / f"{_LOCK}-{self.shard.label}.lock"
                own = Lock(
                    self._own_lock,
                    f"shard {self.shard} of the capture in {self.path} is being drawn already",
                )
                stack.callback(own.release)
        except OSError as error:
            reason = error.strerror or error
            raise FireflyError(f"cannot write into {self.path} ({reason}): choose another folder") from error

    def _remove_unfinished(self) -> None:
        inner = {name for layout in LAYOUTS for name in layout.folders()}
        for folder in (self.path, *self._swept_folders()):
            for path in (folder, *(folder / name for name in inner)):
                if path.is_dir():
                    remove_unfinished(path)

    def _swept_folders(self) -> list[Path]:
        """Return the folders that a sweep may have made, and not those with a capture of their own."""
        with os.scandir(self.path) as entries:
            found = [
                Path(entry.path)
                for entry in entries
                if "=" in entry.name and entry.is_dir(follow_symlinks=False)
            ]
        own = (f"{_LOCK}.lock", MANIFEST, PREVIOUS)
        return [
            folder
            for folder in found
            if not journals(folder) and not any((folder / name).exists() for name in own)
        ]

    def check_free(self) -> None:
        """Raise an OutputError if there is a capture in the folder; for a shard, one in the same share."""
        if self.shard is not None:
            others = re.compile(rf"journal-\d+-of-{self.shard.count}\.jsonl")
            strange = [path for path in journals(self.path) if not others.fullmatch(path.name)]
            used = bool(strange) or any(
                (self.path / name).exists() for name in (journal_name(self.shard), MANIFEST, PREVIOUS)
            )
        else:
            used = bool(self.records.folders())
            used = used or any((self.path / name).exists() for name in (MANIFEST, PREVIOUS))
            strays = [] if used else self._strays()
            if strays:
                raise OutputError(
                    f"there are files in {self.path} that are named like frames, for example {strays[0]}: "
                    "use another folder, or --overwrite, which removes them"
                )
        if used:
            replace = "" if self.shard is not None else "--overwrite to replace it, "
            raise OutputError(
                f"there is a capture in {self.path} already: use --resume to go on with it, {replace}or "
                "another folder"
            )

    def _strays(self) -> list[str]:
        """Return the files that a new capture would take for its own."""
        frames = {name for layout in self._layouts() for name in self._frames_in("", layout)}
        own = [path.name for path in self._documents("", self._dataset) if path.exists()]
        return sorted(frames) + own

    def _layouts(self, records: Records | None = None) -> list[Layout]:
        """Return the layouts of captures in this folder: the usual one, this one's, and those of records."""
        known = {} if records is None else records.descriptions
        datasets = [description.get("dataset") for description in known.values()]
        return list(dict.fromkeys(map(layout_of, (None, self._dataset, *datasets))))

    def _documents(self, folder: str, dataset: str | None) -> list[Path]:
        """Return the paths of what makes a folder a data set, whether they are there or not."""
        names = DATASETS[dataset].documents if dataset in DATASETS else ()
        return [self.path / folder / name for name in names]

    def _recorded_documents(self, records: Records) -> list[Path]:
        """Return the documents of earlier captures in this folder."""
        known = {(one["folder"], one.get("dataset")) for one in records.descriptions.values()}
        return [path for folder, dataset in known for path in self._documents(folder, dataset)]

    def reread(self) -> None:
        """Read the records again: other shards may have added to theirs."""
        self.records.close()
        self.records = read_records(self.path)

    def add(self, description: Mapping[str, Any], frame: Mapping[str, Any]) -> None:
        """Append a frame to the journal, after its files."""
        self.begin()
        assert self._journal is not None
        self.records.add(self._journal, description, frame)
        self._is_unused = False

    def note_written(self) -> None:
        """Note that a file of a frame is in its place: what describes earlier files may not describe it."""
        self._is_unused = False
        with suppress(IndexError):  # several threads do it
            while True:
                self._remove(self._outdated.pop())

    def begin(self) -> None:
        """Put an earlier manifest aside and open the journal, unless that has been done."""
        if self._journal is not None:
            return
        if self._overwrite:
            self._remove_earlier()
        self._outdated = self._recorded_documents(self.records)
        try:
            with suppress(FileNotFoundError):  # another shard may be faster
                os.replace(self.path / MANIFEST, self.path / PREVIOUS)
        except OSError as error:
            raise FireflyError(f"cannot rename {self.path / MANIFEST}: {error.strerror or error}") from error
        path = self.path / journal_name(self.shard)
        self._is_unused = not path.exists()
        self._journal = Journal(path, self.records.run + 1, self._asked)
        with suppress(OSError):  # without it, a loss of power costs time only
            sync_folder(self.path)

    def _remove_earlier(self) -> None:
        """Remove the files of an earlier capture, its documents first, and then what describes them.

        The journals go last: a capture that is killed before can still be seen to be there.
        """
        described = [self.path / MANIFEST, self.path / PREVIOUS, *journals(self.path)]
        try:
            earlier = read_records(self.path)
        except FireflyError as error:
            warnings.warn(f"{error}; only pictures in {self.path} itself are removed", stacklevel=2)
            earlier = Records([], journals(self.path))
        with earlier:
            folders, layouts = {"", *earlier.folders()}, self._layouts(earlier)
            documents = self._recorded_documents(earlier)
        for path in (*documents, *self._documents("", self._dataset)):
            self._remove(path)
        for folder in folders:
            for layout in layouts:
                for name in self._frames_in(folder, layout):
                    self._remove(self.path / name)
                self._remove_empty(folder, layout)
            with suppress(OSError):  # there are other files in it
                if folder:
                    (self.path / folder).rmdir()
        for path in described:
            self._remove(path)

    def _remove_empty(self, folder: str, layout: Layout) -> None:
        """Remove the folders of a layout in a capture's folder, if no file is in them."""
        for inner in filter(None, layout.folders()):
            with suppress(OSError):  # there are files in it, or it is not there
                (self.path / folder / inner).rmdir()

    def _frames_in(self, folder: str, layout: Layout) -> dict[str, int]:
        """Return the files with names of frames, by their paths from the capture's folder, with the frame."""
        found: dict[str, int] = {}
        for name in names_in(self.path / folder, layout):
            named = layout.parse(name)
            if named is not None:
                found[f"{folder}/{name}" if folder else name] = named[1]
        return found

    def remove_strays(self) -> None:
        """Remove files with names of frames that no record has, and log their names.

        These may be those of an earlier capture in another layout.
        """
        removed = list[str]()
        layouts = self._layouts(self.records)
        for folder in ("", *self.records.folders()):
            named = {name: index for one in layouts for name, index in self._frames_in(folder, one).items()}
            found = sorted(named.items(), key=lambda one: one[1])
            for index, names in groupby(found, key=lambda one: one[1]):
                frame = self.records.frame(folder, index) if self.records.has(folder, index) else {}
                kept = set(frame.get("files", {}).values())
                for name in (name for name, _ in names if name not in kept):
                    self._remove(self.path / name)
                    removed.append(name)
            for layout in layouts:
                self._remove_empty(folder, layout)
        if removed:
            listed = ", ".join(sorted(removed)[:_LISTED]) + (", ..." if len(removed) > _LISTED else "")
            log.info("removed from %s, because no frame has them: %s (%d)", self.path, listed, len(removed))

    def become_alone(self) -> bool:
        """Return whether no other shard is being drawn; none can begin then."""
        if not self._lock.become_exclusive():
            return False
        self._remove_unfinished()
        return True

    def end(self) -> None:
        """Remove what a finished capture does not need beside its manifest."""
        if self._journal is not None:
            self._journal.close()
            self._journal = None
        for path in (self.path / PREVIOUS, *journals(self.path)):
            self._remove(path)
        if self._lock.become_exclusive():  # the locks of shards that were killed are nobody's
            for path in self.path.glob(f"{_LOCK}-*.lock"):
                if path != self._own_lock:
                    self._remove(path)

    def _remove(self, path: Path) -> None:
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise FireflyError(f"cannot remove {path}: {error.strerror or error}") from error
