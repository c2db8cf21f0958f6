"""An X display of our own, without a screen."""

from __future__ import annotations

import os
import select
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

from firefly_sample.errors import FireflyError

_LONGEST = 600.0


@contextmanager
def start_display() -> Iterator[str]:
    """Start Xvfb, and give the name of its display, for example ":7".

    Raises
    ------
    FireflyError
        If it does not start.
    """
    readable, writable = os.pipe()
    screen = ["-screen", "0", "1024x768x24", "-nolisten", "tcp", "-noreset"]
    command = ["Xvfb", "-displayfd", str(writable), *screen]
    try:
        server = subprocess.Popen(command, pass_fds=(writable,), stderr=subprocess.DEVNULL)
    except OSError as error:
        os.close(readable)
        raise FireflyError(f"Xvfb cannot be started: {error.strerror or error}") from error
    finally:
        os.close(writable)
    with server:
        try:
            answered = select.select([readable], [], [], _LONGEST)[0]
            number = os.read(readable, 16).decode().strip() if answered else ""
            if not number.isdigit():
                raise FireflyError(f"Xvfb does not start (exit code {server.poll()})")
            yield f":{number}"
        finally:
            os.close(readable)
            server.terminate()
