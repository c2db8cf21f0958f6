"""What is derived from models and takes long to make, kept on disk: the first picture comes sooner for it.

Whatever is kept is found by all that it depends on, and what is found is what would be made, to the last
bit. So the folder may be deleted at any time, also by parts; a file that is damaged or of another kind counts
as missing; a folder that cannot be written costs time and nothing else. What was used least lately goes by
itself.
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
"""The environment variable that names another folder, or is "off"."""
LARGEST_CACHE = 2**30
"""Bytes: the forest's models and textures take about 180 MB."""

_SUFFIX = ".derived"
_OWN = re.compile(r"(model|texture)-[0-9a-f]{40}\.derived")
"""Names of files that may be deleted to make room: the keys are those of `fingerprint`."""
_MAGIC = b"firefly_sample derived 2\n"
_FRAME = struct.Struct("<II")  # bytes of the JSON header, CRC-32 of the key and all that follows
_ALIGNED = 64


class Kept(NamedTuple):
    """What a file holds.

    Attributes
    ----------
    about : dict
        Whatever JSON can say.
    arrays : dict of ndarray
        By name; read-only.
    """

    about: dict[str, Any]
    arrays: dict[str, NDArray[Any]]


def derived_folder() -> Path | None:
    """Where things are kept: `VARIABLE`'s folder, else ``firefly_sample/models`` in the user's cache.

    None if the variable is "off", or nobody knows the user's home.
    """
    given = os.environ.get(VARIABLE)
    if not given:
        return user_cache("models")
    try:
        return None if given.lower() == "off" else Path(given).expanduser()
    except RuntimeError:  # no home
        return None


def fingerprint(*parts: object) -> str:
    """Hexadecimal digits that change with any of the parts: bytes, arrays, or what has an exact repr."""
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
    """Return what `save_derived` kept under `key`, or None if it is missing or damaged."""
    folder = derived_folder()
    if folder is None:
        return None
    path = folder / f"{key}{_SUFFIX}"
    if not path.is_file():  # a pipe would be waited for
        return None
    with contextlib.suppress(Exception):  # there is no end to what a wrong file may raise
        kept = _unpack(key, np.fromfile(path, dtype=np.uint8))
        with contextlib.suppress(OSError):
            os.utime(path)  # used lately
        return kept
    return None


def save_derived(key: str, about: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Keep `about` and `arrays` under `key`, if that can be done."""
    folder = derived_folder()
    if folder is None:
        return
    # a full disk, or a folder that cannot be written, costs time and nothing else
    with contextlib.suppress(OSError):
        _write(folder, key, about, arrays)


def _unpack(key: str, content: NDArray[np.uint8]) -> Kept:
    """The parts of a file; any exception if it is not whole, or another key's."""
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
    """Return the checksum's first part, from the key, so that another key's file does not fit."""
    return zlib.crc32(key.encode())


def _write(folder: Path, key: str, about: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write a file whole, and make room for it."""
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
