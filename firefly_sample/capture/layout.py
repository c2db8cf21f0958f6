"""The names of a capture's files: one folder for all of them, or the folders of BOP."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Protocol

from firefly_sample.encoding.formats import FORMATS, LAYERS
from firefly_sample.frame import OUTPUTS

MASKS = ("mask", "mask_visib")
"""BOP's masks of one instance: all that it would cover alone, and what is seen of it.

The key of a file is one of these, a slash, and the number of the instance in its frame: ``mask/3``.
"""

SUFFIXES = tuple(dict.fromkeys(kind.suffixes[0] for kind in FORMATS.values()))
"""The endings of the files in a capture."""


class Layout(Protocol):
    """A rule that names each file of a capture, and recognises the files that it names.

    A key is an output, `LAYERS`, or for BOP a mask of an instance.
    """

    def path(self, key: str, index: int, suffix: str) -> str:
        """Return the path of a frame's file from the capture's folder, with slashes.

        `suffix` is one of `SUFFIXES`, with its dot.
        """

    def parse(self, path: str) -> tuple[str, int] | None:
        """Return the key and the frame of a path that `path` returns; None for any other text."""

    def folders(self, keys: Iterable[str] | None = None) -> tuple[str, ...]:
        """Return the folders of the files with these keys, or of all files; "" is the capture's own."""


class FlatLayout:
    """All files in the capture's folder: ``color_000012.png``."""

    _name = re.compile(r"([a-z_]+)_([0-9]{6,})(\.[a-z]+)")

    def path(self, key: str, index: int, suffix: str) -> str:
        """Return for example ``depth_000012.npz``."""
        return f"{key}_{index:06d}{suffix}"

    def parse(self, path: str) -> tuple[str, int] | None:
        """Return the key and the frame of a path that `path` returns; None for any other text."""
        match = self._name.fullmatch(path)
        return _checked(self, path, match[1], match[2], match[3]) if match else None

    def folders(self, keys: Iterable[str] | None = None) -> tuple[str, ...]:
        """Return the capture's own folder."""
        return ("",)


class BopLayout:
    """A folder for each kind of file, as in a scene of BOP: ``rgb/000012.png``."""

    _name = re.compile(r"([a-z_]+)/([0-9]{6,})(?:_([0-9]{6,}))?(\.[a-z]+)")

    def path(self, key: str, index: int, suffix: str) -> str:
        """Return for example ``depth/000012.png``, or ``mask/000012_000003.png`` for the key ``mask/3``."""
        kind, slash, number = key.partition("/")
        part = f"_{int(number):06d}" if slash else ""
        return f"{_FOLDER_OF.get(kind, kind)}/{index:06d}{part}{suffix}"

    def parse(self, path: str) -> tuple[str, int] | None:
        """Return the key and the frame of a path that `path` returns; None for any other text."""
        match = self._name.fullmatch(path)
        if match is None:
            return None
        kind = _KIND_OF.get(match[1], match[1])
        key = kind if match[3] is None else f"{kind}/{int(match[3])}"
        return _checked(self, path, key, match[2], match[4])

    def folders(self, keys: Iterable[str] | None = None) -> tuple[str, ...]:
        """Return for example ``("rgb", "depth")`` for the keys "color" and "depth"."""
        keys = (*OUTPUTS, LAYERS, *MASKS) if keys is None else keys
        kinds = (key.partition("/")[0] for key in keys)
        return tuple(dict.fromkeys(_FOLDER_OF.get(kind, kind) for kind in kinds))


_FOLDER_OF = {"color": "rgb"}
_KIND_OF = {folder: kind for kind, folder in _FOLDER_OF.items()}


def _checked(layout: Layout, path: str, key: str, digits: str, suffix: str) -> tuple[str, int] | None:
    kind, slash, _ = key.partition("/")
    known = kind in MASKS if slash else kind in OUTPUTS or kind == LAYERS
    if not known or suffix not in SUFFIXES or layout.path(key, int(digits), suffix) != path:
        return None
    return key, int(digits)


LAYOUTS: tuple[Layout, ...] = (FlatLayout(), BopLayout())
"""All layouts, the usual one first."""


def layout_of(dataset: str | None) -> Layout:
    """Return the layout of a data set's captures, or of a capture that is none."""
    return LAYOUTS[1] if dataset == "bop" else LAYOUTS[0]


def names_in(folder: Path, layout: Layout) -> Iterator[str]:
    """Yield the files that are where a layout puts files, as paths from a capture's folder."""
    for inner in layout.folders():
        with suppress(OSError), os.scandir(folder / inner) as entries:
            for entry in entries:
                if not entry.is_dir():
                    yield f"{inner}/{entry.name}" if inner else entry.name
