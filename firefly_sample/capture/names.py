"""The names of the files of one job: by its encoding, its layout, and its folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from firefly_sample.capture.layout import Layout, layout_of
from firefly_sample.encoding.formats import Encoding
from firefly_sample.frame import OUTPUTS


@dataclass(frozen=True)
class FileNames:
    """The names of the files of one job's frames.

    Attributes
    ----------
    encoding : Encoding
    dataset : str or None
    folder : str
        Where the files are, relative to the manifest; "" if the capture is no sweep.
    """

    encoding: Encoding
    dataset: str | None = None
    folder: str = ""

    @classmethod
    def of(cls, description: Mapping[str, Any]) -> FileNames:
        """Return the names in a capture, by its `Job.description` or by what a manifest says of it.

        Those of earlier versions have no formats. Raises a FireflyError if one is not known.
        """
        given = {name: description.get(name) for name in ("formats", "quality", "depth_scale")}
        if "formats" in description:
            encoding = Encoding.from_json(given)
        else:
            encoding = Encoding.of(description.get("outputs", OUTPUTS))
        return cls(encoding, description.get("dataset"), description.get("folder", ""))

    @property
    def layout(self) -> Layout:
        """The layout of the files."""
        return layout_of(self.dataset)

    def path(self, key: str, index: int) -> str:
        """Return the path of a frame's file, relative to the manifest; `key` is as in `Encoding.files`.

        A mask of a data set has its own name as its key.
        """
        name = self.layout.path(key, index, self.suffix(key))
        return f"{self.folder}/{name}" if self.folder else name

    def suffix(self, key: str) -> str:
        """Return the ending of a file's name; masks are PNG."""
        return self.encoding.suffix(key) if key in self.encoding.files() else ".png"

    def key_of(self, output: str) -> str:
        """Return the key of the file that holds an output, or that is a mask."""
        return next((key for key, held in self.encoding.files().items() if output in held), output)
