"""Options from a scene, the settings, the environment and TOML; help; start-up."""

from __future__ import annotations

import json
import resource
import statistics
import subprocess
import sys

import pytest

import firefly_sample
from firefly_sample.cli import main
from firefly_sample.settings import SETTINGS, Settings
from tests.cli.command import GLADE, environment, firefly, manifest_of


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def help_of(capsys, *arguments, flag="--help"):
    assert main([*arguments, flag]) == 0
    return " ".join(capsys.readouterr().out.replace("│", " ").split())


def width(capsys, *arguments):
    """The width of a captured picture."""
    import numpy as np

    manifest = manifest_of(capsys, *arguments, "--outputs", "depth", "--overwrite")
    with np.load(f"out/{manifest['frames'][0]['files']['depth']}") as arrays:
        return arrays["depth"].shape[1]


def test_help_shows_a_scenes_parameters_with_range_unit_and_default(capsys):
    text = help_of(capsys, "capture", GLADE)
    assert "--fireflies INT How many lights (between 0 and 20000). [default: 40]" in text
    assert "--reach FLOAT How far a light reaches (between 0 and 100 units). [default: 2.5]" in text
    assert "--dusk --no-dusk Ambient light. [default: True]" in text
    assert "--no-glass" not in text


def test_help_of_the_window_describes_the_performance_test(capsys):
    text = help_of(capsys, "run", GLADE)
    assert "--performance-test SECONDS Turn the camera around the scene for this long" in text
    assert "--headless Run the performance test without a window or a display." in text
    assert "--json Print the results of performance tests as JSON." in text


def test_each_scene_has_its_own_options(capsys):
    assert "--model" in help_of(capsys, "plan", "tests.cli.glade:statue")
    assert "--model" not in help_of(capsys, "plan", GLADE)


def test_a_parameter_gives_way_to_an_option_of_the_same_name(here, capsys):
    crowded = "tests.cli.glade:crowded"
    assert "--scene-size FLOAT How big. [default: 1.0]" in help_of(capsys, "capture", crowded)
    options = ("--size", "8x6", "--scene-size", 2, "--scene-look", "--look", "classic")
    manifest = manifest_of(capsys, crowded, *options)
    assert manifest["parameters"] == {"size": 2.0, "look": True}
    assert manifest["settings"]["look"] == "classic"


def test_every_setting_is_an_option_with_its_help_and_values(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "300")
    text = help_of(capsys, "capture", GLADE, flag="--help-all")
    for name, setting in SETTINGS.items():
        assert f"--{name.replace('_', '-')} " in text
        assert setting.help.rstrip(".") in text
    assert "[choices: rgba32f, rgba16f, r11g11b10f, rgba8] [default: rgba32f]" in text
    assert "Slices of a cloud of particles along its light (8 to 256). [default: 64]" in text
    assert "[default: each light's own]" in text


@pytest.mark.parametrize("command", ["capture", "run", "plan"])
def test_help_fits_a_screen_and_leaves_settings_to_help_all(capsys, monkeypatch, command):
    monkeypatch.setenv("COLUMNS", "80")
    assert main([command, "--help"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) <= 45
    text = "\n".join(lines)
    for option in ("--size", "--preset", "--fireflies", "--mist"):
        assert option in text
    for option in ("--position-method", "--tone", "--require-gpu", "--max-error"):
        assert option not in text
    assert lines[-1] == f"firefly {command} SCENE --help-all shows all options, also those of settings."
    assert main([command, "--help-all"]) == 0
    assert "--position-method" in capsys.readouterr().out


def test_settings_reach_the_renderer(here, capsys):
    options = (
        "--tone",
        "none",
        "--position-method",
        "depth24",
        "--no-volume-depth-test",
        "--light-method",
        "loop",
    )
    manifest = manifest_of(capsys, GLADE, "--size", "8x6", *options)
    expected = Settings(
        tone="none", position_method="depth24", volume_depth_test=False, light_method="loop", supersample=2
    )
    assert manifest["settings"] == expected.as_dict()


def test_a_scene_may_come_after_options(here, capsys):
    manifest = manifest_of(capsys, "--size", "8x6", "--frames", "3", GLADE)
    assert (manifest["scene"], manifest["frames"][0]["index"]) == (GLADE, 3)


def test_command_line_wins_over_environment_over_toml(here, capsys, monkeypatch):
    (here / "firefly.toml").write_text('[firefly.capture]\nsize = "10x6"\noutput = "out"\nseed = 5\n')
    assert width(capsys, GLADE) == 10
    monkeypatch.setenv("FIREFLY_CAPTURE_SIZE", "20x6")
    assert width(capsys, GLADE) == 20
    assert width(capsys, GLADE, "--size", "30x6") == 30
    assert json.loads((here / "out" / "manifest.json").read_text())["seed"] == 5


def test_a_list_of_outputs_in_pyproject(here, capsys):
    table = '[tool.firefly.capture]\nsize = "10x6"\noutputs = ["color", "depth"]\ndusk = false\n'
    (here / "pyproject.toml").write_text(table)
    manifest = manifest_of(capsys, GLADE)
    assert manifest["frames"][0]["files"].keys() == {"color", "depth"}
    assert manifest["parameters"]["dusk"] is False


def test_the_scene_may_come_from_the_configuration(here, capsys):
    table = f'[firefly.capture]\nscene = "{GLADE}"\nsize = "8x6"\nreach = 1.5\n'
    (here / "firefly.toml").write_text(table)
    manifest = manifest_of(capsys, "--no-dusk")
    assert (manifest["scene"], manifest["parameters"]["reach"]) == (GLADE, 1.5)


def test_scenes_lists_the_forest_and_its_parameters(capsys):
    assert main(["scenes", "--json"]) == 0
    listed = {scene["name"]: scene for scene in json.loads(capsys.readouterr().out)}
    count = next(p for p in listed["forest"]["parameters"] if p["name"] == "fireflies")
    assert (count["type"], count["default"]) == ("int", 500)
    assert main(["scenes"]) == 0
    text = capsys.readouterr().out
    assert f"forest: {listed['forest']['summary']}\n" in text
    assert "  --fireflies" in text


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == firefly_sample.__version__


def test_help_takes_little_longer_than_the_libraries_that_print_it(tmp_path):
    """In processor time and as a ratio, measured in turns: the machine may be slow or busy."""

    def processor_seconds(run):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        run()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    def print_help():
        assert "capture" in firefly("--help", cwd=tmp_path).stdout

    def import_libraries():
        subprocess.run([sys.executable, "-c", "import cyclopts, rich.console, rich.table"], check=True)

    ratios = [processor_seconds(print_help) / processor_seconds(import_libraries) for _ in range(5)]
    assert statistics.median(ratios) < 2.0, ratios


def test_help_loads_neither_numpy_nor_gl(tmp_path):
    code = (
        "import sys; from firefly_sample.cli import main; main(['--help'])\n"
        "sys.exit(' '.join({'numpy', 'moderngl', 'glcontext', 'trimesh', 'PIL'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stderr == "\n"
