"""Models that were read before: meshes, materials and the tree, without trimesh and without decoding images.

The pixels themselves are not kept. What is drawn of them is (see `firefly_sample.mipmaps`), and whoever wants
them all the same has the file parsed after all.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, replace
from functools import cache
from importlib import metadata
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.derived import Kept, derived_folder, fingerprint, load_derived, save_derived
from firefly_sample.scene.model_data import GeomData, ImageData, MaterialData, ModelData, NodeData
from firefly_sample.scene.nodepath import NodePath

_DTYPES: dict[str, np.dtype[Any]] = {
    **{what: np.dtype("<f8") for what in ("vertices", "normals", "texcoords", "colors", "matrix")},
    "triangles": np.dtype("<i4"),
}
VERSION = 1
"""Of what is read from a file, and how it is kept: counts up when either changes."""


def model_key(name: str, data: bytes) -> str | None:
    """The key of a model by its name and its file's bytes; None if nothing is kept."""
    return f"model-{fingerprint(VERSION, name, data, _readers())}" if derived_folder() else None


@cache
def _readers() -> tuple[str, ...]:
    """The versions of what parses files and decodes images."""
    return tuple(f"{package} {_version(package)}" for package in ("trimesh", "pillow"))


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:  # there, but not installed as a package
        return "unknown"


def load_kept(key: str, parse: Callable[[], ModelData]) -> NodePath | None:
    """The tree of the model that was kept under `key`; None if there is none, or it is not one.

    `parse` is called for an image's pixels.
    """
    kept = load_derived(key)
    if kept is None:
        return None
    with suppress(Exception):  # there is no end to what a file with a wrong inside may raise
        return _unpacked(kept, _Images(parse)).as_tree(digests=False)
    return None


def save_kept(key: str, model: ModelData) -> None:
    """Keep a model, whose images must have their digests."""
    arrays: dict[str, NDArray[Any]] = {}
    for number, geom in enumerate(model.geoms):
        arrays |= {
            f"{number} {what}": np.asarray(array, dtype=_DTYPES[what]) for what, array in geom.arrays.items()
        }
    arrays |= {
        f"{number} matrix": node.matrix for number, node in enumerate(model.nodes) if node.matrix is not None
    }
    about = {
        "name": model.name,
        "nodes": [(node.name, node.parent, node.geoms) for node in model.nodes],
        "geoms": [(geom.name, geom.material, list(geom.arrays)) for geom in model.geoms],
        "materials": [asdict(made) for made in model.materials],
        "images": [(image.name, image.size, image.digest) for image in model.images],
    }
    save_derived(key, about, arrays)


class _Images:
    """Pixels of a file's images; the file is parsed when the first are asked for."""

    def __init__(self, parse: Callable[[], ModelData]) -> None:
        self._parse = parse
        self._lock = Lock()
        self._model: ModelData | None = None

    def __getitem__(self, number: int) -> Callable[[], NDArray[np.uint8]]:
        def decode() -> NDArray[np.uint8]:
            with self._lock:
                if self._model is None:
                    self._model = replace(self._parse(), geoms=[], nodes=[])
            return self._model.images[number].decode()

        return decode


def _unpacked(kept: Kept, images: _Images) -> ModelData:
    """The model in a file; an exception if it is none. What the tree checks is not checked here."""
    about, arrays = kept
    counts = {what: len(about[what]) for what in ("nodes", "geoms", "materials", "images")}
    used = set()

    def array(number: int, what: str) -> NDArray[Any]:
        used.add(name := f"{number} {what}")
        if arrays[name].dtype != _DTYPES[what]:
            raise TypeError(name)
        return arrays[name]

    model = ModelData(
        _text(about["name"]),
        [
            NodeData(
                _text(name),
                _index(parent, number, least=-1),
                array(number, "matrix") if f"{number} matrix" in arrays else None,
                tuple(_index(geom, counts["geoms"]) for geom in geoms),
            )
            for number, (name, parent, geoms) in enumerate(about["nodes"])
        ],
        [
            GeomData(
                _text(name),
                _index(material, counts["materials"]),
                {what: array(number, what) for what in given},
            )
            for number, (name, material, given) in enumerate(about["geoms"])
        ],
        [MaterialData(**made) for made in about["materials"]],
        [
            ImageData(
                _text(name), (_index(width, 2**16, 1), _index(height, 2**16, 1)), images[number], digest
            )
            for number, (name, (width, height), digest) in enumerate(about["images"])
        ],
    )
    for made in model.materials:
        _text(made.name)
        if made.image is not None:
            _index(made.image, counts["images"])
        if type(made.alpha_cutoff) is not float or type(made.double_sided) is not bool:
            raise TypeError(made)
    for image in model.images:
        if not re.fullmatch("[0-9a-f]{40}", _text(image.digest)):
            raise ValueError(image.digest)
    shown = {geom for node in model.nodes for geom in node.geoms}
    if used != set(arrays) or not shown or shown != set(range(counts["geoms"])):
        raise ValueError("other arrays, or geoms that no node shows")
    return model


def _index(value: object, count: int, least: int = 0) -> int:
    if type(value) is not int or not least <= value < count:
        raise ValueError(value)
    return value


def _text(value: object) -> str:
    if type(value) is not str:
        raise TypeError(value)
    return value
