"""One file format for images: what it can hold, and how it is written and read."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from firefly_sample.frame import Image

DEPTH_SCALE = 0.001
"""Scene units of one code of a 16-bit depth: a millimetre, where a unit is a metre."""


@dataclass(frozen=True)
class Choices:
    """Numbers that some formats need.

    Attributes
    ----------
    quality : int or None
        1 to 100, of JPEG and WebP; None for JPEG's 95, and for WebP without loss.
    depth_scale : float
        Scene units of one code of a 16-bit depth.
    """

    quality: int | None = None
    depth_scale: float = DEPTH_SCALE


class Format(ABC):
    """A file format for images.

    Attributes
    ----------
    name : str
        As in ``--format``.
    suffixes : tuple of str
        The endings of its files; the first is the one that captures give.
    has_layers : bool
        True if one file holds any number of outputs.
    """

    name: ClassVar[str]
    suffixes: ClassVar[tuple[str, ...]]
    has_layers: ClassVar[bool] = False

    @abstractmethod
    def refusal(self, output: str) -> str:
        """Return why it cannot hold an output, for example "it has no alpha"; "" if it can."""

    def is_exact(self, output: str, choices: Choices) -> bool:
        """Return whether an output's decoded image has the same bits as the encoded one."""
        return True

    def choices_for(self, output: str) -> frozenset[str]:
        """Return the names of the `Choices` that an output's file depends on."""
        return frozenset()

    def require(self) -> None:
        """Raise a MissingPackageError if a package that it needs is not installed."""
        return

    @abstractmethod
    def encode(self, images: Mapping[str, Image], choices: Choices) -> bytes:
        """Return the content of a file; the same images and choices give the same bytes.

        `images` are by output: one, unless the format has layers. Raises an OutputError that names the output
        and the value if a value does not fit.
        """

    @abstractmethod
    def decode(self, content: bytes, outputs: tuple[str, ...], choices: Choices) -> dict[str, Image]:
        """Return the images of a file, in the dtype and shape of their outputs.

        It raises any exception if the file is damaged, or has another kind of picture in it.
        """
