"""A display in memory, and windows on it that xdotool drives."""

from __future__ import annotations

import os
import select
import shutil
import subprocess
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.viewer.driver import LAMPS, WindowDriver


@pytest.fixture(scope="session")
def display() -> Iterator[str]:
    """The name of an X display of our own, for example ":7"."""
    missing = [tool for tool in ("Xvfb", "xdotool") if shutil.which(tool) is None]
    missing += ["the Python package glfw"] if find_spec("glfw") is None else []
    if missing:
        reason = f"tests of the window need {', '.join(missing)} (Debian: apt-get install xvfb xdotool)"
        if os.environ.get("CI"):
            pytest.fail(reason)
        pytest.skip(reason)
    readable, writable = os.pipe()
    # the server chooses a free display and says which; without -noreset it starts anew, deaf for a moment,
    # whenever its last window closes
    screen = ["-screen", "0", "1024x768x24", "-nolisten", "tcp", "-noreset"]
    command = ["Xvfb", "-displayfd", str(writable), *screen]
    with subprocess.Popen(command, pass_fds=(writable,), stderr=subprocess.DEVNULL) as server:
        os.close(writable)
        try:
            assert select.select([readable], [], [], 600)[0], "Xvfb does not start"
            number = os.read(readable, 16).decode().strip()
            assert number.isdigit(), f"Xvfb did not start (exit code {server.poll()})"
            yield f":{number}"
        finally:
            os.close(readable)
            server.terminate()


@pytest.fixture
def open_window(display: str, tmp_path: Path) -> Iterator[Callable[..., WindowDriver]]:
    """``open_window(*options, scene=LAMPS)`` runs ``firefly run`` in `tmp_path`, until the test ends."""
    drivers: list[WindowDriver] = []

    def start(*options: str, scene: str = LAMPS, stays: bool = True) -> WindowDriver:
        drivers.append(WindowDriver(display, tmp_path, *options, scene=scene))
        if stays:  # one that closes by itself may be gone before anybody looks
            drivers[-1].wait_for_picture()
        return drivers[-1]

    yield start
    for driver in drivers:
        driver.close()
