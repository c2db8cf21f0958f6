"""``firefly measure start``."""

import json
import os

import pytest

from firefly_sample.cli import main
from firefly_sample.commands.measure_start import start_as_text
from firefly_sample.disk_cache import VARIABLE
from firefly_sample.errors import FireflyError
from firefly_sample.lab.start import CACHES, measure_start
from tests.cli.command import ROOT
from tests.lab.first_pictures import SIZE, answer, picture_here

ONE_CAT = "tests.lab.one_cat:one_cat"


def test_the_command_measures_every_state_of_the_cache(capsys, tmp_path, monkeypatch):
    own = tmp_path / "own"
    monkeypatch.setenv(VARIABLE, str(own))
    arguments = ("measure", "start", ONE_CAT, "--size", "48x36", "--rounds", "1", "--json")
    assert main(arguments) == 0
    result = json.loads(capsys.readouterr().out)
    assert result.keys() == {"scene", "size", "rounds", "driver", "dependencies", "rows"}
    assert (result["scene"], result["size"], result["rounds"]) == ("one_cat", SIZE, 1)
    assert result["dependencies"] > 0
    assert [row["cache"] for row in result["rows"]] == list(CACHES)
    for row in result["rows"]:
        assert row.keys() == {"cache", "seconds", "ratio", "spread", "sha256"}
        assert row["seconds"] > 0
        assert row["ratio"] > 0
        assert row["spread"] == 0
    assert not own.exists()
    monkeypatch.setenv(VARIABLE, "off")
    assert {row["sha256"] for row in result["rows"]} == {picture_here(ONE_CAT)}
    lines = start_as_text(result).splitlines()
    assert [line.split()[0] for line in lines[2:5]] == list(CACHES)


def test_what_a_scene_prints_is_not_taken_for_the_answer(tmp_path):
    (tmp_path / "chatty.py").write_text(
        'print({"driver": "mine"})\nfrom tests.cli.glade import glade as plugin\n'
    )
    told, said = answer("chatty:plugin", PYTHONPATH=f"{tmp_path}{os.pathsep}{ROOT}")
    assert told.keys() == {"driver", "sha256"}
    assert said == "{'driver': 'mine'}\n"


def test_what_cannot_be_drawn_is_said_in_one_line(capsys):
    assert main(["measure", "start", "nowhere"]) == 1
    assert "nowhere" in capsys.readouterr().err
    assert main(["measure", "start", "--rounds", "0"]) == 1
    assert "at least one round" in capsys.readouterr().err
    with pytest.raises(FireflyError, match="no EGL device 99"):
        measure_start("lightbulbs", size=(8, 6), rounds=1, device=99)
