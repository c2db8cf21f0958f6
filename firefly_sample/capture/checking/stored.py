"""Captures on disk: the frames of a manifest, checked before they are trusted, and the files they name."""

from __future__ import annotations

import hashlib
import json
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

from firefly_sample.capture.datasets.masks import image_info, read_mask
from firefly_sample.capture.files import pixel_hash
from firefly_sample.capture.layout import names_in
from firefly_sample.capture.manifest import MANIFEST, FrameLines, Manifest, read_manifest
from firefly_sample.capture.names import FileNames
from firefly_sample.encoding.formats import Encoding
from firefly_sample.errors import FireflyError, MissingPackageError
from firefly_sample.frame import OUTPUTS, Image
from firefly_sample.settings import to_whole
from firefly_sample.whole_files import is_unfinished

_DIGEST = re.compile(r"[0-9a-f]{64}")


class StoredFile(NamedTuple):
    """A file of a frame: its path, as in the manifest and in full, and the hashes in the manifest.

    Manifests of version 0.1.0 have no hash of the file. `names` tell how it is decoded.
    """

    name: str
    path: Path
    pixels: str
    file: str | None
    names: FileNames

    def decode(self, output: str, content: bytes) -> Image:
        """Return an image in the file; raise any exception if the file is damaged."""
        key = self.names.key_of(output)
        if key in self.names.encoding.files():
            return self.names.encoding.decode(key, content)[output]
        if output in OUTPUTS:  # version 0.1.0 names neither formats nor outputs
            return Encoding.of([output]).decode(output, content)[output]
        return read_mask(content)


class FilmImage(NamedTuple):
    """A frame of a film, decoded: the film's path, the hash of the pixels, and the pixels."""

    path: Path
    pixels: str
    image: Image

    def decode(self, output: str, content: bytes) -> Image:
        """Return the image; as of a `StoredFile`."""
        return self.image


@dataclass(frozen=True)
class StoredFrame:
    """A frame of a manifest: its number, its files by output, and the names of its ids."""

    index: int
    files: Mapping[str, StoredFile | FilmImage]
    id_names: Sequence[str]


@dataclass
class StoredCapture:
    """One capture of a manifest: the only one, or one of a sweep.

    Attributes
    ----------
    root : Path
        The folder of the manifest.
    folder : str
        Where its files are, relative to `root`: "" if the capture is no sweep.
    keys : mapping
        What the manifest says of it.
    errors : list of str
        What is wrong with the frames of the manifest, as far as they were read.
    names : FileNames
        Those of its files.
    """

    root: Path
    folder: str
    keys: Mapping[str, Any]
    errors: list[str]
    names: FileNames

    def __len__(self) -> int:
        return len(self.keys["frames"])

    def failed(self) -> dict[int, str]:
        """Return the frames that could not be drawn, with their errors."""
        entries = self.keys.get("failed", [])
        found: dict[int, str] = {}
        for entry in entries if isinstance(entries, list) else [entries]:
            index = to_whole(entry.get("index")) if isinstance(entry, dict) else None
            if index is None:
                self.errors.append("an entry of 'failed' has no 'index'")
            else:
                found[index] = str(entry.get("error", "unknown error"))
        return found

    def frames(self) -> Iterator[StoredFrame]:
        """Read the frames in order; those that cannot be read are left out and named in `errors`."""
        last = -1
        entries = self.keys["frames"]
        if isinstance(entries, list):  # earlier versions wrote frames in the order of drawing
            entries = sorted(entries, key=_index)
        for number, entry in enumerate(entries.lines() if isinstance(entries, FrameLines) else entries, 1):
            try:
                frame = self._frame(json.loads(entry) if isinstance(entry, bytes) else entry)
                if frame.index <= last:
                    raise ValueError("it is not in order")
            except (ValueError, TypeError, RecursionError) as error:
                self.errors.append(f"entry {number} of its frames is damaged: {error}")
                continue
            last = frame.index
            yield frame

    def _frame(self, entry: object) -> StoredFrame:
        index = _index(entry)
        if not isinstance(entry, dict) or index < 0:
            raise ValueError("it has no 'index'")
        names, pixels = (_texts(entry, key) for key in ("files", "sha256"))
        hashes = _texts(entry, "file_sha256") if "file_sha256" in entry else {}
        if not names and is_film(self.keys):
            pixels = {}
        if names.keys() != pixels.keys() or (hashes and hashes.keys() != names.keys()):
            raise ValueError(f"frame {index}: files and hashes do not have the same outputs")
        for digest in (*pixels.values(), *hashes.values()):
            if not _DIGEST.fullmatch(digest):
                raise ValueError(f"frame {index}: {digest[:80]!r} is not a SHA-256")
        if isinstance(self.keys.get("file"), dict):  # a still picture, which may have been renamed
            names = dict.fromkeys(names, self.keys["file"].get("name", ""))
        files: dict[str, StoredFile | FilmImage] = {
            output: StoredFile(
                name, path_inside(self.root, name), pixels[output], hashes.get(output), self.names
            )
            for output, name in names.items()
        }
        id_names = entry.get("id_names", self.keys.get("id_names", []))
        if not isinstance(id_names, list) or not all(isinstance(name, str) for name in id_names):
            raise ValueError("'id_names' are not names")
        return StoredFrame(index, files, id_names)


