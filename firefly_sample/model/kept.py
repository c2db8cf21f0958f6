"""Models kept on disk, so that a file is parsed once.

A kept model is loaded without decoding images. The pixels are not kept: drawing needs only the mipmaps (see
`firefly_sample.mipmaps`), and asking for the pixels parses the file again.
"""

from __future__ import annotations

import math
import re
import types
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import fields, replace
from functools import cache, partial
from importlib import metadata
from threading import Lock
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from firefly_sample.disk_cache import Kept, derived_folder, fingerprint, load_derived, save_derived
from firefly_sample.model.data import ImageData, ModelData
from firefly_sample.model.tree import make_tree
from firefly_sample.scene.nodepath import NodePath

VERSION = 8
"""Version of the readers and of the cached form; counts up when either changes."""

_PACKAGES = "pillow", "DracoPy", "meshoptimizer", "trimesh"
"""Packages that decode a part of a file."""
_WHOLE = {"triangles", "joints"}
"""Arrays of a geom that hold int32; the others are float64."""
_DIGEST = re.compile("[0-9a-f]{40}")


def model_key(name: str, files: Mapping[str, bytes], *options: object) -> str | None:
    """Return the cache key of a model from its name, all bytes that it consists of, and what was asked for.

    None if the cache is off.
    """
    if derived_folder() is None:
        return None
    parts = [part for file in sorted(files) for part in (file, files[file])]
    return f"model-{fingerprint(VERSION, name, options, _versions(), *parts)}"


@cache
def _versions() -> tuple[str, ...]:
    found = []
    for package in _PACKAGES:
        try:
            found.append(f"{package} {metadata.version(package)}")
        except metadata.PackageNotFoundError:  # missing, or not installed as a package
            found.append(f"{package} unknown")
    return tuple(found)


def load_kept(key: str, parse: Callable[[], ModelData]) -> NodePath | None:
    """Return the tree cached under `key`, None if missing or damaged; `parse` is called for pixels."""
    kept = load_derived(key)
    if kept is None:
        return None
    with suppress(Exception):  # a damaged file may raise anything
        return make_tree(*_unpacked_model(kept, _decoder(parse)))
    return None


def save_kept(key: str, model: ModelData, digests: list[str]) -> None:
    """Cache a model, whose images have these hashes."""
    packer = _Packer()
    about = {
        "model": packer.pack(ModelData, replace(model, images=[])),
        "images": [
            (image.name, image.size, digest) for image, digest in zip(model.images, digests, strict=True)
        ],
    }
    save_derived(key, about, packer.arrays)


def _decoder(parse: Callable[[], ModelData]) -> Callable[[int], NDArray[np.uint8]]:
    """Return a function that decodes an image of a file; the file is parsed when the first is needed."""
    lock = Lock()
    parsed = cache(lambda: parse().images)

    def decode(number: int) -> NDArray[np.uint8]:
        with lock:
            images = parsed()
        return images[number].decode()

    return decode


def _unpacked_model(
    kept: Kept, decode: Callable[[int], NDArray[np.uint8]]
) -> tuple[ModelData, list[str | None]]:
    """Return the model of a cached file and the hashes of its images, or raise any exception."""
    unpacker = _Unpacker(kept.arrays)
    model: ModelData = unpacker.unpack(ModelData, kept.about["model"])
    if unpacker.unused or set(kept.about) != {"model", "images"}:
        raise ValueError("it holds something else")
    digests: list[str | None] = []
    for number, image in enumerate(kept.about["images"]):
        name, size, digest = unpacker.unpack(tuple[str, tuple[int, int], str], image)
        if not _DIGEST.fullmatch(digest) or not all(0 < length < 2**16 for length in size):
            raise ValueError(image)
        model.images.append(ImageData(name, size, partial(decode, number)))
        digests.append(digest)
    _check_indices(model)
    return model, digests


