"""Small real captures for tests, and all that is in their folders."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from firefly_sample.capture.sequence import capture_frames
from tests.cli.command import GLADE

SMALL: dict[str, Any] = {"size": (8, 6), "fps": 1.0, "time": 0.0, "parameters": {"fireflies": 3}}


def capture(folder: Path, scene: str = GLADE, **options: Any) -> Any:
    """A capture of a few pixels, of 6 frames unless told otherwise."""
    return capture_frames(scene, folder, **({"frames": "0:6"} | SMALL | options))


def content(folder: Path) -> dict[str, bytes]:
    """Every file below a folder by its path, the manifest and whatever was left included."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def touched(folder: Path) -> dict[str, int]:
    """When each picture was written."""
    return {path.name: path.stat().st_mtime_ns for path in folder.rglob("*_*.*")}
