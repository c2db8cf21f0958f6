"""Conditions in which a driver draws other pictures, crashes or hangs: environment variables, and forked
processes.

The effects of the variables on Mesa's drivers were found by drawing the scenes of this package with each,
with Mesa 22.3.6.
"""

from __future__ import annotations

import os
import re
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from firefly_sample.errors import GpuError, NoGpuError
from firefly_sample.gpu.current import CurrentContext


class Variable(NamedTuple):
    """The effect of a variable, a clause without subject; `silent` if the driver's name does not show it."""

    effect: str
    silent: bool = False


VARIABLES = {
    "LP_PERF": Variable("makes llvmpipe leave out parts of drawing, such as depth tests", silent=True),
    "GALLIVM_PERF": Variable("makes llvmpipe filter textures less exactly", silent=True),
    "LP_NATIVE_VECTOR_WIDTH": Variable(
        "sets the bits of llvmpipe's vectors; below 256 it crashes on a processor with AVX"
    ),
    "GALLIUM_OVERRIDE_CPU_CAPS": Variable(
        "hides what the processor can do; llvmpipe then rounds differently"
    ),
    "GALLIUM_NOSSE": Variable("hides what the processor can do; llvmpipe then rounds differently"),
    "GALLIUM_DRIVER": Variable("chooses the software driver"),
    "DRAW_USE_LLVM": Variable("can keep llvmpipe from having OpenGL 3.3"),
    "MESA_GL_VERSION_OVERRIDE": Variable("changes the version of OpenGL that Mesa says it has"),
    "MESA_GLSL_VERSION_OVERRIDE": Variable("changes the version of GLSL that Mesa says it has"),
    "MESA_EXTENSION_OVERRIDE": Variable("changes the extensions that Mesa says it has"),
    "MESA_LOADER_DRIVER_OVERRIDE": Variable("chooses Mesa's driver"),
    "LIBGL_ALWAYS_SOFTWARE": Variable("chooses a software driver"),
    "LIBGL_DRIVERS_PATH": Variable("changes where Mesa looks for its drivers"),
}

_WITHOUT_AVX = ("nosse", "sse", "sse2", "sse3", "ssse3", "sse4.1")
"""Values of GALLIUM_OVERRIDE_CPU_CAPS that hide AVX."""


def variables_set() -> dict[str, str]:
    """Return those of `VARIABLES` that are set and not empty, with their values."""
    return {name: os.environ[name] for name in VARIABLES if os.environ.get(name)}


def silent_changes(driver: str) -> list[str]:
    """Return a sentence for each variable that silently changes a driver's pictures."""
    if not driver.startswith("llvmpipe"):
        return []
    return [
        f"{name}={value} in the environment {VARIABLES[name].effect}: unset it"
        for name, value in variables_set().items()
        if VARIABLES[name].silent
    ]


def software_warning(driver: str) -> str:
    """Return the text of the `SoftwareDriverWarning` for a driver's name."""
    return f"drawing on the CPU ({driver}): right, but slow"


def vector_bits(driver: str) -> int | None:
    """Return the width of llvmpipe's vectors, which its name contains, or None for other drivers."""
    found = re.match(r"llvmpipe \(.*\b(\d+) bits\)", driver)
    return int(found[1]) if found else None


def check_vector_width(driver: str) -> None:
    """Raise `GpuError` if LP_NATIVE_VECTOR_WIDTH asks for vectors narrower than the processor's.

    With them llvmpipe overwrites memory while it draws the first mesh, and crashes then or later.
    """
    asked, bits = os.environ.get("LP_NATIVE_VECTOR_WIDTH"), vector_bits(driver)
    if not asked or bits is None or bits >= 256 or not _has_avx():
        return
    if os.environ.get("GALLIUM_OVERRIDE_CPU_CAPS") not in _WITHOUT_AVX:
        raise GpuError(
            f"LP_NATIVE_VECTOR_WIDTH={asked} in the environment makes this driver ({driver}) crash on a "
            "processor with AVX: unset it; for the pictures of a processor without AVX, set "
            "GALLIUM_OVERRIDE_CPU_CAPS=sse4.1 in its place"
        )


def _has_avx() -> bool:
    """Return True if the processor has AVX, False also if the system does not say."""
    with suppress(OSError):
        return re.search(r"^flags\s*:.*\bavx\b", Path("/proc/cpuinfo").read_text(), re.MULTILINE) is not None
    return False


_NAMING_SECONDS = 2.0
"""How long threads have to name themselves."""
_FORKED_WITHOUT_EXEC = 0x40  # PF_FORKNOEXEC of Linux' sched.h

_opened: dict[tuple[str, int], tuple[int, bool]] = {}
"""By `_screen`: the process that last opened a driver there, and True if a fork of it can draw."""


def check_not_forked(context: CurrentContext | None) -> None:
    """Raise `NoGpuError` if this process was forked after its parent used the driver, and it cannot draw in a
    fork.

    A fork copies memory, but only the thread that calls it. llvmpipe's threads are missing in the child, and
    drawing would wait for them forever; a GPU's driver would share its memory and queues with the parent.
    `context` is the one to be used, None for an EGL context to be made.
    """
    process, safe = _opened.get(_screen(context), (os.getpid(), True))
    if process != os.getpid() and not safe:
        raise NoGpuError(_refusal("firefly_sample"))


def check_threads(renderer: str) -> None:
    """Raise `NoGpuError` if drawing would wait forever for llvmpipe's threads, which a fork does not have.

    This is so if another library used llvmpipe before the fork. Call it after making a context, which starts
    the threads if the driver was not used before; `renderer` is the driver's name.
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
    with suppress(OSError):
        fields = Path("/proc/self/stat").read_bytes().rpartition(b")")[2].split()  # names may be no UTF-8
        return bool(int(fields[6]) & _FORKED_WITHOUT_EXEC)
    return False


def _wants_threads() -> bool:
    """Return True if llvmpipe makes threads here: not on one core, nor with LP_NUM_THREADS=0."""
    given = os.environ.get("LP_NUM_THREADS", "")
    return int(given) > 0 if given.isdigit() else len(os.sched_getaffinity(0)) > 1


def _has_threads() -> bool:
    """Return True if this process has threads of llvmpipe, or if that cannot be known.

    Each gives itself its name when it begins to run, which takes a while on a busy machine.
    """
    deadline = time.monotonic() + _NAMING_SECONDS
    while True:
        names = []
        for task in Path("/proc/self/task").glob("*/comm"):
            with suppress(OSError):  # a thread may end meanwhile
                names.append(task.read_bytes())
        if not names or any(name.startswith(b"llvmpipe-") for name in names):
            return True
        if len(names) == 1 or not _wants_threads() or time.monotonic() > deadline:
            return False
        time.sleep(0.001)
