"""Looks into files that trimesh reads, for what it leaves out without a word."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path

from firefly_sample.losses import Losses

_3MF_LOSSES = {
    b":colorgroup": "colours of 3MF files",
    b"<basematerials": "base materials of 3MF files",
    b":texture2d ": "textures of 3MF files",
    b":compositematerials": "composite materials of 3MF files",
    b":beamlattice": "beam lattices of 3MF files",
    b":slicestack": "slices of 3MF files",
}
_LONGEST_PART = 2**28


def note_content(path: Path, suffix: str, losses: Losses) -> None:
    """Note the losses of a file that trimesh has read."""
    look = {"3mf": _look_at_3mf, "ctm": _look_at_ctm}.get(suffix)
    if look is not None:
        look(path, losses)


def _look_at_3mf(path: Path, losses: Losses) -> None:
    """Note the elements that trimesh does not know."""
    with zipfile.ZipFile(path) as archive:
        for name in archive.namelist():
            if name.lower().endswith(".model"):
                with archive.open(name) as part:
                    text = part.read(_LONGEST_PART)
                for element, loss in _3MF_LOSSES.items():
                    if element in text:
                        losses.add(loss)


def _look_at_ctm(path: Path, losses: Losses) -> None:
    """Note texture coordinates and attributes; their numbers stand in the header."""
    with path.open("rb") as file:
        head = file.read(36)
    if head[:4] == b"OCTM" and len(head) >= 32:
        _, _, _, _, maps, attributes, _ = struct.unpack_from("<7I", head, 4)
        if maps or attributes:
            losses.add("texture coordinates and attributes of OpenCTM files")
