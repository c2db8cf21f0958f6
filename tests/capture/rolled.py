"""Captures of a ball that rolls past, small and quick, and their files read back by other libraries."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageSequence

from firefly_sample.capture import sequence
from firefly_sample.capture.sequence import capture_frames

SIZE = (32, 24)


def roll(path: Path, scene: str = "tests.capture.scenes:rolling", **options: Any) -> Any:
    """A capture of four frames, unless told otherwise."""
    return capture_frames(scene, path, **({"frames": "0:4", "size": SIZE} | options))


CAPTURES: dict[str, dict[str, Any]] = {
    "frames": {"outputs": ("color", "color_alpha")},
    "color": {},
    "alpha": {"outputs": ("color_alpha",)},
    "exact.mp4": {"crf": 0},
    "exact.webm": {"crf": 0},
    "alpha.webp": {"outputs": ("color_alpha",)},
    "alpha.apng": {"outputs": ("color_alpha",)},
    "late.apng": {"frames": "2:6"},
    "small": {"size": (31, 23)},
    "padded.mp4": {"size": (31, 23), "pad": True, "crf": 1},
}
"""Captures that several tests read, where they have options."""


class Rolled:
    """A folder of captures that several tests read, each made when it is asked for; not to be changed."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def __truediv__(self, name: str) -> Path:
        capture = name.removesuffix(".json")
        if not (self._folder / capture).exists():
            roll(self._folder / capture, **CAPTURES.get(capture, {}))
        return self._folder / name


def pictures(folder: Path, output: str = "color") -> list[np.ndarray]:
    """The pictures of a folder, by Pillow."""
    return [np.asarray(Image.open(path)) for path in sorted(folder.glob(f"{output}_0*"))]


def film_pictures(path: Path, mode: str = "rgb24") -> list[np.ndarray]:
    """The pictures of a film, by PyAV or Pillow alone."""
    if path.suffix in (".mp4", ".webm"):
        import av

        with av.open(str(path)) as container:
            return [frame.to_ndarray(format=mode) for frame in container.decode(video=0)]
    with Image.open(path) as film:
        wanted = {"rgb24": "RGB", "rgba": "RGBA"}[mode]
        return [np.asarray(frame.convert(wanted)) for frame in ImageSequence.Iterator(film)]


def names_in(folder: Path) -> list[str]:
    """Return the names in a folder, sorted."""
    return sorted(path.name for path in folder.iterdir())


def luma_psnr(expected: list[np.ndarray], actual: list[np.ndarray]) -> float:
    """The signal-to-noise ratio of pictures' brightness (BT.709's luma) in decibels."""
    first, second = (np.stack(images) @ np.array([0.2126, 0.7152, 0.0722]) for images in (expected, actual))
    return float(10 * np.log10(255**2 / max(np.mean((first - second) ** 2), 1e-9)))


def without(monkeypatch: pytest.MonkeyPatch, package: str) -> None:
    """Let a package be missing."""
    monkeypatch.setitem(sys.modules, package, None)


@pytest.fixture
def no_drawing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is drawn in a test, and no driver asked."""

    def fail(*_: Any) -> None:
        pytest.fail("something is drawn")

    monkeypatch.setattr(sequence, "_engine", fail)
