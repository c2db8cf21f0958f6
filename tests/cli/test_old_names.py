"""Names that were changed: whoever still uses an old one gets an error with the new one."""

from __future__ import annotations

import importlib

import pytest

import firefly_sample
from firefly_sample.cli import main
from firefly_sample.errors import RENAMED, OutputError, SettingsError
from firefly_sample.frame import OUTPUTS, check_outputs
from firefly_sample.settings import SETTINGS, Settings
from tests.cli.command import GLADE

OLD_SETTINGS = {old: new for old, news in RENAMED.items() for new in news if new in SETTINGS}


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def error_line(capsys, *arguments):
    assert main(list(arguments)) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    return err


def test_the_table_leads_from_names_that_are_gone_to_names_that_exist():
    assert len(OLD_SETTINGS) == 14
    assert not OLD_SETTINGS.keys() & SETTINGS.keys()
    assert set(RENAMED["volume_atlas"]) <= OUTPUTS.keys() - RENAMED.keys()


@pytest.mark.parametrize("old", OLD_SETTINGS)
def test_a_setting(old):
    message = rf"no setting '{old}' \(it is now called '{OLD_SETTINGS[old]}'\)"
    for make in (Settings, Settings().with_changes, lambda **given: Settings.preset("fast", **given)):
        with pytest.raises(SettingsError, match=message):
            make(**{old: "loop"})


@pytest.mark.parametrize("old", OLD_SETTINGS)
def test_an_option_a_key_and_a_variable_of_a_setting(here, capsys, monkeypatch, old):
    option, new = "--" + old.replace("_", "-"), "--" + OLD_SETTINGS[old].replace("_", "-")
    for given in ((option, "loop"), (f"{option}=loop",)):
        line = error_line(capsys, "plan", GLADE, *given)
        assert line.startswith(f"firefly: Unknown option: {option}")
        assert line.endswith(f" (it is now called {new!r})\n")

    (here / "firefly.toml").write_text(f"[firefly.plan]\n{old} = 'loop'\n")
    line = error_line(capsys, "plan", GLADE)
    assert f"{here / 'firefly.toml'} (it is now called {new[2:]!r})\n" in line
    (here / "firefly.toml").unlink()

    monkeypatch.setenv(f"FIREFLY_PLAN_{old.upper()}", "loop")
    now = f"FIREFLY_PLAN_{OLD_SETTINGS[old].upper()}"
    assert error_line(capsys, "plan", GLADE) == f"firefly: FIREFLY_PLAN_{old.upper()} is now called {now}\n"


def test_a_switch(capsys):
    line = error_line(capsys, "plan", GLADE, "--no-volume-interpolation")
    assert "(it is now called '--no-particle-shadow-interpolation')" in line


def test_an_option_of_a_scene(capsys):
    assert main(["plan", "spheres", "--lights", "3", "--json"]) == 0
    assert '"in_scene": 3,' in capsys.readouterr().out
    assert "(it is now called '--lights')" in error_line(capsys, "plan", "spheres", "--scene-lights", "3")


def test_an_output():
    with pytest.raises(OutputError, match=r"'volume_atlas' \(it is now called 'particle_shadow_atlas'\)"):
        check_outputs(["color", "volume_atlas"])


def test_a_class():
    with pytest.raises(ImportError, match="'VolumeShadow': it is now called 'ParticleShadow'"):
        from firefly_sample import VolumeShadow  # noqa: F401
    with pytest.raises(ImportError, match="'ParticleShadow'"):
        _ = firefly_sample.VolumeShadow
    assert not hasattr(firefly_sample, "VolumeLight")


@pytest.mark.parametrize("old", [name for name in RENAMED if "." in name])
def test_a_module(old):
    (new,) = RENAMED[old]
    assert importlib.util.find_spec(new) is not None
    for name in (old, f"{old}.anything"):
        with pytest.raises(ImportError, match=rf"^{old} is now called {new}$"):
            importlib.import_module(name)
