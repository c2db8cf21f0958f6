"""The images of a glTF file, from buffer views, data URIs and files beside it (glTF 2.0, section 3.8)."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import ModelError
from firefly_sample.model.data import ImageData
from firefly_sample.model.gltf.container import is_data_uri
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.json_object import JsonObject
from firefly_sample.model.gltf.pixels import decode_image, image_size


class Images:
    """The images that materials use, each once.

    Parameters
    ----------
    document : Document
    max_megapixels : float
        Images with more than this many million pixels are refused before they are decoded.

    Attributes
    ----------
    found : list of ImageData
    """

    def __init__(self, document: Document, max_megapixels: float) -> None:
        self.found: list[ImageData] = []
        self._document = document
        self._max_megapixels = max_megapixels
        self._places: dict[int, int] = {}

    def add(self, index: int, material: str) -> int:
        """Return the place in `found` of an image of the file, which a material uses.

        Raises
        ------
        ModelError
            If it is missing, damaged in its header, or too large; its `decode` also raises it. The message
            names the image and the material.
        """
        if index not in self._places:
            self._places[index] = len(self.found)
            self.found.append(self.read(index, material))
        return self._places[index]

    def read(self, index: int, material: str) -> ImageData:
        """Return an image of the file without keeping it; see `add`."""
        image = self._document.item("images", index, "image")
        name = _name(image, index)
        what = f"model {self._document.path}: image {name!r} of material {material!r}"
        data = self._data(image)
        try:
            size = image_size(data)
        except ValueError as error:
            raise ModelError(f"{what} cannot be read: {error}") from None
        if size[0] * size[1] > self._max_megapixels * 1e6:
            raise ModelError(
                f"{what} has {size[0]}x{size[1]} pixels, more than max_texture_megapixels="
                f"{self._max_megapixels:g} allows: make it smaller, or raise that limit"
            )
        return ImageData(name, size, partial(_decode, data, what))

    def _data(self, image: JsonObject) -> bytes:
        uri = image.text("uri", None)
        if uri is not None:
            return self._document.read_uri(uri, image.place("uri"))[0]
        if "bufferView" not in image:
            raise image.error("", "has neither a uri nor a bufferView")
        view, _ = self._document.read_buffer_view(image.json["bufferView"], image.place("bufferView"))
        return view.tobytes()


def _name(image: JsonObject, index: int) -> str:
    uri = image.text("uri", None)
    beside = uri if uri is not None and not is_data_uri(uri) else ""
    return image.text("name", "") or beside or f"image {index}"


def _decode(data: bytes, what: str) -> NDArray[np.uint8]:
    try:
        return decode_image(data)
    except ValueError as error:
        raise ModelError(f"{what} is damaged: {error}") from None
