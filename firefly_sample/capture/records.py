"""What is known of the frames in a folder: read from its journals, and from a manifest of before."""

from __future__ import annotations

import json
from array import array
from collections.abc import Container, Iterator, Mapping
from pathlib import Path
from typing import IO, Any, Literal

from firefly_sample.capture.frames import MAX_FRAMES
from firefly_sample.capture.job import Driver, key_of
from firefly_sample.capture.journal import SHARED, Journal
from firefly_sample.capture.manifest import FrameLines, read_manifest
from firefly_sample.errors import FireflyError

_PAGE = 256
_OFFSET = 1 << 44
"""A frame's place is one number: that of its file times this, and the offset of its line, plus one.

Frames that have no line have negative places: minus their number in a list, from 1.
"""


class Records:
    """The records of frames. A context manager: it keeps the files open.

    A record takes eight bytes; the frame's line is read when it is asked for.

    Parameters
    ----------
    manifests, journals : list of Path
        Those that are missing count as empty. Where several say something of a frame, the later run counts,
        and a manifest least.

    Attributes
    ----------
    descriptions : dict of str to dict
        Each `Job.description` by its `key_of`.
    run : int
        The number of the latest run; 0 if there is none.
    asked : list of dict
        What was asked for in the latest run of each journal: see `firefly_sample.capture.journal.Asked`.

    Raises
    ------
    FireflyError
        If a file cannot be read.
    """

    def __init__(self, manifests: list[Path], journals: list[Path]) -> None:
        self.descriptions: dict[str, dict[str, Any]] = {}
        self.run = 0
        self.asked: list[dict[str, Any]] = []
        self._files: list[IO[bytes]] = []
        self._heads: dict[tuple[int, str], Mapping[str, Any]] = {}
        self._loose: list[dict[str, Any]] = []
        self._places: dict[str, _Places] = {}
        self._runs: dict[str, _Places] = {}
        try:
            for path in manifests:
                if path.exists():
                    self._read_manifest(path)
            for path in journals:
                if path.exists():
                    self._read_journal(path)
        except OSError as error:
            self.close()
            raise FireflyError(f"cannot read {path}: {error.strerror or error}") from error
        except BaseException:
            self.close()
            raise

    def driver(self) -> Driver | None:
        """Return the driver of the latest description; None if there is none."""
        for latest in reversed(self.descriptions.values()):
            name, version, software = (latest.get(each) for each in ("driver", "driver_version", "software"))
            return Driver(str(name), str(version), bool(software))
        return None

    def folders(self) -> list[str]:
        """Return the folders that have records, "" for that of a capture which is no sweep."""
        return [folder for folder, places in self._places.items() if any(True for _ in places.indices())]

    def indices(self, folder: str) -> Iterator[int]:
        """Yield the numbers of the frames of a folder that have records, in order."""
        if folder in self._places:
            yield from self._places[folder].indices()

    def has(self, folder: str, index: int) -> bool:
        """Return whether there is a record of a frame."""
        return folder in self._places and self._places[folder].get(index) != 0

    def frame(self, folder: str, index: int) -> dict[str, Any]:
        """Return the record of a frame; its member "about" is the key of its description."""
        place = self._places[folder].get(index)
        if place < 0:
            return dict(self._loose[-place - 1])
        source, offset = divmod(place - 1, _OFFSET)
        frame = self._line(source, offset)
        head = self._heads.get((source, folder))
        if head is None:
            for name in SHARED:
                if name in frame:
                    frame[name] = self._line(source, frame[name])["value"]
        else:
            _complete(frame, head)
        return frame

    def add(self, journal: Journal, description: Mapping[str, Any], frame: Mapping[str, Any]) -> None:
        """Append a frame to a journal, and keep its record."""
        offset = journal.add(description, frame)
        names = [file.name for file in self._files]
        if str(journal.path) not in names:
            names.append(str(journal.path))
            try:
                self._files.append(journal.path.open("rb"))
            except OSError as error:  # it was removed meanwhile
                raise FireflyError(f"cannot read {journal.path}: {error.strerror or error}") from error
        self._describe(journal.key(description), dict(description))
        place = names.index(str(journal.path)) * _OFFSET + offset + 1
        self._places.setdefault(description["folder"], _Places()).put(frame["index"], place)

    def forget(self, folder: str, index: int) -> None:
        """Remove the record of a frame from memory."""
        self._places[folder].put(index, 0)

    def close(self) -> None:
        """Close the files."""
        for file in self._files:
            file.close()

    def __enter__(self) -> Records:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _line(self, source: int, offset: int) -> dict[str, Any]:
        file = self._files[source]
        file.seek(offset)
        line: dict[str, Any] = json.loads(file.readline().strip().removesuffix(b","))
        return line

    def _read_manifest(self, path: Path) -> None:
        source = len(self._files)
        manifest = read_manifest(path)
        self._files.append(path.open("rb"))
        try:
            for part in manifest.captures():
                check_folder(path, part["folder"])
                self._read_part(source, part)
        except ValueError as error:
            raise FireflyError(f"{path} is not a manifest: {error}") from error
        except (KeyError, TypeError, AttributeError, RecursionError) as error:
            raise FireflyError(f"{path} is not a manifest: {type(error).__name__}: {error}") from error

    def _read_part(self, source: int, part: Mapping[str, Any]) -> None:
        description = {name: part[name] for name in _DESCRIBED if name in part}
        wrong = _wrong_member(description)
        if wrong:
            raise ValueError(f"its {wrong!r} is damaged")
        key, folder, frames = key_of(description), part["folder"], part["frames"]
        self._describe(key, description)
        head = {**part, "about": key, "frames": None}
        for name in SHARED:
            if not isinstance(part.get(name, []), list):
                raise ValueError(f"its {name!r} are no list")
        self._heads[source, folder] = head
        places = self._places.setdefault(folder, _Places())
        for number, frame in enumerate(frames):
            if not _is_record(frame, "files"):
                raise ValueError(f"entry {number + 1} of its frames is damaged")
            if isinstance(frames, FrameLines):
                places.put(frame["index"], source * _OFFSET + frames.offsets[number] + 1)
            else:  # the manifest was formatted by another program
                self._keep(places, _complete(dict(frame), head))
        for number, frame in enumerate(part.get("failed", ())):
            if not _is_record(frame, "error"):
                raise ValueError(f"entry {number + 1} of 'failed' is damaged")
            self._keep(places, {**frame, "about": key})

    def _keep(self, places: _Places, frame: dict[str, Any]) -> None:
        """Keep a frame that has no line of its own in a file."""
        self._loose.append(frame)
        places.put(frame["index"], -len(self._loose))

    def _describe(self, key: str, description: dict[str, Any]) -> None:
        known = self.descriptions.get(key)
        if known is None or description.get("exposure") is not None:
            self.descriptions[key] = description

    def _read_journal(self, path: Path) -> None:
        source = len(self._files)
        file = path.open("rb")
        self._files.append(file)
        offset, run = 0, 0
        asked: dict[str, Any] = {}
        values: set[int] = set()
        for data in file:
            line = _parsed(data)
            if _is_run(line):
                run, asked = line["run"], line
                self.run = max(self.run, run)
            elif "value" in line:
                values.add(offset)
            elif "is" in line:
                if _is_description(line):
                    check_folder(path, line["is"]["folder"])
                    self._describe(line["about"], line["is"])
            elif _is_frame(line, values) and line["about"] in self.descriptions:
                folder, index = self.descriptions[line["about"]]["folder"], line["index"]
                runs = self._runs.setdefault(folder, _Places())
                if run >= runs.get(index):
                    runs.put(index, run)
                    self._places.setdefault(folder, _Places()).put(index, source * _OFFSET + offset + 1)
            offset += len(data)
        if asked:
            self.asked.append(asked)


