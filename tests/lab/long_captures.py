"""Measurements of captures that take long: ``python -m pytest tests/lab/long_captures.py``."""

import json

import pytest

from firefly_sample.cli import main
from firefly_sample.lab import captures
from firefly_sample.lab.captures_growth import measure_growth
from firefly_sample.lab.captures_report import captures_as_text, growth_as_text
from tests.cli.command import GLADE
from tests.lab.test_captures import WAYS


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


def test_the_command_measures_every_way(capsys, tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    check_command(capsys, tmp_path, monkeypatch, WAYS)


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
