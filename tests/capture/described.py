"""Jobs, drivers and frames without any driver, for tests of what is written of them."""

from __future__ import annotations

import hashlib
from typing import Any

from firefly_sample.capture.drawn import Drawn
from firefly_sample.capture.job import Driver, Job
from firefly_sample.settings import Settings
from tests.capture.usual_files import file_name

CAMERA = {"projection": "perspective", "width": 8, "height": 6}
"""The start of a camera: nothing here looks into it."""
DRIVER = Driver("llvmpipe (LLVM 15.0.6, 256 bits)", "4.5 (Core Profile) Mesa 22.3.6", True)


def job_of(**changes: Any) -> Job:
    """A job of the tests' glade."""
    given: dict[str, Any] = {
        "scene": "tests.cli.glade:glade",
        "parameters": {"fireflies": 3, "seed": 7},
        "settings": Settings(),
        "exposure": 1.0,
        "size": (8, 6),
        "outputs": ("color",),
        "fps": 24.0,
        "start": 0.0,
    }
    return Job(**(given | changes))


def description_of(**changes: Any) -> dict[str, Any]:
    return job_of(**changes).description(DRIVER)


def content_of(index: int, output: str = "color", version: int = 0) -> bytes:
    """The content of a frame's file: no picture, because nothing here looks into it."""
    return f"{output} {index} {version}\n".encode()


def drawn_of(
    index: int, outputs: tuple[str, ...] = ("color",), version: int = 0, exposure: float = 1.0, **more: Any
) -> Drawn:
    files = {output: content_of(index, output, version) for output in outputs}
    hashes = {output: hashlib.sha256(content).hexdigest() for output, content in files.items()}
    lights = {"in_scene": 3, "in_view": 2, "dropped": 0}
    pixels = {output: hashes[output][::-1] for output in outputs}
    keys = {output: output for output in outputs}
    return Drawn(index, index / 24.0, exposure, lights, CAMERA, files, keys, pixels, hashes, **more)


def frame_of(
    index: int, outputs: tuple[str, ...] = ("color",), folder: str = "", **more: Any
) -> dict[str, Any]:
    """A frame's record, as the journal gets it."""
    drawn = drawn_of(index, outputs)
    before = f"{folder}/" if folder else ""
    return {
        "index": index,
        "time": drawn.time,
        "lights": drawn.lights,
        "camera": drawn.camera,
        "files": {output: before + file_name(output, index) for output in outputs},
        "sha256": drawn.sha256,
        "file_sha256": drawn.file_sha256,
        **more,
    }


def failed_of(index: int) -> dict[str, Any]:
    return {"index": index, "time": index / 24.0, "error": f"no frame {index}"}