_NEW = ("formats", "quality", "depth_scale", "dataset", "views")
"""The members of a `Job.description` that those of earlier versions lack, so that frames are drawn again."""
_DESCRIBED = (
    *("folder", "values", "scene", "parameters", "settings", "exposure", "seed", "sources"),
    *("size", "outputs", "fps", "time", "driver", "driver_version", "software", "version", *_NEW),
)
"""The members of a `Job.description`."""


def check_folder(path: Path, folder: object) -> None:
    """Raise a FireflyError if a manifest or journal names a folder that is not in its own."""
    if not isinstance(folder, str) or folder in (".", "..") or "/" in folder or "\\" in folder:
        raise FireflyError(f"{path} names a folder that is not in its own: {folder!r}")


def _parsed(data: bytes) -> dict[str, Any]:
    """Return a line of a journal; an empty one if it was cut off or damaged."""
    try:
        line = json.loads(data)
    except (ValueError, RecursionError):
        return {}
    return line if isinstance(line, dict) else {}


def _is_run(line: Mapping[str, Any]) -> bool:
    """Return whether a line of a journal is the first one of a run."""
    frames = line.get("frames")
    numbers = [line.get("run"), line.get("jobs"), *(frames if isinstance(frames, list) else ())]
    whole = len(numbers) == 5 and all(type(number) is int for number in numbers) and numbers[-1] != 0
    views = line.get("views", 1)
    return whole and type(views) is int and views >= 1


