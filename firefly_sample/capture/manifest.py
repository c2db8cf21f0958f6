"""The manifest of a capture: ``manifest.json``, written and read frame by frame."""

from __future__ import annotations

import json
import os
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, NotRequired, TypedDict, overload

from firefly_sample.errors import FireflyError
from firefly_sample.whole_files import open_whole

_Version = tuple[int, int, int]
MANIFEST = "manifest.json"
FRAME_START = b'{"index":'
"""The start of each line that holds a frame."""
_FRAMES = (b'  "frames": [', b'      "frames": [')
"""The line before the frames: of a capture, and of one in a sweep."""


class FrameEntry(TypedDict):
    """One frame of a manifest.

    Attributes
    ----------
    time : float
        Seconds.
    lights : dict of str to int
        Counts: in_scene, in_view, dropped.
    camera : dict
        Intrinsics, and the camera's pose in three conventions: see `FrameCamera.as_dict`. Frames of earlier
        versions have none.
    files, sha256, file_sha256 : dict of str to str
        By output: its path, relative to the manifest; the `pixel_hash` of the image in it; the hash of the
        file. Of a data set also by the masks' names.
    view : int
        Only with views: the number of the camera.
    instances : list of dict
        Only of data sets that need them: what is in the picture, see ``docs/datasets.md``.
    id_names : list of str
        Only if they differ from the manifest's own.
    """

    index: int
    time: float
    lights: dict[str, int]
    camera: NotRequired[dict[str, Any]]
    files: dict[str, str]
    sha256: dict[str, str]
    file_sha256: dict[str, str]
    view: NotRequired[int]
    instances: NotRequired[list[dict[str, Any]]]
    id_names: NotRequired[list[str]]


class FailedEntry(TypedDict):
    """One frame of a manifest that could not be drawn: its error is one line."""

    index: int
    time: float
    error: str


class Manifest(Mapping[str, Any]):
    """The description of a capture, as in its ``manifest.json``.

    Its frames are read from the file when they are asked for, so that it takes little memory.

    Keys
    ----
    scene : str
        The scene's name as given.
    sources : dict of str to str
        The SHA-256 of each file that the scene is made of.
    parameters, settings : dict
        All parameters of the scene and all of `Settings`, with the values that were used.
    exposure : float
        The setting of that name as a number: if it is "auto", the one that was measured for all frames.
    seed : int or None
        The scene's parameter "seed"; None if it has none.
    size : [int, int]
        Width and height in pixels.
    outputs : list of str
    formats : dict of str to str
        The format of each output's file.
    quality : int or None
        Of JPEG or WebP, if it was given.
    depth_scale : float or None
        Scene units of one code of a 16-bit depth; None if there is none.
    dataset : str or None
    fps, time : float
        Frame i shows the time ``time + i / fps`` in seconds; with n views, this is so for the frames n * i to
        n * i + n - 1.
    views : dict or None
        The cameras that see each moment, if there are others than the scene's own.
    driver, driver_version : str
        The GL renderer and version strings; the version is that of Mesa or of the GPU's driver. Machines with
        the same two strings draw the same bytes.
    software : bool
        True if the driver is a software rasteriser.
    version : str
        The version of firefly_sample.
    warnings : list of str
        Every warning of a frame once, in order: for example the properties of a model that are not drawn.
    id_names : list of str
        Only with the output "id": the name of each value.
    categories : list of str
        Only of data sets that number them: all categories of the scene, sorted; of a sweep, those of all its
        scenes.
    failed : list of FailedEntry
        The frames that could not be drawn.
    documents : dict of str to str
        Only of a data set: the SHA-256 of each file that describes it, by its path.
    file : dict
        Only of a single file, such as a film: its "name", "sha256", and how it was written.
    frames : sequence of FrameEntry
        By index.
    sweep : dict of str to list
        Only if the capture is a sweep: its names and their values.
    captures : list of dict
        Only if the capture is a sweep: for each combination "folder", "values", and the keys above whose
        values it has for itself. These keys are absent from the manifest itself.
    """

    def __init__(self, path: Path, content: dict[str, Any]) -> None:
        self.path = path
        self._content = content

    def __getitem__(self, key: str) -> Any:
        return self._content[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self._content)

    def __len__(self) -> int:
        return len(self._content)

    def __eq__(self, other: object) -> bool:
        return self.as_dict() == (other.as_dict() if isinstance(other, Manifest) else other)

    __hash__ = None  # type: ignore[assignment]

    def as_dict(self) -> dict[str, Any]:
        """Return all of it, with every frame, as plain JSON values."""
        return {name: _plain(value) for name, value in self.items()}

    def captures(self) -> list[Mapping[str, Any]]:
        """Return the captures of a sweep, each with all keys; of another capture, a list of itself."""
        if "captures" not in self:
            return [{"folder": "", "values": {}, **self}]
        common = {name: value for name, value in self.items() if name not in ("captures", "sweep")}
        return [common | capture for capture in self["captures"]]


