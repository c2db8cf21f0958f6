"""A model file as plain data: the tree of nodes that it becomes, and how it is kept on disk.

A kept model is loaded without trimesh and without decoding images. The pixels are not kept: drawing needs
only the mipmaps (see `firefly_sample.mipmaps`), and asking for the pixels parses the file.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from functools import cache, partial
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
    images: list[Texture] = field(default_factory=list)

    def as_tree(self) -> NodePath:
        """Return new nodes, geoms and materials; raise SceneError if a number or an array is wrong."""
        materials = []
        for made in self.materials:
            arguments = asdict(made)
            image = arguments.pop("image")
            materials.append(Material(**arguments, texture=None if image is None else self.images[image]))
        geoms = [(Geom(**geom.arrays, name=geom.name), materials[geom.material]) for geom in self.geoms]
        root = NodePath(self.name)
        paths: list[NodePath] = []
        for data in self.nodes:
            node = GeomNode(data.name)
            for number in data.geoms:
                node.add_geom(*geoms[number])
            path = (root if data.parent < 0 else paths[data.parent]).attach_new_node(node)
            if data.matrix is not None:
                path.set_mat(data.matrix)
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
    if derived_folder() is None:
        return None
    readers = _version("trimesh"), _version("pillow")  # they parse files and decode images
    return f"model-{fingerprint(VERSION, name, data, readers)}"


@cache
def _version(package: str) -> str:
    try:
        return f"{package} {metadata.version(package)}"
    except metadata.PackageNotFoundError:  # there, but not installed as a package
        return f"{package} unknown"


def load_kept(key: str, parse: Callable[[], ModelData]) -> NodePath | None:
    """Return the tree cached under `key`, None if missing or damaged; `parse` is called for pixels."""
    kept = load_derived(key)
    if kept is None:
        return None
    with suppress(Exception):  # a damaged file may raise anything
        return _unpacked(kept, _decoder(parse)).as_tree()
    return None


def save_kept(key: str, model: ModelData) -> None:
    """Cache a model, and give its images their hashes."""
    for image in model.images:
        image.digest = fingerprint(image.pixels)
    arrays = {
        f"{number} {what}": np.asarray(array, dtype=_DTYPES[what])
        for number, geom in enumerate(model.geoms)
        for what, array in geom.arrays.items()
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


def _decoder(parse: Callable[[], ModelData]) -> Callable[[int], NDArray[np.uint8]]:
    """Return a function that decodes an image of a file; the file is parsed when the first is needed."""
    lock = Lock()
    parsed = cache(lambda: replace(parse(), geoms=[], nodes=[]))

    def decode(number: int) -> NDArray[np.uint8]:
        with lock:
            model = parsed()
        return model.images[number].pixels

    return decode


def _unpacked(kept: Kept, decode: Callable[[int], NDArray[np.uint8]]) -> ModelData:
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
            Texture.from_file(
                partial(decode, number),
                (_index(width, 2**16, 1), _index(height, 2**16, 1)),
                digest,
                _text(name),
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
