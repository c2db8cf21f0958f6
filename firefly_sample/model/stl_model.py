"""An STL file, binary or text, as a `ModelData`.

This reader is our own because importing trimesh takes longer than reading most of these files. The formats:
M. Burns, "Automated Fabrication", 1993, section 6.5.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from firefly_sample.errors import ModelError
from firefly_sample.losses import Losses
from firefly_sample.model.data import ModelData, NodeData
from firefly_sample.model.formats import Up
from firefly_sample.model.plain_meshes import PLAIN, make_geom
from firefly_sample.scene.arrays import Float64

_HEADER = 84
_RECORD = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (9,)), ("attribute", "<u2")])
_WORDS = {"facet", "outer", "endfacet", "endsolid", "color"}


def read_stl(path: Path, up: Up, losses: Losses) -> ModelData:
    """Return the solids of an STL file, each as a node; a binary file has one.

    Normals in the file are not read: programs leave them zero or wrong, and the corners give them.

    Raises
    ------
    ModelError
        If the file is not as long as it says, or a line cannot be read.
    """
    data = path.read_bytes()
    try:
        if data.lstrip()[:5].lower() == b"solid" and not _has_binary_length(data):
            solids = _read_text(data.decode("latin-1"))
        else:
            solids = [("", _read_binary(data, losses))]
    except ValueError as error:
        raise ModelError(f"model {path}: damaged STL file ({error})") from None
    model = ModelData(path.stem, materials=[PLAIN])
    for solid, corners in solids:
        name = solid if solid and len(solids) > 1 else path.stem
        triangles = np.arange(len(corners)).reshape(-1, 3)
        geom = make_geom(f"model {path}", name, 0, triangles, {"vertices": corners}, up)
        if geom is not None:
            model.nodes.append(NodeData(name, -1, geoms=(len(model.geoms),)))
            model.geoms.append(geom)
    return model


def _has_binary_length(data: bytes) -> bool:
    """Return whether a file has the length of a binary one with the number of triangles at its byte 80."""
    return len(data) >= _HEADER and len(data) == _HEADER + _RECORD.itemsize * _count(data)


def _count(data: bytes) -> int:
    return int(struct.unpack_from("<I", data, 80)[0])


def _read_binary(data: bytes, losses: Losses) -> Float64:
    """Return the corners (3 n, 3) of a binary file: 84 bytes of header, then 50 per triangle."""
    if len(data) < _HEADER:
        raise ValueError(f"cut short: it has {len(data)} bytes, and a header has {_HEADER}")
    if not _has_binary_length(data):
        there = (len(data) - _HEADER) / _RECORD.itemsize
        raise ValueError(f"it promises {_count(data)} triangles and has {there:g}")
    records = np.frombuffer(data, _RECORD, offset=_HEADER)
    if records["attribute"].any():
        losses.add("attributes (colours) of STL triangles")
    return records["corners"].astype(np.float64).reshape(-1, 3)


def _read_text(text: str) -> list[tuple[str, Float64]]:
    """Return the name and the corners (3 n, 3) of each solid."""
    solids: list[tuple[str, list[float]]] = []
    last = ""
    for number, line in enumerate(text.splitlines(), 1):
        words = line.split()
        if not words:
            continue
        last = words[0].lower()
        if last == "vertex" and solids and len(words) == 4:
            try:
                solids[-1][1].extend([float(word) for word in words[1:]])
            except ValueError:
                raise ValueError(f"line {number} has no numbers: {line.strip()[:60]}") from None
        elif last == "solid":
            solids.append((" ".join(words[1:]), []))
        elif last == "endloop":
            if not solids or len(solids[-1][1]) % 9:
                raise ValueError(f"the loop that ends on line {number} has not three corners")
        elif last not in _WORDS:
            raise ValueError(f"line {number} cannot be read: {line.strip()[:60]}")
    if last != "endsolid":
        raise ValueError("cut short: it does not end with endsolid")
    if any(len(numbers) % 9 for _, numbers in solids):
        raise ValueError("a loop has no end")
    return [(name, np.array(numbers).reshape(-1, 3)) for name, numbers in solids]
