"""NumPy's compressed archives, for data."""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any

import numpy as np

from firefly_sample.encoding.format import Choices, Format
from firefly_sample.frame import OUTPUTS, Image


class Npz(Format):
    """Compressed ``.npz`` with arrays that are named like their outputs.

    The same pixels give the same bytes with the same versions of zlib and NumPy.
    """

    name = "npz"
    suffixes = (".npz",)

    def refusal(self, output: str) -> str:
        """Return why it cannot hold an output; "" if it can."""
        return "it is for data, not for 8-bit pictures" if OUTPUTS[output].dtype == "uint8" else ""

    def encode(self, images: Mapping[str, Image], choices: Choices) -> bytes:
        """Return a file with an array for each image."""
        file = io.BytesIO()
        arrays: dict[str, Any] = dict(images)
        np.savez_compressed(file, **arrays)
        return file.getvalue()

    def decode(self, content: bytes, outputs: tuple[str, ...], choices: Choices) -> dict[str, Image]:
        """Return the images of a file."""
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            return {output: arrays[output] for output in outputs}
