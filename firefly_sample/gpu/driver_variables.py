"""Environment variables that change the pictures of Mesa's drivers, or keep them from drawing.

Their effects were found by drawing the scenes of this package with each, with Mesa 22.3.6.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from pathlib import Path

from firefly_sample.errors import GpuError


@dataclass(frozen=True)
class Variable:
    """The effect of a variable.

    Attributes
    ----------
    effect : str
        A clause with the variable as its subject.
    silent : bool
        True if llvmpipe draws different pictures under the same driver name.
    """

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


def vector_bits(driver: str) -> int | None:
    """Return the width of llvmpipe's vectors, which its name contains, or None for other drivers."""
    found = re.match(r"llvmpipe \(.*\b(\d+) bits\)", driver)
    return int(found[1]) if found else None


def check_vector_width(driver: str) -> None:
    """Refuse vectors that are narrower than the processor's.

    With them llvmpipe overwrites memory while it draws the first mesh, and crashes then or later.

    Raises
    ------
    GpuError
        If LP_NATIVE_VECTOR_WIDTH asks for them.
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
    try:
        return re.search(r"^flags\s*:.*\bavx\b", Path("/proc/cpuinfo").read_text(), re.MULTILINE) is not None
    except OSError:
        return False
