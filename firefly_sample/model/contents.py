"""Looks into files that trimesh reads, for damage that it passes over and for what it leaves out."""

from __future__ import annotations

import re
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from firefly_sample.losses import Losses
from firefly_sample.model.polygons import has_concave

PLY_COLORS = ("red", "green", "blue", "alpha")
_PLY_INDICES = ("vertex_indices", "vertex_index")
_PLY_READ = {
    "vertex": {*"xyz", "nx", "ny", "nz", *PLY_COLORS, *"stuv", "texture_u", "texture_v"},
    "face": {*_PLY_INDICES, *PLY_COLORS, "texcoord"},
}
MIXED_PLY = (
    "it is cut short, or its faces have different numbers of corners, which trimesh reads only in PLY files "
    "of text: export triangles, or as text"
)
_CONCAVE = "the shapes of concave faces, which trimesh cuts as if they were convex"
_LONGEST_HEADER = 2**20
_STL_HEADER = 84
_STL_TRIANGLE = 50
_3MF_LOSSES = {
    b":colorgroup": "colours of 3MF files",
    b"<basematerials": "base materials of 3MF files",
    b":texture2d ": "textures of 3MF files",
    b":compositematerials": "composite materials of 3MF files",
    b":beamlattice": "beam lattices of 3MF files",
    b":slicestack": "slices of 3MF files",
}
_LONGEST_PART = 2**28


def check_content(path: Path, suffix: str, losses: Losses) -> dict[str, Any]:
    """Return options for trimesh, once it is sure that a file is as long as it says; note its losses.

    Raises
    ------
    ValueError
        If it is not.
    """
    if suffix in ("stl", "stl_ascii"):
        _check_stl(path.read_bytes())
    elif suffix == "off":
        _look_at_off(path.read_text("latin-1"), losses)
    elif suffix == "ply":
        # vertices are parted at seams only where faces have texture coordinates: it costs the normals
        return {"fix_texture": b" texcoord" in _ply_header(path)}
    return {}


def note_content(path: Path, suffix: str, scene: Any, losses: Losses) -> None:
    """Note the losses of a file that trimesh has read.

    Raises
    ------
    ValueError
        If trimesh has read less than the file says that it holds.
    """
    if suffix == "ply":
        _look_at_ply(path, scene, losses)
    elif suffix in ("stl", "stl_ascii"):
        attributes = [mesh.face_attributes.get("stl") for mesh in scene.geometry.values()]
        if any(found is not None and found.any() for found in attributes):
            losses.add("attributes (colours) of STL triangles")
    elif suffix == "3mf":
        _look_at_3mf(path, losses)
    elif suffix == "ctm":
        _look_at_ctm(path, losses)


def _check_stl(data: bytes) -> None:
    """Check that a binary file has its triangles, and that a text has all its corners and its end."""
    promised = int(struct.unpack_from("<I", data, 80)[0]) if len(data) >= _STL_HEADER else 0
    if len(data) == _STL_HEADER + _STL_TRIANGLE * promised:
        return
    text = data.lower()
    if not text.lstrip().startswith(b"solid"):
        there = max(len(data) - _STL_HEADER, 0) / _STL_TRIANGLE
        raise ValueError(f"it promises {promised} triangles and has {there:g}")
    facets, corners = (len(re.findall(rb"^\s*%s\s" % word, text, re.M)) for word in (b"facet", b"vertex"))
    if corners != 3 * facets or text.rfind(b"endsolid") < text.rfind(b"facet"):
        raise ValueError(f"cut short: it has {facets} triangles, {corners} corners, and no end")


