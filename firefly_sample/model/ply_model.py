"""A PLY file as a `ModelData`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import ModelError
from firefly_sample.losses import Losses
from firefly_sample.model.data import ModelData
from firefly_sample.model.folder import Folder
from firefly_sample.model.formats import Up
from firefly_sample.model.plain_meshes import linear_colors, one_mesh, split_face_colors
from firefly_sample.model.ply import Column, PlyFile, parse_ply, strips_to_triangles
from firefly_sample.model.polygons import MOST_CORNERS, cut_faces
from firefly_sample.scene.arrays import Float64

_COLORS = (("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b"))
_TEXCOORDS = (("u", "v"), ("s", "t"), ("texture_u", "texture_v"))
_INDICES = ("vertex_indices", "vertex_index")


def read_ply(path: Path, up: Up, folder: Folder, losses: Losses) -> ModelData:
    """Return the mesh of a PLY file: faces or strips, with normals, colours and a texture.

    Raises
    ------
    ModelError
        If the file does not hold what its header says, or its texture is too large.
    """
    try:
        parsed = parse_ply(path.read_bytes())
        faces, columns = _faces(parsed)
        arrays = _vertex_arrays(parsed)
        vertices = arrays["vertices"]
        texcoords = columns.get("texcoord")
        if texcoords is not None:
            faces, arrays = _split_corners(faces, arrays, texcoords)
        triangles, owners = cut_faces(faces, arrays["vertices"])
    except (ValueError, TypeError, KeyError, IndexError) as error:
        raise ModelError(f"model {path}: damaged PLY file ({error})") from None
    _note_losses(parsed, faces, losses)
    if not len(triangles) and len(vertices):
        losses.add("points")
    face_colors = _colors(columns)
    if face_colors is not None and "colors" not in arrays:
        triangles, arrays = split_face_colors(triangles, arrays, face_colors[owners])
    texture = folder.image(parsed.textures[0]) if parsed.textures and "texcoords" in arrays else None
    return one_mesh(path, triangles, arrays, up, texture)


def _faces(parsed: PlyFile) -> tuple[Any, dict[str, Column]]:
    """Return the faces, as an array or as lists of different lengths, and the columns of their table."""
    table = parsed.elements.get("face")
    if table is not None and table.count:
        name = next((name for name in _INDICES if name in table.columns), None)
        if name is None:
            raise ValueError(f"its faces have none of the lists {', '.join(_INDICES)}")
        faces = table.columns[name]
        return (faces if isinstance(faces, np.ndarray) else [face.tolist() for face in faces]), table.columns
    strips = parsed.elements.get("tristrips")
    if strips is not None and strips.count:
        name = next((name for name in _INDICES if name in strips.columns), None)
        if name is None:
            raise ValueError(f"its strips have none of the lists {', '.join(_INDICES)}")
        return [made for strip in strips.columns[name] for made in strips_to_triangles(strip.tolist())], {}
    return [], {}


def _vertex_arrays(parsed: PlyFile) -> dict[str, Float64]:
    table = parsed.elements.get("vertex")
    if table is None or not table.count:
        return {"vertices": np.zeros((0, 3))}
    columns = table.columns
    arrays = {"vertices": _stacked(columns, ("x", "y", "z"))}
    if "nx" in columns:
        arrays["normals"] = _stacked(columns, ("nx", "ny", "nz"))
    for names in _TEXCOORDS:
        if names[0] in columns and names[1] in columns:
            arrays["texcoords"] = _stacked(columns, names)
            break
    colors = _colors(columns)
    if colors is not None:
        arrays["colors"] = colors
    return arrays


def _stacked(columns: dict[str, Column], names: tuple[str, ...]) -> Float64:
    missing = [name for name in names if name not in columns]
    if missing:
        raise ValueError(f"its vertices have no {missing[0]}")
    return np.stack([np.asarray(columns[name], dtype=np.float64) for name in names], axis=1)


def _colors(columns: dict[str, Column]) -> Float64 | None:
    """Return the linear colours (n, 4) of a table, None if it has none."""
    for names in _COLORS:
        if all(name in columns for name in names):
            red = np.asarray(columns[names[0]])
            alpha = (name for name in ("alpha", "a") if name in columns)
            return linear_colors(_display([columns[name] for name in (*names, *alpha)], red.dtype))
    return None


def _display(columns: list[Column], kind: np.dtype[Any]) -> NDArray[Any]:
    """Return colours as unsigned numbers, or as floats of 0 to 1: larger ones are taken as 0 to 255."""
    colors = np.stack([np.asarray(column) for column in columns], axis=1)
    if kind.kind == "u" and kind.itemsize <= 2:
        return colors.astype(kind)
    floats = colors.astype(np.float64)
    return floats / 255.0 if floats.max(initial=0.0) > 1.0 else floats


def _split_corners(
    faces: Any, arrays: dict[str, Float64], texcoords: Column
) -> tuple[Any, dict[str, Float64]]:
    """Return faces and arrays in which each corner is a vertex, with its texture coordinates."""
    lengths = [len(face) for face in faces]
    if [len(given) for given in texcoords] != [2 * length for length in lengths]:
        raise ValueError("a face does not have two texture coordinates for each corner")
    corners = np.concatenate([np.asarray(face, dtype=np.int64) for face in faces])
    if corners.min() < 0 or corners.max() >= len(arrays["vertices"]):
        raise ValueError("a face uses a vertex that is not there")
    split = {what: array[corners] for what, array in arrays.items()}
    split["texcoords"] = np.concatenate(list(texcoords)).astype(np.float64).reshape(-1, 2)
    ends = np.cumsum(lengths)
    if len(set(lengths)) == 1:
        return np.arange(len(corners)).reshape(-1, lengths[0]), split
    return [list(range(end - length, end)) for length, end in zip(lengths, ends.tolist(), strict=True)], split


def _note_losses(parsed: PlyFile, faces: Any, losses: Losses) -> None:
    for name, element in parsed.elements.items():
        if element.count and name not in ("vertex", "face", "tristrips"):
            losses.add("tables of PLY files other than vertices, faces and strips", name)
    for name in parsed.textures[1:]:
        losses.add("textures after the first", name)
    if any(len(face) > MOST_CORNERS for face in faces):
        losses.add(f"the concave parts of faces with more than {MOST_CORNERS} corners")
