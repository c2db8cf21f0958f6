"""The images of a glTF file, from buffer views, data URIs and files beside it (glTF 2.0, section 3.8)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.model.data import ImageData
from firefly_sample.model.gltf.container import is_data_uri
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.json_object import JsonObject
from firefly_sample.model.pixels import GLTF_FORMATS, made_image, open_image


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

    def add_made(self, pixels: NDArray[np.uint8], name: str) -> int:
        """Return the place in `found` of an image that is not in the file."""
        self.found.append(made_image(pixels, name))
        return len(self.found) - 1

    def read(self, index: int, material: str) -> ImageData:
        """Return an image of the file without keeping it; see `add`."""
        image = self._document.item("images", index, "image")
        name = _name(image, index)
        what = f"model {self._document.path}: image {name!r} of material {material!r}"
        data = self._data(image)
        return open_image(data, name, what, self._max_megapixels, GLTF_FORMATS)

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
