"""Draw a user's copy of Panda3D's sample "fireflies" by Panda3D and by this package, side by side.

A process of its own runs the sample's main.py, and sends the picture of its window and its graph as a `Scene`
of ours. Nothing of the sample is part of this package.
"""

from __future__ import annotations

import io
import os
import pickle
import shutil
import statistics
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from json import dumps
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.columns import align
from firefly_sample.errors import FireflyError, SceneError, SettingsError
from firefly_sample.frame import check_size
from firefly_sample.lab.fresh import FreshProcess, start_process
from firefly_sample.lab.reference.chunks import Progress
from firefly_sample.lab.x_display import start_display
from firefly_sample.losses import ConversionWarning
from firefly_sample.model.panda3d.package import import_panda3d
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings, to_number
from firefly_sample.whole_files import open_whole

LONGEST = 1800.0
"""Seconds after which the sample's process is ended."""
_PROCESS = "firefly_sample.interop.panda3d.program"
_TIMED = 5
_GAP, _LINE = 8, 16


def measure_fireflies(
    folder: Path,
    output: Path | None = None,
    *,
    seconds: float = 10.0,
    size: tuple[int, int] = (800, 600),
    look: str = "classic",
    device: int | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Draw a folder's main.py, a copy of Panda3D's sample "fireflies", by Panda3D and by this package.

    Panda3D uses the display that DISPLAY names, or else Xvfb, or else none. Without a display it runs no
    shaders in Cg, and the result says so. Both draw the scene at one time, with one sample a pixel.

    Parameters
    ----------
    folder : Path
        With main.py, which calls ``run()`` at its end, and what that loads.
    output : Path, optional
        A PNG file with both pictures, Panda3D's on the left.
    seconds : float
        The time of the pictures, after all models are loaded. The sample's fireflies become more with time.
    size : (int, int)
        Pixels of each picture.
    look : str
        Of our picture, see `firefly_sample.Settings`; "classic" is the sample's.
    device : int, optional
        EGL device index, for our picture.
    progress : callable, optional
        Called with (frames done, frames in all).

    Returns
    -------
    dict
        The output of ``firefly measure fireflies --json``: "size", [width, height]; "seconds"; "look";
        "panda3d", its version; "panda3d_driver" and "driver", GL renderer strings; "models", "lights" and
        "dots", how many nodes with geometry there are; "panda3d_ms" and "ms", medians of a frame's
        milliseconds, Panda3D's with the sample's own tasks; "mean_codes" and "largest_codes", differences
        between the pictures; "within_two", the share of pixels whose channels all differ by two codes or
        less; and "differences", lines about what is not drawn, or is drawn differently.

    Raises
    ------
    MissingPackageError
        If Panda3D is not installed.
    FireflyError
        If the folder has no main.py, that fails or ends by itself, its graph has no lights, or nothing can be
        drawn.

    Warns
    -----
    ConversionWarning
        Once for each of the "differences".
    """
    import_panda3d()
    settings = Settings().with_changes(look=look, supersample=1)
    width, height = check_size(size)
    if not (folder / "main.py").is_file():
        raise SceneError(f"{folder} has no main.py: give the folder of Panda3D's sample fireflies")
    if not 0.0 <= to_number(seconds) <= 1e6:
        raise SettingsError(f"seconds must be a number of 0 to 1e6, got {seconds!r}")
    job = {"folder": str(folder.absolute()), "size": (width, height), "seconds": seconds}
    theirs, scene, found = run_sample(job, progress)
    height, width = theirs.shape[:2]  # the sample may have chosen them itself
    with Renderer((width, height), settings, device=device) as renderer:
        frame = renderer.render(scene)
        spent = []
        for _ in range(_TIMED):
            start = perf_counter()
            renderer.render(scene)
            spent.append(1e3 * (perf_counter() - start))
    differences = list(dict.fromkeys((*found["lines"], *frame.warnings)))
    for line in differences:
        warnings.warn(line, ConversionWarning, stacklevel=2)
    apart = np.abs(frame.color.astype(int) - theirs.astype(int))
    result = {
        "size": [width, height],
        "seconds": seconds,
        "look": look,
        "panda3d": found["version"],
        "panda3d_driver": found["driver"],
        "driver": frame.driver,
        "models": found["models"],
        "lights": found["lights"],
        "dots": found["dots"],
        "panda3d_ms": found["milliseconds"],
        "ms": statistics.median(spent),
        "mean_codes": float(apart.mean()),
        "largest_codes": int(apart.max()),
        "within_two": float((apart.max(axis=-1) <= 2).mean()),
        "differences": differences,
    }
    if output is not None:
        titles = (
            (f"Panda3D {result['panda3d']}", f"{result['panda3d_ms']:.1f} ms a frame, with its own tasks"),
            (f"firefly_sample, look {look}", f"{result['ms']:.1f} ms a frame, {result['lights']} lights"),
        )
        with open_whole(output) as file:
            file.write(side_by_side((theirs, frame.color), titles))
    return result


def fireflies_as_text(result: dict[str, Any]) -> str:
    """Return a measurement as lines of text, without its "differences"."""
    width, height = result["size"]
    rows = [
        ("DRAWN BY", "MS", "DRIVER"),
        (f"Panda3D {result['panda3d']}", f"{result['panda3d_ms']:.1f}", result["panda3d_driver"]),
        (f"firefly_sample, {result['look']}", f"{result['ms']:.1f}", result["driver"]),
    ]
    counts = ", ".join(f"{result[what]} {what}" for what in ("models", "lights", "dots"))
    return "\n".join(
        [
            f"{width}x{height}, at {result['seconds']:g} s: {counts}",
            align(rows),
            f"difference: mean {result['mean_codes']:.2f} codes, largest {result['largest_codes']}; "
            f"{result['within_two']:.1%} of pixels within two codes",
        ]
    )


def side_by_side(
    pictures: Sequence[NDArray[Any]], titles: Sequence[tuple[str, ...]], gap: int = _GAP
) -> bytes:
    """Return pictures of one size, from left to right, each with lines of text above it, as a PNG file."""
    from PIL import Image, ImageDraw

    height, width = pictures[0].shape[:2]
    top = max(map(len, titles)) * _LINE + gap
    sheet = Image.new("RGB", (len(pictures) * (width + gap) + gap, height + top + gap), (48, 48, 48))
    draw = ImageDraw.Draw(sheet)
    for place, (picture, lines) in enumerate(zip(pictures, titles, strict=True)):
        left = gap + place * (width + gap)
        sheet.paste(Image.fromarray(np.ascontiguousarray(picture)), (left, top))
        for row, line in enumerate(lines):
            draw.text((left, 4 + row * _LINE), line, (255, 255, 255))
    file = io.BytesIO()
    sheet.save(file, format="PNG")
    return file.getvalue()


class Shown(NamedTuple):
    """The sample's picture and its scene at one time.

    Attributes
    ----------
    picture : ndarray of uint8, shape (height, width, 3)
        Of its window without texts, the first row on top.
    scene : Scene
        Its graph, as `firefly_sample.interop.panda3d.deferred` reads it.
    figures : dict
        See `firefly_sample.interop.panda3d.program.run_program`.
    """

    picture: NDArray[np.uint8]
    scene: Scene
    figures: dict[str, Any]


def run_sample(job: dict[str, Any], progress: Progress | None = None) -> Shown:
    """Run main.py of a folder in a process of its own, and return what it shows.

    Parameters
    ----------
    job : dict
        "folder", its absolute path; "size", (width, height); and "seconds", the time of its picture.
    progress : callable, optional
        Called with (frames done, frames in all).

    Raises
    ------
    FireflyError
        See `measure_fireflies`.
    """
    with tempfile.TemporaryDirectory() as into, _opened(job | {"into": into}) as process:
        found = process.answer()
        while "done" in found:
            if progress is not None:
                progress(found["done"], found["total"])
            found = process.answer()
        with (Path(into) / "scene.pickle").open("rb") as file:
            scene = pickle.load(file)
        return Shown(np.load(Path(into) / "picture.npy"), scene, found)


@contextmanager
def _opened(job: dict[str, Any]) -> Iterator[FreshProcess]:
    """Start the sample's process with the first display that Panda3D can open."""
    has_server = shutil.which("Xvfb") is not None
    for way, exists in (("DISPLAY", "DISPLAY" in os.environ), ("Xvfb", has_server), ("none", True)):
        if not exists:
            continue
        with _display(way) as variables:
            given = dumps(job | {"has_display": way != "none"})
            with start_process(_PROCESS, given, **variables) as process, process.within(LONGEST):
                if process.answer()["opened"]:
                    yield process
                    return
    raise FireflyError("Panda3D can open no window: there is no X display, no Xvfb, and no EGL")


@contextmanager
def _display(way: str) -> Iterator[dict[str, str]]:
    """Give the environment variables of a way to draw."""
    if way != "Xvfb":
        yield {}
        return
    with start_display() as name:
        yield {"DISPLAY": name}
