"""One kind of data set: what it needs of a capture, and the documents that it adds to it."""

from __future__ import annotations

import json
import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import IO, Any, ClassVar, Literal

from firefly_sample.capture.datasets.masks import require_rle
from firefly_sample.capture.layout import Layout, layout_of
from firefly_sample.errors import OutputError
from firefly_sample.scene.intrinsics import Intrinsics
from firefly_sample.scene.lens_base import Lens

Frame = Mapping[str, Any]
"""A `FrameEntry` of a manifest."""
Frames = Iterable[Frame]
"""The entries of one capture in the order of their frames. They are gone through more than once."""
Need = Literal["instances", "whole masks", "rle"]
Matrix = Sequence[Sequence[float]]

_WHOLE = re.compile(r"0|[1-9][0-9]{0,9}")
_LARGEST_ID = 2**31 - 1
"""Readers keep ids in arrays of whole numbers, some of them with 32 bits."""


class Dataset(ABC):
    """A kind of data set.

    Attributes
    ----------
    name : str
        As in ``--dataset``.
    outputs : tuple of str
        The outputs that are drawn if none are named.
    formats : mapping of str to str
        The format of an output for which none is chosen, where it is not the usual one.
    needs : frozenset of str
        What a frame's entry must have: "instances"; in each of these "whole" and files of both masks ("whole
        masks"); in each of these "rle".
    pictures : tuple of str
        The outputs of which one is the picture of a frame, the best one first.
    picture_formats : tuple of str
        The formats that its readers open.
    pinhole : bool
        True if it describes cameras by a matrix K, which only perspective lenses have.
    documents : tuple of str
        The names of the files that `write` adds.
    """

    name: ClassVar[str]
    outputs: ClassVar[tuple[str, ...]] = ("color",)
    formats: ClassVar[Mapping[str, str]] = MappingProxyType({})
    needs: ClassVar[frozenset[Need]] = frozenset()
    pictures: ClassVar[tuple[str, ...]] = ("color",)
    picture_formats: ClassVar[tuple[str, ...]] = ("png", "jpeg")
    pinhole: ClassVar[bool] = True
    documents: ClassVar[tuple[str, ...]]

    @property
    def layout(self) -> Layout:
        """The names of its files."""
        return layout_of(self.name)

    def check(self, outputs: Iterable[str], formats: Mapping[str, str]) -> None:
        """Raise an OutputError if a capture of these outputs, in these formats, cannot be this data set."""
        outputs = tuple(outputs)
        picture = next((one for one in self.pictures if one in outputs), None)
        if picture is None:
            names = " or ".join(map(repr, self.pictures))
            raise OutputError(f"data set {self.name!r} needs the output {names}: add it to the outputs")
        if formats[picture] not in self.picture_formats:
            raise OutputError(
                f"data set {self.name!r} cannot have {picture!r} as {formats[picture]}, which its readers do "
                f"not open: choose {' or '.join(self.picture_formats)}"
            )

    def require(self) -> None:
        """Raise a MissingPackageError if a package that it needs is not installed."""
        if "rle" in self.needs:
            require_rle()

    def check_lens(self, lens: Lens | Intrinsics) -> None:
        """Raise an OutputError if this data set cannot describe a camera of this lens or intrinsics."""
        if self.pinhole and not lens.is_perspective():
            raise OutputError(
                f"data set {self.name!r} cannot describe an orthographic lens, because it knows a "
                "camera by its matrix K: use a perspective lens, or data set 'coco'"
            )

    @abstractmethod
    def write(self, folder: Path, capture: Mapping[str, Any], frames: Frames) -> list[str]:
        """Write its documents, each whole or not at all; return their paths from `folder`.

        Parameters
        ----------
        folder : Path
            The folder of the manifest.
        capture : mapping
            What the manifest says of the capture: formats, depth_scale, the categories of its instances, and
            of a sweep also folder, which is where the documents go.
        frames : iterable of mapping
            Those that were drawn.
        """

    def place(self, capture: Mapping[str, Any]) -> str:
        """Return where the files of a capture are, for the front of a path: "" or a folder and a slash."""
        inner = capture.get("folder", "")
        return f"{inner}/" if inner else ""

    def picture(self, capture: Mapping[str, Any], frame: Frame) -> str:
        """Return the path of a frame's picture from the documents' folder."""
        files = frame["files"]
        path: str = next(files[output] for output in self.pictures if output in files)
        return path.removeprefix(self.place(capture))


def category_ids(categories: Iterable[str]) -> dict[str, int]:
    """Return the number of each category, in the order of the numbers.

    It is the category itself if all are whole numbers of at most 2^31 - 1. Otherwise they are sorted and
    counted from 1.
    """
    names = set(categories)
    if all(_WHOLE.fullmatch(name) and int(name) <= _LARGEST_ID for name in names):
        return {name: int(name) for name in sorted(names, key=int)}
    return {name: number for number, name in enumerate(sorted(names), 1)}


def as_json(value: Any) -> str:
    """Return a value as one line of JSON; ValueError if it has a number that is not finite."""
    return json.dumps(value, allow_nan=False)


def write_joined(file: IO[bytes], start: str, items: Iterable[str], end: str) -> None:
    """Write texts one by one, each on a line of its own and with commas between them."""
    file.write(start.encode())
    separator = "\n"
    for item in items:
        file.write(f"{separator}{item}".encode())
        separator = ",\n"
    file.write(f"\n{end}".encode())
