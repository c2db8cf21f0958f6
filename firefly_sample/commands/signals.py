"""The signals that end a command: Ctrl-C (SIGINT), SIGTERM, and SIGHUP where the system has it.

Before a command begins, each ends the process at once. During a command, each is a KeyboardInterrupt in the
main thread, so that everything is cleaned up as after Ctrl-C. A second signal interrupts the cleaning up:
files that were not whole may keep their temporary names then, but no file under its own name is ever
half-written, and locks end with the process.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterable
from types import FrameType

_WORDS = {"SIGINT": "interrupted", "SIGTERM": "terminated", "SIGHUP": "hung up"}


class Ended(KeyboardInterrupt):
    """The end of a command by a signal."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def unhandled() -> tuple[signal.Signals, ...]:
    """Return the signals that end the process by default; none outside the main thread.

    A signal that is ignored, as ``nohup`` and shells in the background have it, is not among them.
    """
    if threading.current_thread() is not threading.main_thread():
        return ()
    known = [signal.Signals[name] for name in _WORDS if hasattr(signal, name)]
    defaults = signal.SIG_DFL, signal.default_int_handler
    return tuple(each for each in known if signal.getsignal(each) in defaults)


def end_at_once(signals: Iterable[int]) -> None:
    """Let signals end the process at once, because there is nothing to clean up yet.

    KeyboardInterrupt would not do, because some libraries swallow it while they are imported.
    """
    for number in signals:
        signal.signal(number, _leave)


def interrupt(signals: Iterable[int]) -> None:
    """Let signals raise a KeyboardInterrupt: `Ended`, but for Ctrl-C."""
    for number in signals:
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else _raise)


def ignore(signals: Iterable[int]) -> None:
    """Ignore signals."""
    for number in signals:
        signal.signal(number, signal.SIG_IGN)


def reset(signals: Iterable[int]) -> None:
    """Let signals kill the process, as they do by default."""
    for number in signals:
        signal.signal(number, signal.SIG_DFL)


def outcome(error: KeyboardInterrupt) -> tuple[str, int]:
    """Return the word for what has ended a command, for example "terminated", and the exit code."""
    return _outcome(error.number if isinstance(error, Ended) else signal.SIGINT)


def _outcome(number: int) -> tuple[str, int]:
    return _WORDS[signal.Signals(number).name], 128 + number


def _leave(number: int, _: FrameType | None) -> None:
    word, code = _outcome(number)
    try:
        os.write(2, f"firefly: {word}\n".encode())
    finally:
        os._exit(code)


def _raise(number: int, _: FrameType | None) -> None:
    raise Ended(number)
