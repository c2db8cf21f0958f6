"""Files in the user's cache: data derived from models, which shortens the time to the first picture.

A key is made of everything the data depends on, and cached data is identical to new data, to the last bit. So
the folder, or files in it, may be deleted at any time; a damaged or foreign file counts as missing; a folder
that cannot be written only costs time. Files are written completely or not at all. The least recently used
ones are deleted, but only those with this package's names: the folder may contain others.
"""

from __future__ import annotations

import hashlib
import json
import math
import operator
import os
import re
import stat
import struct
import tempfile
import time
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

VARIABLE = "FIREFLY_MODEL_CACHE"
"""The environment variable with the name of another folder, or "off"."""
LARGEST_CACHE = 2**30
"""Bytes: the forest's models and textures take about 180 MB."""

_SUFFIX = ".derived"
_OWN = re.compile(r"(model|texture)-[0-9a-f]{40}\.derived")
"""The names of files that may be deleted to make room."""
_MAGIC = b"firefly_sample derived 2\n"
_FRAME = struct.Struct("<II")  # bytes of the JSON header, CRC-32 of the key and all that follows
_ALIGNED = 64
_ABANDONED = 86_400.0
"""Seconds after which an unfinished file is deleted, because its writer has died."""
_UNFINISHED = re.compile(r"\.firefly_sample-\w{8}\.tmp")
"""The names that `keep_whole` gives while it writes."""


class Kept(NamedTuple):
    """The contents of a file: data that JSON can represent, and read-only arrays by name."""

    about: dict[str, Any]
    arrays: dict[str, NDArray[Any]]


def derived_folder() -> Path | None:
    """Return the cache folder: `VARIABLE`'s, or else ``firefly_sample/models`` in the user's cache.

    None if the variable is "off", or there is no home folder.
    """
    given = os.environ.get(VARIABLE)
    if not given:
        return user_cache("models")
    with suppress(RuntimeError):  # no home
        return None if given.lower() == "off" else Path(given).expanduser()
    return None


def fingerprint(*parts: object) -> str:
    """Return a hash, in hexadecimal, of bytes, arrays, and objects that have an exact repr."""
    state = hashlib.sha256()
    for part in parts:
        if isinstance(part, np.ndarray):
            state.update(repr((part.dtype.str, part.shape)).encode())
            state.update(np.ascontiguousarray(part).data)
        elif isinstance(part, bytes):
            state.update(repr(len(part)).encode())
            state.update(part)
        else:
            state.update(repr(part).encode())
        state.update(b"\0")
    return state.hexdigest()[:40]


def load_derived(key: str) -> Kept | None:
    """Return the contents that `save_derived` wrote under `key`, or None if missing or damaged."""
    folder = derived_folder()
    if folder is None:
        return None
    path = folder / f"{key}{_SUFFIX}"
    if not path.is_file():  # reading a pipe would block
        return None
    with suppress(Exception):  # a damaged file may raise anything
        kept = _unpack(key, np.fromfile(path, dtype=np.uint8))
        with suppress(OSError):
            os.utime(path)  # the time of the last use
        return kept
    return None


def _unpack(key: str, content: NDArray[np.uint8]) -> Kept:
    """Return the contents of a file; raise any exception if it is damaged or has another key."""
    content.setflags(write=False)
    start = len(_MAGIC) + _FRAME.size
    if content[: len(_MAGIC)].tobytes() != _MAGIC:
        raise ValueError("another kind of file")
    header_bytes, checksum = _FRAME.unpack(content[len(_MAGIC) : start].tobytes())
    if zlib.crc32(content[start:].data, zlib.crc32(key.encode())) != checksum:
        raise ValueError("damaged")
    end = start + header_bytes
    header = json.loads(content[start:end].tobytes())
    arrays = {}
    for name, code, shape in header["arrays"]:
        offset, dtype = end + -end % _ALIGNED, np.dtype(code)
        end = offset + dtype.itemsize * math.prod(map(operator.index, shape))
        if dtype.str != code or min(shape, default=0) < 0 or name in arrays:
            raise ValueError("no such array")
        arrays[name] = content[offset:end].view(dtype).reshape(shape)
    if end != len(content):
        raise ValueError("other arrays")
    return Kept(header["about"], arrays)


def save_derived(key: str, about: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write `about` and `arrays` under `key`, if possible."""
    folder = derived_folder()
    if folder is None:
        return
    rows = {name: np.asarray(array, order="C") for name, array in arrays.items()}
    described = [(name, array.dtype.str, array.shape) for name, array in rows.items()]
    header = json.dumps({"about": about, "arrays": described}).encode()
    parts: list[Any] = [header]
    end = len(_MAGIC) + _FRAME.size + len(header)
    for array in rows.values():
        gap = -end % _ALIGNED
        parts += [bytes(gap), array.reshape(-1).view(np.uint8).data]
        end += gap + array.nbytes
    checksum = zlib.crc32(key.encode())
    for part in parts:
        checksum = zlib.crc32(part, checksum)
    # a full disk, or a folder that cannot be written, only costs time
    with suppress(OSError):
        path = folder / f"{key}{_SUFFIX}"
        with keep_whole(path) as file:
            file.writelines([_MAGIC, _FRAME.pack(len(header), checksum), *parts])
        drop_old(path, _OWN, LARGEST_CACHE)


def user_cache(kind: str) -> Path | None:
    """Return the folder ``firefly_sample/<kind>`` in the user's cache; None if there is no home folder.

    The cache is $XDG_CACHE_HOME, or ~/.cache. A relative $XDG_CACHE_HOME does not count, as the XDG Base
    Directory Specification has it.
    """
    given = os.environ.get("XDG_CACHE_HOME", "")
    try:
        base = Path(given) if os.path.isabs(given) else Path.home() / ".cache"
    except RuntimeError:  # no home
        return None
    return base / "firefly_sample" / kind if base.is_absolute() else None


@contextmanager
def keep_whole(path: Path) -> Iterator[IO[bytes]]:
    """Open a temporary file that becomes `path` at the end: readers find all of it or nothing.

    Raises
    ------
    OSError
        If it cannot be written; the temporary file is removed.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".firefly_sample-", suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        os.replace(temporary, path)
    except BaseException:
        with suppress(OSError):
            Path(temporary).unlink()
        raise


def drop_old(newest: Path, own: re.Pattern[str], largest: int) -> None:
    """Delete the least recently used files of one kind until the rest fits; never the newest.

    Parameters
    ----------
    newest : Path
        The file that was just written.
    own : re.Pattern
        Matches the names of the files of its kind, and no others.
    largest : int
        Bytes that all of them may take.
    """
    files, now = [], time.time()
    for path in newest.parent.iterdir():
        with suppress(OSError):  # another process may delete, too
            status = path.lstat()
            if not stat.S_ISREG(status.st_mode):
                continue
            if own.fullmatch(path.name):
                files.append((path != newest, -status.st_mtime_ns, status.st_size, path))
            elif _UNFINISHED.fullmatch(path.name) and now - status.st_mtime > _ABANDONED:
                path.unlink()
    total = 0
    for _, _, size, path in sorted(files):
        total += size
        if total > largest and path != newest:
            with suppress(OSError):
                path.unlink()
