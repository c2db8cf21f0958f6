"""Small glTF files for tests, made of arrays: .glb, and .gltf with its data inside or in a file beside it.

    file = GltfFile()
    mesh = file.mesh(POSITION=corners, indices=triangles, TEXCOORD_0=uv, material=file.add("materials", ...))
    file.node(mesh=mesh)
    path = file.write(tmp_path / "quad.glb")

What is unusual is written into `file.json` before `write`.
"""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

COMPONENT_TYPES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
TYPES = {
    (): "SCALAR",
    (2,): "VEC2",
    (3,): "VEC3",
    (4,): "VEC4",
    (2, 2): "MAT2",
    (3, 3): "MAT3",
    (4, 4): "MAT4",
}


def pad(data: bytes, filler: bytes = b"\0") -> bytes:
    return data + filler * (-len(data) % 4)


def glb(*chunks: tuple[bytes, bytes], version: int = 2) -> bytes:
    """A container of (type, data) chunks: ``glb((b"JSON", text), (b"BIN\\0", data))``."""
    body = b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in chunks)
    return struct.pack("<4sII", b"glTF", version, 12 + len(body)) + body


def packed(array: np.ndarray) -> bytes:
    """The bytes of an accessor's elements; columns of matrices start at multiples of four bytes."""
    if array.ndim < 3:
        return array.tobytes()
    return b"".join(pad(column.tobytes()) for matrix in array for column in matrix.T)


class GltfFile:
    """A file in the making: ``json``, its properties, and ``data``, the bytes of its only buffer."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]}
        self.data = b""

    def add(self, kind: str, **properties: Any) -> int:
        """Append an object to a list such as "materials", and return its index."""
        entries = self.json.setdefault(kind, [])
        entries.append(properties)
        return len(entries) - 1

    def view(self, data: bytes, **properties: Any) -> int:
        """Append bytes as a buffer view, at a multiple of four bytes."""
        self.data = pad(self.data)
        start = len(self.data)
        self.data += data
        return self.add("bufferViews", buffer=0, byteOffset=start, byteLength=len(data), **properties)

    def accessor(self, values: ArrayLike, **properties: Any) -> int:
        """Append an array as it is: its dtype is the component type, and its shape (n, ...) the type.

        Floats are written as float32, int64 as uint32. Matrices are [row, column].
        """
        array = np.asarray(values)
        if array.dtype.kind == "f":
            array = array.astype("<f4")
        elif array.dtype == np.int64:
            array = array.astype("<u4")
        extremes = {}
        if array.ndim == 2 and len(array):
            extremes = {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
        described = {
            "bufferView": self.view(packed(array)),
            "componentType": COMPONENT_TYPES[array.dtype.str[1:]],
            "count": len(array),
            "type": TYPES[array.shape[1:]],
        }
        return self.add("accessors", **{**described, **extremes, **properties})

    def primitive(self, indices: ArrayLike | None = None, targets: Any = (), **given: Any) -> dict[str, Any]:
        """A primitive: attributes (in capitals, or with "_" before them) are arrays, or indices of accessors.

        Other properties, such as ``material`` and ``mode``, are written as they are.
        """
        made: dict[str, Any] = {
            "attributes": {name: self._of(value) for name, value in given.items() if is_attribute(name)}
        }
        if indices is not None:
            made["indices"] = self._of(indices)
        if targets:
            made["targets"] = [{name: self._of(value) for name, value in each.items()} for each in targets]
        made.update({name: value for name, value in given.items() if not is_attribute(name)})
        return made

    def mesh(self, *primitives: dict[str, Any], **given: Any) -> int:
        """Append a mesh of these primitives, or of one that is described as for `primitive`."""
        named = {key: given.pop(key) for key in ("name", "weights") if key in given}
        return self.add("meshes", primitives=list(primitives) or [self.primitive(**given)], **named)

    def node(self, *, parent: int | None = None, **properties: Any) -> int:
        """Append a node, to the first scene or below another node."""
        index = self.add("nodes", **properties)
        if parent is None:
            self.json["scenes"][0]["nodes"].append(index)
        else:
            self.json["nodes"][parent].setdefault("children", []).append(index)
        return index

    def write(self, path: Path, beside: bool = False) -> Path:
        """Write a .glb or .gltf file by the path's suffix; `beside`: with data in a file of its own."""
        found = json.loads(json.dumps(self.json))
        if path.suffix == ".glb":
            if self.data:
                found.setdefault("buffers", [{"byteLength": len(self.data)}])
            chunks = [(b"JSON", pad(json.dumps(found).encode(), b" "))]
            path.write_bytes(glb(*chunks, *([(b"BIN\0", pad(self.data))] if self.data else [])))
            return path
        if self.data:
            uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
            if beside:
                path.with_suffix(".bin").write_bytes(self.data)
                uri = f"{path.stem}.bin"
            found.setdefault("buffers", [{"byteLength": len(self.data), "uri": uri}])
        path.write_text(json.dumps(found), encoding="utf-8")
        return path

    def _of(self, value: Any) -> int:
        return value if isinstance(value, int) else self.accessor(value)


def is_attribute(name: str) -> bool:
    return name == name.upper()
