"""Textures of materials."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, NamedTuple, TypeVar, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.errors import SceneError
from firefly_sample.scene.arrays import ReadOnlyArrays, as_codes, new_serial, read_only
from firefly_sample.scene.camel_case import CamelCase

Wrap = Literal["repeat", "clamp", "mirror"]
MagFilter = Literal["nearest", "linear"]
MinFilter = Literal[
    "nearest",
    "linear",
    "nearest_mipmap_nearest",
    "linear_mipmap_nearest",
    "nearest_mipmap_linear",
    "linear_mipmap_linear",
]

_Choice = TypeVar("_Choice", Wrap, MinFilter, MagFilter)


class Sampling(NamedTuple):
    """The wrap modes and filters of a `Texture`."""

    wrap_u: Wrap
    wrap_v: Wrap
    minfilter: MinFilter
    magfilter: MagFilter


class Texture(CamelCase, ReadOnlyArrays):
    """An image for a material, and how it is sampled.

    Parameters
    ----------
    pixels : array_like, shape (height, width, 4)
        sRGB colour and linear alpha (coverage) in 8 bits; the first row is the top of the picture. uint16,
        floats of 0 to 1 and bool are rounded to 8 bits: see `firefly_sample.scene.arrays`.
    name : str
    wrap_u, wrap_v : {"repeat", "clamp", "mirror"}
        What happens beyond the image, across and up: it repeats, its edge goes on, or it repeats and every
        second copy is mirrored.
    minfilter : {"nearest", "linear", "nearest_mipmap_nearest", "linear_mipmap_nearest", \
"nearest_mipmap_linear", "linear_mipmap_linear"}
        The filter of texels that are smaller than a pixel, by OpenGL's names: first the filter within a
        mipmap level, then whether the nearest level is taken or two are mixed.
    magfilter : {"nearest", "linear"}
        The filter of texels that are larger than a pixel.

    Two textures may share an image and differ in their sampling: ``copy.copy`` makes such a second one.

    Attributes
    ----------
    serial, revision : int
        As of a `Geom`; the sampling counts as well.
    size : (int, int)
        Width and height.
    digest : str or None
        A hash of the pixels if the image came from a file, under which derived data is cached: see
        `firefly_sample.disk_cache`.
    """

    digest: str | None
    size: tuple[int, int]
    _pixels: NDArray[np.uint8] | None
    _decode: Callable[[], NDArray[np.uint8]] | None
    _least_alpha: float | None = None

    def __init__(
        self,
        pixels: ArrayLike,
        name: str = "texture",
        *,
        wrap_u: Wrap = "repeat",
        wrap_v: Wrap = "repeat",
        minfilter: MinFilter = "linear_mipmap_linear",
        magfilter: MagFilter = "linear",
    ) -> None:
        self.name = name
        self.serial = new_serial()
        self.revision = 0
        self._set_sampling(wrap_u, wrap_v, minfilter, magfilter)
        self.set_pixels(pixels)

    @classmethod
    def from_file(
        cls,
        decode: Callable[[], NDArray[np.uint8]],
        size: tuple[int, int],
        digest: str | None,
        name: str,
        *,
        wrap_u: Wrap = "repeat",
        wrap_v: Wrap = "repeat",
        minfilter: MinFilter = "linear_mipmap_linear",
        magfilter: MagFilter = "linear",
    ) -> Texture:
        """Return a texture whose pixels, of this size, are decoded when they are first needed.

        `decode` is called at most once; with cached mipmaps the pixels are not needed.
        """
        texture = cls.__new__(cls)
        texture.name, texture.size, texture.digest = name, size, digest
        texture.serial, texture.revision = new_serial(), 1
        texture._pixels, texture._decode = None, decode
        texture._set_sampling(wrap_u, wrap_v, minfilter, magfilter)
        return texture

    @property
    def pixels(self) -> NDArray[np.uint8]:
        """The image, read-only."""
        if self._decode is not None:
            self._pixels, self._decode = self._checked(self._decode()), None
        assert self._pixels is not None
        return self._pixels

    def set_pixels(self, pixels: ArrayLike) -> None:
        """Replace the image, of any size; `pixels` is copied and then read-only."""
        image = self._checked(pixels)
        self._pixels, self._decode, self._least_alpha = image, None, None
        self.digest = None
        self.size = (image.shape[1], image.shape[0])
        self.revision += 1

    def set_wrap_u(self, wrap: Wrap) -> None:
        """Set what happens beyond the image's left and right edges."""
        self._set_sampling(wrap, self.wrap_v, self.minfilter, self.magfilter)
        self.revision += 1

    def set_wrap_v(self, wrap: Wrap) -> None:
        """Set what happens beyond the image's lower and upper edges."""
        self._set_sampling(self.wrap_u, wrap, self.minfilter, self.magfilter)
        self.revision += 1

    def set_minfilter(self, minfilter: MinFilter) -> None:
        """Set the filter of texels that are smaller than a pixel."""
        self._set_sampling(self.wrap_u, self.wrap_v, minfilter, self.magfilter)
        self.revision += 1

    def set_magfilter(self, magfilter: MagFilter) -> None:
        """Set the filter of texels that are larger than a pixel."""
        self._set_sampling(self.wrap_u, self.wrap_v, self.minfilter, magfilter)
        self.revision += 1

    def _set_sampling(self, wrap_u: Wrap, wrap_v: Wrap, minfilter: MinFilter, magfilter: MagFilter) -> None:
        self.wrap_u: Wrap = self._choice("wrap_u", wrap_u, get_args(Wrap))
        self.wrap_v: Wrap = self._choice("wrap_v", wrap_v, get_args(Wrap))
        self.minfilter: MinFilter = self._choice("minfilter", minfilter, get_args(MinFilter))
        self.magfilter: MagFilter = self._choice("magfilter", magfilter, get_args(MagFilter))

    @property
    def sampling(self) -> Sampling:
        """All four settings as one hashable value."""
        return Sampling(self.wrap_u, self.wrap_v, self.minfilter, self.magfilter)

    def _choice(self, what: str, given: _Choice, choices: tuple[_Choice, ...]) -> _Choice:
        if not isinstance(given, str) or given not in choices:
            *others, last = map(repr, choices)
            raise SceneError(
                f"texture {self.name!r}: {what} must be {', '.join(others)} or {last}, got {given!r}"
            )
        return given

    def least_alpha(self) -> float:
        """Return the smallest alpha of all texels, 0..1; it is computed once per image."""
        if self._least_alpha is None:
            self._least_alpha = int(self.pixels[..., 3].min()) / 255.0
        return self._least_alpha

    def _checked(self, pixels: ArrayLike) -> NDArray[np.uint8]:
        what = f"texture {self.name!r}: pixels"
        image = as_codes(what, pixels)
        if image.ndim != 3 or image.shape[2] != 4 or 0 in image.shape:
            raise SceneError(f"{what} must have shape (height, width, 4), got {image.shape}")
        return read_only(image)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state with decoded pixels: another process may lack the function that decodes them."""
        return self.__dict__ | {"_pixels": self.pixels, "_decode": None}

    def __copy__(self) -> Texture:
        twin = type(self).__new__(type(self))
        twin.__dict__.update(self.__dict__)
        twin.serial = new_serial()
        return twin

    def __deepcopy__(self, _: dict[int, Any]) -> Texture:
        return self.__copy__()  # its pixels are never changed, only replaced

    def __repr__(self) -> str:
        return f"Texture({self.name!r}, {self.size[0]}x{self.size[1]})"
