"""Ctrl-C, SIGTERM and SIGHUP from the first moment on: real signals to real processes."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager

import pytest

from firefly_sample.cli import main
from tests.cli.command import ROOT, environment

ENDINGS = {
    "SIGINT": (130, "", "firefly: interrupted\n"),
    "SIGTERM": (143, "", "firefly: terminated\n"),
    "SIGHUP": (129, "", "firefly: hung up\n"),
}
SLOW = """
import pathlib, time
try:
    pathlib.Path("begun").touch()
    time.sleep(600)
except BaseException:
    pass  # as libraries do that try what there is
"""
BUILDING = """
import pathlib, signal, time
from firefly_sample import Scene

def wait_for(name):
    while not pathlib.Path(name).exists():
        time.sleep(0.01)

def build():
    try:
        pathlib.Path("begun").touch()
        wait_for("go")
    finally:
        pathlib.Path("cleaning").touch()
        wait_for("clean")
        pathlib.Path("cleaned").touch()
    return Scene()

class Slow:
    name, summary, parameters = "slow_plugin", "It takes its time.", ()
    build = staticmethod(build)

plugin = Slow()
"""
RESTING = """
from firefly_sample import Scene
from signal import SIGHUP, SIGINT, SIGTERM, getsignal

class Resting:
    name, summary, parameters = "resting_plugin", "It prints how signals are handled.", ()

    def build(self):
        print(getsignal(SIGINT), getsignal(SIGTERM), getsignal(SIGHUP))
        return Scene()

plugin = Resting()
"""


@contextmanager
def planning(folder, ignored=()):
    """``firefly plan`` of a slow plugin, in a process of its own that has begun."""

    def set_signals():
        # whoever runs the tests in the background may have had signals ignored, which children inherit
        for name in ENDINGS:
            signal.signal(signal.Signals[name], signal.SIG_IGN if name in ignored else signal.SIG_DFL)

    process = subprocess.Popen(
        [sys.executable, "-m", "firefly_sample.cli", "plan", "slow_plugin:plugin"],
        cwd=folder,
        env=environment(PYTHONPATH=f"{folder}:{ROOT}"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=set_signals,
    )
    try:
        wait_for(folder / "begun", process)
        yield process
    finally:
        process.kill()
        process.wait()


def wait_for(path, process):
    deadline = time.monotonic() + 600
    while not path.exists():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.02)


def end_of(process):
    """Exit code, stdout and stderr."""
    out, err = process.communicate(timeout=600)
    return process.returncode, out, err


@pytest.mark.parametrize(
    ("module", "name"),
    [("cyclopts", "SIGINT"), ("cyclopts", "SIGHUP"), ("slow_plugin", "SIGINT"), ("slow_plugin", "SIGTERM")],
)
def test_a_signal_while_it_starts(tmp_path, module, name):
    """While a library or a plugin is imported, which may swallow KeyboardInterrupt."""
    (tmp_path / f"{module}.py").write_text(SLOW)
    with planning(tmp_path) as process:
        process.send_signal(signal.Signals[name])
        assert end_of(process) == ENDINGS[name]


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_signal_during_a_command_lets_it_clean_up(tmp_path, name):
    (tmp_path / "slow_plugin.py").write_text(BUILDING)
    (tmp_path / "clean").touch()
    with planning(tmp_path) as process:
        process.send_signal(signal.Signals[name])
        assert end_of(process) == ENDINGS[name]
    assert (tmp_path / "cleaned").exists()


def test_a_second_signal_does_not_wait_for_the_cleaning_up(tmp_path):
    (tmp_path / "slow_plugin.py").write_text(BUILDING)
    with planning(tmp_path) as process:
        process.send_signal(signal.SIGHUP)
        wait_for(tmp_path / "cleaning", process)
        process.send_signal(signal.SIGTERM)
        assert end_of(process) == ENDINGS["SIGTERM"]
    assert not (tmp_path / "cleaned").exists()


def test_signals_that_were_ignored_stay_ignored(tmp_path):
    """As by nohup and for a script's jobs in the background, which SIGTERM still ends."""
    (tmp_path / "slow_plugin.py").write_text(BUILDING)
    with planning(tmp_path, ignored=("SIGHUP", "SIGINT")) as process:
        process.send_signal(signal.SIGHUP)
        process.send_signal(signal.SIGINT)
        (tmp_path / "go").touch()
        wait_for(tmp_path / "cleaning", process)
        process.send_signal(signal.SIGTERM)
        (tmp_path / "clean").touch()
        assert end_of(process) == ENDINGS["SIGTERM"]


def test_other_programs_keep_their_own_handlers(tmp_path, monkeypatch, capsys):
    """Both where they pass a command line, and in a thread, where no handler can be set."""
    (tmp_path / "resting_plugin.py").write_text(RESTING)
    monkeypatch.syspath_prepend(tmp_path)
    signals = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
    handlers = " ".join(str(signal.getsignal(each)) for each in signals)
    words = ["plan", "resting_plugin:plugin"]
    assert main(words) == 0
    monkeypatch.setattr(sys, "argv", ["firefly", *words])
    codes = []
    thread = threading.Thread(target=lambda: codes.append(main()))
    thread.start()
    thread.join()
    assert codes == [0]
    assert capsys.readouterr().out.splitlines().count(handlers) == 2
