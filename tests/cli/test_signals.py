"""Ctrl-C from the first moment on: real signals to real processes."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest

from tests.cli.command import ROOT, environment

SLOW = """
import pathlib, time
try:
    pathlib.Path("begun").touch()
    time.sleep(600)
except BaseException:
    pass  # as libraries do that try what there is
"""


@pytest.mark.parametrize("module", ["cyclopts", "slow_plugin"])
def test_ctrl_c_while_it_starts(tmp_path, module):
    """While a library or a plugin is imported, which may swallow KeyboardInterrupt."""
    (tmp_path / f"{module}.py").write_text(SLOW)
    command = [sys.executable, "-m", "firefly_sample.cli", "plan", "slow_plugin:plugin"]
    process = subprocess.Popen(
        command,
        cwd=tmp_path,
        env=environment(PYTHONPATH=f"{tmp_path}:{ROOT}"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # whoever runs the tests in the background may have had SIGINT ignored, which children inherit
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    try:
        deadline = time.monotonic() + 600
        while not (tmp_path / "begun").exists():
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < deadline
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=600)
    finally:
        process.kill()
    assert (process.returncode, out, err) == (130, "", "firefly: interrupted\n")