def is_film(keys: Mapping[str, Any]) -> bool:
    """Return whether a manifest describes a film, whose frames have no files; a still picture's do."""
    about = keys.get("file")
    return isinstance(about, dict) and "fps" in about


def _index(entry: object) -> int:
    """Return the number of a frame's entry; -1 if it has none."""
    index = to_whole(entry.get("index")) if isinstance(entry, dict) else None
    return -1 if index is None else index


def _texts(entry: Mapping[str, Any], key: str) -> dict[str, str]:
    texts = entry.get(key)
    if not isinstance(texts, dict) or not all(isinstance(text, str) for text in texts.values()):
        raise ValueError(f"frame {entry['index']} has no {key!r}" if texts is None else f"{key!r} is wrong")
    return texts


def path_inside(root: Path, name: object) -> Path:
    """Return the path of a file or folder of a manifest; raise a ValueError if it is not inside `root`."""
    if not isinstance(name, str) or not name or "\0" in name:
        raise ValueError(f"{name!r} is not the name of a file")
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts:
        raise ValueError(f"{name!r} is not inside the capture's folder")
    return root / path


def stored_captures(folder: str | Path) -> list[StoredCapture]:
    """Return the captures that a folder's manifest describes, one, or those of a sweep.

    Raises
    ------
    FireflyError
        If there is no manifest, or it is damaged as a whole.
    """
    path = Path(folder)
    if path.is_file() and path.suffix != ".json":
        raise FireflyError(f"{folder} is a file: give the folder of a capture, in which {MANIFEST} is")
    manifest = read_manifest(folder)
    found = []
    for keys in _parts(manifest):
        keys = _with_own_name(manifest.path, keys)
        inside = keys.get("folder", "")
        try:
            if inside != "":
                path_inside(manifest.path.parent, inside)
            elif "captures" in manifest:
                raise ValueError("a capture of a sweep has no 'folder'")
        except ValueError as error:
            raise FireflyError(f"{manifest.path} is damaged: {error}") from error
        try:
            names = FileNames.of(keys)
        except FireflyError as error:
            raise FireflyError(f"{manifest.path}: {error}") from error
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            what = f"{type(error).__name__}: {error}"
            raise FireflyError(f"{manifest.path} is damaged: {what}") from error
        found.append(StoredCapture(manifest.path.parent, inside, keys, [], names))
    return found