def _check_indices(model: ModelData) -> None:
    """Raise IndexError if an index of a model lies outside its list."""
    lists: list[tuple[list[Any], list[Any]]] = [
        (model.images, [texture.image for texture in model.textures]),
        (model.textures, [made.texture for made in model.materials]),
        (model.textures, [made.emission_texture for made in model.materials]),
        (model.textures, [made.metallic_roughness_texture for made in model.materials]),
        (model.textures, [made.normal_texture for made in model.materials]),
        (model.textures, [made.occlusion_texture for made in model.materials]),
        (model.materials, [made.material for made in model.geoms]),
        (model.geoms, [geom for node in model.nodes for geom in node.geoms]),
        (model.skins, [node.skin for node in model.nodes]),
        (model.cameras, [node.camera for node in model.nodes]),
        (model.lights, [node.light for node in model.nodes]),
        (model.nodes, [joint for skin in model.skins for joint in skin.joints]),
        (model.nodes, [channel.node for made in model.animations for channel in made.channels]),
    ]
    for entries, indices in lists:
        if not all(index is None or 0 <= index < len(entries) for index in indices):
            raise IndexError(indices)
    if not all(-1 <= node.parent < index for index, node in enumerate(model.nodes)):
        raise IndexError("parent")


# Data classes become lists of their fields, and arrays numbers, under which they are stored beside the JSON.
# Both directions follow the type hints of the classes, so that a value of another type is noticed.


@cache
def _hints(kind: type) -> dict[str, Any]:
    found = get_type_hints(kind)
    return {entry.name: found[entry.name] for entry in fields(kind)}


def _dtype(name: str) -> np.dtype[Any]:
    return np.dtype("<i4") if name in _WHOLE else np.dtype("<f8")


class _Packer:
    """Turns data into JSON and arrays."""

    def __init__(self) -> None:
        self.arrays: dict[str, NDArray[Any]] = {}

    def pack(self, hint: Any, value: Any, name: str = "") -> Any:
        """Return a value of a type as JSON; `name` is that of the field or key that holds it."""
        if hint in (str, int, float, bool):
            return hint(value)
        origin, inner = get_origin(hint), get_args(hint)
        if origin is Literal:
            return value
        if origin in (Union, types.UnionType):
            return None if value is None else self.pack(_without_none(inner), value, name)
        if origin is np.ndarray:
            number = str(len(self.arrays))
            self.arrays[number] = np.asarray(value, dtype=_dtype(name))
            return int(number)
        if origin is list:
            return [self.pack(inner[0], entry) for entry in value]
        if origin is tuple:
            hints = (inner[0],) * len(value) if inner[-1] is Ellipsis else inner
            return [self.pack(kind, entry) for kind, entry in zip(hints, value, strict=True)]
        if origin is dict:
            return {key: self.pack(inner[1], entry, key) for key, entry in value.items()}
        return [self.pack(kind, getattr(value, field), field) for field, kind in _hints(hint).items()]


class _Unpacker:
    """Turns JSON and arrays into data again, or raises an exception if a type differs."""

    def __init__(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        self.unused = dict(arrays)

    def unpack(self, hint: Any, value: Any, name: str = "") -> Any:
        """Return the value of a type that `_Packer` has packed."""
        if hint in (str, int, float, bool):
            if type(value) is not hint or (hint is float and math.isnan(value)):
                raise TypeError(value)
            return value
        origin, inner = get_origin(hint), get_args(hint)
        if origin is Literal:
            if type(value) is not str or value not in inner:
                raise ValueError(value)
            return value
        if origin in (Union, types.UnionType):
            return None if value is None else self.unpack(_without_none(inner), value, name)
        if origin is np.ndarray:
            return self._array(value, name)
        if origin is dict:
            if type(value) is not dict:
                raise TypeError(value)
            return {key: self.unpack(inner[1], entry, key) for key, entry in value.items()}
        if type(value) is not list:
            raise TypeError(value)
        if origin is list:
            return [self.unpack(inner[0], entry) for entry in value]
        if origin is tuple:
            hints = (inner[0],) * len(value) if inner[-1] is Ellipsis else inner
            return tuple(self.unpack(kind, entry) for kind, entry in zip(hints, value, strict=True))
        assert isinstance(hint, type)
        made = zip(_hints(hint).items(), value, strict=True)
        return hint(**{field: self.unpack(kind, entry, field) for (field, kind), entry in made})

    def _array(self, number: Any, name: str) -> NDArray[Any]:
        if type(number) is not int:
            raise TypeError(number)
        array = self.unused.pop(str(number))  # each is used once
        if array.dtype != _dtype(name):
            raise TypeError(name)
        return array


def _without_none(hints: tuple[Any, ...]) -> Any:
    (hint,) = (hint for hint in hints if hint is not type(None))
    return hint
