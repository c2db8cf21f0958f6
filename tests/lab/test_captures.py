"""``firefly measure captures``: rates, memory and start of each way to capture, and growth of memory."""

import os
import subprocess
import sys

import pytest

from firefly_sample.cli import main
from firefly_sample.errors import FireflyError
from firefly_sample.lab import captures
from firefly_sample.lab.captures import Capturing, measure_captures
from firefly_sample.lab.process_tree import descendants, memory, memory_of_descendants, tree_seconds

WAYS = ["one process", "2 workers", "cluster of 2"]
CHILD = """
import subprocess, sys
filled = bytearray(b"x") * (64 << 20)
grandchild = subprocess.Popen(["sleep", "60"])
while sum(map(float, __import__("os").times()[:2])) < 0.5: pass
print(grandchild.pid, flush=True)
sys.stdin.read()
grandchild.kill()
"""


def test_a_tree_of_processes_has_the_time_and_the_memory_of_all():
    """A child takes 64 MiB and half a second, and has a child of its own."""
    before, seconds = set(descendants()), tree_seconds()
    command = [sys.executable, "-c", CHILD]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as child:
        grandchild = int(child.stdout.readline())
        assert set(descendants()) - before == {child.pid, grandchild}
        assert tree_seconds() - seconds >= 0.5 - 2 / os.sysconf("SC_CLK_TCK")
        assert 64 << 20 <= memory(child.pid) < 96 << 20
        sizes = memory_of_descendants()
        assert sizes == sorted(sizes, reverse=True)
        assert sizes[0] >= 64 << 20
        child.stdin.close()
    assert set(descendants()) == before


def test_files_that_differ_are_an_error(monkeypatch):
    answers = iter([{"sha256": "a", "driver": "d"}, {"sha256": "b", "driver": "d"}])
    monkeypatch.setattr(captures, "answer_of", lambda *_, **__: (0.0, next(answers)))
    with Capturing("lightbulbs", None, 2, None) as capturing:
        capturing.capture("one process", (8, 6), 4)
        with pytest.raises(FireflyError, match="by 2 workers differ from those by one process"):
            capturing.capture("2 workers", (8, 6), 4)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere"], "nowhere"),
        (["--rounds", "0"], "at least one round"),
        (["--frames", "3"], "at least 4 frames"),
        (["--workers", "1"], "workers must be 2 or more"),
        (["--growth", "0:20"], "1000:20000"),
        (["--growth", "5:20", "-o", "out"], "--json"),
    ],
)
def test_what_cannot_be_measured_is_said_in_one_line(capsys, arguments, said):
    assert main(["measure", "captures", *arguments]) == 1
    assert said in capsys.readouterr().err


def test_a_driver_that_is_not_there_is_said_by_the_process():
    with pytest.raises(FireflyError, match="no EGL device 99"):
        measure_captures("lightbulbs", sizes=[(8, 6)], frames=4, rounds=1, device=99)
