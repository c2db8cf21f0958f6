"""OFF files as a `ModelData`.

This reader is our own: trimesh leaves out all colours, normals and texture coordinates. The format: Geomview
manual, "OFF Files".
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from firefly_sample.errors import ModelError
from firefly_sample.losses import Losses
from firefly_sample.model.data import ModelData
from firefly_sample.model.formats import Up
from firefly_sample.model.plain_meshes import linear_colors, one_mesh, split_face_colors
from firefly_sample.model.polygons import MOST_CORNERS, cut_faces
from firefly_sample.scene.arrays import Float64

_PLAIN_FACE = (0.8, 0.8, 0.8)
"""The linear colour of faces without one beside faces with one."""


def read_off(path: Path, up: Up, losses: Losses) -> ModelData:
    """Return the mesh of an OFF file, with normals, texture coordinates, and colours of vertices or faces.

    Raises
    ------
    ModelError
        If the file cannot be read, or does not hold what it announces.
    """
    try:
        kinds, rows = _rows(path.read_bytes().decode("latin-1"))
        vertex_count, face_count = (int(number) for number in rows[0][:2])
        if min(vertex_count, face_count) < 0 or vertex_count + face_count > len(rows) - 1:
            raise ValueError(f"cut short: it promises {vertex_count} vertices and {face_count} faces")
        arrays = _vertex_arrays(kinds, rows[1 : 1 + vertex_count])
        lines = rows[1 + vertex_count : 1 + vertex_count + face_count]
        faces = [[int(number) for number in line[1 : 1 + int(line[0])]] for line in lines]
        colors = [line[1 + len(face) :] for line, face in zip(lines, faces, strict=True)]
        shown = [(face, color) for face, color in zip(faces, colors, strict=True) if len(face) > 2]
        triangles, owners = cut_faces([face for face, _ in shown], arrays["vertices"])
        face_colors = _face_colors([color for _, color in shown], losses)
    except (ValueError, IndexError, OverflowError) as error:
        raise ModelError(f"model {path}: damaged OFF file ({error})") from None
    if len(shown) < len(faces):
        losses.add("faces with one or two corners: points and lines")
    if any(len(face) > MOST_CORNERS for face in faces):
        losses.add(f"the concave parts of faces with more than {MOST_CORNERS} corners")
    if face_colors is not None and "colors" not in arrays:
        triangles, arrays = split_face_colors(triangles, arrays, face_colors[owners])
    return one_mesh(path, triangles, arrays, up)


def _rows(text: str) -> tuple[str, list[list[str]]]:
    """Return the letters before OFF in the first word, and the words of each line after it."""
    lines = [line.partition("#")[0].split() for line in text.splitlines()]
    rows = [line for line in lines if line]
    if not rows or not (found := re.fullmatch(r"((?:ST)?C?N?4?n?)OFF", rows[0][0])):
        raise ValueError("its first word is not OFF")
    if "4" in found[1] or "n" in found[1] or rows[0][1:2] == ["BINARY"]:
        raise ValueError("only text files of three dimensions can be read")
    first = [rows[0][1:]] if rows[0][1:] else []
    rest = first + rows[1:]
    if not rest or len(rest[0]) < 2:
        raise ValueError("it does not say how many vertices and faces it has")
    return found[1], rest


def _vertex_arrays(kinds: str, rows: list[list[str]]) -> dict[str, Float64]:
    """Return the columns that the letters announce: coordinates, normals (N), colours (C), texture (ST)."""
    if not rows:
        return {"vertices": np.zeros((0, 3))}
    width = min(len(row) for row in rows)
    table = np.array([row[:width] for row in rows], dtype=np.float64)
    arrays = {"vertices": table[:, :3]}
    start, end = 3, width
    if "N" in kinds:
        arrays["normals"] = table[:, 3:6]
        start = 6
    if "ST" in kinds:
        end = width - 2
        arrays["texcoords"] = table[:, end:]
    if "C" in kinds:
        arrays["colors"] = linear_colors(_shares(table[:, start : min(end, start + 4)]))
    if any(array.shape[1] < least for array, least in zip(arrays.values(), (3, 2, 2, 2), strict=False)):
        raise ValueError(f"its vertices have {width} numbers, which are too few for {kinds}OFF")
    return arrays


def _shares(colors: Float64) -> Float64:
    """Return colours as 0..1; those with a number above 1 are 0..255."""
    if colors.shape[1] < 3:
        raise ValueError("a colour has three or four numbers")
    return colors / 255.0 if colors.max(initial=0.0) > 1.0 else colors


def _face_colors(colors: list[list[str]], losses: Losses) -> Float64 | None:
    """Return the linear colour of each face, None if no face has one."""
    if any(len(color) in (1, 2) for color in colors):
        losses.add("colours of faces that are numbers in a colour map")
    if not any(len(color) >= 3 for color in colors):
        return None
    found = np.tile((*_PLAIN_FACE, 1.0), (len(colors), 1))
    for place, color in enumerate(colors):
        if len(color) >= 3:
            numbers = np.array([color[:4]], dtype=np.float64)
            whole = all(word.lstrip("+").isdigit() for word in color[:4])
            found[place] = linear_colors(numbers / 255.0 if whole else numbers)[0]
    return found
