"""The progress bar in a real terminal, its rate and its time left, and lines that are printed above it."""

from __future__ import annotations

import logging
import os
import re
import subprocess
import sys

import pytest

import firefly_sample.capture  # noqa: F401 (silences the logger)
from firefly_sample.commands.pace import Pace, rate_text
from firefly_sample.commands.terminal import messages
from tests.cli.command import environment, open_terminal, run_python

RESUMED = """
import logging, threading, time
from firefly_sample.commands.terminal import messages, progress_bar
log = logging.getLogger("firefly_sample.capture.any")
with messages(), progress_bar("frames", unit="frame") as progress:
    log.info("5000 frames are\\nwhole")
    progress(5000, 5100)
    for done in range(5001, 5071):
        time.sleep(0.02)
        progress(done, 5100)
        if done == 5060:
            thread = threading.Thread(target=log.info, args=("%d frames to go", 40))
            thread.start()
            thread.join()
print("done")
"""


class Steps:
    """A pace, and the clock that it looks at."""

    def __init__(self):
        self.now, self.done = 100.0, 0
        self.pace = Pace(lambda: self.now)

    def do(self, seconds, steps=1, total=1000):
        self.now += seconds
        self.done += steps
        self.pace.advance(self.done, total)


def test_frames_of_an_earlier_run_and_the_first_one_do_not_count():
    steps = Steps()
    steps.do(0.0, 900)
    assert steps.pace.text("frame") == ""
    steps.do(60.0)  # it makes what others use
    for _ in range(8):
        steps.do(0.25)
    assert steps.pace.rate == pytest.approx(4.0)
    assert steps.pace.seconds_left == pytest.approx(91 / 4.0)
    assert steps.pace.text("frame") == "0:00:23 left, 4.0 frames/s"
    steps.now += 3.0  # the time left goes on, also while nothing is done
    assert steps.pace.text() == "0:00:20 left"
    steps.now += 3000.0
    assert steps.pace.text() == "0:00:00 left"


def test_it_is_the_pace_of_recent_frames():
    steps = Steps()
    steps.do(0.0, 0)
    for _ in range(100):
        steps.do(0.5)
    for _ in range(100):
        steps.do(0.8)
    assert steps.pace.rate == pytest.approx(1.25)
    for _ in range(10):
        steps.do(100.0)
    assert steps.pace.text("frame") == "21:56:40 left, 100 s/frame"


def test_many_processes_that_finish_at_once():
    steps = Steps()
    steps.do(0.0, 0)
    for _ in range(40):
        steps.do(2.0)
        for _ in range(7):
            steps.do(0.001)
        assert steps.pace.rate is None or 2.0 < steps.pace.rate < 8.0
    assert steps.pace.rate == pytest.approx(4.0, rel=0.1)


def test_frames_that_are_drawn_again():
    steps = Steps()
    for _ in range(10):
        steps.do(1.0)
    steps.do(0.0, -5)
    assert steps.pace.rate is None
    steps.do(1.0)
    for _ in range(2):
        steps.do(2.0)
        steps.do(0.0, 0)
    assert steps.pace.text("frame") == "0:33:04 left, 2.0 s/frame"


@pytest.mark.parametrize(
    ("rate", "text"),
    [
        (12345.6, "12346 frames/s"),
        (99.96, "100 frames/s"),
        (12.34, "12.3 frames/s"),
        (1.0, "1.0 frames/s"),
        (0.3125, "3.2 s/frame"),
        (0.001, "1000 s/frame"),
    ],
)
def test_rates_in_words(rate, text):
    assert rate_text(rate, "frame") == text


def test_a_terminal_sees_rate_and_time_left_and_lines_above_the_bar(tmp_path):
    terminal, end = open_terminal()
    try:
        process = subprocess.Popen(
            [sys.executable, "-c", RESUMED],
            cwd=tmp_path,
            env=environment(TERM="xterm", COLUMNS="80"),
            stdout=subprocess.PIPE,
            stderr=end,
            text=True,
        )
        os.close(end)
        seen = "".join(iter(lambda: read(terminal), ""))
        assert process.communicate(timeout=600) == ("done\n", None)
    finally:
        os.close(terminal)
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-ln-z]", "\r", re.sub(r"\x1b\[[0-9;]*m", "", seen))
    assert "firefly: 5000 frames are whole\r\n" in plain
    assert "firefly: 40 frames to go\r\n" in plain
    rates = re.findall(r"frames [━╸╺ ]*50\d\d/5100 +0:00:0\d left, ([\d.]+) frames/s", plain)
    assert rates
    assert max(map(float, rates)) < 50.5  # each frame sleeps for 0.02 s


def read(terminal):
    try:
        return os.read(terminal, 4096).decode()
    except OSError:  # how Linux says that the other end is closed
        return ""


def test_without_a_terminal_there_are_only_lines(tmp_path):
    done = run_python("-c", RESUMED.replace("sleep(0.02)", "sleep(0.0)"), cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "done\n")
    assert done.stderr == "firefly: 5000 frames are whole\nfirefly: 40 frames to go\n"


def test_messages_are_for_the_command_alone(capsys):
    log = logging.getLogger("firefly_sample.any")
    handlers = logging.getLogger("firefly_sample").handlers[:]
    for block, expected in ((messages(), ["one", "two"]), (messages(show=False), ["two"])):
        with block:
            log.debug("nothing")
            log.info("one")
            log.warning("two")
        assert capsys.readouterr().err.split() == [word for text in expected for word in ("firefly:", text)]
        assert logging.getLogger("firefly_sample").handlers == handlers
        assert logging.getLogger("firefly_sample").level == logging.NOTSET
    # without a handler of any kind, Python itself would print warnings
    assert any(isinstance(handler, logging.NullHandler) for handler in handlers)
