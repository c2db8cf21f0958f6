"""The keys of the JSON that other programs read. A change here breaks them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from firefly_sample.cli import main
from firefly_sample.lab.speed_report import speed_as_text
from firefly_sample.settings import Settings
from tests.cli.command import GLADE

WHOLE = {
    "capture": {
        *("scene", "parameters", "settings", "exposure", "seed", "driver", "driver_version", "software"),
        *("version", "sources", "size", "outputs", "formats", "quality", "depth_scale", "dataset", "fps"),
        *("time", "views", "warnings", "failed", "frames"),
    },
    "plan": {"passes", "targets", "lights", "light_method", "exposure", "warnings"},
}


def told(capsys, *arguments):
    assert main([*arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.fixture
def capture(tmp_path, capsys):
    return told(capsys, "capture", GLADE, "--size", "8x6", "--frames", "0:2", "-o", str(tmp_path))


def test_capture(capture):
    assert capture.keys() == WHOLE["capture"]
    assert isinstance(capture["seed"], int)
    assert isinstance(capture["software"], bool)
    assert capture["size"] == [8, 6]
    assert capture["outputs"] == ["color"]
    assert (capture["fps"], capture["time"]) == (24.0, 5.0)
    assert (capture["sources"], capture["failed"]) == ({}, [])
    for frame in capture["frames"]:
        assert frame.keys() == {"index", "time", "lights", "camera", "files", "sha256", "file_sha256"}
        assert frame["lights"].keys() == {"in_scene", "in_view", "dropped"}
        assert all(not Path(path).is_absolute() for path in frame["files"].values())
        for hashes in (frame["sha256"], frame["file_sha256"]):
            assert hashes.keys() == frame["files"].keys()
            assert all(len(bytes.fromhex(digest)) == 32 for digest in hashes.values())


def test_capture_of_ids(tmp_path, capsys):
    manifest = told(capsys, "capture", GLADE, "--size", "8x6", "--outputs", "id", "-o", str(tmp_path))
    assert manifest.keys() == WHOLE["capture"] | {"id_names"}
    assert all(isinstance(name, str) for name in manifest["id_names"])


def test_capture_of_a_sweep(tmp_path, capsys):
    options = ("--size", "8x6", "--sweep", "fireflies=1,2", "--sweep", "exposure=1,2", "-o", str(tmp_path))
    manifest = told(capsys, "capture", GLADE, *options)
    own = {"parameters", "settings", "exposure", "seed", "sources", "warnings", "failed", "frames"}
    assert manifest.keys() == WHOLE["capture"] - own | {"sweep", "captures"}
    assert manifest["sweep"] == {"fireflies": [1, 2], "exposure": [1.0, 2.0]}
    assert [capture["values"] for capture in manifest["captures"]] == [
        {"fireflies": lights, "exposure": exposure} for lights in (1, 2) for exposure in (1.0, 2.0)
    ]
    for capture in manifest["captures"]:
        assert capture.keys() == own | {"folder", "values"}
        ((path,),) = (frame["files"].values() for frame in capture["frames"])
        assert path == f"{capture['folder']}/color_000000.png"
        assert (tmp_path / path).exists()


def test_capture_with_a_frame_that_fails(tmp_path, capsys):
    options = ("--size", "4x3", "--frames", "2:4", "--fps", "1", "--time", "0", "-o", str(tmp_path))
    assert main(["capture", "tests.cli.glade:failing", *options, "--json"]) == 3
    manifest = json.loads(capsys.readouterr().out)
    assert manifest.keys() == WHOLE["capture"]
    assert manifest["failed"] == [{"index": 3, "time": 3.0, "error": "no fourth frame"}]


def test_a_scene_without_a_seed_has_the_seed_null(tmp_path, capsys):
    manifest = told(capsys, "capture", "tests.cli.glade:empty", "--size", "4x3", "-o", str(tmp_path))
    assert manifest["seed"] is None
    assert manifest["parameters"] == {}


def test_plan(capsys):
    plan = told(capsys, "plan", GLADE)
    assert plan.keys() == WHOLE["plan"]
    for step in plan["passes"]:
        assert step.keys() == {"name", "reads", "writes", "updates", "because"}
    for target in plan["targets"]:
        assert target.keys() == {"name", "format", "bytes_per_pixel", "because"}
    assert plan["lights"].keys() == {"in_scene", "in_view", "dropped"}
    assert {"method", "because", "estimated_pairs"} <= plan["light_method"].keys()
    assert "light_method" not in told(capsys, "plan", GLADE, "--fireflies", "0", "--no-dusk")


def test_measure_speed(capsys):
    options = ("--size", "16x12", "--fireflies", "5", "--seeds", "1,2")
    result = told(capsys, "measure", "speed", GLADE, *options)
    assert result.keys() == {"scene", "size", "driver", "rows", "chosen", "left_out"}
    assert result["size"] == [16, 12]
    assert result["left_out"] == []
    assert result["chosen"] in [row["method"] for row in result["rows"]]
    for row in result["rows"]:
        assert row.keys() == {
            *("size", "lights", "method", "ms", "spread", "ratio", "passes", "host_ms", "plan_ms"),
            *("draw_calls", "bytes_per_pixel", "shaded", "pairs", "shaded_per_pair", "slope", "growth"),
        }
        assert row["size"] == [16, 12]
        assert all(milliseconds >= 0 for milliseconds in row["passes"].values())


def test_measure_speed_at_several_sizes(capsys):
    options = ("--sizes", "16x12,8x6", "--counts", "2,3", "--rounds", "1", "--longest", "1e-9")
    result = told(capsys, "measure", "speed", GLADE, *options)
    assert result["size"] == [[16, 12], [8, 6]]
    assert result["rows"] == []
    assert result["left_out"]
    for left in result["left_out"]:
        assert left.keys() == {"size", "lights", "method", "because"}
        assert left["size"] in result["size"]
        assert left["lights"] in (2, 3)


def test_performance_test(capsys):
    options = ("--headless", "--performance-test", "0.2", "--size", "16x12", "--fireflies", "5")
    result = told(capsys, "run", GLADE, *options)
    assert result.keys() == {
        *("scene", "parameters", "size", "driver", "software", "frames", "seconds", "frames_per_second"),
        *("lights", "milliseconds", "settings"),
    }
    assert (result["scene"], result["size"]) == ("glade", [16, 12])
    assert result["parameters"]["fireflies"] == result["lights"]["in_scene"] == 5
    assert result["lights"].keys() == {"in_scene", "in_view", "dropped"}
    assert isinstance(result["software"], bool)
    assert isinstance(result["frames"], int)
    assert result["milliseconds"].keys() == {"geometry", "ambient", "point_lights", "resolve"}
    assert result["settings"] == Settings().as_dict()


def test_a_table_of_measured_speed():
    row = {
        "size": [800, 600],
        "lights": 500,
        "spread": 0.013,
        "passes": {"geometry": 3.0},
        "shaded": 1234567,
        "pairs": 411522,
        "host_ms": 4.0,
        "plan_ms": 1.5,
        "draw_calls": 15,
        "bytes_per_pixel": 36.0,
        "slope": None,
        "growth": None,
    }
    result = {
        "scene": "forest",
        "size": [800, 600],
        "driver": "llvmpipe",
        "rows": [
            {"method": "volumes", "ms": 12.345, "ratio": 1.0, "shaded_per_pair": 3.0, **row},
            {"method": "loop", "ms": 99.0, "ratio": 8.02, "shaded_per_pair": 0.5, **row}
            | {"passes": {}, "slope": 182.51, "growth": 1.0},
        ],
        "chosen": "volumes",
        "left_out": [{"size": [800, 600], "lights": 1000, "method": "loop", "because": "it would take long"}],
    }
    title, head, volumes, loop, chosen, left_out = speed_as_text(result).splitlines()
    assert title == "forest, 800x600, llvmpipe; milliseconds of a frame and its passes"
    assert head.split() == [
        *(
            "LIGHTS",
            "METHOD",
            "MS",
            "SPREAD",
            "RATIO",
            "GEOMETRY",
            "HOST",
            "MS",
            "PLAN",
            "MS",
            "DRAW",
            "CALLS",
        ),
        *("BYTES/PX", "SHADED", "PAIRS", "SHADED/PAIR", "US/LIGHT", "GROWTH"),
    ]
    assert volumes.split() == [
        *("500", "volumes", "12.35", "0.01", "1.00", "3.00", "4.00", "1.50", "15", "36", "1,234,567"),
        *("411,522", "3.00", "-", "-"),
    ]
    assert loop.split() == [
        *("500", "loop", "99.00", "0.01", "8.02", "-", "4.00", "1.50", "15", "36", "1,234,567"),
        *("411,522", "0.50", "182.5", "1.00"),
    ]
    assert chosen == "ratios are to the time of method volumes"
    assert left_out == "left out: loop with 1,000 lights at 800x600: it would take long"
    result["size"] = [[800, 600], [16, 12]]
    lines = speed_as_text(result).splitlines()
    assert lines[:4] == [title, head, volumes, loop]
    assert lines[4].startswith("forest, 16x12, llvmpipe; ")
    assert lines[6:] == [chosen, left_out]
