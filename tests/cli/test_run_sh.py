"""run.sh where nothing can or need be installed; that it installs is shown in a bare root, not here."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TOOLS = ("sh", "cat", "cksum", "dirname", "id", "rm", "env")


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A folder with what run.sh reads, and a bin/ with the few commands that it may use."""
    for name in ("run.sh", "requirements.lock", "requirements-test.lock", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    (tmp_path / "bin").mkdir()
    for tool in TOOLS:
        found = shutil.which(tool)
        assert found is not None
        (tmp_path / "bin" / tool).symlink_to(found)
    return tmp_path


def script(path: Path, *lines: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(["#!/bin/sh", *lines]) + "\n")
    path.chmod(0o755)


def sh(checkout: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["sh", checkout / "run.sh", *words],
        env={"PATH": str(checkout / "bin")},
        cwd=checkout.parent,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.mark.parametrize("words", [(), ("--help",), ("-h",)])
def test_help_installs_nothing(checkout: Path, words: tuple[str, ...]) -> None:
    done = sh(checkout, *words)
    assert done.returncode == 0
    assert done.stderr == ""
    assert "sh run.sh COMMAND" in done.stdout
    assert all(f"\n  {word} " in done.stdout for word in ("capture", "run", "test"))
    assert not (checkout / ".venv").exists()


def test_without_python(checkout: Path) -> None:
    done = sh(checkout, "capture")
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.startswith("run.sh: needs Python 3.11 or newer")
    assert done.stderr.count("\n") == 1


def test_without_rights(checkout: Path) -> None:
    """A user without sudo is told the one line that installs what is missing, and only that."""
    script(checkout / "bin" / "id", "echo 1000")
    script(checkout / "bin" / "apt-get", "exit 1")
    script(checkout / "bin" / "python3", "exit 0")
    states = ("libc-bin=installed", "libegl1=installed", "libgl1=config-files")
    script(checkout / "bin" / "dpkg-query", f"echo '{' '.join(states)} '", "exit 1")
    done = sh(checkout, "capture")
    assert done.returncode == 1
    assert done.stderr == (
        "run.sh: system packages are missing; as root, run: "
        "apt-get update && apt-get install -y --no-install-recommends libgl1 libgl1-mesa-dri\n"
    )


def make_fake_python(checkout: Path) -> None:
    """A python3 whose "venv" makes a copy of itself and a firefly that prints its words; pip does nothing."""
    script(
        checkout / "bin" / "python3",
        'case "$*" in',
        '*"-m venv"*)',
        '    for venv; do :; done; mkdir -p "$venv/bin"; cp "$0" "$venv/bin/python"',
        '    printf \'#!/bin/sh\\necho firefly "$@"\\n\' >"$venv/bin/firefly"',
        '    chmod +x "$venv/bin/firefly" ;;',
        '*"pip install"*) echo "pip $*"; [ ! -e broken ] ;;',
        "-V) echo Python 3.11.0 ;;",
        "esac",
    )
    for tool in ("mkdir", "cp", "chmod"):
        (checkout / "bin" / tool).symlink_to(str(shutil.which(tool)))


def test_installs_once_and_repeats_what_failed(checkout: Path) -> None:
    make_fake_python(checkout)
    broken = checkout.parent / "broken"
    broken.touch()
    done = sh(checkout, "scenes")
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.splitlines()[-1].startswith("run.sh: the Python packages could not be installed")

    broken.unlink()
    done = sh(checkout, "plan", "a b", "--json")
    assert (done.returncode, done.stdout) == (0, "firefly plan a b --json\n")
    assert "making .venv" in done.stderr
    assert f"--require-hashes -r {checkout}/requirements.lock" in done.stderr

    done = sh(checkout, "plan")
    assert (done.stdout, done.stderr) == ("firefly plan\n", "")

    with (checkout / "requirements.lock").open("a") as lock:
        lock.write("\n")
    assert "making .venv" in sh(checkout, "plan").stderr
    assert sh(checkout, "plan").stderr == ""
