"""Bad input: one clear line on stderr, the right exit code, nothing left on disk."""

from __future__ import annotations

import os
import resource
import shutil

import pytest

from firefly_sample.assets import asset_dir
from firefly_sample.cli import main
from tests.cli.command import GLADE, ROOT, broken_gl, environment, firefly
from tests.cli.permissions import obeyed_permissions

STATUE = "tests.cli.glade:statue"

USAGE = [
    ([], "", 0),
    (["captur"], 'Did you mean "capture"?', 2),
    (["measure", "sped"], 'Did you mean "speed"?', 2),
    (["capture", "--firefly", "3"], "Unknown option: --firefly (did you mean '--fireflies'?)", 2),
    (["capture", "--size", "0x3"], "width and height must be 1 or more", 2),
    (["capture", "--size", "800"], "WIDTHxHEIGHT", 2),
    (["capture", "--size", "-8x6"], "WIDTHxHEIGHT", 2),
    (["capture", "--size"], "--size requires an argument", 2),
    (["capture", "--fireflies", "2.5"], "--fireflies: it must be a whole number, got '2.5'", 2),
    (["capture", "--fireflies", "9" * 400], "must be less than 2**64", 2),
    (["plan", "--size", "9" * 400 + "x2"], "WIDTHxHEIGHT", 2),
    (["capture", "--device", "x"], "--device: it must be a whole number", 2),
    (["capture", "--look", "clasic"], 'Did you mean "classic"?', 2),
    (
        ["capture", "--exposure", "bright"],
        "--exposure: it must be a number above 0, at most 1e+30, or auto",
        2,
    ),
    (["plan", "--exposure", "Auto"], "or auto, got 'Auto'", 2),
    (["measure", "trade", "--exposure", ""], "or auto, got ''", 2),
    (["capture", GLADE, "leftover"], "leftover", 2),
    (["plan", GLADE, "--json", "--dot"], "--json, --dot", 2),
    (["run", GLADE, "--performance-test", "long", "--headless"], "--performance-test", 2),
    (["run", GLADE, "--performance-test"], "--performance-test requires an argument", 2),
    (["doctor", "forest"], "forest", 2),
]
INPUT = [
    (["capture", "florest"], "did you mean 'forest'?"),
    (["capture", "no.such.module:scene"], "no.such.module"),
    (["capture", "tests.cli.glade:swamp"], "'swamp'"),
    (["capture", "tests.cli.glade:doubled"], "parameter 'scene_size' needs another name"),
    (["capture", GLADE, "--fireflies", "-1"], "fireflies must be between 0 and 20000, got -1"),
    (["capture", GLADE, "--fireflies", "1000000000"], "between 0 and 20000"),
    (["capture", GLADE, "--reach", "nan"], "reach must be finite"),
    (["capture", GLADE, "--outputs", "color,colour"], "there is no output 'colour'"),
    (["capture", GLADE, "--outputs", ","], "no outputs"),
    (["capture", GLADE, "--outputs", "depth", "--supersample", "2"], "set supersample to 1"),
    (["capture", GLADE, "--supersample", "3"], "must be one of 1, 2"),
    *(
        (
            ["capture", GLADE, "--exposure", number],
            "'exposure' must be a number above 0, at most 1e+30, or auto",
        )
        for number in ("-1", "0", "nan", "inf", "1e31")
    ),
    (["capture", GLADE, "--look", "classic", "--exposure", "auto"], "change 'exposure' or 'look'"),
    (["capture", GLADE, "--look", "classic", "--exposure", "2"], "classic"),
    (["capture", GLADE, "--frames", "3:3"], "holds no frame"),
    (["capture", GLADE, "--frames", "-1:3"], "none negative"),
    (["capture", GLADE, "--frames", "0:1000000000000"], "between 0 and 999999"),
    (["capture", GLADE, "--fps", "0"], "fps must be a finite number above 0"),
    (["capture", GLADE, "--time", "inf"], "time must be a finite number"),
    (["capture", GLADE, "--size", "1000000x8"], "above this driver's limit"),
    (["capture", GLADE, "--device", "77"], "no EGL device 77"),
    (["capture", GLADE, "--device", "-1"], "-1"),
    (["capture", GLADE, "--device", "10000000000000000000"], "no OpenGL context"),
    (["capture", GLADE, "--size", "999999999x1"], "above any driver's limit"),
    (["capture", STATUE, "--model", "missing.glb"], "missing.glb"),
    (["plan", GLADE, "--time", "nan"], "time must be a finite number"),
    (["run", GLADE, "--headless"], "add --performance-test SECONDS"),
    *(
        (
            ["run", GLADE, *window, "--performance-test", seconds],
            "finite number of seconds above 0, at most 3600",
        )
        for window in ((), ("--headless",))
        for seconds in ("0", "-1", "nan", "inf", "3601")
    ),
    (
        ["run", GLADE, "--headless", "--performance-test", "1", "--time", "inf"],
        "time must be a finite number",
    ),
    (["run", GLADE, "--headless", "--performance-test", "1", "--fireflies", "-1"], "between 0 and 20000"),
    (["run", GLADE, "--headless", "--performance-test", "1", "--size", "1000000x8"], "driver's limit"),
]


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def only_line(text: str) -> str:
    """The one line of an error, warnings aside."""
    lines = [line for line in text.splitlines() if not line.startswith("firefly: warning: ")]
    assert len(lines) == 1, text
    assert lines[0].startswith("firefly: ")
    return lines[0]


