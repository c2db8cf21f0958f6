"""Plain meshes, as most formats have them, as the geoms of a `ModelData`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import ModelError
from firefly_sample.model.creases import row_ids, split_at_creases
from firefly_sample.model.data import GeomData, ImageData, MaterialData, ModelData, NodeData, TextureData
from firefly_sample.model.formats import Up
from firefly_sample.scene.arrays import LARGEST, Float64
from firefly_sample.srgb import srgb_to_linear

Int = NDArray[np.int64]

_TURNS = {
    "x": [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]],
    "y": [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
    "z": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
}
"""Matrices for row vectors, from the axes of a file with this axis up to ours.

A file's right, up and front (the side that is looked at) become X, Z and -Y. They are its X, Y and Z if Y is
up, its X, Z and -Y if Z is, and its -Y, X and Z if X is (COLLADA 1.5, "up_axis").
"""

PLAIN = MaterialData("plain", base_color=(0.8, 0.8, 0.8, 1.0), double_sided=True)
"""The material of geoms without one, and without colours."""
PLAIN_COLORED = MaterialData("plain", double_sided=True)
"""The material of geoms whose colours are those of their vertices."""


def turn(up: Up) -> Float64:
    """Return the rotation (3, 3), for row vectors, from a file's axes to Z up; it only moves and negates."""
    return np.array(_TURNS[up])


def turn_matrix(up: Up, matrix: Float64) -> Float64:
    """Return a 4x4 matrix for row vectors in our axes that does what `matrix` does in the file's."""
    turned = np.eye(4)
    turned[:3, :3] = turn(up)
    return np.asarray(turned.T @ matrix @ turned) + 0.0  # no negative zeros


def linear_color(display: ArrayLike) -> tuple[float, float, float]:
    """Return a linear colour of display codes, which are clipped to 0..1."""
    red, green, blue = srgb_to_linear(np.clip(np.asarray(display, dtype=np.float64), 0.0, 1.0)).tolist()
    return (red, green, blue)


def linear_colors(display: NDArray[Any]) -> Float64:
    """Return linear colours (n, 4) of display codes (n, 3) or (n, 4); alpha is linear as it is.

    Codes are whole numbers, whose largest is white, or floats of 0 to 1.
    """
    white = np.iinfo(display.dtype).max if display.dtype.kind == "u" else 1
    codes = np.clip(display.astype(np.float64) / white, 0.0, 1.0)
    alpha = codes[:, 3:4] if codes.shape[1] == 4 else np.ones((len(codes), 1))
    return np.concatenate([srgb_to_linear(codes[:, :3]), alpha], axis=1)


def make_geom(
    where: str,
    name: str,
    material: int,
    triangles: NDArray[Any],
    arrays: dict[str, Float64],
    up: Up,
    groups: Int | None = None,
) -> GeomData | None:
    """Return a geom in our axes, with normals, of vertices that are used; None if it has no triangles.

    Parameters
    ----------
    where : str
        The beginning of error messages, such as "model chair.obj".
    triangles : ndarray of int, shape (m, 3)
    arrays : dict
        "vertices", and what there is of "normals", "texcoords" and "colors" (linear), a row a vertex. Missing
        normals are made by `split_at_creases`, as are all if one is no direction.
    groups : ndarray of int64, shape (m,), optional
        Smoothing groups, for that.

    Raises
    ------
    ModelError
        If an index is out of range, or a number is not finite or too large.
    """
    where = f"{where}: mesh {name!r}"
    vertices = arrays["vertices"]
    triangles = np.asarray(triangles, dtype=np.int64).reshape(-1, 3)
    if not len(triangles):
        return None
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise ModelError(f"{where} is damaged: a triangle uses a vertex that is not there")
    used, compact = np.unique(triangles, return_inverse=True)
    triangles = compact.reshape(-1, 3)
    arrays = {what: np.ascontiguousarray(array[used], dtype=np.float64) for what, array in arrays.items()}
    _check_numbers(where, arrays)

    normals = _units(arrays.pop("normals", None))
    if normals is None:
        merge = arrays.keys() == {"vertices"}
        source, triangles, normals = split_at_creases(arrays["vertices"], triangles, groups, merge)
        arrays = {what: array[source] for what, array in arrays.items()}
    arrays["vertices"] = arrays["vertices"] @ turn(up) + 0.0
    arrays["normals"] = normals @ turn(up) + 0.0
    if "colors" in arrays and (arrays["colors"] == 1.0).all():
        del arrays["colors"]
    return GeomData(name, material, {**arrays, "triangles": triangles.astype(np.int32)})


def split_face_colors(
    triangles: Int, arrays: dict[str, Float64], face_colors: Float64
) -> tuple[Int, dict[str, Float64]]:
    """Return triangles, and arrays with "colors"; vertices are doubled where colours of faces meet."""
    colors = row_ids(face_colors)
    keys = triangles * (colors.max() + 1) + colors[:, None]
    _, first, new = np.unique(keys, return_index=True, return_inverse=True)
    source = triangles.ravel()[first]
    split = {what: array[source] for what, array in arrays.items()}
    return new.reshape(-1, 3), {**split, "colors": face_colors[first // 3]}


def _check_numbers(where: str, arrays: dict[str, Float64]) -> None:
    for what in ("vertices", "texcoords", "colors"):
        if what in arrays and not (np.abs(arrays[what]) <= LARGEST).all():
            problem = f"its {what} have a number that is not finite or above {LARGEST:g}"
            raise ModelError(f"{where} is damaged: {problem}")


def _units(normals: Float64 | None) -> Float64 | None:
    """Return normals as unit vectors; None if one of them is no direction."""
    if normals is None:
        return None
    with np.errstate(all="ignore"):
        scaled = normals / np.abs(normals).max(axis=1, keepdims=True)
        units = scaled / np.linalg.norm(scaled, axis=1, keepdims=True)
    return units if np.isfinite(units).all() else None


def one_mesh(
    path: Path,
    triangles: Int,
    arrays: dict[str, Float64],
    up: Up,
    texture: ImageData | None = None,
) -> ModelData:
    """Return a model of one node with one geom, both named after the file; see `make_geom`."""
    model = ModelData(path.stem)
    colors = arrays.get("colors")
    material = PLAIN if colors is None and texture is None else PLAIN_COLORED
    if colors is not None and (colors[:, 3] < 1.0).any():
        material = replace(material, alpha_mode="blend")
    if texture is not None:
        model.images.append(texture)
        model.textures.append(TextureData(0))
        material = replace(material, texture=0)
    geom = make_geom(f"model {path}", path.stem, 0, triangles, arrays, up)
    if geom is not None:
        model.materials.append(material)
        model.geoms.append(geom)
        model.nodes.append(NodeData(path.stem, -1, geoms=(0,)))
    return model
