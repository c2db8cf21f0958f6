"""run.sh where nothing can or need be installed; that it installs is shown in a bare root, not here."""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
BOUNDS = ("max-error", "max-codes", "budget-ms")
TOOLS = (
    "sh",
    "cat",
    "cksum",
    "dirname",
    "id",
    "rm",
    "env",
    "readlink",
    "mv",
    "mkdir",
    "cp",
    "chmod",
    "sleep",
)


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A folder with what run.sh reads, and a bin/ with the few commands that it may use."""
    root = tmp_path.resolve() / "check out"
    root.mkdir()
    for path in (ROOT / "run.sh", ROOT / "pyproject.toml", *ROOT.glob("requirements*.lock")):
        shutil.copy(path, root)
    (root / "bin").mkdir()
    for tool in TOOLS:
        found = shutil.which(tool)
        assert found is not None
        (root / "bin" / tool).symlink_to(found)
    return root


def script(path: Path, *lines: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)  # it may be a link to the system's own
    path.write_text("\n".join(["#!/bin/sh", *lines]) + "\n")
    path.chmod(0o755)


def sh(
    checkout: Path, *words: str, file: Path | None = None, **variables: str
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["sh", file or checkout / "run.sh", *words],
        env={"PATH": str(checkout / "bin"), **variables},
        cwd=checkout.parent,
        capture_output=True,
        text=True,
        timeout=600,
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


@pytest.fixture
def faked(checkout: Path) -> Path:
    """The checkout with a python3 whose "venv" makes a copy of itself and a firefly that prints its words.

    Its pip "installs" a folder for each lock: not while the file "broken" is there, and while "held" is
    there, it does not get ready. What it is asked goes into the file "asked".
    """
    script(
        checkout / "bin" / "python3",
        f"cd {str(checkout)!r}",
        'echo "$*" >>asked',
        "for last; do :; done",
        "packages=.venv/lib/python3/site-packages",
        'case "$*" in',
        f'*fcntl*) exec {sys.executable!r} "$@" ;;',
        '*"-m venv"*)',
        "    rm -rf .venv",
        "    mkdir -p .venv/bin $packages",
        "    cp bin/python3 .venv/bin/python",
        "    printf '#!/bin/sh\\necho firefly \"$@\"\\n' >.venv/bin/firefly",
        "    chmod +x .venv/bin/firefly ;;",
        '*"pip install"*)',
        "    while [ -e held ]; do : >holding; sleep 0.02; done",
        "    [ ! -e broken ] || exit 1",
        '    mkdir -p "$packages/${last##*/}" ;;',
        "-V) echo Python 3.11.0 ;;",
        "esac",
    )
    return checkout


def installed(checkout: Path) -> set[str]:
    """The locks whose packages are in .venv."""
    found = (checkout / ".venv" / "lib" / "python3" / "site-packages").glob("requirements*.lock")
    return {path.stem.removeprefix("requirements").removeprefix("-") or "base" for path in found}


def test_installs_once_and_repeats_what_failed(faked: Path) -> None:
    (faked / "broken").touch()
    done = sh(faked, "scenes")
    assert done.returncode == 1
    assert done.stdout == ""
    assert done.stderr.splitlines()[-1].startswith("run.sh: the Python packages could not be installed")

    (faked / "broken").unlink()
    done = sh(faked, "plan", "a b", "--json")
    assert (done.returncode, done.stdout) == (0, "firefly plan a b --json\n")
    assert "making .venv" in done.stderr
    assert f"--require-hashes -r {faked}/requirements.lock\n" in (faked / "asked").read_text()

    done = sh(faked, "plan")
    assert (done.stdout, done.stderr) == ("firefly plan\n", "")

    with (faked / "requirements-test.lock").open("a") as lock:
        lock.write("\n")
    assert "making .venv" in sh(faked, "plan").stderr
    assert sh(faked, "plan").stderr == ""


@pytest.mark.parametrize(
    ("words", "locks"),
    [
        (("capture",), {"base"}),
        (("run", "smoke"), {"base", "window"}),
        (("measure", "speed"), {"base", "measure"}),
        (("measure", "speed", "--help"), {"base"}),
        (("capture", "--cluster", "tcp://host:8786"), {"base", "cluster"}),
        (("capture", "--cluster=local", "--max-error=0.5"), {"base", "measure", "cluster"}),
        *((("capture", f"--{name}", "0.5"), {"base", "measure"}) for name in BOUNDS),
        *((("run", f"--{name}=0.5"), {"base", "window", "measure"}) for name in BOUNDS),
    ],
)
def test_only_what_a_command_needs_is_installed(faked: Path, words: tuple[str, ...], locks: set[str]) -> None:
    done = sh(faked, *words)
    assert (done.returncode, done.stdout) == (0, f"firefly {' '.join(words)}\n")
    assert installed(faked) == locks
    said = [line for line in done.stderr.splitlines() if "installing Python packages" in line]
    assert len(said) == len(locks)
    assert all(line.endswith(" MB)") for line in said)
    assert sh(faked, *words).stderr == ""


def test_more_is_added_to_what_is_there(faked: Path) -> None:
    for words, locks in ((("capture",), {"base"}), (("run",), {"base", "window"})):
        assert ("making .venv" in sh(faked, *words).stderr) == (words == ("capture",))
        assert installed(faked) == locks
    assert "making .venv" not in sh(faked, "measure").stderr
    assert installed(faked) == {"base", "window", "measure"}
    # a second time, other commands that run meanwhile would miss it
    assert (faked / "asked").read_text().count("--editable") == 1
    assert sh(faked, "run", "--max-error", "1").stderr == ""
    assert sh(faked, "capture").stderr == ""


@pytest.mark.parametrize(
    "part", ["bin/firefly", "lib/python3/site-packages/requirements.lock", ".complete", "bin/python"]
)
def test_a_venv_that_has_lost_a_part_is_made_anew(faked: Path, part: str) -> None:
    sh(faked, "capture")
    (faked / ".venv" / "lib" / "python3" / "site-packages" / "of the user").mkdir()
    assert sh(faked, "capture").stderr == ""
    lost = faked / ".venv" / part
    lost.rmdir() if lost.is_dir() else lost.unlink()
    done = sh(faked, "capture")
    assert (done.returncode, done.stdout) == (0, "firefly capture\n")
    assert "making .venv" in done.stderr
    assert lost.exists()
    assert sh(faked, "capture").stderr == ""


def test_a_venv_without_compiled_code_is_whole(faked: Path) -> None:
    with (faked / "bin" / "python3").open("a") as python:
        python.write("[ ! -d .venv ] || mkdir -p .venv/lib/python3/site-packages/__pycache__\n")
    sh(faked, "capture")
    compiled = faked / ".venv" / "lib" / "python3" / "site-packages" / "__pycache__"
    compiled.rmdir()
    assert sh(faked, "capture").stderr == ""


def test_another_python_makes_another_venv(faked: Path) -> None:
    sh(faked, "capture")
    newer = faked / "bin" / "python3.12"
    script(newer, *(faked / "bin" / "python3").read_text().replace("3.11.0", "3.12.0").splitlines()[1:])
    assert "making .venv" in sh(faked, "capture", PYTHON="python3.12").stderr
    assert sh(faked, "capture", PYTHON="python3.12").stderr == ""
    assert sh(faked, "capture", PYTHON="python3").stderr != ""


def test_nothing_of_the_working_folder_or_pythonpath_is_imported(faked: Path) -> None:
    """Python is always isolated, but where it only says its version."""
    sh(faked, "measure")
    asked = (faked / "asked").read_text().splitlines()
    assert len(asked) > 5
    assert all(line.startswith("-I ") or line == "-V" for line in asked), asked


@pytest.mark.parametrize("relative", [True, False])
def test_a_symbolic_link_to_it_is_not_the_checkout(faked: Path, relative: bool) -> None:
    folder = faked.parent / "elsewhere"
    folder.mkdir()
    link = folder / "fireflies"
    link.symlink_to(Path("..", faked.name, "run.sh") if relative else faked / "run.sh")
    assert sh(faked, "plan", file=link).stdout == "firefly plan\n"
    assert list(folder.iterdir()) == [link]
    assert sh(faked, "plan").stderr == ""  # it is the same .venv


def test_a_checkout_behind_a_symbolic_link_has_one_venv(faked: Path) -> None:
    link = faked.parent / "link"
    link.symlink_to(faked, target_is_directory=True)
    assert "making .venv" in sh(faked, "plan", file=link / "run.sh").stderr
    assert sh(faked, "plan").stderr == ""


class Started:
    """A run.sh that goes on by itself."""

    def __init__(self, checkout: Path, name: str) -> None:
        self._said = checkout / f"{name}.err"
        with self._said.open("w") as said:
            self.process = subprocess.Popen(
                ["sh", checkout / "run.sh", "plan"],
                env={"PATH": str(checkout / "bin")},
                stdout=subprocess.DEVNULL,
                stderr=said,
            )

    def said(self) -> str:
        return self._said.read_text()

    def kill(self) -> None:
        self.process.kill()
        self.process.wait(600)


def wait_for(ready: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 600
    while not ready():
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.mark.parametrize("killed", ["first", "second", "none"])
def test_two_at_once_with_one_of_them_killed(faked: Path, killed: str) -> None:
    """The second waits for the first, and for a pip that the killed first one leaves behind."""
    (faked / "held").touch()
    first = Started(faked, "first")
    try:
        wait_for((faked / "holding").exists)
        second = Started(faked, "second")
        try:
            wait_for(lambda: "waiting" in second.said())
            if killed != "none":
                {"first": first, "second": second}[killed].kill()
            assert second.process.poll() in (None, -9)
            assert not (faked / ".venv" / ".complete").exists()
            (faked / "held").unlink()
            for name, one in (("first", first), ("second", second)):
                assert one.process.wait(600) == (-9 if name == killed else 0)
        finally:
            second.kill()
    finally:
        (faked / "held").unlink(missing_ok=True)
        first.kill()
    # only one that is left behind is made anew
    assert ("making .venv" in second.said()) == (killed == "first")
    assert sh(faked, "plan").stderr == ""
    assert installed(faked) == {"base"}
