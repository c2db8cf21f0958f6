"""``firefly measure panda3d``."""

from __future__ import annotations

import json
from contextlib import nullcontext

import pytest

from firefly_sample.cli import main
from firefly_sample.errors import SceneError
from firefly_sample.lab import measure_panda3d
from firefly_sample.lab.panda3d_speed import panda3d_as_text

TIMES = "live", "alone", "graph", "picture", "hand over"


def test_a_live_frame_is_timed_with_its_parts():
    result = measure_panda3d(lights=[3], frames=3, size=(48, 36))
    (row,) = result["rows"]
    assert (result["size"], result["frames"]) == ([48, 36], 3)
    assert result["driver"]
    assert list(row) == ["lights", *TIMES]
    assert min(row[name] for name in TIMES) > 0
    assert row["live"] > max(row["graph"], row["picture"], row["hand over"])


def test_the_command_measures_three_numbers_of_lights(capsys, monkeypatch):
    jobs = []

    class KnownTimes:
        tell = jobs.append

        def answer(self):
            return {"driver": "driver", "ms": {name: 2.0 * number for number, name in enumerate(TIMES)}}

    def start(module):
        assert module == "firefly_sample.lab.panda3d_process"
        return nullcontext(KnownTimes())

    monkeypatch.setattr("firefly_sample.lab.panda3d_speed.start_process", start)
    assert main(["measure", "panda3d", "--frames", "7", "--size", "48x36", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert jobs == [{"lights": count, "size": (48, 36), "frames": 7} for count in (0, 100, 500)]
    title, _, *rows, _ = panda3d_as_text(result).splitlines()
    assert title == "7 frames, 48x36, driver"
    numbers = ["0.0", "2.0", "4.0", "6.0", "8.0"]
    assert [row.split() for row in rows] == [[count, *numbers] for count in ("0", "100", "500")]


@pytest.mark.parametrize("wrong", [{"frames": 0}, {"lights": []}, {"lights": [-1]}])
def test_nothing_to_measure_is_refused(wrong):
    with pytest.raises(SceneError, match="nothing to measure"):
        measure_panda3d(**wrong)
