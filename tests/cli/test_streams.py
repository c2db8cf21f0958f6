"""Standard streams that are closed, full, or read by nobody: the work is done, and its exit code is right.

In real processes, since it is the process's own descriptors that are broken.
"""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys

import pytest
from PIL import Image

from firefly_sample.commands.terminal import failure_of, safe_streams
from tests.cli.command import ROOT, environment

FIREFLY = f"{shlex.quote(sys.executable)} -m firefly_sample.cli"
CAPTURE = f"{FIREFLY} capture nothing:plugin --size 8x6 --frames 0:3 -o out"
NOTHING = """
from firefly_sample import Scene

class Nothing:
    name, summary, parameters = "nothing", "A background.", ()
    build = lambda self: Scene()

plugin = Nothing()
"""
FULL = "firefly: cannot write to stdout: No space left on device"
CLOSED = "firefly: cannot write to stdout: it is closed"


@pytest.fixture(scope="module")
def modules(tmp_path_factory):
    """A folder with a scene plugin that imports no more than it must."""
    folder = tmp_path_factory.mktemp("modules")
    (folder / "nothing.py").write_text(NOTHING)
    return f"{folder}{os.pathsep}{ROOT}"


def shell(script, cwd, **variables):
    """A POSIX shell's exit code, stdout, and lines of stderr; warnings aside."""
    done = subprocess.run(
        ["sh", "-c", script],
        cwd=cwd,
        env=environment(**variables),
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    lines = done.stderr.splitlines()
    return done.returncode, done.stdout, [line for line in lines if not line.startswith("firefly: warning: ")]


def check_capture(folder):
    """Three whole pictures and their manifest, and nothing in them that was meant for a stream."""
    manifest = json.loads((folder / "manifest.json").read_text())
    assert [frame["index"] for frame in manifest["frames"]] == [0, 1, 2]
    assert len(list(folder.iterdir())) == 4
    for path in folder.glob("*.png"):
        with Image.open(path) as image:
            image.load()
            assert image.size == (8, 6)


def test_a_capture_without_any_stream_and_without_a_working_folder(tmp_path, modules):
    """As daemons may start it; Mesa writes a line to stderr, which must not end up in a picture."""
    (tmp_path / "gone").mkdir()
    script = f"rmdir ../gone; {CAPTURE[:-3]} {tmp_path}/out <&- >&- 2>&-; echo $? >{tmp_path}/code"
    shell(script, tmp_path / "gone", PYTHONPATH=modules, XDG_CACHE_HOME="/dev/null")
    assert (tmp_path / "code").read_text() == "0\n"
    check_capture(tmp_path / "out")


def test_a_capture_whose_log_is_on_a_full_disk(tmp_path, modules):
    script = f"{CAPTURE} 2>/dev/full"
    assert shell(script, tmp_path, PYTHONPATH=modules) == (0, "3 frames (color) in out\n", [])
    check_capture(tmp_path / "out")


def test_a_name_that_no_encoding_has_and_no_stream_to_say_it(tmp_path, modules):
    """A warning names the folder, and stderr, which is closed, must take it all the same."""
    folder = os.path.join(os.fsencode(tmp_path), b"\xff")
    os.mkdir(folder)
    with open(os.path.join(folder, b"pyproject.toml"), "w") as file:
        file.write("[tool\n")
    assert shell(f"{CAPTURE} 2>&-", folder, PYTHONPATH=modules) == (0, "3 frames (color) in out\n", [])
    os.rename(os.path.join(folder, b"out"), tmp_path / "out")
    check_capture(tmp_path / "out")


def test_a_capture_whose_log_nobody_reads(tmp_path, modules):
    """Its warnings meet a broken pipe before the first frame."""
    script = f"({CAPTURE}; echo $? >code) 2>&1 >summary | true"
    assert shell(script, tmp_path, PYTHONPATH=modules) == (0, "", [])
    assert (tmp_path / "code").read_text() == "0\n"
    assert (tmp_path / "summary").read_text() == "3 frames (color) in out\n"
    check_capture(tmp_path / "out")


def test_a_manifest_that_cannot_be_printed_is_an_error_that_says_what_is_written(tmp_path, modules):
    line = f"{FULL}; written all the same: 3 frames (color) in out"
    assert shell(f"{CAPTURE} --json >/dev/full", tmp_path, PYTHONPATH=modules) == (1, "", [line])
    check_capture(tmp_path / "out")


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        ("scenes >/dev/full", (1, "", [FULL])),
        ("scenes >&-", (1, "", [CLOSED])),
        ("--help >/dev/full", (1, "", [FULL])),
        ("nonsense 2>/dev/full", (2, "", [])),
    ],
)
def test_a_result_that_cannot_be_printed_is_an_error(tmp_path, command, expected):
    assert shell(f"{FIREFLY} {command}", tmp_path) == expected


def test_a_reader_that_has_seen_enough_is_no_error(tmp_path):
    script = f"({FIREFLY} scenes; echo $? >&2) | head -n 1"
    code, out, lines = shell(script, tmp_path, PYTHONUNBUFFERED="1")
    assert (code, out.count("\n"), lines) == (0, 1, ["0"])


@pytest.fixture
def own_stdout(monkeypatch):
    """`sys.stdout` on a descriptor, as in a process of its own; gives a function that sets it."""
    opened = []

    def put(descriptor, encoding="utf-8"):
        stream = os.fdopen(descriptor, "w", encoding=encoding)
        opened.append(stream)
        monkeypatch.setattr(sys, "stdout", stream)
        monkeypatch.setattr(sys, "__stdout__", stream)
        return stream

    yield put
    for stream in opened:
        stream.close()


def test_after_its_first_failure_a_stream_is_silent(own_stdout):
    reading, writing = os.pipe()
    before = own_stdout(writing)
    with safe_streams():
        print("seen", flush=True)
        assert failure_of(sys.stdout) is None
        assert os.read(reading, 99) == b"seen\n"
        os.close(reading)
        for _ in range(3):
            print("x" * 100_000, flush=True)
            sys.stdout.buffer.write(b"bytes")
        assert isinstance(failure_of(sys.stdout), BrokenPipeError)
    assert sys.stdout is before
    before.write("")
    before.flush()


def test_a_pipe_that_does_not_wait_gets_everything(own_stdout):
    """Whoever started the process may have set the pipe so; it holds 64 KiB at once."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    own_stdout(writing)
    text = "".join(f"line {number}\n" for number in range(30_000))
    reader = subprocess.Popen(["wc", "-c"], stdin=reading, stdout=subprocess.PIPE)
    os.close(reading)
    with safe_streams():
        print(text, end="", flush=True)
        assert failure_of(sys.stdout) is None
    os.set_blocking(writing, True)
    sys.stdout.close()
    assert int(reader.communicate(timeout=600)[0]) == len(text)


def test_a_name_that_the_encoding_lacks_is_escaped(own_stdout):
    reading, writing = os.pipe()
    own_stdout(writing, encoding="ascii")
    with safe_streams():
        print("glüh \udcff")
    assert os.read(reading, 99) == b"gl\\xfch \\udcff\n"
    os.close(reading)


def test_a_stream_of_the_callers_own_is_left_alone(capsys):
    with safe_streams():
        print("hello")
        assert failure_of(sys.stdout) is None
    assert capsys.readouterr().out == "hello\n"
