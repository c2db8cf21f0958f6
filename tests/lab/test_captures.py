"""``firefly measure captures``: rates, memory and start of each way to capture, and growth of memory."""

import json
import os
import subprocess
import sys

import pytest

from firefly_sample.cli import main
from firefly_sample.errors import FireflyError
from firefly_sample.lab import captures
from firefly_sample.lab.captures import Capturing, measure_captures
from firefly_sample.lab.captures_growth import measure_growth
from firefly_sample.lab.captures_report import captures_as_text, growth_as_text
from firefly_sample.lab.process_tree import descendants, memory, memory_of_descendants, tree_seconds
from tests.cli.command import GLADE

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


def test_the_command_measures_one_process_and_workers(capsys, tmp_path, monkeypatch):
    """A cluster as well: see tests/lab/long_captures.py."""
    monkeypatch.setattr(captures, "find_spec", lambda name: None)
    check_command(capsys, tmp_path, monkeypatch, WAYS[:2])


def check_command(capsys, tmp_path, monkeypatch, ways):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    arguments = ("measure", "captures", GLADE, "--sizes", "16x12", "--frames", "8", "--rounds", "1", "--json")
    assert main([*arguments, "-o", str(tmp_path / "out")]) == 0
    result = json.loads(capsys.readouterr().out)
    assert json.loads((tmp_path / "out" / "captures.json").read_text()) == result
    assert [path.name for path in tmp_path.iterdir()] == ["out"]  # captures and caches are removed
    assert result.keys() == {"scene", "driver", "workers", "rounds", "left_out", "rows"}
    assert (result["scene"], result["workers"], result["rounds"]) == ("glade", 2, 1)
    assert result["left_out"].keys() == set(WAYS) - set(ways)
    assert [row["way"] for row in result["rows"]] == ways
    for row in result["rows"]:
        assert row.keys() == {
            *("size", "frames", "way", "first", "rate", "ratio", "spread", "cpu", "cores"),
            *("seconds", "parent", "worker", "all", "sha256"),
        }
        assert (row["size"], row["frames"], row["spread"]) == ([16, 12], 8, 0)
        assert 0 < row["first"] < row["seconds"]
        assert row["seconds"] - row["first"] > 6 / row["rate"]  # the last six frames took this long
        assert row["ratio"] == row["rate"] / result["rows"][0]["rate"]
        assert row["cores"] == row["cpu"] * row["rate"]
        assert row["parent"] > 10 << 20
    assert len({row["sha256"] for row in result["rows"]}) == 1
    one, *others = result["rows"]
    assert one["worker"] is None
    assert one["all"] == one["parent"]
    for row in others:
        assert row["worker"] > 10 << 20
        assert row["parent"] + 1.5 * row["worker"] < row["all"]  # there are two workers, and shared pages
    lines = captures_as_text(result).splitlines()
    assert [line.split("  ")[0] for line in lines[2 : 2 + len(ways)]] == ways
    report = (tmp_path / "out" / "captures.md").read_text()
    assert "## 16x12, 8 frames" in report
    assert [line.split(" | ")[0] for line in report.splitlines() if line.startswith("| ")][-len(ways) :] == [
        f"| {way}" for way in ways
    ]


def test_growth_is_measured_with_few_frames_too(monkeypatch):
    """Without distributed the cluster is left out, and said to be."""
    monkeypatch.setattr(captures, "find_spec", lambda name: None)
    result = measure_growth("2:12")
    assert result["frames"] == [2, 12]
    assert [row["way"] for row in result["rows"]] == WAYS[:2]
    assert result["left_out"].keys() == set(WAYS[2:])
    assert "pip install" in result["left_out"]["cluster of 2"]
    for row, others in zip(result["rows"], (0, 2), strict=True):
        frames = [sample["frame"] for sample in row["samples"]]
        assert frames == sorted(frames)
        assert (frames[0], frames[-1]) == (2, 12)
        assert {len(sample["others"]) for sample in row["samples"]} == {others}
        assert row["growth"] == row["samples"][-1]["parent"] - row["samples"][0]["parent"]
        assert abs(row["growth"]) < 20 << 20
        assert row["finished"] > 10 << 20
    text = growth_as_text(result)
    assert "AT 2  " in text
    assert text.splitlines()[-1].startswith("left out: cluster of 2: distributed is not installed")


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
