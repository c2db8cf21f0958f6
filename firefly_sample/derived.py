"""A cache on disk for data derived from models, which shortens the time to the first picture.

A key is made of everything the data depends on, and cached data is identical to new data, to the last bit. So
the folder, or files in it, may be deleted at any time; a damaged or foreign file counts as missing; a folder
that cannot be written only costs time. The least recently used files are deleted automatically.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import operator
import os
import re
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.cache_files import drop_old, keep_whole, user_cache

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


class Kept(NamedTuple):
    """The contents of a file.

    Attributes
    ----------
    about : dict
        Data that JSON can represent.
    arrays : dict of ndarray
        By name; read-only.
    """

    about: dict[str, Any]
    arrays: dict[str, NDArray[Any]]


def derived_folder() -> Path | None:
    """Return the cache folder: `VARIABLE`'s, or else ``firefly_sample/models`` in the user's cache.

    None if the variable is "off", or there is no home folder.
    """
    given = os.environ.get(VARIABLE)
    if not given:
        return user_cache("models")
    try:
        return None if given.lower() == "off" else Path(given).expanduser()
    except RuntimeError:  # no home
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
    with contextlib.suppress(Exception):  # a damaged file may raise anything
        kept = _unpack(key, np.fromfile(path, dtype=np.uint8))
        with contextlib.suppress(OSError):
            os.utime(path)  # the time of the last use
        return kept
    return None


def save_derived(key: str, about: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write `about` and `arrays` under `key`, if possible."""
    folder = derived_folder()
    if folder is None:
        return
    # a full disk, or a folder that cannot be written, only costs time
    with contextlib.suppress(OSError):
        _write(folder, key, about, arrays)


def _unpack(key: str, content: NDArray[np.uint8]) -> Kept:
    """Return the contents of a file; raise any exception if it is damaged or has another key."""
    content.setflags(write=False)
    start = len(_MAGIC) + _FRAME.size
    if content[: len(_MAGIC)].tobytes() != _MAGIC:
        raise ValueError("another kind of file")
    header_bytes, checksum = _FRAME.unpack(content[len(_MAGIC) : start].tobytes())
    if zlib.crc32(content[start:].data, _seed(key)) != checksum:
        raise ValueError("damaged")
    header = json.loads(content[start : start + header_bytes].tobytes())
    end = start + header_bytes
    arrays = {}
    for name, code, shape in header["arrays"]:
        offset, dtype = _aligned(end), np.dtype(code)
        end = offset + dtype.itemsize * math.prod(map(operator.index, shape))
        if dtype.str != code or min(shape, default=0) < 0 or name in arrays:
            raise ValueError("no such array")
        arrays[name] = content[offset:end].view(dtype).reshape(shape)
    if end != len(content):
        raise ValueError("other arrays")
    return Kept(header["about"], arrays)


def _seed(key: str) -> int:
    """Return the checksum of the key, with which that of the file begins."""
    return zlib.crc32(key.encode())


def _write(folder: Path, key: str, about: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write a file, and make room for it."""
    path = folder / f"{key}{_SUFFIX}"
    rows = {name: np.asarray(array, order="C") for name, array in arrays.items()}
    described = [(name, array.dtype.str, array.shape) for name, array in rows.items()]
    header = json.dumps({"about": about, "arrays": described}).encode()
    parts: list[Any] = [header]
    position = len(_MAGIC) + _FRAME.size + len(header)
    for array in rows.values():
        parts.append(bytes(_aligned(position) - position))
        parts.append(array.reshape(-1).view(np.uint8).data)
        position = _aligned(position) + array.nbytes
    checksum = _seed(key)
    for part in parts:
        checksum = zlib.crc32(part, checksum)
    with keep_whole(path) as file:
        file.write(_MAGIC + _FRAME.pack(len(header), checksum))
        for part in parts:
            file.write(part)
    drop_old(path, _OWN, LARGEST_CACHE)


def _aligned(position: int) -> int:
    return -(-position // _ALIGNED) * _ALIGNED
