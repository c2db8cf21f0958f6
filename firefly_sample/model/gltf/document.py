"""An open glTF file: its JSON with checked access, its buffers, and the files beside it.

"glTF 2.0" is Khronos' specification of that name; numbers of sections are its.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import ModelError
from firefly_sample.model.gltf.compression import decode_meshopt
from firefly_sample.model.gltf.container import (
    decode_data_uri,
    is_data_uri,
    read_file,
    relative_path,
    split_container,
)
from firefly_sample.model.gltf.json_object import JsonObject, shown

Bytes = NDArray[np.uint8]
FREE_NUMBERS = 16_000_000
"""Numbers that any file may become, be it ever so small."""
NUMBERS_PER_BYTE = 64
"""Numbers that each byte of a file may become besides; for many morph targets 34."""


class Document:
    """An open file. Nothing that a count in it claims is allocated before the bytes are there.

    Attributes
    ----------
    path : Path
    json : dict
        The whole JSON, unchecked.
    root : JsonObject
        The same, with checked access.
    files : dict of str to bytes
        All bytes that were read so far by the name of their file, "" for the file itself. Together they
        determine what it contains.
    """

    def __init__(self, path: Path, json: dict[str, Any], binary: memoryview | None, data: bytes) -> None:
        self.path = path
        self.json = json
        self.root = JsonObject(self, json, "")
        self.files: dict[str, bytes] = {"": data}
        self._binary = binary
        self._buffers: dict[int, Bytes] = {}
        self._decoded: dict[int, Bytes] = {}
        self._claimed = 0
        self._check_version()

    @classmethod
    def open(cls, path: str | Path) -> Document:
        """Open a .glb or .gltf file; raise ModelError if it is missing, damaged or not of glTF 2."""
        path = Path(path)
        data = read_file(path)
        json, binary = split_container(path, data)
        return cls(path, json, binary, data)

    def _check_version(self) -> None:
        """Refuse versions that this reader does not know, by the rules of section 3.2.

        A later minor version is readable unless `minVersion` says that it is not.
        """
        asset = self.root.required_object("asset")
        version = asset.text("version")
        needed = asset.text("minVersion", version)
        for key, value in (("version", version), ("minVersion", needed)):
            if not re.fullmatch(r"[0-9]{1,9}\.[0-9]{1,9}", value):
                raise asset.error(key, f"must be a version such as 2.0, got {shown(value)}")
        major, minor = map(int, needed.split("."))
        if major != 2 or ("minVersion" in asset and minor > 0):
            raise asset.error("", f"the file needs glTF {needed}, expected 2.0: export it as glTF 2.0")

    def error(self, where: str, what: str) -> ModelError:
        """Return an error that names the file and a place in its JSON."""
        return ModelError(f"model {self.path}: {where}: {what}" if where else f"model {self.path}: {what}")

    # lists of the file

    def items(self, kind: str) -> list[JsonObject]:
        """Return a list of the file, for example "materials", which is empty if there is none."""
        return self.root.objects(kind)

    def count(self, kind: str) -> int:
        """Return the length of a list of the file."""
        found = self.json.get(kind, [])
        if not isinstance(found, list):
            raise self.error(kind, f"must be a list, got {shown(found)}")
        return len(found)

    def item(self, kind: str, index: object, where: str) -> JsonObject:
        """Return an object of a list of the file; `where` is the place that refers to it."""
        number = self.as_index(index, kind, where)
        return self.as_object(self.json[kind][number], f"{kind}[{number}]")

    def extensions_required(self) -> tuple[str, ...]:
        """Return the names of the extensions without which the file cannot be read."""
        return self._names("extensionsRequired")

    def extensions_used(self) -> tuple[str, ...]:
        """Return the names of the extensions that occur in the file."""
        return self._names("extensionsUsed")

    def _names(self, key: str) -> tuple[str, ...]:
        names = self.json.get(key, [])
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise self.error(key, "must be a list of names")
        return tuple(JsonObject(self, {"name": name}, key).text("name") for name in names)

    # values of JSON

    def as_whole(self, value: object, where: str, least: int = 0, most: int | None = None) -> int:
        """Return a JSON value that must be a whole number of `least` to `most`."""
        if isinstance(value, float) and value.is_integer():  # 1.0 is a whole number in JSON
            value = int(value)
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.error(where, f"must be a whole number, got {shown(value)}")
        if value < least or (most is not None and value > most):
            raise self.error(where, f"must be {_limits(least, most)}, got {shown(value)}")
        return value

    def as_number(self, value: object, where: str, least: float = -math.inf, most: float = math.inf) -> float:
        """Return a JSON value that must be a finite number of `least` to `most`."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(where, f"must be a number, got {shown(value)}")
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise self.error(where, "must be a finite number, got one that is too large")
        if not least <= number <= most:
            raise self.error(where, f"must be {_limits(least, most)}, got {number:g}")
        return number

    def as_object(self, value: object, where: str) -> JsonObject:
        """Return a JSON value that must be an object."""
        if not isinstance(value, dict):
            raise self.error(where, f"must be an object, got {shown(value)}")
        return JsonObject(self, value, where)

    def as_index(self, value: object, kind: str, where: str) -> int:
        """Return a JSON value that must be an index into a list of the file."""
        index, count = self.as_whole(value, where), self.count(kind)
        if index >= count:
            raise self.error(where, f"refers to {kind}[{shown(index)}], but the file has {count} {kind}")
        return index

    # memory

    def claim(self, count: int, where: str) -> None:
        """Count numbers that are about to be made; raise ModelError if they outgrow the file.

        Every byte of a file may become many numbers, but not without limit: a small file can name the same
        bytes, or zeros, any number of times.
        """
        self._claimed += count
        limit = FREE_NUMBERS + NUMBERS_PER_BYTE * sum(map(len, self.files.values()))
        if self._claimed > limit:
            raise self.error(where, f"too large: a file of this size may hold at most {limit:,} numbers")

    # bytes

    def read_uri(self, uri: str, where: str) -> tuple[bytes, str]:
        """Return the bytes that a URI names, and their media type, which is empty if it does not say.

        It is a data URI, or a file in the model's folder or below; others raise ModelError.
        """
        if is_data_uri(uri):
            try:
                return decode_data_uri(uri)
            except ValueError as error:
                raise self.error(where, str(error)) from None
        try:
            name = relative_path(uri)
        except ValueError as reason:
            raise self.error(where, f"{shown(uri)} {reason}") from None
        if name not in self.files:
            try:
                self.files[name] = read_file(self.path.parent / name)
            except ModelError as error:
                fault = str(error).rpartition(": ")[2]
                raise self.error(where, f"{shown(name)}: {fault}") from None
        return self.files[name], ""

    def read_buffer(self, index: object, where: str) -> Bytes:
        """Return the bytes of a buffer, read-only."""
        number = self.as_index(index, "buffers", where)
        if number not in self._buffers:
            buffer = self.item("buffers", number, where)
            length = buffer.whole("byteLength")
            data = self._buffer_data(number, buffer)
            if data is None:
                raise buffer.error("", "has no data: neither a uri nor a binary chunk")
            if len(data) < length:
                raise buffer.error("byteLength", f"is {shown(length)}, but only {len(data)} bytes are there")
            self._buffers[number] = np.frombuffer(data, np.uint8)[:length]
        return self._buffers[number]

    def has_data(self, buffer: int) -> bool:
        """Return whether a buffer has data; those that stand for compressed ones may have none."""
        return "uri" in self.item("buffers", buffer, "buffers") or self._is_binary_chunk(buffer)

    def _is_binary_chunk(self, buffer: int) -> bool:
        """Return whether a buffer without a uri is the binary chunk (section 4.4.3.3)."""
        extension = self.item("buffers", buffer, "buffers").extension("EXT_meshopt_compression")
        stands_in = extension is not None and extension.flag("fallback", False)
        return buffer == 0 and self._binary is not None and not stands_in

    def _buffer_data(self, number: int, buffer: JsonObject) -> bytes | memoryview | None:
        uri = buffer.text("uri", None)
        if uri is not None:
            return self.read_uri(uri, buffer.place("uri"))[0]
        return self._binary if self._is_binary_chunk(number) else None

    def read_buffer_view(self, index: object, where: str) -> tuple[Bytes, int]:
        """Return the bytes of a buffer view, read-only, and its stride in bytes, 0 if it has none.

        Views that are compressed by EXT_meshopt_compression are decoded.
        """
        number = self.as_index(index, "bufferViews", where)
        view = self.item("bufferViews", number, where)
        stride = view.whole("byteStride", 0)
        if view.extension("EXT_meshopt_compression") is not None:
            if number not in self._decoded:
                decoded = decode_meshopt(self, view)
                self._decoded[number] = self.slice_buffer(view) if decoded is None else decoded
            return self._decoded[number], stride
        return self.slice_buffer(view), stride

    def slice_buffer(self, view: JsonObject) -> Bytes:
        """Return the part of a buffer that an object names by buffer, byteOffset and byteLength."""
        if "buffer" not in view:
            raise view.error("buffer", "is missing")
        data = self.read_buffer(view.json["buffer"], view.place("buffer"))
        offset, length = view.whole("byteOffset", 0), view.whole("byteLength")
        if offset + length > len(data):
            raise view.error(
                "", f"ends at byte {shown(offset + length)} of a buffer that has {len(data)} bytes"
            )
        return data[offset : offset + length]


def _limits(least: float, most: float | None) -> str:
    """Return the range of a number for a message; None and infinity are no limit."""
    if most is None or most == math.inf:
        return f"at least {least:g}"
    return f"at most {most:g}" if least == -math.inf else f"{least:g} to {most:g}"
