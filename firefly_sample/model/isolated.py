"""Reading a model in a process of its own, with limits.

The packages of the extra "formats" are large, partly in C++, and made for trusted files: of STEP files with a
few wrong bytes, one in nine ends the process, and small OpenCTM files ask for gigabytes. In a process of its
own, either is one line of error.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, cast

from firefly_sample.errors import FireflyError, ModelError
from firefly_sample.model.data import ModelData

MEMORY = 2 * 2**30
"""The most bytes that the process may hold, packages and content."""
SECONDS, SECONDS_PER_MEGABYTE = 60, 30
"""The most seconds of processor time that it may take: for any file, and besides by its size."""


def read_isolated(path: Path, suffix: str, up: str | None, max_texture_megapixels: float) -> ModelData:
    """Return the content of a file, as `readers.read_here` does, which runs in a process of its own.

    Raises
    ------
    ModelError
        Also if that process crashes, or needs more memory or time than it may.
    """
    with tempfile.TemporaryDirectory(prefix="firefly-model-") as folder:
        result = Path(folder) / "result"
        seconds = SECONDS + SECONDS_PER_MEGABYTE * path.stat().st_size // 10**6
        done = subprocess.run(
            [sys.executable, "-c", "from firefly_sample.model.isolated import main; main()"],
            input=pickle.dumps((path, suffix, up, max_texture_megapixels, result, seconds)),
            capture_output=True,
            env={
                **os.environ,
                "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
                "OPENBLAS_NUM_THREADS": "1",
            },
            check=False,
        )
        try:
            found = pickle.loads(result.read_bytes())
        except FileNotFoundError:
            raise ModelError(f"model {path}: {_end(done.returncode, seconds)}") from None
    if isinstance(found, FireflyError):
        raise found
    assert isinstance(found, ModelData)
    return found


def _end(code: int, seconds: int) -> str:
    """Return why a process ended that left no result."""
    if code == -signal.SIGXCPU:
        return f"reading it takes more than {seconds} seconds: simplify it"
    if code < 0:
        return f"damaged: its reader crashed ({signal.Signals(-code).name}): export it again"
    return f"damaged: its reader ended without a result (exit code {code}): export it again"


def main() -> None:
    """Read what standard input asks for, and write the result, or the error, to a file."""
    import resource

    # trimesh imports SciPy where it is installed, which takes as long as all else here; no format needs it
    cast("Any", sys.modules)["scipy"] = None

    from firefly_sample.model.readers import read_here

    path, suffix, up, max_texture_megapixels, result, seconds = pickle.load(sys.stdin.buffer)
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        found: object = read_here(path, suffix, up, max_texture_megapixels)
    except FireflyError as error:
        found = error
    part = result.with_suffix(".part")  # a process that dies while it writes leaves no result
    part.write_bytes(pickle.dumps(found))
    part.rename(result)
