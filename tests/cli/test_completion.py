"""``firefly completion``: what a real shell offers for the word under the cursor."""

from __future__ import annotations

import shutil
import subprocess
import sys

import pytest

from firefly_sample.cli import main
from firefly_sample.scenes import list_scenes
from tests.cli.command import broken_gl


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    """``complete(*words)``: what bash offers for the last word; the driver's libraries are broken."""
    if shutil.which("bash") is None:
        pytest.skip("there is no bash")
    folder = tmp_path_factory.mktemp("completion")
    command = folder / "firefly"
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -m firefly_sample "$@"\n')
    command.chmod(0o755)
    env = broken_gl(folder / "lib")
    env["PATH"] = f"{folder}:{env['PATH']}"

    (folder / "vases").mkdir()
    for name in ("vase.glb", "vase.txt", "vases/tall.OBJ"):
        (folder / name).touch()

    def bash(script, *arguments):
        done = subprocess.run(
            ["bash", "--norc", "-c", script, "bash", *arguments],
            cwd=folder,
            env=env,
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )
        assert (done.returncode, done.stderr) == (0, "")
        return done.stdout.splitlines()

    bash("firefly completion bash > script")

    def offered(*words):
        return bash(
            "source ./script\n"
            'COMP_WORDS=(firefly "$@")\nCOMP_CWORD=$#\n'
            "function=$(complete -p firefly | sed 's/.*-F \\([^ ]*\\) .*/\\1/')\n"
            "$function\nprintf '%s\\n' \"${COMPREPLY[@]}\"",
            *words,
        )

    return offered


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("ca",), ["capture"]),
        (("ver",), ["verify"]),
        (("verify", "vases", "--max"), ["--max-codes", "--max-error", "--max-share"]),
        (("measure", "st"), ["start", "stability"]),
        (("measure", "captures", "--gr"), ["--growth"]),
        (("completion", ""), ["bash", "zsh", "fish"]),
        (("capture", "sp"), ["spheres"]),
        (("capture", "vas"), ["vase.glb", "vases/"]),
        (("run", "vases/"), ["vases/tall.OBJ"]),
        (("capture", "--scene", "ligh"), ["lightbulbs"]),
        (("capture", "--light-m"), ["--light-method"]),
        (("plan", "--no-volume-d"), ["--no-volume-depth-test"]),
        (("capture", "forest", "--fire"), ["--fireflies", "--firefly-size"]),
        (("plan", "--light-method", "f"), ["fullscreen", "forward"]),
        (("capture", "--outputs", "no"), ["normal", "normal_world"]),
        (("measure", "speed", "--pre"), ["--preset"]),
    ],
    ids=" ".join,
)
def test_bash_completes(complete, words, expected):
    assert sorted(complete(*words)) == sorted(expected)


def test_bash_offers_every_scene_and_the_models_of_the_folder(complete):
    assert complete("run", "") == [*(plugin.name for plugin in list_scenes()), "vase.glb"]


def test_bash_offers_files_after_the_first_one(capsys):
    """The function has no words for later operands; readline then offers files, and quotes their names."""
    assert main(["completion", "bash"]) == 0
    assert capsys.readouterr().out.rstrip().endswith("\ncomplete -o filenames -o default -F _firefly firefly")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_has_a_script_of_its_own(capsys, shell):
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert f"# {shell.capitalize()} completion for firefly" in script or script.startswith("#compdef firefly")
    for word in ("capture", "speed", "fireflies", "particle-shadow-slices"):
        assert word in script
    if shutil.which(shell) is not None:
        done = subprocess.run([shell, "-n"], input=script, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")