class FrameLines(Sequence[FrameEntry]):
    """The frames of a manifest, each read from its line in the file when it is asked for.

    `offsets` are the places of the lines in the file, and `version` tells it from another one at its path.
    Reading a frame raises a FireflyError when the file has been replaced or removed.
    """

    def __init__(self, path: Path, offsets: array[int], version: _Version) -> None:
        self._path = path
        self.offsets = offsets
        self._version = version

    def __len__(self) -> int:
        return len(self.offsets)

    @overload
    def __getitem__(self, place: int) -> FrameEntry: ...
    @overload
    def __getitem__(self, place: slice) -> list[FrameEntry]: ...
    def __getitem__(self, place: int | slice) -> FrameEntry | list[FrameEntry]:
        if isinstance(place, slice):
            return [self[one] for one in range(*place.indices(len(self)))]
        with self._opened() as file:
            file.seek(self.offsets[place])
            return _frame(file.readline().strip().removesuffix(b","))

    def __iter__(self) -> Iterator[FrameEntry]:
        return map(_frame, self.lines())

    def lines(self) -> Iterator[bytes]:
        """Read the frames one by one as JSON, for those who do not trust it."""
        with self._opened() as file:
            for offset in self.offsets:
                file.seek(offset)
                yield file.readline().strip().removesuffix(b",")

    def _opened(self) -> IO[bytes]:
        file = _opened(self._path)
        if _version(file) != self._version:
            file.close()
            raise FireflyError(f"{self._path} has changed since it was read: read it again")
        return file

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment]


def read_manifest(folder: str | Path) -> Manifest:
    """Return the manifest of a folder, or the manifest that `folder` itself is.

    Raises
    ------
    FireflyError
        If there is none, or it is not one.
    """
    path = Path(folder)
    path = path / MANIFEST if path.is_dir() else path
    skeleton: list[bytes] = []
    sequences: list[FrameLines] = []
    with _opened(path) as file:
        offset = 0
        for line in file:
            if line.lstrip().startswith(FRAME_START) and sequences:
                sequences[-1].offsets.append(offset + len(line) - len(line.lstrip()))
            else:
                skeleton.append(line)
                if line.rstrip() in _FRAMES:
                    sequences.append(FrameLines(path, array("Q"), _version(file)))
            offset += len(line)
    try:
        content = json.loads(b"".join(skeleton))
        if not isinstance(content, dict):
            raise ValueError("it is not an object")
        wholes = [content] if "frames" in content else list(content["captures"])
        if not all(isinstance(whole.get("frames"), list) for whole in wholes):
            raise ValueError("its frames are not a list")
        if any(whole["frames"] for whole in wholes):  # on more lines, as other programs write them
            return Manifest(path, json.loads(path.read_bytes()))
        if any(sequences):
            if len(sequences) != len(wholes):
                raise ValueError("its frames are not where they belong")
            for whole, frames in zip(wholes, sequences, strict=True):
                whole["frames"] = frames
    except KeyError as error:
        raise FireflyError(f"{path} is not a manifest: it has no {error}") from error
    except (ValueError, TypeError, AttributeError, RecursionError) as error:
        raise FireflyError(f"{path} is not a manifest: {error}") from error
    return Manifest(path, content)


def write_manifest(
    path: Path,
    head: Mapping[str, Any],
    parts: Iterable[tuple[Mapping[str, Any], Iterable[FrameEntry]]],
    sweep: bool = False,
) -> None:
    """Write a manifest, whole or not at all, frame by frame.

    Parameters
    ----------
    path : Path
    head : mapping
        What comes first.
    parts : iterable of (mapping, iterable of FrameEntry)
        The captures: one, whose keys follow those of `head`, or those of a sweep.
    sweep : bool
    """
    with open_whole(path, sync=True) as file:

        def write(text: str) -> None:
            file.write(text.encode())

        def write_part(keys: Mapping[str, Any], frames: Iterable[FrameEntry], indent: str) -> None:
            write(_members(keys, indent))
            write(f'{indent}"frames": [')
            separator = "\n"
            for frame in frames:
                write(f"{separator}{indent}  {json.dumps(frame, allow_nan=False)}")
                separator = ",\n"
            write(f"\n{indent}]\n")

        write("{\n")
        if not sweep:
            ((keys, frames),) = parts
            write_part({**head, **keys}, frames, "  ")
            write("}\n")
            return
        write(_members(head, "  "))
        write('  "captures": [')
        separator = "\n"
        for keys, frames in parts:
            write(f"{separator}    {{\n")
            write_part(keys, frames, "      ")
            write("    }")
            separator = ",\n"
        write("\n  ]\n}\n")


def _members(keys: Mapping[str, Any], indent: str) -> str:
    """Return the members of an object as lines, each with a comma at its end."""
    lines = []
    for name, value in keys.items():
        text = json.dumps(value, indent=2, allow_nan=False).replace("\n", f"\n{indent}")
        lines.append(f"{indent}{json.dumps(name)}: {text},\n")
    return "".join(lines)


def _frame(line: bytes) -> FrameEntry:
    frame: FrameEntry = json.loads(line)
    return frame


def _version(file: IO[bytes]) -> _Version:
    """Return what differs between a file and another one that took its place."""
    status = os.fstat(file.fileno())
    return status.st_ino, status.st_size, status.st_mtime_ns


def _opened(path: Path) -> IO[bytes]:
    try:
        return path.open("rb")
    except OSError as error:
        raise FireflyError(f"cannot read {path}: {error.strerror or error}") from error


def _plain(value: Any) -> Any:
    """Return JSON values in which sequences of frames are lists."""
    if isinstance(value, Mapping):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(one) for one in value]
    return value
