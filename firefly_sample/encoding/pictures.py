"""PNG, WebP and JPEG by Pillow, for 8-bit pictures.

The codes are sRGB's. The files do not say so, because readers take pictures without a colour profile for sRGB
(CSS Color 4 demands it), and because the bytes of PNG files stay those of earlier versions.
"""

from __future__ import annotations

import io
from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from firefly_sample.encoding.format import Choices, Format
from firefly_sample.errors import OutputError
from firefly_sample.frame import OUTPUTS, Image


class _Picture(Format):
    """A format of Pillow.

    Attributes
    ----------
    kind : str
        Pillow's name.
    has_alpha : bool
        True if it holds four channels.
    largest_side : int
        The largest width and height in pixels.
    """

    kind: ClassVar[str]
    has_alpha: ClassVar[bool] = True
    largest_side: ClassVar[int] = 2**31 - 1

    def refusal(self, output: str) -> str:
        """Return why it cannot hold an output; "" if it can."""
        if OUTPUTS[output].dtype != "uint8":
            return "it is for 8-bit pictures"
        return "" if OUTPUTS[output].channels == 3 or self.has_alpha else "it has no alpha"

    @abstractmethod
    def options(self, choices: Choices) -> dict[str, Any]:
        """Return the arguments of Pillow's ``save``."""

    def encode(self, images: Mapping[str, Image], choices: Choices) -> bytes:
        """Return a file with one image."""
        import PIL.Image

        ((output, image),) = images.items()
        height, width = image.shape[:2]
        if max(width, height) > self.largest_side:
            raise OutputError(
                f"output {output!r} has {width}x{height} pixels: a side of a {self.name} picture ends at "
                f"{self.largest_side}, choose png"
            )
        file = io.BytesIO()
        PIL.Image.fromarray(image).save(file, format=self.kind, **self.options(choices))
        return file.getvalue()

    def decode(self, content: bytes, outputs: tuple[str, ...], choices: Choices) -> dict[str, Image]:
        """Return the images of a file."""
        import PIL.Image

        (output,) = outputs
        with PIL.Image.open(io.BytesIO(content), formats=[self.kind]) as picture:
            return {output: _pixels(picture, OUTPUTS[output].channels)}


def _pixels(picture: Any, channels: int) -> Image:
    """Return the pixels of a picture. Tools that make files smaller store the same pixels in other modes."""
    wanted = {3: "RGB", 4: "RGBA"}[channels]
    plain = picture.mode == wanted and "transparency" not in picture.info
    if plain or picture.mode not in ("1", "L", "LA", "P", "PA", "RGB", "RGBA"):
        return np.asarray(picture)
    rgba = np.asarray(picture.convert("RGBA"))
    return rgba[..., :channels] if (rgba[..., channels:] == 255).all() else rgba


class Png(_Picture):
    """PNG with 8 bits a channel."""

    name = "png"
    suffixes = (".png",)
    kind = "PNG"

    def options(self, choices: Choices) -> dict[str, Any]:
        """Return the arguments of Pillow's ``save``."""
        return {}


class WebP(_Picture):
    """WebP: without loss, or with a quality.

    Without loss, the colours of pixels with alpha 0 are kept too. libwebp's least effort makes files a tenth
    smaller than PNG in a tenth of its time; its largest effort takes another tenth off them in forty times
    the time.
    """

    name = "webp"
    suffixes = (".webp",)
    kind = "WEBP"
    largest_side = 16383

    def is_exact(self, output: str, choices: Choices) -> bool:
        """Return whether an output's bits survive."""
        return choices.quality is None

    def choices_for(self, output: str) -> frozenset[str]:
        """Return the names of the `Choices` that an output's file depends on."""
        return frozenset({"quality"})

    def options(self, choices: Choices) -> dict[str, Any]:
        """Return the arguments of Pillow's ``save``."""
        if choices.quality is not None:
            return {"quality": choices.quality}
        return {"lossless": True, "exact": True, "method": 0, "quality": 20}


class Jpeg(_Picture):
    """JPEG with a colour for each pixel (4:4:4)."""

    name = "jpeg"
    suffixes = (".jpg", ".jpeg")
    kind = "JPEG"
    has_alpha = False
    largest_side = 65500

    def is_exact(self, output: str, choices: Choices) -> bool:
        """Return whether an output's bits survive."""
        return False

    def choices_for(self, output: str) -> frozenset[str]:
        """Return the names of the `Choices` that an output's file depends on."""
        return frozenset({"quality"})

    def options(self, choices: Choices) -> dict[str, Any]:
        """Return the arguments of Pillow's ``save``."""
        return {"quality": 95 if choices.quality is None else choices.quality, "subsampling": "4:4:4"}
