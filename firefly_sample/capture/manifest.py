"""The manifest of a capture: scene, settings, driver, files, and the hash of every image's pixels."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any, NotRequired, TypedDict

import numpy as np

from firefly_sample.capture.writers import open_whole
from firefly_sample.errors import FireflyError
from firefly_sample.frame import Image

_NAME = "manifest.json"


class FrameEntry(TypedDict):
    """One frame of a manifest.

    Attributes
    ----------
    index : int
    time : float
        Seconds.
    lights : dict
        Counts: in_scene, in_view, dropped.
    files : dict of str to str
        Path by output, relative to the manifest.
    sha256 : dict of str to str
        `pixel_hash` by output.
    id_names : list of str
        Only if they differ from the manifest's own.
    """

    index: int
    time: float
    lights: dict[str, int]
    files: dict[str, str]
    sha256: dict[str, str]
    id_names: NotRequired[list[str]]


class Manifest(TypedDict):
    """The description of a capture.

    Attributes
    ----------
    scene : str
        The scene's name as given.
    parameters : dict
        All parameters of the scene, with the values that were used.
    settings : dict
        All of `Settings`.
    seed : int or None
        The scene's parameter "seed"; None if it has none.
    driver : str
        The GL renderer string.
    driver_version : str
        The GL version string, which has the version of Mesa or of the GPU's driver. Machines with the same
        two strings draw the same bytes.
    software : bool
        True if that is a software rasteriser.
    version : str
        The version of firefly_sample.
    frames : list of FrameEntry
    id_names : list of str
        Only with the output "id": the name of each value.
    """

    scene: str
    parameters: dict[str, Any]
    settings: dict[str, Any]
    seed: int | None
    driver: str
    driver_version: str
    software: bool
    version: str
    frames: list[FrameEntry]
    id_names: NotRequired[list[str]]


def pixel_hash(image: Image) -> str:
    """Return the SHA-256 of an image's raw pixels (C order, little-endian) as hexadecimal digits.

    Files are not hashed, because different versions of zlib compress the same pixels to different bytes.
    """
    little = np.ascontiguousarray(image, dtype=image.dtype.newbyteorder("<"))
    return hashlib.sha256(little.data).hexdigest()


def manifest_as_json(manifest: Manifest) -> str:
    """Return the text of a manifest, the same in the file and on stdout."""
    return json.dumps(manifest, indent=2, allow_nan=False) + "\n"


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """Write ``manifest.json``, whole or not at all.

    Raises
    ------
    FireflyError
        If it cannot be written.
    """
    with open_whole(folder / _NAME) as file:
        file.write(manifest_as_json(manifest).encode())


def remove_manifest(folder: Path) -> None:
    """Remove the manifest of an earlier capture, which would describe files that are about to change.

    Raises
    ------
    FireflyError
        If it cannot be removed.
    """
    path = folder / _NAME
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise FireflyError(f"cannot replace {path}: {error.strerror or error}") from error
