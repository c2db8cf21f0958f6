"""``firefly run --performance-test --headless``: no window, no display, one line."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys

import pytest

from firefly_sample.cli import main
from tests.cli.command import GLADE, environment, firefly, open_terminal

LINE = (
    r"performance test: (\d+) frames in ([\d.]+) s, ([\d.]+) frames/s at (\d+)x(\d+), "
    r"(\d+) lights in view of (\d+) \((.+)\)\n"
)
SMALL = ("--headless", "--size", "32x24")
TICKING = "tests.cli.glade:ticking"


def without_display():
    return {key: value for key, value in environment().items() if key not in ("DISPLAY", "WAYLAND_DISPLAY")}


def test_it_prints_one_line(capsys, device):
    assert main(["run", GLADE, "--performance-test", "0.5", *SMALL, "--fireflies", "9"]) == 0
    match = re.fullmatch(LINE, capsys.readouterr().out)
    assert match
    frames, seconds, rate, width, height, in_view, in_scene, driver = match.groups()
    assert (width, height, in_scene, driver) == ("32", "24", "9", device.renderer)
    assert int(in_view) <= 9
    assert int(frames) > 0
    assert float(seconds) >= 0.5
    assert float(rate) == pytest.approx(int(frames) / float(seconds), rel=0.2)


def test_settings_and_parameters_reach_the_frames(capsys):
    options = ("--performance-test", "0.2", "--light-method", "loop", "--fireflies", "0", "--json")
    options += ("--supersample", "2")
    assert main(["run", GLADE, *SMALL, *options]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["settings"]["supersample"], result["settings"]["light_method"]) == (2, "loop")
    assert result["lights"] == {"in_scene": 0, "in_view": 0, "dropped": 0}
    assert result["milliseconds"].keys() == {"geometry", "ambient", "resolve"}


def test_a_scene_without_anything(capsys):
    assert main(["run", "tests.cli.glade:empty", "--performance-test", "0.1", *SMALL]) == 0
    assert re.fullmatch(LINE, capsys.readouterr().out)


def test_it_needs_neither_a_display_nor_glfw(tmp_path):
    code = (
        "import sys; sys.modules['glfw'] = None\n"
        "from firefly_sample.cli import main\n"
        f"code = main(['run', {GLADE!r}, '--performance-test', '0.1', '--headless', '--size', '8x6'])\n"
        "sys.exit(code or 'firefly_sample.viewer.glfw_window' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=without_display(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout.count("\n")) == (0, 1), done.stderr
    assert list(tmp_path.iterdir()) == []


def test_with_a_window_it_needs_a_display(tmp_path):
    done = firefly("run", GLADE, "--performance-test", "1", cwd=tmp_path, env=without_display())
    assert (done.returncode, done.stdout) == (1, "")
    assert "no display" in done.stderr


@pytest.mark.parametrize("form", [(), ("--json",)])
def test_ctrl_c_prints_the_result_so_far(tmp_path, form):
    command = [sys.executable, "-m", "firefly_sample.cli", "run", TICKING, "--performance-test", "600"]
    process = subprocess.Popen(
        [*command, *SMALL, *form],
        cwd=tmp_path,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # whoever runs the tests in the background may have had SIGINT ignored, which children inherit
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert process.stdout is not None
    try:
        for _ in range(20):
            assert process.stdout.readline() == "tick\n"
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=600)
    finally:
        process.kill()
    assert process.returncode == 130
    assert err.splitlines()[-1] == "firefly: interrupted"
    assert "Traceback" not in err
    said = out.replace("tick\n", "")
    if form:
        result = json.loads(said)
        frames, seconds = result["frames"], result["seconds"]
        assert result["frames_per_second"] == frames / seconds
    else:
        match = re.fullmatch(LINE, said)
        assert match, said
        frames, seconds = int(match[1]), float(match[2])
    # twenty are planned: the first is not counted, and the last may not be finished
    assert frames >= 18
    assert seconds < 600


def test_a_terminal_sees_how_far_it_is(tmp_path):
    """The bar is on stderr; what is piped from stdout stays clean."""
    terminal, end = open_terminal()
    try:
        process = subprocess.Popen(
            [sys.executable, "-m", "firefly_sample.cli", "run", GLADE, "--performance-test", "1.5", *SMALL],
            cwd=tmp_path,
            env=environment(TERM="xterm", COLUMNS="100"),
            stdout=subprocess.PIPE,
            stderr=end,
            text=True,
        )
        os.close(end)
        seen = b""
        while part := read(terminal):
            seen += part
        out, _ = process.communicate(timeout=600)
    finally:
        os.close(terminal)
    assert process.returncode == 0
    assert re.fullmatch(LINE, out)
    assert b"seconds" in seen
    assert b"1/2" in seen


def read(terminal: int) -> bytes:
    try:
        return os.read(terminal, 4096)
    except OSError:  # how Linux says that the other end is closed
        return b""
