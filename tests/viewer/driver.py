"""Drives a window like a user: real keys and mouse through xdotool, and looks at the screen."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from PIL import ImageGrab

from tests.cli.command import environment

LAMPS = "tests.viewer.lamps:lamps"
SIZE = (480, 360)
BARE = slice(0, 220), slice(280, None)
"""Rows and columns of the window that no text and no strip covers; frames of 10 s make text 272 wide."""
PATIENCE = 600.0
"""Seconds until what should happen is given up: a machine with other work is slow."""
T = TypeVar("T")


class WindowDriver:
    """``firefly run`` on a scene, in a process of its own, with its window in the screen's corner."""

    def __init__(self, display: str, folder: Path, *options: str, scene: str = LAMPS) -> None:
        self._display = display
        self._folder = folder
        self._name = scene.rpartition(":")[2]
        self._env = environment(DISPLAY=display)
        size = "x".join(map(str, SIZE))
        self.process = subprocess.Popen(
            [sys.executable, "-m", "firefly_sample.cli", "run", scene, "--size", size, *options],
            cwd=folder,
            env=self._env,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            # whoever runs the tests in the background may have had SIGINT ignored, which children inherit
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        self.said: list[dict[str, Any]] = []
        """What the scene has printed: how it was built, and what was set."""
        self.printed: list[str] = []
        """Lines that the command itself has printed."""
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith('{"'):
                self.said.append(json.loads(line))
            else:
                self.printed.append(line.rstrip("\n"))

    def wait_until(self, what: str, ready: Callable[[], T]) -> T:
        """What `ready` gives as soon as that is true, or an array."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            result = ready()
            if isinstance(result, np.ndarray) or result:
                return result
            if self.process.poll() is not None:
                break
            time.sleep(0.03)
        code = self.process.poll()
        complaint = "" if code is None else self.finish()[1]
        raise AssertionError(
            f"waited in vain: {what}; exit code {code}, {self.said} {self.printed} {complaint}"
        )

    def wait_for_picture(self) -> None:
        """Wait for the first frame; the mouse is over the window then, and so is the keyboard."""
        self.wait_until("the window", self.window)
        self.wait_until("the first frame", lambda: self.grab().any())
        self.xdotool("mousemove", "300", "200")

    def xdotool(self, *arguments: str) -> str:
        done = subprocess.run(
            ["xdotool", *arguments], env=self._env, capture_output=True, text=True, timeout=600, check=False
        )
        return done.stdout.strip()

    def window(self) -> str | None:
        """The window's number."""
        name = f"^{self._name}.* - firefly$"
        return self.xdotool("search", "--all", "--pid", str(self.process.pid), "--name", name) or None

    def title(self) -> str:
        return self.xdotool("getwindowname", self.window() or "0")

    def key(self, *names: str) -> None:
        """Press keys one after the other."""
        self.xdotool("key", *names)

    def drag(self, button: int, *places: tuple[int, int]) -> None:
        """Press a mouse button at the first place, let go at the last."""
        first, *rest = [("mousemove", str(x), str(y)) for x, y in places]
        moves = [word for move in rest for word in move]
        self.xdotool(*first, "mousedown", str(button), *moves, "mouseup", str(button))

    def grab(self, size: tuple[int, int] = SIZE) -> np.ndarray:
        """What is on the screen, where the window is."""
        return np.asarray(ImageGrab.grab((0, 0, *size), xdisplay=self._display))

    def picture(self) -> np.ndarray:
        """The part of the window that no text and no strip covers."""
        return self.grab()[BARE]

    def message(self) -> np.ndarray:
        """The lower edge of the window, where messages come and go."""
        return self.grab()[-30:]

    def settled(self) -> np.ndarray:
        """The picture after all that was done so far; in a pause it stays.

        However slow frames are: a screenshot shows that a frame was drawn since, a second one that it is on
        the screen.
        """
        for _ in range(2):
            before = self._shots()
            self.key("s")
            (shot,) = self.wait_until("a screenshot", lambda before=before: self._shots() - before)
            shot.unlink()
        return self.picture()

    def _shots(self) -> set[Path]:
        return set(self._folder.glob("*.png"))

    def changed_from(self, before: np.ndarray) -> np.ndarray:
        """The picture, once it is another one, after all that was done so far."""
        self.wait_until("another picture", lambda: not np.array_equal(self.picture(), before))
        return self.settled()

    def pause(self) -> np.ndarray:
        """Stop time; the picture that then stays."""
        self.key("p")
        return self.settled()

    def finish(self) -> tuple[int, str]:
        """Wait for the end: the exit code, and what was printed on stderr."""
        code = self.process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        assert self.process.stderr is not None
        return code, self.process.stderr.read()

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        # the server clears up by itself, a little later: the next test must not see this window
        while self.window():
            time.sleep(0.03)
        self._reader.join(PATIENCE)
        for stream in (self.process.stdout, self.process.stderr):
            assert stream is not None
            stream.close()
