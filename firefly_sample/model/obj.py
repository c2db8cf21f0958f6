"""Wavefront OBJ files as plain meshes.

This reader is our own: trimesh joins all objects, drops smoothing groups and most of a material library
without a word, and counts negative indices from the end of the file instead of from the current line.
The format: "Object Files (.obj)", Wavefront Advanced Visualizer 4.0, appendix B1.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from firefly_sample.losses import Losses
from firefly_sample.model.creases import BY_ANGLE, FLAT
from firefly_sample.model.polygons import MOST_CORNERS, cut_faces
from firefly_sample.scene.arrays import Float64

Int = NDArray[np.int64]
Corner = tuple[int, int, int]
"""A corner's vertex, texture coordinates and normal, counted from 1 as in the file; 0: none."""

_NOT_DRAWN = {
    "p": "points",
    "l": "lines",
    "curv": "curves",
    "curv2": "curves",
    "surf": "free-form surfaces",
}


@dataclass
class ObjPart:
    """The faces of one object with one material, as indices of `corners`."""

    node: str
    material: str
    corners: list[Corner] = field(default_factory=list)
    faces: list[list[int]] = field(default_factory=list)
    groups: list[int] = field(default_factory=list)
    """The smoothing group of each face."""
    known: dict[str, int] = field(default_factory=dict)


@dataclass
class ObjMesh:
    """The triangles of a part.

    `arrays` holds "vertices" and what there is of "texcoords", "normals" and "colors" (display colours).
    """

    node: str
    material: str
    triangles: Int
    groups: Int
    arrays: dict[str, Float64]


@dataclass
class ObjFile:
    """What an OBJ file holds."""

    libraries: list[str]
    meshes: list[ObjMesh]


def parse_obj(text: str, losses: Losses) -> ObjFile:
    """Return the meshes of a file, in its order, and the names of its material libraries.

    Nodes are objects (`o`), or groups (`g`) in a file without objects; each has a mesh for each material.
    Faces with more than three corners are cut into triangles.

    Raises
    ------
    ValueError
        If a line cannot be read, or an index has nothing behind it; the message names the line.
    """
    named_by = "o" if re.search(r"^o[ \t]", text, re.MULTILINE) else "g"
    parser = _Parser(named_by, losses)
    for number, line in enumerate(text.replace("\\\r\n", " ").replace("\\\n", " ").splitlines(), 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        try:
            parser.read(words[0], words[1:], line)
        except (ValueError, OverflowError) as error:
            shown = " ".join(words)[:60]
            raise ValueError(f"line {number} cannot be read ({error}): {shown}") from None
    return ObjFile(parser.libraries, parser.meshes())


class _Parser:
    """Reads one line after another."""

    def __init__(self, named_by: str, losses: Losses) -> None:
        self.named_by = named_by
        self.losses = losses
        self.libraries: list[str] = []
        self.vertices: list[list[float]] = []
        self.colors: dict[int, list[float]] = {}
        self.texcoords: list[list[float]] = [[0.0, 0.0]]
        self.normals: list[list[float]] = [[0.0, 0.0, 0.0]]
        self.parts: dict[tuple[str, str], ObjPart] = {}
        self.node = self.material = ""
        self.smoothing = BY_ANGLE

    def read(self, keyword: str, words: list[str], line: str) -> None:
        if keyword == "v":
            self._vertex([float(word) for word in words])
        elif keyword == "vt":
            self.texcoords.append([*(float(word) for word in words[:2]), 0.0][:2])
        elif keyword == "vn":
            x, y, z = (float(word) for word in words[:3])
            self.normals.append([x, y, z])
        elif keyword == "f":
            self._face(words)
        elif keyword == self.named_by:
            self.node = _rest(line)
        elif keyword == "usemtl":
            self.material = _rest(line)
        elif keyword == "s" and words:
            self.smoothing = FLAT if words[0] == "off" else int(words[0])
        elif keyword == "mtllib":
            self.libraries.append(_rest(line))
        elif keyword in _NOT_DRAWN:
            self.losses.add(_NOT_DRAWN[keyword], self.node)

    def _vertex(self, numbers: list[float]) -> None:
        if len(numbers) < 3:
            raise ValueError("a vertex has three coordinates")
        if len(numbers) >= 6:
            self.colors[len(self.vertices)] = numbers[3:6]
        self.vertices.append(numbers[:3])

    def _face(self, words: list[str]) -> None:
        if len(words) < 3:
            raise ValueError("a face has three corners or more")
        if len(words) > MOST_CORNERS:
            self.losses.add(f"the concave parts of faces with more than {MOST_CORNERS} corners", self.node)
        key = (self.node, self.material)
        part = self.parts.get(key) or self.parts.setdefault(key, ObjPart(*key))
        face = []
        for word in words:
            index = part.known.get(word)
            if index is None:
                index = len(part.corners)
                part.corners.append(self._corner(word))
                if "-" not in word:  # which means the same on every line
                    part.known[word] = index
            face.append(index)
        part.faces.append(face)
        part.groups.append(self.smoothing)

    def _corner(self, word: str) -> Corner:
        """Return a corner such as "3", "3/1", "3//2" or "-1/-1/-1"; negative numbers count back from here."""
        given = [int(number) if number else 0 for number in word.split("/")]
        counts = (len(self.vertices), len(self.texcoords) - 1, len(self.normals) - 1)
        found = []
        for index, count in zip([*given, 0, 0][:3], counts, strict=True):
            found.append(index if index >= 0 else count + 1 + index)
            if found[-1] < 0 or (index < 0 and found[-1] == 0):
                raise ValueError(f"index {index}, of {count} before this line")
        if found[0] == 0:
            raise ValueError("indices count from 1")
        return (found[0], found[1], found[2])

    def meshes(self) -> list[ObjMesh]:
        colors = None
        if self.colors:
            colors = np.ones((len(self.vertices), 3))
            colors[list(self.colors)] = list(self.colors.values())
        tables = {
            "vertices": np.array(self.vertices, dtype=np.float64).reshape(-1, 3),
            "texcoords": np.array(self.texcoords, dtype=np.float64),
            "normals": np.array(self.normals, dtype=np.float64),
        }
        return [_mesh(part, tables, colors) for part in self.parts.values()]


def _mesh(part: ObjPart, tables: dict[str, Float64], colors: Float64 | None) -> ObjMesh:
    """Return the triangles of a part; vertices are told apart by their three indices."""
    indices = np.array(part.corners, dtype=np.int64)
    for what, column, first in (("vertices", 0, 1), ("texcoords", 1, 0), ("normals", 2, 0)):
        count, largest = len(tables[what]) - 1 + first, int(indices[:, column].max())
        if largest > count:
            thing = f"object {part.node!r}" if part.node else "a face"
            raise ValueError(f"{thing} uses number {largest} of {count} {what}")
    vertices = tables["vertices"][indices[:, 0] - 1]
    arrays = {"vertices": vertices}
    if indices[:, 1].any():
        arrays["texcoords"] = tables["texcoords"][indices[:, 1]]
    if indices[:, 2].all():
        arrays["normals"] = tables["normals"][indices[:, 2]]
    if colors is not None:
        arrays["colors"] = colors[indices[:, 0] - 1]
    triangles, owners = cut_faces(part.faces, vertices)
    return ObjMesh(part.node, part.material, triangles, np.array(part.groups)[owners], arrays)


def _rest(line: str) -> str:
    """Return the text after the keyword of a line, which may have spaces."""
    return line.strip().partition(" ")[2].strip()
