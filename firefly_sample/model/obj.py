"""A Wavefront OBJ file, with its material libraries and textures, as a `ModelData`.

This reader is our own. trimesh takes negative indices from the end of the file instead of from their line,
cuts concave faces as if convex, and drops smoothing groups, emission, options of textures and what is missing
without a word. tinyobjloader has no smoothing groups, emission and options in Python, and reads libraries
outside the folder. The format: "Object Files (.obj)", Wavefront Advanced Visualizer 4.0, appendix B1.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from firefly_sample.errors import ModelError
from firefly_sample.losses import Losses
from firefly_sample.model.builder import Builder
from firefly_sample.model.conventions import linear_colors
from firefly_sample.model.creases import BY_ANGLE, FLAT
from firefly_sample.model.data import ModelData
from firefly_sample.model.folder import Folder
from firefly_sample.model.formats import Up
from firefly_sample.model.mtl import Statements, make_material, parse_mtl
from firefly_sample.model.pixels import one_line
from firefly_sample.model.polygons import MOST_CORNERS, cut_faces

Corner = tuple[int, int, int]
"""A corner's vertex, texture coordinates and normal, counted from 0; -1: none."""

_NOT_DRAWN = {
    "p": "points",
    "l": "lines",
    "curv": "curves",
    "curv2": "curves",
    "surf": "free-form surfaces",
}


@dataclass
class _Part:
    """The faces of one object with one material, as indices of `corners`, and their smoothing groups."""

    corners: dict[Corner, int] = field(default_factory=dict)
    faces: list[list[int]] = field(default_factory=list)
    groups: list[int] = field(default_factory=list)


def read_obj(path: Path, up: Up, folder: Folder, losses: Losses) -> ModelData:
    """Return the content of an OBJ file: a node for each object, a geom for each of its materials.

    Nodes are objects (`o`), or groups (`g`) in a file without objects. Faces with more than three corners are
    cut into triangles.

    Raises
    ------
    ModelError
        If a line cannot be read, of the file or of a library, an index has nothing behind it, or a texture is
        too large.
    """
    text = _decode(path.read_bytes())
    parser = _Parser("o" if re.search(r"^o[ \t]", text, re.MULTILINE) else "g", losses)
    for number, line in enumerate(re.sub(r"\\\r?\n", " ", text).splitlines(), 1):
        keyword, _, rest = line.strip().replace("\t", " ").partition(" ")
        try:
            parser.read(keyword, rest.strip())
        except (ValueError, OverflowError) as error:
            shown = " ".join(line.split())[:60]
            raise ModelError(
                f"model {path}: line {number} cannot be read ({one_line(error)}): {shown}"
            ) from None
    builder = Builder(path, up, folder, losses)
    library = _read_libraries(parser.libraries, folder)
    nodes: dict[str, int] = {}
    for (node, material), part in parser.parts.items():
        geoms = _add_part(builder, parser, node, material, part, library)
        if node not in nodes:
            nodes[node] = builder.add_node(node or path.stem, -1)
        builder.model.nodes[nodes[node]].geoms += geoms
    return builder.model