def _look_at_off(text: str, losses: Losses) -> None:
    """Check that a text has the numbers that it announces, and note what trimesh does not read."""
    lines = [words for line in text.splitlines() if (words := line.partition("#")[0].split())]
    if not lines or not re.fullmatch("(ST)?C?N?OFF", lines[0][0]) or "BINARY" in lines[0]:
        raise ValueError("its first word is not OFF, or it is no text of three dimensions")
    counts, *rows = [lines[0][1:], *lines[1:]] if len(lines[0]) > 1 else lines[1:] or [[]]
    if len(counts) < 2:
        raise ValueError("it does not say how many vertices and faces it has")
    vertex_count, face_count = int(counts[0]), int(counts[1])
    if min(vertex_count, face_count) < 0 or vertex_count + face_count > len(rows):
        raise ValueError(f"cut short: it promises {vertex_count} vertices and {face_count} faces")
    if any(len(row) > 3 for row in rows[:vertex_count]):
        losses.add("colours, normals and texture coordinates of OFF vertices")
    for row in rows[vertex_count : vertex_count + face_count]:
        corners = int(row[0])
        if corners < 0 or len(row) <= corners:
            raise ValueError(f"a face has not the corners that it promises: {' '.join(row)[:60]}")
        if corners < 3:
            losses.add("faces with one or two corners: points and lines")
        if len(row) > corners + 1:
            losses.add("colours of OFF faces")
    faces = [[int(word) for word in row[1 : 1 + int(row[0])]] for row in rows[vertex_count:][:face_count]]
    if has_concave(faces, np.array([row[:3] for row in rows[:vertex_count]], dtype=np.float64)):
        losses.add(_CONCAVE)


def _ply_header(path: Path) -> bytes:
    with path.open("rb") as file:
        header, end, _ = file.read(_LONGEST_HEADER).partition(b"end_header")
    if not header.startswith(b"ply") or not end:
        raise ValueError("not a PLY file, or its header has no end")
    return header


def _look_at_ply(path: Path, scene: Any, losses: Losses) -> None:
    """Check the lengths of tables and lists, and note tables, columns and textures that are not drawn."""
    for name in re.findall(rb"(?mi)^comment\s+texturefile\s+(.*?)\s*$", _ply_header(path))[:-1]:
        losses.add("textures before the last", name.decode("latin-1"))
    for mesh in scene.geometry.values():
        tables = mesh.metadata["_ply_raw"]
        for name, table in tables.items():
            if table["length"] and name not in _PLY_READ:
                losses.add("tables of PLY files other than vertices and faces", name)
            elif table["length"]:
                _check_ply_table(name, table)
                for column in table["properties"]:
                    if column not in _PLY_READ[name]:
                        losses.add(f"columns of the PLY table {name!r} that are not known", column)
        if hasattr(mesh, "faces"):
            _look_at_ply_mesh(mesh, tables, losses)


def _check_ply_table(name: str, table: dict[str, Any]) -> None:
    """Check that a table has all its rows, and that trimesh has taken lists as alike only where they are."""
    for column in table["properties"]:
        values = table["data"][column]
        if len(values) != table["length"]:
            raise ValueError(f"cut short: its header promises {table['length']} of {name!r}")
        if values.dtype.names and (values["f0"] != values["f0"][0]).any():
            raise ValueError(MIXED_PLY)


def _look_at_ply_mesh(mesh: Any, tables: Any, losses: Losses) -> None:
    """Note what trimesh has read and not kept: colours, normals, and shapes of concave faces."""
    rows = next(tables["face"]["data"][name] for name in _PLY_INDICES if name in tables["face"]["properties"])
    vertices = np.column_stack([tables["vertex"]["data"][name] for name in "xyz"])
    if has_concave(rows["f1"] if rows.dtype.names else rows, vertices):
        losses.add(_CONCAVE)
    if "red" in tables["face"]["properties"] and (
        mesh.visual.kind != "face" or len(mesh.visual.face_colors) != len(mesh.faces)
    ):
        losses.add("colours of PLY faces that are no triangles, or beside colours of vertices or a texture")
    if (
        len(mesh.vertices) != tables["vertex"]["length"]
        and {"red", "nx"} & tables["vertex"]["properties"].keys()
    ):
        losses.add("colours and normals of PLY vertices with several texture coordinates")


def _look_at_3mf(path: Path, losses: Losses) -> None:
    """Note the elements that trimesh does not know."""
    with zipfile.ZipFile(path) as archive:
        for name in archive.namelist():
            if name.lower().endswith(".model"):
                with archive.open(name) as part:
                    text = part.read(_LONGEST_PART)
                for element, loss in _3MF_LOSSES.items():
                    if element in text:
                        losses.add(loss)


def _look_at_ctm(path: Path, losses: Losses) -> None:
    """Note texture coordinates and attributes; their numbers stand in the header."""
    with path.open("rb") as file:
        head = file.read(36)
    if head[:4] == b"OCTM" and len(head) >= 32:
        _, _, _, _, maps, attributes, _ = struct.unpack_from("<7I", head, 4)
        if maps or attributes:
            losses.add("texture coordinates and attributes of OpenCTM files")
