"""Refuse to draw in a forked process if the driver was used before the fork."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from firefly_sample.errors import NoGpuError
from firefly_sample.gpu.current import CurrentContext

_FORKED_WITHOUT_EXEC = 0x40  # PF_FORKNOEXEC of Linux' sched.h

_opened: dict[tuple[str, int], tuple[int, bool]] = {}
"""By `_screen`: the process that last opened a driver there, and True if a fork of it can draw."""


def check_not_forked(context: CurrentContext | None) -> None:
    """Refuse a driver that this package used in the process from which this one was forked.

    A fork copies memory, but of the threads only the one that calls it. llvmpipe's threads are missing in the
    child, and drawing would wait for them forever; a GPU's driver would share its memory and queues with the
    parent.

    Parameters
    ----------
    context : CurrentContext or None
        The context that is to be used; None for an EGL context that is to be made.

    Raises
    ------
    NoGpuError
        If this process was forked since, and the driver cannot draw in a fork.
    """
    process, safe = _opened.get(_screen(context), (os.getpid(), True))
    if process != os.getpid() and not safe:
        raise NoGpuError(_refusal("firefly_sample"))


def check_threads(renderer: str) -> None:
    """Refuse llvmpipe if another library used it before this process was forked: its threads are missing.

    Call it after making a context, which starts the threads if the driver was not used before; `renderer` is
    the driver's name.

    Raises
    ------
    NoGpuError
        If drawing would wait for the threads forever.
    """
    if "llvmpipe" in renderer and was_forked() and _wants_threads() and not _has_threads():
        raise NoGpuError(_refusal("another library"))


def note_opened(context: CurrentContext | None, renderer: str, software: bool) -> None:
    """Remember that this process uses a driver, for `check_not_forked` in the processes forked from it."""
    _opened[_screen(context)] = os.getpid(), software and not ("llvmpipe" in renderer and _has_threads())


def _screen(context: CurrentContext | None) -> tuple[str, int]:
    """Return a key of the contexts that share driver threads: all of EGL, or GLX on one X connection."""
    return (context.api, context.display) if context is not None and context.api == "GLX" else ("EGL", 0)


def _refusal(who: str) -> str:
    return (
        f"this process was forked from one in which {who} had used OpenGL already, and the driver does not "
        "work in a forked process: start worker processes with multiprocessing's 'spawn' or 'forkserver' "
        "method, or fork before the first use of OpenGL"
    )


def was_forked() -> bool:
    """Return True if this process is a fork that has started no other program; False if not on Linux."""
    try:
        fields = Path("/proc/self/stat").read_bytes().rpartition(b")")[2].split()  # names may be no UTF-8
    except OSError:
        return False
    return bool(int(fields[6]) & _FORKED_WITHOUT_EXEC)


def _wants_threads() -> bool:
    """Return True if llvmpipe makes threads here: not on one core, nor with LP_NUM_THREADS=0."""
    given = os.environ.get("LP_NUM_THREADS", "")
    return int(given) > 0 if given.isdigit() else len(os.sched_getaffinity(0)) > 1


def _has_threads() -> bool:
    """Return True if this process has threads of llvmpipe, or if that cannot be known."""
    names = []
    for task in Path("/proc/self/task").glob("*/comm"):
        with suppress(OSError):  # a thread may end meanwhile
            names.append(task.read_bytes())
    return not names or any(name.startswith(b"llvmpipe-") for name in names)
