"""A model file as plain data: the tree of nodes that it becomes, and how it is kept on disk.

A kept model is loaded without trimesh and without decoding images. The pixels are not kept: what is
drawn is made of the mipmaps (see `firefly_sample.mipmaps`). Whoever asks for the pixels has the file parsed.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from importlib import metadata
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.disk_cache import Kept, derived_folder, fingerprint, load_derived, save_derived
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.material import AlphaMode, Material, Texture
from firefly_sample.scene.nodepath import NodePath


@dataclass
class ImageData:
    """An image: a function that returns its pixels and, if known, their hash."""

    name: str
    size: tuple[int, int]
    decode: Callable[[], NDArray[np.uint8]]
    digest: str | None = None

    @classmethod
    def of(cls, pixels: NDArray[np.uint8], name: str) -> ImageData:
        """Return an image that is decoded already."""
        return cls(name, (pixels.shape[1], pixels.shape[0]), lambda: pixels)


@dataclass
class MaterialData:
    """The arguments of a `Material`; `image` is an index into the model's images."""

    name: str
    base_color: ArrayLike
    image: int | None
    alpha_mode: AlphaMode
    alpha_cutoff: float
    double_sided: bool


@dataclass
class GeomData:
    """The arrays of a `Geom`, and the index of its material."""

    name: str
    material: int
    arrays: dict[str, NDArray[Any]]


@dataclass
class NodeData:
    """A node: the index of its parent, which comes earlier (-1: the root), its matrix and its geoms."""

    name: str
    parent: int
    matrix: NDArray[np.float64] | None
    geoms: tuple[int, ...]


@dataclass
class ModelData:
    """A whole file, with the name of its root."""

    name: str
    nodes: list[NodeData] = field(default_factory=list)
    geoms: list[GeomData] = field(default_factory=list)
    materials: list[MaterialData] = field(default_factory=list)
    images: list[ImageData] = field(default_factory=list)

    def as_tree(self, digests: bool = True) -> NodePath:
        """Return new nodes, geoms, materials and textures; what several nodes use is shared.

        Parameters
        ----------
        digests : bool
            Compute the hashes of images that have none.

        Raises
        ------
        SceneError
            If a number or an array is wrong.
        """
        if digests:
            for image in self.images:
                if image.digest is None:
                    image.digest = fingerprint(image.decode())
        textures = [
            Texture.from_file(image.decode, image.size, image.digest, image.name) for image in self.images
        ]
        materials = [
            Material(
                made.name,
                base_color=made.base_color,
                texture=None if made.image is None else textures[made.image],
                alpha_mode=made.alpha_mode,
                alpha_cutoff=made.alpha_cutoff,
                double_sided=made.double_sided,
            )
            for made in self.materials
        ]
        geoms = [(Geom(**geom.arrays, name=geom.name), materials[geom.material]) for geom in self.geoms]
        root = NodePath(self.name)
        paths: list[NodePath] = []
        for made in self.nodes:
            node = GeomNode(made.name)
            for number in made.geoms:
                node.add_geom(*geoms[number])
            path = (root if made.parent < 0 else paths[made.parent]).attach_new_node(node)
            if made.matrix is not None:
                path.set_mat(made.matrix)
            paths.append(path)
        return root


_DTYPES: dict[str, np.dtype[Any]] = {
    **{what: np.dtype("<f8") for what in ("vertices", "normals", "texcoords", "colors", "matrix")},
    "triangles": np.dtype("<i4"),
}
VERSION = 1
"""Version of the reader and of the cached form; counts up when either changes."""


def model_key(name: str, data: bytes) -> str | None:
    """Return the cache key of a model from its name and its file's bytes; None if the cache is off."""
    return f"model-{fingerprint(VERSION, name, data, _readers())}" if derived_folder() else None


@cache
def _readers() -> tuple[str, ...]:
    """Return the versions of the packages that parse files and decode images."""
    return tuple(f"{package} {_version(package)}" for package in ("trimesh", "pillow"))


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:  # there, but not installed as a package
        return "unknown"


def load_kept(key: str, parse: Callable[[], ModelData]) -> NodePath | None:
    """Return the tree of the model that is cached under `key`; None if it is missing or damaged.

    `parse` is called if an image's pixels are needed.
    """
    kept = load_derived(key)
    if kept is None:
        return None
    with suppress(Exception):  # a damaged file may raise anything
        return _unpacked(kept, _Images(parse)).as_tree(digests=False)
    return None


def save_kept(key: str, model: ModelData) -> None:
    """Cache a model, whose images must have their hashes."""
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
    """The pixels of a file's images; the file is parsed when the first are needed."""

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
    """Return the model of a cached file, or raise; what `as_tree` checks is not checked here."""
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