def _with_own_name(path: Path, keys: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return what a manifest says; a single file that was renamed with its manifest has its new name."""
    about = keys.get("file")
    if not isinstance(about, dict) or path.name == MANIFEST or path.suffix != ".json":
        return keys
    return {**keys, "file": {**about, "name": path.name.removesuffix(".json")}}


def _parts(manifest: Manifest) -> list[Mapping[str, Any]]:
    captures = manifest.captures()
    if len({capture.get("folder") for capture in captures if isinstance(capture.get("folder"), str)}) < len(
        captures
    ):
        raise FireflyError(f"{manifest.path} is damaged: its captures do not have a 'folder' each")
    return captures


class Listed:
    """The files that a manifest lists, in little memory: one byte for each frame's usual file."""

    def __init__(self, names: FileNames) -> None:
        self._layout = names.layout
        self._usual: dict[tuple[str, str], bytearray] = {}
        self._others: set[str] = set()

    def add(self, name: str) -> None:
        """Add a file, by its path relative to the folder of its capture."""
        named = self._layout.parse(name)
        if named is None:
            self._others.add(name)
            return
        key, index = named
        marks = self._usual.setdefault((key, PurePosixPath(name).suffix), bytearray())
        marks.extend(bytes(max(0, index + 1 - len(marks))))
        marks[index] = 1

    def stale(self, folder: Path) -> list[str]:
        """Return the files in `folder` that have names as captures give them, and are not listed."""
        found = []
        for name in names_in(folder, self._layout):
            named = self._layout.parse(name)
            if named is None:
                if is_unfinished(PurePosixPath(name).name):
                    found.append(name)
                continue
            key, index = named
            marks = self._usual.get((key, PurePosixPath(name).suffix), b"")
            if not (index < len(marks) and marks[index]) and name not in self._others:
                found.append(name)
        return sorted(found)


class Checked(NamedTuple):
    """A file that was compared with its manifest.

    `kind` says what is wrong, `text` describes it; both are "" if nothing is. `content` is that of the file;
    None if it cannot be read. `rewritten` is True if only the file differs, and not its pixels.
    """

    kind: str
    text: str
    content: bytes | None
    rewritten: bool = False


def without_content(checked: Mapping[str, Checked]) -> dict[str, Checked]:
    """Return what was found about files, without their bytes."""
    return {output: one._replace(content=None) for output, one in checked.items()}


def check_frame(frame: StoredFrame) -> dict[str, Checked]:
    """Compare the files of a frame with its manifest: by their hashes, and if those differ, by their pixels.

    A file that holds several outputs is read once. Raises a MissingPackageError if a file whose hash differs
    cannot be decoded here.
    """
    found: dict[str, Checked] = {}
    read: dict[Path, Checked] = {}
    for output, file in frame.files.items():
        if isinstance(file, FilmImage):
            found[output] = Checked("", "", b"")
            continue
        if file.path not in read:
            read[file.path] = _read(file)
        found[output] = _check(output, file, read[file.path])
    return found


def _read(file: StoredFile) -> Checked:
    """Return the content of a file; its `kind` is "?" if the hash differs."""
    try:
        if not stat.S_ISREG(file.path.stat().st_mode):  # reading from a pipe would wait for ever
            return Checked("missing", "is not a file", None)
        content = file.path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return Checked("missing", "is missing", None)
    except OSError as error:
        return Checked("missing", f"cannot be read: {error.strerror or error}", None)
    if file.file is not None and hashlib.sha256(content).hexdigest() == file.file:
        return Checked("", "", content)
    if not content:
        return Checked("damaged", "is damaged: it is empty", None)
    return Checked("?", "", content)


def _check(output: str, file: StoredFile, read: Checked) -> Checked:
    if read.kind != "?" or read.content is None:
        return read
    if image_info(output) is None:
        return Checked("unknown", f"cannot be checked: this version has no output {output!r}", None)
    try:
        image = file.decode(output, read.content)
    except MissingPackageError:
        raise
    except Exception:  # noqa: BLE001 - a decoder may raise anything
        return Checked("damaged", "is damaged: it cannot be decoded", None)
    if not _fits(output, image) or pixel_hash(image) != file.pixels:
        return Checked("changed", "has other pixels than its manifest says", read.content)
    return Checked("", "", read.content, rewritten=file.file is not None)


def _fits(output: str, image: Image) -> bool:
    info = image_info(output)
    channels = image.shape[2] if image.ndim == 3 else 1
    return (
        info is not None
        and image.dtype.newbyteorder("=") == info.dtype
        and image.ndim in (2, 3)
        and channels == info.channels
    )