def _decode(data: bytes) -> str:
    """Return a text that is UTF-8 or, if it is not, Latin-1, in which all bytes stand for something."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


class _Parser:
    """Reads one line after another."""

    def __init__(self, named_by: str, losses: Losses) -> None:
        self.named_by = named_by
        self.losses = losses
        self.libraries: list[str] = []
        self.tables: dict[str, list[list[float]]] = {"vertices": [], "texcoords": [], "normals": []}
        self.colors: dict[int, list[float]] = {}
        self.parts: dict[tuple[str, str], _Part] = {}
        self.node = self.material = ""
        self.smoothing = BY_ANGLE

    def read(self, keyword: str, rest: str) -> None:
        if keyword == "v":
            numbers = [float(word) for word in rest.split()]
            if len(numbers) >= 6:
                self.colors[len(self.tables["vertices"])] = numbers[3:6]
            self._append("vertices", numbers[:3], 3)
        elif keyword == "vt":
            self._append("texcoords", [*(float(word) for word in rest.split()[:2]), 0.0][:2], 2)
        elif keyword == "vn":
            self._append("normals", [float(word) for word in rest.split()[:3]], 3)
        elif keyword == "f":
            self._face(rest.split())
        elif keyword == self.named_by:
            self.node = rest
        elif keyword == "usemtl":
            self.material = rest
        elif keyword == "s":
            self.smoothing = FLAT if rest == "off" else int(rest)
        elif keyword == "mtllib":
            self.libraries.append(rest)
        elif keyword in _NOT_DRAWN:
            self.losses.add(_NOT_DRAWN[keyword], self.node)

    def _append(self, what: str, row: list[float], width: int) -> None:
        if len(row) < width:
            raise ValueError(f"{what} have {width} numbers")
        self.tables[what].append(row)

    def _face(self, words: list[str]) -> None:
        if len(words) < 3:
            raise ValueError("a face has three corners or more")
        if len(words) > MOST_CORNERS:
            self.losses.add(f"the concave parts of faces with more than {MOST_CORNERS} corners", self.node)
        part = self.parts.setdefault((self.node, self.material), _Part())
        corners = [self._corner(word) for word in words]
        part.faces.append([part.corners.setdefault(corner, len(part.corners)) for corner in corners])
        part.groups.append(self.smoothing)

    def _corner(self, word: str) -> Corner:
        """Return a corner such as "3", "3/1", "3//2" or "-1/-1/-1"; negative numbers count back from here."""
        found = [-1, -1, -1]
        for place, (number, table) in enumerate(zip(word.split("/"), self.tables.values(), strict=False)):
            if number:
                index = int(number)
                found[place] = index - 1 if index > 0 else len(table) + index
                if index == 0 or found[place] < 0:
                    raise ValueError(f"index {index}, of {len(table)} before this line")
        if found[0] < 0:
            raise ValueError("a corner without a vertex")
        return (found[0], found[1], found[2])


def _read_libraries(names: list[str], folder: Folder) -> dict[str, Statements]:
    """Return the materials of the libraries; a line names one file, or several."""
    library: dict[str, Statements] = {}
    for line in names:
        for name in [line] if folder.find(line) else line.split():
            data = folder.read(name, "material libraries")
            library = (parse_mtl(_decode(data)) if data is not None else {}) | library
    return library


def _add_part(
    builder: Builder, parser: _Parser, node: str, material: str, part: _Part, library: dict[str, Statements]
) -> tuple[int, ...]:
    """Return the index of the geom of a part."""
    where = f"model {builder.path}"
    arrays = {}
    for (what, table), indices in zip(parser.tables.items(), np.array(list(part.corners)).T, strict=True):
        if indices.max() >= len(table):
            raise ModelError(f"{where}: a face uses number {indices.max() + 1} of {len(table)} {what}")
        if what == "texcoords" and indices.max() >= 0:  # (0, 0) for corners without
            arrays[what] = np.array([*table, [0.0, 0.0]])[indices]
        elif indices.min() >= 0:
            arrays[what] = np.array(table)[indices]
    if parser.colors:
        colors = np.ones((len(parser.tables["vertices"]), 3))
        colors[list(parser.colors)] = list(parser.colors.values())
        colors = colors / 255.0 if colors.max() > 1.0 else colors  # some programs write 0 to 255
        arrays["colors"] = linear_colors(colors[[corner[0] for corner in part.corners]])
    triangles, owners = cut_faces(part.faces, arrays["vertices"])
    source = library.get(material)
    if source is None:
        index = builder.plain_material(arrays.get("colors"))
        if material:
            builder.losses.add("materials not found in a library", material)
    else:
        try:
            index = builder.material(material, partial(make_material, material, source, builder))
        except ValueError as error:
            raise ModelError(f"{where}: material {material!r} is damaged: {one_line(error)}") from None
    name = node or material or builder.path.stem
    return builder.add_geom(name, index, triangles, arrays, np.array(part.groups)[owners])