def _is_description(line: Mapping[str, Any]) -> bool:
    """Return whether a line of a journal holds a whole `Job.description`."""
    described = line["is"]
    if not isinstance(described, dict) or not described.keys() >= set(_DESCRIBED) - set(_NEW):
        return False
    if _wrong_member(described):
        return False
    try:
        return key_of(described) == line.get("about")
    except ValueError:  # it holds a number that JSON does not have
        return False


def _wrong_member(described: Mapping[str, Any]) -> str:
    """Return the name of a member of a description that is not what it can be; "" if there is none."""
    dataset, views = described.get("dataset"), described.get("views")
    if not isinstance(dataset, str | None):
        return "dataset"
    listed = isinstance(views, dict) and ("orbit" in views or isinstance(views.get("views"), list))
    return "" if views is None or listed else "views"


def _is_frame(line: Mapping[str, Any], values: Container[int]) -> bool:
    """Return whether a line of a journal is a frame, of which all `values` are there."""
    whole = _is_record(line, "error" if "error" in line else "files")
    return (
        whole
        and isinstance(line.get("about"), str)
        and ("error" in line or isinstance(line.get("file_sha256"), dict))
        and all(type(line[name]) is int and line[name] in values for name in SHARED if name in line)
    )


def _is_record(frame: object, kind: Literal["files", "error"]) -> bool:
    """Return whether a frame of a journal or a manifest has all that is used of it.

    Manifests of version 0.1.0 have no hashes of files: frames without them count as damaged.
    """
    if not isinstance(frame, dict):
        return False
    index, time = frame.get("index"), frame.get("time")
    numbered = type(index) is int and 0 <= index < MAX_FRAMES and isinstance(time, int | float)
    if kind == "error":
        return numbered and isinstance(frame.get("error"), str)
    return (
        numbered
        and all(isinstance(frame.get(name), dict) for name in ("files", "sha256", "lights"))
        and all(isinstance(frame.get(name, {}), dict) for name in ("file_sha256", "camera"))
        and isinstance(frame.get("instances", []), list)
        and all(isinstance(frame.get(name, []), list | int) for name in ("id_names", "categories"))
    )


def _complete(frame: dict[str, Any], head: Mapping[str, Any]) -> dict[str, Any]:
    """Add to a frame of a manifest what the manifest says of all its frames."""
    frame |= {"about": head["about"], "warnings": head.get("warnings", [])}
    frame.setdefault("file_sha256", {})
    if "id" in frame["files"]:
        frame.setdefault("id_names", head.get("id_names", []))
    if "instances" in frame:
        frame["categories"] = head.get("categories", [])
    return frame


class _Places:
    """A whole number for each of many indices; 0 at first. It takes little more than eight bytes for each."""

    def __init__(self) -> None:
        self._pages: dict[int, array[int]] = {}

    def get(self, index: int) -> int:
        page = self._pages.get(index // _PAGE)
        return page[index % _PAGE] if page is not None else 0

    def put(self, index: int, number: int) -> None:
        page = self._pages.get(index // _PAGE)
        if page is None:
            page = self._pages[index // _PAGE] = array("q", bytes(8 * _PAGE))
        page[index % _PAGE] = number

    def indices(self) -> Iterator[int]:
        """Yield the indices whose number is not 0, in order; a number may be changed meanwhile."""
        for number in sorted(self._pages):
            for place in range(_PAGE):
                if self._pages[number][place]:
                    yield number * _PAGE + place
