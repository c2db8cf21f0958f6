"""``firefly measure start``, and that no cache changes a picture."""

import json
import os
import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor

import pytest

from firefly_sample import SoftwareDriverWarning
from firefly_sample.cli import main
from firefly_sample.commands.measure_start import start_as_text
from firefly_sample.disk_cache import VARIABLE
from firefly_sample.errors import FireflyError
from firefly_sample.lab.start import CACHES, measure_start
from firefly_sample.lab.start_process import first_picture
from tests.cli.command import ROOT, environment

SIZE = [48, 36]
ONE_CAT = "tests.lab.one_cat:one_cat"


def answer(scene, **variables):
    """The answer of a fresh process that draws a picture, and what else it said."""
    job = json.dumps({"scene": scene, "size": SIZE, "time": 5.0, "device": None})
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-m", "firefly_sample.lab.start_process", job],
        env=environment(**variables),
        capture_output=True,
        text=True,
        timeout=600,
        check=True,
    )
    return json.loads(done.stdout), done.stderr


def picture(scene, folder):
    """The digest of a picture that a fresh process draws."""
    told, said = answer(scene, **{VARIABLE: str(folder)})
    assert said == ""
    return told["sha256"]


def test_the_forest_is_the_same_with_the_cache_off_empty_full_damaged_and_shut(tmp_path, monkeypatch, capfd):
    """Two processes fill the cache at once; this one, which keeps no model, draws the other pictures."""

    def here(folder):
        monkeypatch.setenv(VARIABLE, str(folder))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SoftwareDriverWarning)
            digest = first_picture("forest", SIZE, 5.0, None)["sha256"]
        assert capfd.readouterr() == ("", "")
        return digest

    folder = tmp_path / "kept"
    plain = here("off")
    with ThreadPoolExecutor() as pool:  # two fill it at once
        assert set(pool.map(picture, ["forest"] * 2, [folder] * 2)) == {plain}
    files = sorted(folder.iterdir())
    assert {path.name.split("-")[0] for path in files} == {"model", "texture"}
    assert {path.suffix for path in files} == {".derived"}
    written = {path: path.stat().st_ino for path in files}
    assert here(folder) == plain
    assert {path: path.stat().st_ino for path in files} == written  # nothing was made again
    for number, path in enumerate(files):
        if number % 3 == 0:
            path.unlink()
        elif number % 3 == 1:
            os.truncate(path, path.stat().st_size // 2)
    assert here(folder) == plain
    (tmp_path / "file").write_text("")
    assert here(tmp_path / "file" / "kept") == plain


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
    assert {row["sha256"] for row in result["rows"]} == {picture(ONE_CAT, "off")}
    assert not own.exists()
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
