"""Models that were read before: meshes, materials and the tree, without trimesh and without decoding images.

The pixels themselves are not kept. What is drawn of them is (see `firefly_sample.mipmaps`), and whoever wants
them all the same has the file parsed after all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace
from functools import cache
from importlib import metadata
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.derived import Kept, derived_folder, fingerprint, load_derived, save_derived
from firefly_sample.scene.model_data import GeomData, ImageData, MaterialData, ModelData, NodeData

__all__ = ["load_kept", "model_key", "save_kept"]

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


def load_kept(key: str, parse: Callable[[], ModelData]) -> ModelData | None:
    """The model that was kept under `key`, None if there is none; `parse` is called for an image's pixels."""
    kept = load_derived(key)
    if kept is None:
        return None
    images = _Images(parse)
    try:
        return _unpacked(kept, images)
    except (KeyError, IndexError, TypeError, ValueError):  # whole, but not of a model
        return None


def save_kept(key: str, model: ModelData) -> None:
    """Keep a model, whose images must have their digests."""
    arrays: dict[str, NDArray[Any]] = {}
    for number, geom in enumerate(model.geoms):
        arrays |= {f"{number} {what}": array for what, array in geom.arrays.items()}
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
    about, arrays = kept
    return ModelData(
        about["name"],
        [
            NodeData(name, parent, arrays.get(f"{number} matrix"), tuple(geoms))
            for number, (name, parent, geoms) in enumerate(about["nodes"])
        ],
        [
            GeomData(name, material, {what: arrays[f"{number} {what}"] for what in given})
            for number, (name, material, given) in enumerate(about["geoms"])
        ],
        [MaterialData(**made) for made in about["materials"]],
        [
            ImageData(name, (size[0], size[1]), images[number], digest)
            for number, (name, size, digest) in enumerate(about["images"])
        ],
    )
