"""``--exposure auto``: measured once per run, stated, and a scene's own default as are other settings."""

from __future__ import annotations

import json

import pytest

from firefly_sample.capture.sequence import capture_frames, capture_settings
from firefly_sample.cli import main
from firefly_sample.errors import SceneError
from firefly_sample.pipeline import build_plan
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.scenes.plugin import Plugin, scene_settings
from firefly_sample.settings import Settings
from tests.cli.command import GLADE, manifest_of

METERED = "tests.cli.glade:metered"
SMALL = ("--size", "12x9")


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def planned(time, scene=GLADE, **parameters):
    built = build_scene(find_scene(scene), **parameters)
    return build_plan(built, Settings(exposure="auto"), (12, 9), time=time).settings.exposure


def told(capsys, *arguments):
    assert main([*map(str, arguments), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


# --- One number for a run ---


def test_all_frames_have_the_exposure_of_frame_0_and_the_manifest_states_it(here, capsys):
    """The lights circle, so that each frame would have its own."""
    options = (GLADE, *SMALL, "--fireflies", 5, "--no-dusk", "--time", 2, "--fps", 1)
    manifest = manifest_of(capsys, *options, "--frames", "0:3", "--exposure", "auto")
    values = [planned(time, fireflies=5, dusk=False) for time in (2.0, 3.0, 4.0)]
    assert len(set(values)) == 3
    assert manifest["exposure"] == values[0]
    assert manifest["settings"]["exposure"] == "auto"
    repeated = manifest_of(capsys, *options, "--frames", "0:3", "--exposure", values[0], "-o", "number")
    assert [frame["sha256"] for frame in repeated["frames"]] == [
        frame["sha256"] for frame in manifest["frames"]
    ]
    third = manifest_of(capsys, *options, "--frames", "2", "--exposure", "auto", "-o", "third")
    assert third["exposure"] == values[0]
    assert third["frames"][0]["sha256"] == manifest["frames"][2]["sha256"]


def test_a_number_is_stated_as_well(here, capsys):
    assert manifest_of(capsys, GLADE, *SMALL, "--exposure", "2.5")["exposure"] == 2.5
    assert manifest_of(capsys, GLADE, *SMALL, "-o", "default")["exposure"] == 1.0


def test_the_plan_prints_it(capsys):
    expected = planned(3.0)
    options = ("plan", GLADE, "--time", "3", "--exposure", "auto")
    assert told(capsys, *options)["exposure"] == expected
    assert main([*options]) == 0
    assert f"; exposure {expected:g}\n" in capsys.readouterr().out
    assert main(["plan", GLADE, "--look", "classic"]) == 0
    assert "exposure" not in capsys.readouterr().out


def test_a_performance_test_measures_at_its_start(capsys):
    options = ("--headless", "--performance-test", "0.2", "--time", "4", *SMALL)
    result = told(capsys, "run", GLADE, *options, "--exposure", "auto")
    assert result["settings"]["exposure"] == planned(4.0)


def test_it_may_come_from_the_environment_or_toml(here, capsys, monkeypatch):
    (here / "firefly.toml").write_text('[firefly.plan]\nexposure = "auto"\n')
    assert told(capsys, "plan", GLADE)["exposure"] == planned(5.0)
    monkeypatch.setenv("FIREFLY_PLAN_EXPOSURE", "3")
    assert told(capsys, "plan", GLADE)["exposure"] == 3.0
    assert told(capsys, "plan", GLADE, "--exposure", "auto")["exposure"] == planned(5.0)
    monkeypatch.delenv("FIREFLY_PLAN_EXPOSURE")
    (here / "firefly.toml").write_text("[firefly.plan]\nexposure = 4\n")
    assert told(capsys, "plan", GLADE)["exposure"] == 4.0
    (here / "firefly.toml").write_text('[firefly.plan]\nexposure = "car"\n')
    assert main(["plan", GLADE]) == 2
    error = capsys.readouterr().err
    assert f"'exposure' in [firefly.plan] of {here / 'firefly.toml'}: it must be a number above 0" in error
    assert error.count("\n") == 1


# --- A scene's own settings ---


def test_a_scene_brings_settings_that_explicit_ones_override(here, capsys):
    manifest = manifest_of(capsys, METERED, *SMALL)
    own = capture_settings(("color",), exposure="auto", normal_format="oct8", supersample=1)
    assert manifest["settings"] == own.as_dict()
    assert manifest["exposure"] == planned(5.0)
    again = METERED, *SMALL, "--overwrite"
    given = manifest_of(capsys, *again, "--exposure", 2, "--supersample", 2)
    assert given["settings"] == own.with_changes(exposure=2.0, supersample=2).as_dict()
    preset = manifest_of(capsys, *again, "--preset", "accurate")["settings"]
    assert (preset["normal_format"], preset["exposure"]) == ("rgba32f", "auto")
    (here / "firefly.toml").write_text("[firefly.capture]\nexposure = 3\n")
    assert manifest_of(capsys, *again)["exposure"] == 3.0


def test_every_command_uses_them(here, capsys):
    assert told(capsys, "plan", METERED)["exposure"] == planned(5.0)
    options = ("--headless", "--performance-test", "0.1", *SMALL)
    settings = told(capsys, "run", METERED, *options)["settings"]
    assert (settings["normal_format"], settings["exposure"]) == ("oct8", planned(0.0))
    options = ("--counts", 2, "--rounds", 1, *SMALL)
    assert told(capsys, "measure", "speed", METERED, *options)["rows"]


def test_functions_start_from_them_unless_settings_are_given(here):
    options = {"size": (8, 6), "parameters": {"fireflies": 2}}
    assert capture_frames(METERED, here, **options)["settings"]["normal_format"] == "oct8"
    manifest = capture_frames(METERED, here, settings=Settings(), overwrite=True, **options)
    assert manifest["settings"] == Settings().as_dict()


def test_they_give_way_to_what_contradicts_them(capsys):
    assert main(["plan", METERED, "--look", "classic"]) == 0
    assert scene_settings(find_scene(METERED), {"look": "classic"}) == {"look": "classic", "supersample": 1}


def test_the_help_shows_them_as_defaults(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "300")
    for flag in ("--help", "--help-all"):
        assert main(["capture", METERED, flag]) == 0
        text = capsys.readouterr().out
        assert "--exposure FLOAT|auto" in text
        assert "[default: auto]" in text
        assert ("--position-method" in text) == (flag == "--help-all")
    assert main(["capture", GLADE, "--help-all"]) == 0
    text = capsys.readouterr().out
    assert "[default: auto]" in next(line for line in text.splitlines() if "--light-method" in line)
    assert "[default: 1.0]" in text


WRONG = {
    "a name": ({"expsure": 2.0}, "there is no setting 'expsure' (did you mean 'exposure'?)"),
    "a value": ({"exposure": "dark"}, "setting 'exposure' must be a number above 0, at most 1e+30, or auto"),
    "a contradiction": ({"exposure": 2.0, "look": "classic"}, "must be 1.0 with look=classic"),
    "a key": ({3: 4}, "keywords must be strings"),
    "a list": (["exposure"], "must be a dict, got ['exposure']"),
}


@pytest.mark.parametrize(("settings", "reason"), WRONG.values(), ids=WRONG)
def test_a_mistake_in_them_names_the_scene(settings, reason):
    plugin = Plugin("murky", "Dim.", (), build=lambda: None, settings=settings)
    with pytest.raises(SceneError) as caught:
        scene_settings(plugin)
    assert str(caught.value).startswith("scene 'murky': ")
    assert "'settings'" in str(caught.value)
    assert reason in str(caught.value)


def test_a_mistake_in_them_is_one_line(capsys, monkeypatch):
    monkeypatch.setattr(find_scene(METERED), "settings", {"expsure": 2.0}, raising=False)
    for command in ("plan", "capture", "run"):
        assert main([command, METERED]) == 1
        out, err = capsys.readouterr()
        assert (out, err.count("\n")) == ("", 1)
        assert err.startswith("firefly: scene 'metered': in its attribute 'settings', there is no setting")
