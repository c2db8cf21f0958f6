"""Archives with a model: unpacked into a temporary folder, within limits."""

from __future__ import annotations

import bz2
import tarfile
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import IO

from firefly_sample.errors import ModelError
from firefly_sample.model.formats import ARCHIVES, FORMATS, suffix_of
from firefly_sample.model.pixels import one_line

LARGEST_CONTENT = 2**30
"""The most bytes that are unpacked of one archive."""
MOST_FILES = 10_000
"""The most files that are unpacked of one archive."""

_CHUNK = 2**20


@contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """Give the model file in an archive, unpacked with all files beside it, until the end of a block.

    Raises
    ------
    ModelError
        If the archive is damaged, holds too much, or does not hold exactly one model.
    """
    with tempfile.TemporaryDirectory(prefix="firefly-model-") as folder:
        root = Path(folder)
        try:
            with _members(path) as members:
                _unpack(path, members, root)
        except ModelError:
            raise
        except Exception as error:  # zipfile, tarfile and their decoders raise many kinds
            raise ModelError(f"model {path}: damaged archive ({one_line(error)})") from error
        yield _only_model(path, root)


@contextmanager
def _members(path: Path) -> Iterator[Iterator[tuple[str, IO[bytes]]]]:
    """Give the names and the open content of an archive's files, one after another."""
    suffix = suffix_of(path)
    if suffix in ("zip", "zae"):
        with zipfile.ZipFile(path) as archive:
            yield ((info.filename, archive.open(info)) for info in archive.infolist() if not info.is_dir())
    elif suffix.startswith("tar"):
        with tarfile.open(path) as tape:
            yield ((info.name, file) for info in tape if info.isfile() and (file := tape.extractfile(info)))
    else:
        with bz2.open(path) as file:
            yield iter([(path.stem, file)])


def _unpack(path: Path, members: Iterator[tuple[str, IO[bytes]]], root: Path) -> None:
    """Write files below `root`, counting what is there and not what the archive says."""
    left = LARGEST_CONTENT
    for number, (name, file) in enumerate(members):
        if number >= MOST_FILES:
            raise ModelError(
                f"model {path}: the archive holds more than {MOST_FILES} files: unpack it yourself"
            )
        parts = PurePosixPath(name.replace("\\", "/")).parts
        if ".." in parts or not parts or parts[0].startswith("/") or ":" in parts[0]:
            raise ModelError(f"model {path}: the archive has a file outside its own folder: {name[:100]!r}")
        target = root.joinpath(*parts)
        target.parent.mkdir(parents=True, exist_ok=True)
        with file, target.open("wb") as copy:
            while chunk := file.read(_CHUNK):
                left -= len(chunk)
                if left < 0:
                    raise ModelError(
                        f"model {path}: the archive unpacks to more than {LARGEST_CONTENT >> 20} MiB: "
                        "unpack it yourself, and give the model file"
                    )
                copy.write(chunk)


def _only_model(path: Path, root: Path) -> Path:
    """Return the only file of a format with triangles."""
    wanted = {"dae"} if suffix_of(path) == "zae" else _drawable()
    found = sorted(file for file in root.rglob("*") if file.is_file() and suffix_of(file) in wanted)
    if len(found) != 1:
        names = ", ".join(repr(file.relative_to(root).as_posix()) for file in found[:8]) or "none"
        raise ModelError(
            f"model {path}: the archive must hold one model file, and holds {names}: unpack it, and give one"
        )
    return found[0]


def _drawable() -> set[str]:
    known = {suffix for suffix, made in FORMATS.items() if not made.undrawable and suffix not in ARCHIVES}
    return known | {"glb", "gltf"}