@pytest.mark.parametrize(("arguments", "message", "code"), USAGE)
def test_a_command_line_that_cannot_be_understood(here, capsys, arguments, message, code):
    assert main(arguments) == code
    out, err = capsys.readouterr()
    if code:
        assert message in only_line(err)
        assert out == ""
    assert list(here.iterdir()) == []


@pytest.mark.parametrize(("arguments", "message"), INPUT)
def test_bad_input(here, capsys, arguments, message):
    assert main(arguments) == 1
    out, err = capsys.readouterr()
    assert message in only_line(err)
    assert out == ""
    assert list(here.iterdir()) == []


def test_a_required_gpu(here, capsys, device):
    code = main(["capture", GLADE, "--size", "4x3", "--require-gpu"])
    assert code == int(device.software)
    assert ("a GPU is required" in capsys.readouterr().err) == device.software


def test_a_damaged_model(here, capsys):
    (here / "half.glb").write_bytes(b"glTF\x02\x00\x00\x00\xff\xff\x00\x00")
    assert main(["capture", STATUE, "--model", "half.glb"]) == 1
    assert "half.glb" in only_line(capsys.readouterr().err)
    assert [path.name for path in here.iterdir()] == ["half.glb"]


@pytest.mark.parametrize("folder", ["file", "file/below", "/dev/null/frames"])
def test_a_folder_that_cannot_be_written(here, capsys, folder):
    (here / "file").touch()
    assert main(["capture", GLADE, "--size", "4x3", "-o", folder]) == 1
    assert f"cannot write into folder {folder}" in only_line(capsys.readouterr().err)
    assert [path.name for path in here.iterdir()] == ["file"]


def test_a_folder_without_write_permission(here, capsys):
    folder = here / "shut"
    folder.mkdir(0o555)
    with obeyed_permissions():
        assert main(["capture", GLADE, "--size", "4x3", "-o", str(folder / "new")]) == 1
    assert "Permission denied" in only_line(capsys.readouterr().err)
    assert list(folder.iterdir()) == []


def test_a_working_folder_that_may_not_be_read(here, capsys):
    arguments = ["plan", GLADE, "--json"]
    assert main(arguments) == 0  # whatever is imported late is there now, wherever the checkout lies
    expected = capsys.readouterr().out
    here.chmod(0)
    try:
        with obeyed_permissions():
            assert main(arguments) == 0
    finally:
        here.chmod(0o755)
    out, err = capsys.readouterr()
    assert out == expected
    assert err == (
        "firefly: warning: no configuration is read: "
        "the working folder cannot be searched (Permission denied)\n"
    )


def test_a_full_disk_leaves_no_broken_file(here):
    done = firefly(
        *("capture", GLADE, "--size", "64x48", "-o", "out"),
        cwd=here,
        env=environment(
            PYTHONDONTWRITEBYTECODE="1"
        ),  # Python keeps what it has cut off, and fails to load it later
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500)),
    )
    assert done.returncode == 1
    assert "cannot write out/color_000000.png" in only_line(done.stderr)
    assert list(here.iterdir()) == []


def test_no_gl_library(here, tmp_path_factory):
    env = broken_gl(tmp_path_factory.mktemp("lib") / "empty")
    done = firefly("capture", GLADE, "--size", "4x3", cwd=here, env=env)
    assert done.returncode == 1
    assert "apt-get install" in only_line(done.stderr)
    assert list(here.iterdir()) == []


def test_a_shader_that_does_not_compile(here, tmp_path_factory):
    """A checkout of its own, in which one shader has a fault in its last line."""
    checkout = tmp_path_factory.mktemp("checkout")
    ignore = shutil.ignore_patterns("__pycache__", "_assets")
    shutil.copytree(ROOT / "firefly_sample", checkout / "firefly_sample", ignore=ignore)
    shutil.copytree(asset_dir("shaders"), checkout / "shaders")
    shader = checkout / "shaders" / "resolve.frag"
    text = shader.read_text()
    shader.write_text(text + "vec3 fault() { return 1; }\n")
    env = environment()
    env["PYTHONPATH"] = os.pathsep.join((str(checkout), env["PYTHONPATH"]))
    done = firefly("capture", GLADE, "--size", "4x3", cwd=here, env=env)
    assert done.returncode == 1
    line = only_line(done.stderr)
    assert "resolve.frag" in line
    assert str(text.count("\n") + 1) in line
    assert list(here.iterdir()) == []


def test_options_of_another_scene_are_unknown(here, capsys):
    assert main(["capture", STATUE, "--fireflies", "3"]) == 2
    assert "Unknown option: --fireflies" in only_line(capsys.readouterr().err)


def test_an_unknown_key_of_the_configuration(here, capsys):
    (here / "firefly.toml").write_text('[firefly.capture]\nsise = "8x6"\n')
    assert main(["capture", GLADE]) == 2
    assert "sise" in only_line(capsys.readouterr().err)


def test_a_configuration_that_is_not_toml(here, capsys):
    (here / "firefly.toml").write_text("[firefly.capture\n")
    assert main(["capture", GLADE]) == 2
    assert only_line(capsys.readouterr().err)


def test_without_a_display_the_window_says_what_to_do(here):
    env = {k: v for k, v in environment().items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    done = firefly("run", GLADE, cwd=here, env=env)
    assert done.returncode == 1
    assert "firefly capture" in only_line(done.stderr)
