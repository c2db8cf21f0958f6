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
import os
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.cache_files import drop_old, keep_whole

__all__ = ["VARIABLE", "Kept", "derived_folder", "fingerprint", "load_derived", "save_derived"]

VARIABLE = "FIREFLY_MODEL_CACHE"
"""The environment variable that names another folder, or is "off"."""
LARGEST_CACHE = 2**30
"""Bytes: the forest's models and textures take about 180 MB."""

_SUFFIX = ".derived"
_MAGIC = b"firefly_sample derived 1\n"
_FRAME = struct.Struct("<II")  # bytes of the JSON header, CRC-32 of all that follows
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

    That is $XDG_CACHE_HOME, or ~/.cache. None if the variable is "off", or nobody knows the user's home.
    """
    given = os.environ.get(VARIABLE)
    base = os.environ.get("XDG_CACHE_HOME")
    try:
        if given:
            return None if given.lower() == "off" else Path(given).expanduser()
        return Path(base or Path.home() / ".cache") / "firefly_sample" / "models"
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
    """What `save_derived` kept under `key`; None if there is nothing, or it is not whole."""
    folder = derived_folder()
    if folder is None:
        return None
    path = folder / f"{key}{_SUFFIX}"
    try:
        content = np.fromfile(path, dtype=np.uint8)
        kept = _unpack(content)
        with contextlib.suppress(OSError):
            os.utime(path)  # used lately
    except (OSError, ValueError, KeyError, TypeError, struct.error):
        return None
    return kept


def save_derived(key: str, about: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Keep `about` and `arrays` under `key`, if that can be done."""
    folder = derived_folder()
    if folder is None:
        return
    # a full disk, or a folder that cannot be written, costs time and nothing else
    with contextlib.suppress(OSError):
        _write(folder / f"{key}{_SUFFIX}", about, arrays)


def _unpack(content: NDArray[np.uint8]) -> Kept:
    """The parts of a file. Raises ValueError, KeyError, TypeError or struct.error if it is not whole."""
    content.setflags(write=False)
    start = len(_MAGIC) + _FRAME.size
    if content[: len(_MAGIC)].tobytes() != _MAGIC:
        raise ValueError("another kind of file")
    header_bytes, checksum = _FRAME.unpack(content[len(_MAGIC) : start].tobytes())
    if zlib.crc32(content[start:].data) != checksum:
        raise ValueError("damaged")
    header = json.loads(content[start : start + header_bytes].tobytes())
    offset = _aligned(start + header_bytes)
    arrays = {}
    for name, code, shape in header["arrays"]:
        dtype = np.dtype(code)
        end = offset + dtype.itemsize * int(np.prod(shape, dtype=np.int64))
        arrays[name] = content[offset:end].view(dtype).reshape(shape)
        offset = _aligned(end)
    return Kept(header["about"], arrays)


def _write(path: Path, about: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write a file whole, and make room for it."""
    rows = {name: np.asarray(array, order="C") for name, array in arrays.items()}
    described = [(name, array.dtype.str, array.shape) for name, array in rows.items()]
    header = json.dumps({"about": about, "arrays": described}).encode()
    parts: list[Any] = [header]
    position = len(_MAGIC) + _FRAME.size + len(header)
    for array in rows.values():
        parts.append(bytes(_aligned(position) - position))
        parts.append(array.reshape(-1).view(np.uint8).data)
        position = _aligned(position) + array.nbytes
    checksum = 0
    for part in parts:
        checksum = zlib.crc32(part, checksum)
    with keep_whole(path) as file:
        file.write(_MAGIC + _FRAME.pack(len(header), checksum))
        for part in parts:
            file.write(part)
    drop_old(path, LARGEST_CACHE)


def _aligned(position: int) -> int:
    return -(-position // _ALIGNED) * _ALIGNED
