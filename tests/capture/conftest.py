"""Captures that several tests read."""

from __future__ import annotations

import pytest

from firefly_sample import capture_frames
from tests.capture.rolled import Rolled
from tests.cli.command import GLADE

OUTPUTS = ("color", "depth", "id")


@pytest.fixture(scope="package")
def captured(tmp_path_factory):
    """Three frames of three outputs, and a sweep of two captures; not to be changed."""
    folder = tmp_path_factory.mktemp("captured")
    options = {"size": (40, 30), "parameters": {"fireflies": 5}}
    capture_frames(GLADE, folder / "one", frames="0:3", outputs=OUTPUTS, **options)
    capture_frames(GLADE, folder / "sweep", frames="0:2", sweep={"reach": [2.0, 2.5]}, **options)
    return folder


@pytest.fixture(scope="package")
def rolled(tmp_path_factory):
    """Captures of a ball, by their names: ``rolled / "clip.mp4"``; not to be changed."""
    return Rolled(tmp_path_factory.mktemp("rolled"))
