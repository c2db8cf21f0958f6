"""A frame that was drawn and encoded, and one that could not be drawn."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from firefly_sample.capture.datasets.annotations import Annotations
from firefly_sample.capture.datasets.masks import Gray, mask_png
from firefly_sample.capture.files import pixel_hash
from firefly_sample.capture.job import Task
from firefly_sample.encoding.formats import Encoding
from firefly_sample.errors import FireflyError
from firefly_sample.frame import Frame, Image


@dataclass(frozen=True)
class Drawn:
    """A frame that was drawn and encoded. It can be pickled.

    Attributes
    ----------
    index : int
    time : float
        Seconds.
    exposure : float
        As a number: measured, if the settings say "auto".
    lights : dict of str to int
        Counts: in_scene, in_view, dropped.
    camera : dict
        See `FrameCamera.as_dict`.
    files : dict of str to bytes
        The contents of its files: see `Encoding.files`, and of a data set also by the masks' names.
    keys : dict of str to str
        The file of each output.
    sha256, file_sha256 : dict of str to str
        By output: the `pixel_hash` of the image that the file holds, and the SHA-256 of the file.
    instances : list of dict or None
        Those in the picture, for a data set that needs them.
    categories : tuple of str
        Those of the scene, for such a data set.
    warnings : tuple of str
        Those of the frame.
    id_names : tuple of str
        The name of each value of the output "id"; empty without that output.
    said : tuple of str
        The Python warnings that another process issued while it built and drew the scene.
    """

    index: int
    time: float
    exposure: float
    lights: dict[str, int]
    camera: dict[str, Any]
    files: dict[str, bytes]
    keys: dict[str, str]
    sha256: dict[str, str]
    file_sha256: dict[str, str]
    instances: list[dict[str, Any]] | None = None
    categories: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    id_names: tuple[str, ...] = ()
    said: tuple[str, ...] = ()


@dataclass(frozen=True)
class Failed:
    """A frame that could not be drawn. It can be pickled.

    Attributes
    ----------
    index : int
    error : FireflyError
    whole_job : bool
        True if no frame of its job can be drawn, because the scene cannot be built.
    """

    index: int
    error: FireflyError
    whole_job: bool = False
    said: tuple[str, ...] = ()


class Encoded(NamedTuple):
    """The content of one file, its SHA-256, and the `pixel_hash` of each image that it holds, by output."""

    content: bytes
    file_sha256: str
    sha256: dict[str, str]


def encode(encoding: Encoding, key: str, images: Mapping[str, Image]) -> Encoded:
    """Return one file of a frame, with its hashes; raise an OutputError if a value does not fit into it."""
    outputs = encoding.files()[key]
    content = encoding.encode(key, images)
    exact = all(map(encoding.is_exact, outputs))
    held = images if exact else encoding.decode(key, content)
    hashes = {output: pixel_hash(held[output]) for output in outputs}
    return Encoded(content, hashlib.sha256(content).hexdigest(), hashes)


class Sight(NamedTuple):
    """A frame as it was drawn, the exposure, and for some data sets the instances and masks in it."""

    frame: Frame
    exposure: float
    annotations: Annotations | None = None


def encode_masks(masks: Mapping[str, Gray]) -> dict[str, Encoded]:
    """Return the files of masks, with their hashes, by their keys. Equal masks are encoded once."""
    known: dict[str, Encoded] = {}
    found = {}
    for key, mask in masks.items():
        pixels = pixel_hash(mask)
        if pixels not in known:
            content = mask_png(mask)
            known[pixels] = Encoded(content, hashlib.sha256(content).hexdigest(), {})
        found[key] = known[pixels]._replace(sha256={key: pixels})
    return found


def as_drawn(task: Task, sight: Sight, made: Mapping[str, Encoded], said: tuple[str, ...] = ()) -> Drawn:
    """Return a frame whose files were encoded, by their keys."""
    frame, annotations = sight.frame, sight.annotations
    keys = {output: key for key, one in made.items() for output in one.sha256}
    return Drawn(
        index=task.index,
        time=frame.time,
        exposure=sight.exposure,
        lights=asdict(frame.lights),
        camera=frame.camera.as_dict(),
        files={key: one.content for key, one in made.items()},
        keys=keys,
        sha256={output: made[key].sha256[output] for output, key in keys.items()},
        file_sha256={output: made[key].file_sha256 for output, key in keys.items()},
        instances=None if annotations is None else annotations.instances,
        categories=() if annotations is None else annotations.categories,
        warnings=tuple(frame.warnings),
        id_names=tuple(frame.id_names) if "id" in keys else (),
        said=said,
    )
