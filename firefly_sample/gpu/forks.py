"""Refuse to draw in a forked process whose driver was used before the fork."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

from firefly_sample.errors import NoGpuError
from firefly_sample.gpu.current import Holder

_FORKED_WITHOUT_EXEC = 0x40  # PF_FORKNOEXEC of Linux' sched.h

_opened: dict[tuple[str, int], tuple[int, bool]] = {}
"""By `_screen`: the process that opened a driver there last, and whether a fork of it can draw."""


def check_not_forked(holder: Holder | None) -> None:
    """Refuse a driver that this package used in the process that this one was forked from.

    A fork copies memory, but only the thread that calls it. llvmpipe's threads are missing in the child, and
    drawing would wait for them for ever; a GPU's driver would share its memory and queues with the parent.

    Parameters
    ----------
    holder : Holder or None
        The context that is to be used; None for one of EGL that is to be made.

    Raises
    ------
    NoGpuError
        If this process was forked since, and the driver cannot draw without what the fork left behind.
    """
    process, safe = _opened.get(_screen(holder), (os.getpid(), True))
    if process != os.getpid() and not safe:
        raise NoGpuError(_refusal("firefly_sample"))


def check_threads(renderer: str) -> None:
    """Refuse llvmpipe if another library used it before this process was forked: its threads are missing.

    Call it after making a context, with the driver's name `renderer`; making one starts missing threads where
    the driver was not used before.

    Raises
    ------
    NoGpuError
        If drawing would wait for the threads for ever.
    """
    if "llvmpipe" in renderer and _was_forked() and _wants_threads() and not _has_threads():
        raise NoGpuError(_refusal("another library"))


def note_opened(holder: Holder | None, renderer: str, software: bool) -> None:
    """Remember that this process uses a driver, for `check_not_forked` in the processes forked from it."""
    _opened[_screen(holder)] = os.getpid(), software and not ("llvmpipe" in renderer and _has_threads())


def _screen(holder: Holder | None) -> tuple[str, int]:
    """Return what shares one set of driver threads: all of EGL, or GLX on one connection to an X server."""
    return (holder.api, holder.display) if holder is not None and holder.api == "GLX" else ("EGL", 0)


def _refusal(who: str) -> str:
    return (
        f"this process was forked from one in which {who} had used OpenGL already, and the driver does not "
        "work in a forked process: start worker processes with multiprocessing's 'spawn' or 'forkserver' "
        "method, or fork before the first use of OpenGL"
    )


def _was_forked() -> bool:
    """Return whether this process is a fork that has started no other program; False off Linux."""
    try:
        fields = Path("/proc/self/stat").read_bytes().rpartition(b")")[2].split()  # names may be no UTF-8
    except OSError:
        return False
    return bool(int(fields[6]) & _FORKED_WITHOUT_EXEC)


def _wants_threads() -> bool:
    """Return whether llvmpipe makes threads here: not on one core, nor with LP_NUM_THREADS=0."""
    given = os.environ.get("LP_NUM_THREADS", "")
    return int(given) > 0 if given.isdigit() else len(os.sched_getaffinity(0)) > 1


def _has_threads() -> bool:
    """Return whether this process has threads of llvmpipe; True where this cannot be known."""
    names = []
    for task in Path("/proc/self/task").glob("*/comm"):
        with suppress(OSError):  # a thread may end meanwhile
            names.append(task.read_bytes())
    return not names or any(name.startswith(b"llvmpipe-") for name in names)
