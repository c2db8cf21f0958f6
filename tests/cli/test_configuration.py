"""firefly.toml, pyproject.toml and the environment where they are broken: by name, and in one line."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from firefly_sample.capture.sequence import capture_frames
from firefly_sample.cli import main
from firefly_sample.errors import OutputError
from firefly_sample.lab.speed import measure_speed
from firefly_sample.lab.trade import measure_trade
from tests.cli.command import GLADE, run_python
from tests.cli.permissions import obeyed_permissions


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


BROKEN = {
    "no TOML": (lambda path: path.write_text("[tool\n"), "it is not TOML"),
    "no text": (lambda path: path.write_bytes(b"\xff\xfe"), "it is not TOML"),
    "too deep": (lambda path: path.write_text("a = " + "[" * 100_000), "it is not TOML"),
    "a folder": (Path.mkdir, "it is not a file"),
    "a pipe": (os.mkfifo, "it is not a file"),
    "a loop": (lambda path: path.symlink_to(path.name), "Too many levels of symbolic links"),
    "a dead link": (lambda path: path.symlink_to("nowhere"), "a link to a file that does not exist"),
    "endless": (lambda path: path.symlink_to("/dev/zero"), "more than 1048576 bytes"),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_a_broken_firefly_toml_is_an_error_that_names_it(here, capsys, fault):
    make, reason = BROKEN[fault]
    make(here / "firefly.toml")
    assert main(["scenes"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"firefly: {here / 'firefly.toml'} cannot be read: ")
    assert reason in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("fault", BROKEN)
def test_somebody_elses_broken_pyproject_toml_is_a_warning_that_names_it(here, capsys, fault):
    make, reason = BROKEN[fault]
    make(here / "pyproject.toml")
    assert main(["scenes"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("forest: ")
    assert err.startswith(f"firefly: warning: {here / 'pyproject.toml'} cannot be read: ")
    assert reason in err
    assert err.endswith("; it is ignored\n")
    assert err.count("\n") == 1


def test_a_broken_pyproject_toml_that_speaks_of_firefly_is_an_error(here, capsys):
    (here / "pyproject.toml").write_text("[tool.firefly.capture\n")
    assert main(["scenes"]) == 2
    assert f"firefly: {here / 'pyproject.toml'} cannot be read: it is not TOML" in capsys.readouterr().err


@pytest.mark.parametrize("content", ["", "tool = 3", "[tool.other]\nfirefly = 3", None])
def test_what_is_nothing_to_us_is_left_alone(here, capsys, content):
    if content is None:
        (here / "firefly.toml").symlink_to("/dev/null")
    else:
        (here / "pyproject.toml").write_text(content)
    assert main(["scenes"]) == 0
    assert capsys.readouterr().err == ""


KEYS = [
    ("[firefly.capture]\nfirefly = 3", "Unknown option: 'firefly' in [firefly.capture] of {}"),
    ("[firefly.capture]\nfirefly = 3", "(did you mean 'fireflies'?)"),
    ("[firefly.capture]\nsize = 'x'", "Invalid value for 'size' in [firefly.capture] of {}: a size is WIDTH"),
    ("[firefly.capture]\nsize.x = 3", "'size"),
    ("[firefly.capture]\noutput = ''", "'output' in [firefly.capture] of {}: it must name a folder"),
    ('[firefly.capture]\noutput = "a\\u0000b"', "it must name a folder"),
    ("[capture]\nsize = '8x6'", "{}: capture belongs to no command"),
    ("size = '8x6'", "{}: size belongs to no command"),
    ("[firefly]\nsize = '8x6'", "{}: firefly.size belongs to no command"),
    ("[firefly.captur]\nsize = '8x6'", "{}: firefly.captur belongs to no command"),
    ("[firefly.measure]\nrounds = 3", "{}: firefly.measure.rounds belongs to no command"),
    ("firefly = 3", "{}: firefly must be a table, [firefly], got 3"),
    ("[firefly]\ncapture = 3", "{}: firefly.capture must be a table, [firefly.capture], got 3"),
]


@pytest.mark.parametrize(("content", "message"), KEYS)
def test_a_wrong_key_is_called_by_its_table_and_file(here, capsys, content, message):
    (here / "firefly.toml").write_text(content)
    assert main(["capture", GLADE]) == 2
    err = capsys.readouterr().err
    assert message.format(here / "firefly.toml") in err
    assert err.count("\n") == 1
    assert [path.name for path in here.iterdir()] == ["firefly.toml"]


def test_a_variable_that_names_no_option_is_named(here, capsys, monkeypatch):
    monkeypatch.setenv("FIREFLY_PLAN_SISE", "8x6")
    monkeypatch.setenv("FIREFLY_PLAN_SIZE", "10x6")
    monkeypatch.setenv("FIREFLY_CAPTURE_NOTHING", "1")  # of another command
    assert main(["plan", GLADE]) == 0
    out, err = capsys.readouterr()
    assert err == (
        "firefly: warning: FIREFLY_PLAN_SISE names no option of firefly plan with this scene "
        "(did you mean 'FIREFLY_PLAN_SIZE'?)\n"
    )
    assert " at 10x6" in out


@pytest.mark.parametrize("name", ["", " ", "picture.png", "data.npz", "speed.JSON"])
def test_what_names_no_folder_is_no_output(here, capsys, name):
    measure = ["measure", "speed", GLADE], ["measure", "trade", GLADE]
    for command in measure if name.endswith((".png", ".npz")) else (["capture", GLADE], *measure):
        assert main([*command, "-o", name]) == 2
        err = capsys.readouterr().err
        assert "Invalid value for -o: it must name a folder" in err
        assert repr(name) in err
        assert err.count("\n") == 1
    assert list(here.iterdir()) == []


def test_no_function_takes_empty_text_for_the_working_folder(here):
    for function in (capture_frames, measure_speed, measure_trade):
        with pytest.raises(OutputError, match="must have a name, got ''"):
            function(GLADE, "")
    assert list(here.iterdir()) == []


def test_a_folder_where_a_file_is_to_be_is_refused_by_name(here, capsys):
    (here / "old.png").mkdir()
    assert main(["capture", GLADE, "--size", "4x3", "--fireflies", "1", "-q", "-o", "old.png"]) == 1
    assert (
        "old.png is a folder, and a capture whose name ends in .png becomes one file"
        in capsys.readouterr().err
    )
    assert list((here / "old.png").iterdir()) == []


def test_a_working_folder_that_is_gone(tmp_path):
    """The interpreter starts in it, and the folder goes."""
    gone = tmp_path / "gone"
    gone.mkdir()
    script = (
        "import os, sys; os.rmdir(os.getcwd()); sys.path[0] = ''; from firefly_sample.cli import main\n"
        "print(main(['scenes']), main(['capture', 'spheres', '--size', '4x3', '-o', 'here']))"
    )
    done = run_python("-c", script, cwd=gone)
    assert done.stdout.endswith("\n0 1\n")
    assert done.stderr == (
        "firefly: cannot write into folder here (No such file or directory): choose another one\n"
    )


def test_a_link_into_a_folder_that_may_not_be_searched_is_a_file_that_cannot_be_read(here, capsys):
    """It is the user's own file, so it is an error, and pyproject.toml is not to blame."""
    shut = here / "shut"
    shut.mkdir()
    (here / "firefly.toml").symlink_to(shut / "firefly.toml")
    shut.chmod(0)
    try:
        with obeyed_permissions():
            assert main(["plan", GLADE]) == 2
    finally:
        shut.chmod(0o755)
    err = capsys.readouterr().err
    assert err.startswith(f"firefly: {here / 'firefly.toml'} cannot be read: Permission denied")
    assert err.count("\n") == 1


def test_a_terminal_of_no_width(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "0")
    assert main(["--help"]) == 0
    assert "capture" in capsys.readouterr().out
