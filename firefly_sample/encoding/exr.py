"""OpenEXR: one file a frame, with the outputs as named layers.

====================================  ==========================  =====================================
outputs                               channels                    pixels
====================================  ==========================  =====================================
radiance                              R, G, B                     float or half
depth                                 Z                           float or half
albedo, specular, emission, light     albedo.R, .G, .B            float or half
normal, normal_world, position,       normal.X, .Y, .Z            float or half
position_world
shininess, metallic, roughness        shininess.Y                 float or half
id                                    id.Y                        uint: id + 1, and 0 for nothing
visibility                            visibility.X, .Y            uint: index + 1, and 0 for nothing
overdraw                              overdraw.Y                  uint
====================================  ==========================  =====================================

R, G, B, Z and Y are OpenEXR's own names for colour, depth and brightness: viewers show the radiance first,
and Nuke and Blender find the depth. The other channels are <layer>.<letter>, because Blender reads only
channels that end in a single letter. The atlases have another size than the picture, and no layer.
"""

from __future__ import annotations

import io
import sys
import threading
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from firefly_sample.encoding.format import Choices, Format
from firefly_sample.errors import MissingPackageError, OutputError
from firefly_sample.extras import install_command
from firefly_sample.frame import OUTPUTS, Image

_LETTERS = {
    "radiance": "RGB",
    "depth": "Z",
    **dict.fromkeys(("albedo", "specular", "emission", "light"), "RGB"),
    **dict.fromkeys(("normal", "normal_world", "position", "position_world"), "XYZ"),
    **dict.fromkeys(("shininess", "metallic", "roughness", "id", "overdraw"), "Y"),
    "visibility": "XY",
}
_UNNAMED = ("radiance", "depth")
"""The outputs whose channels have no layer's name before the letter."""
LARGEST_HALF = 65504


class Exr(Format):
    """OpenEXR with 32-bit floats and unsigned integers, compressed by ZIP."""

    name = "exr"
    suffixes = (".exr",)
    has_layers = True
    half: ClassVar[bool] = False
    """True if floats are stored with 16 bits."""

    def refusal(self, output: str) -> str:
        """Return why it cannot hold an output; "" if it can."""
        if OUTPUTS[output].dtype == "uint8":
            return "it is for light and data, and the output 'radiance' is the picture as light"
        return "" if output in _LETTERS else "its size is not the picture's"

    def is_exact(self, output: str, choices: Choices) -> bool:
        """Return whether an output's bits survive."""
        return not (self.half and OUTPUTS[output].dtype == "float32")

    def require(self) -> None:
        """Raise a MissingPackageError if OpenEXR is not installed."""
        _library()

    def encode(self, images: Mapping[str, Image], choices: Choices) -> bytes:
        """Return a file with a layer for each image."""
        return encode_layers(images, images if self.half else ())

    def decode(self, content: bytes, outputs: tuple[str, ...], choices: Choices) -> dict[str, Image]:
        """Return the images of a file."""
        library = _library()
        with (
            _prints_to_stderr(),
            library.File(io.BytesIO(content), separate_channels=True, num_threads=0) as file,
        ):
            channels = {name: channel.pixels for name, channel in file.channels().items()}
        return {output: _image_of(output, channels) for output in outputs}


class Exr16(Exr):
    """OpenEXR with 16-bit floats and 32-bit unsigned integers, compressed by ZIP."""

    name = "exr16"
    half = True


def channel_names(output: str) -> tuple[str, ...]:
    """Return the names of an output's channels in a file, in the order of the image's last axis."""
    return tuple(letter if output in _UNNAMED else f"{output}.{letter}" for letter in _LETTERS[output])


def encode_layers(images: Mapping[str, Image], halves: Collection[str]) -> bytes:
    """Return the content of a file with images of one size, by output; floats of `halves` have 16 bits."""
    library = _library()
    channels = {}
    for output, image in images.items():
        stored = _stored(output, image, output in halves)
        planes = stored.reshape(*stored.shape[:2], -1)
        for index, name in enumerate(channel_names(output)):
            # the library ignores strides
            channels[name] = np.ascontiguousarray(planes[..., index])
    header = {"compression": library.ZIP_COMPRESSION, "type": library.scanlineimage}
    content = io.BytesIO()
    # the caller has threads of its own
    with library.File(header, channels, num_threads=0) as file:
        file.write(content)
    return content.getvalue()


def _stored(output: str, image: Image, half: bool) -> Any:
    """Return an image in the type of its channels."""
    info = OUTPUTS[output]
    if info.dtype == "int32":
        shift = _shift(output)
        if image.size and image.min() < -shift:
            raise OutputError(f"output {output!r} has the value {image.min()}, and exr begins at {-shift}")
        return image.astype(np.uint32) + np.uint32(shift)
    if not half:
        return image
    with np.errstate(over="ignore"):
        halves = image.astype(np.float16)
    beyond = image[np.isinf(halves) & np.isfinite(image)]
    if beyond.size:
        worst = beyond[np.argmax(np.abs(beyond))]
        raise OutputError(
            f"output {output!r} has the value {worst:.6g}, and exr16 ends at {LARGEST_HALF}: choose exr"
        )
    return halves


def _shift(output: str) -> int:
    """Return what is added to whole numbers, so that nothing is 0."""
    return 1 if OUTPUTS[output].invalid == "-1" else 0


def _image_of(output: str, channels: Mapping[str, Any]) -> Image:
    planes = [channels[name] for name in channel_names(output)]
    stored = planes[0] if OUTPUTS[output].channels == 1 else np.stack(planes, axis=-1)
    if OUTPUTS[output].dtype == "float32":
        if stored.dtype not in (np.float32, np.float16):
            raise ValueError(f"the channels of {output} are {stored.dtype}")
        return stored.astype(np.float32)
    if stored.dtype != np.uint32:
        raise ValueError(f"the channels of {output} are {stored.dtype}")
    return (stored - np.uint32(_shift(output))).astype(np.int32)


def _library() -> ModuleType:
    try:
        import OpenEXR
    except ImportError as error:
        raise MissingPackageError(
            f"EXR files need the package OpenEXR ({error}): run {install_command('exr')}"
        ) from error
    module: ModuleType = OpenEXR
    return module


_printing = threading.Lock()


@contextmanager
def _prints_to_stderr() -> Iterator[None]:
    """Send to the standard error what the library prints about damaged files: others read our output."""
    with _printing, redirect_stdout(sys.stderr):
        yield
