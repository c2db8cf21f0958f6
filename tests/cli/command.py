"""Run the command line: in this process where only its answer matters, in one of its own otherwise."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from firefly_sample.cli import main

ROOT = Path(__file__).resolve().parents[2]
GLADE = "tests.cli.glade:glade"


def environment(**changes: str) -> dict[str, str]:
    """This process's environment, in which a child finds the tests' scenes."""
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH", ""))))
    return {**os.environ, "PYTHONPATH": path, **changes}


def firefly(*arguments: object, cwd: Path, env: dict[str, str] | None = None, **options: Any):
    """``firefly ...`` in a process of its own."""
    return run_python("-m", "firefly_sample", *map(str, arguments), cwd=cwd, env=env, **options)


def run_python(*arguments: str, cwd: Path, env: dict[str, str] | None = None, **options: Any):
    """``python ...`` in a process of its own, which finds the tests' scenes."""
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=cwd,
        env=env or environment(),
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
        **options,
    )


def manifest_of(capsys: Any, *arguments: object) -> dict[str, Any]:
    """What ``firefly capture ... --json`` prints, from within this process."""
    code = main(["capture", *map(str, arguments), "--json"])
    out, err = capsys.readouterr()
    assert code == 0, err
    return json.loads(out)


def broken_gl(folder: Path) -> dict[str, str]:
    """An environment in which the dynamic loader finds OpenGL's libraries empty."""
    folder.mkdir()
    for name in ("libGL.so.1", "libEGL.so.1"):
        (folder / name).touch()
    return environment(LD_LIBRARY_PATH=str(folder))


def open_terminal() -> tuple[int, int]:
    """The two ends of a pseudo-terminal: what the user sees, and what a command is given."""
    try:
        return pty.openpty()
    except OSError as error:
        pytest.skip(f"this machine has no pseudo-terminals (is /dev/pts mounted?): {error}")
