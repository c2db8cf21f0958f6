"""A sweep over parameters and settings, drawn by workers, killed, and resumed."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from firefly_sample.capture.sequence import capture_frames, capture_settings
from firefly_sample.capture.verify import verify_capture
from tests.capture.captures import content
from tests.cli.command import GLADE, environment

pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")

SWEEP = {
    "fireflies": (3, 9),
    "seed": (1, 2),
    "dusk": (True, False),
    "exposure": (1.0, 2.5),
    "shadow_taps": (1, 4),
}
SIZE = (8, 6)


def words_of(sweep: dict[str, tuple[Any, ...]]) -> list[str]:
    return [
        word
        for name, values in sweep.items()
        for word in ("--sweep", f"{name}={','.join(str(value) for value in values)}")
    ]


def test_three_parameters_and_two_settings_on_two_workers_killed_once(tmp_path: Path) -> None:
    undisturbed = capture_frames(GLADE, tmp_path / "undisturbed", size=SIZE, sweep=SWEEP)
    expected = content(tmp_path / "undisturbed")
    assert undisturbed["sweep"] == {name: sorted(values) for name, values in SWEEP.items()}
    assert len(undisturbed["captures"]) == 2**5

    folder = tmp_path / "sweep"
    command = [sys.executable, "-m", "firefly_sample", "capture", GLADE, "--size", "8x6", "-o", str(folder)]
    command += [*words_of(SWEEP), "--workers", "2", "--quiet"]
    process = subprocess.Popen(command, cwd=tmp_path, env=environment(), stderr=subprocess.PIPE)
    deadline = time.monotonic() + 600
    while len(list(folder.glob("*/color_*.png"))) < 5:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.002)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert not (folder / "manifest.json").exists()
    whole = {path: path.stat().st_mtime_ns for path in folder.glob("*/color_*.png")}
    assert 5 <= len(whole) < 2**5

    subprocess.run([*command, "--resume"], cwd=tmp_path, env=environment(), check=True)
    assert content(folder) == expected
    kept = [path for path, written in whole.items() if path.stat().st_mtime_ns == written]
    assert len(kept) >= 5 - 1  # the one that was written when the kill came may not have been recorded
    assert verify_capture(folder).ok


def test_each_picture_is_that_of_a_single_capture(tmp_path: Path) -> None:
    sweep = {"fireflies": (3, 9), "exposure": (1.0, 2.5)}
    swept = capture_frames(GLADE, tmp_path / "sweep", frames="0:2", size=SIZE, sweep=sweep)
    for part in swept["captures"]:
        values = part["values"]
        single = capture_frames(
            GLADE,
            tmp_path / part["folder"],
            frames="0:2",
            size=SIZE,
            parameters={"fireflies": values["fireflies"]},
            settings=capture_settings(["color"], exposure=values["exposure"]),
        )
        assert part["settings"] == single["settings"]
        assert part["parameters"] == single["parameters"]
        assert [frame["sha256"] for frame in part["frames"]] == [
            frame["sha256"] for frame in single["frames"]
        ]
        for frame in single["frames"]:
            name = frame["files"]["color"]
            picture = tmp_path / "sweep" / part["folder"] / name
            assert picture.read_bytes() == (tmp_path / part["folder"] / name).read_bytes()
    assert len({frame["sha256"]["color"] for part in swept["captures"] for frame in part["frames"]}) == 8


def test_a_sweep_is_extended_by_other_values(tmp_path: Path) -> None:
    capture_frames(GLADE, tmp_path / "parts", size=SIZE, sweep=["fireflies=3,9"])
    written = {path: path.stat().st_mtime_ns for path in tmp_path.glob("parts/*/*.png")}
    capture_frames(GLADE, tmp_path / "parts", size=SIZE, sweep=["fireflies=5"], resume=True)
    capture_frames(GLADE, tmp_path / "whole", size=SIZE, sweep=["fireflies=3,5,9"])
    assert content(tmp_path / "parts") == content(tmp_path / "whole")
    assert {path: path.stat().st_mtime_ns for path in written} == written
    assert json.loads((tmp_path / "parts/manifest.json").read_text())["sweep"] == {"fireflies": [3, 5, 9]}
