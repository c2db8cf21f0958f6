"""Programs that draw in processes: scripts of any kind, and programs that are killed or interrupted."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import textwrap
import time

from tests.cli.command import environment

SCRIPT = """
import os, sys, warnings

warnings.simplefilter("ignore", UserWarning)
sys.path.append({plugins!r})
os.chdir({work!r})
from firefly_sample.capture.job import Job, Task
from firefly_sample.capture.processes import ProcessEngine
from firefly_sample.settings import Settings

job = Job("meadow:plugin", {{}}, Settings(), 1.0, (64, 48), ("color",), 1.0, 0.0)
print("begun")
with ProcessEngine(job, 1) as engine:
    print(*(type(result).__name__ for _, result in engine.draw(Task(job, index) for index in range(2))))
"""
MEADOW = """
from pathlib import Path

from firefly_sample import Scene


class Meadow:
    name, summary, parameters = "meadow", "Reads a file in the working folder.", ()

    def build(self):
        print(Path("meadow.txt").read_text())
        return Scene()


plugin = Meadow()
"""
FOREVER = """
import warnings

warnings.simplefilter("ignore", UserWarning)
from firefly_sample.capture.job import Task
from firefly_sample.capture.processes import ProcessEngine
from tests.capture.hazards import job

long = job("tests.capture.hazards:sleeper")
with ProcessEngine(long, 1) as engine:
    for _ in engine.draw(Task(long, index) for index in range(3)):
        print(engine._workers[0]._process.pid, flush=True)
"""


def test_a_script_needs_no_guard(tmp_path):
    check_script(tmp_path, "file")


def check_script(tmp_path, kind):
    """Its modules are found in folders that it adds itself; it runs once; only it prints on stdout."""
    plugins, work = tmp_path / "plugins", tmp_path / "work"
    plugins.mkdir()
    work.mkdir()
    (plugins / "meadow.py").write_text(MEADOW)
    (work / "meadow.txt").write_text("green")
    script = textwrap.dedent(SCRIPT.format(plugins=str(plugins), work=str(work)))
    (tmp_path / "script.py").write_text(script)
    arguments = {"file": ["script.py"], "stdin": ["-"]}[kind]
    done = subprocess.run(
        [sys.executable, "-W", "error::ResourceWarning", *arguments],
        cwd=tmp_path,
        env=environment(),
        input=script if kind == "stdin" else None,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "begun\nDrawn Drawn\n", "green\n")


def test_workers_end_with_their_parent_whatever_they_draw():
    check_parent(signal.SIGKILL)


def check_parent(number):
    """A worker is in a frame that takes ten minutes when its parent ends."""
    parent = subprocess.Popen(
        [sys.executable, "-c", FOREVER],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert parent.stdout is not None
    line = parent.stdout.readline()
    assert line, parent.communicate()
    worker = os.pidfd_open(int(line))
    try:
        time.sleep(0.1)  # it draws the frame that takes ten minutes
        os.killpg(parent.pid, number)  # as a terminal does
        _, err = parent.communicate(timeout=30)
        assert select.select([worker], [], [], 30.0)[0], "the worker lives on"
    finally:
        os.close(worker)
        parent.kill()
    assert parent.returncode == -number
    assert err == "" if number == signal.SIGKILL else err.endswith("KeyboardInterrupt\n")
    assert err.count("Traceback") == (number == signal.SIGINT)
