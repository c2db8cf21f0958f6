"""The wheel, built and installed without a network: what is in it, and that it works without the checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path
from zipfile import ZipFile

import pytest

ROOT = Path(__file__).resolve().parents[2]


def run(*command: str | Path, cwd: Path, **changes: str) -> str:
    clean = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"} | changes
    done = subprocess.run(
        command, cwd=cwd, env=clean, capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def files_below(folder: Path) -> set[str]:
    return {
        path.relative_to(ROOT).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder, cwd=ROOT)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A virtual environment with the wheel, its dependencies borrowed from the environment of the tests."""
    venv = tmp_path_factory.mktemp("venv")
    run(sys.executable, "-m", "venv", "--without-pip", venv, cwd=venv)
    pip = [sys.executable, "-m", "pip", "--python", venv / "bin" / "python"]
    run(*pip, "install", "--quiet", "--no-index", "--no-deps", "--no-compile", wheel, cwd=venv)
    # Only now: pip must not take what is borrowed for installed.
    (site_packages,) = venv.glob("lib/python3*/site-packages")
    (site_packages / "borrowed.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return venv


def test_contents(wheel: Path) -> None:
    names = set(ZipFile(wheel).namelist())
    code = {name for name in files_below(ROOT / "firefly_sample") if name.endswith((".py", "py.typed"))}
    assert "firefly_sample/__init__.py" in code
    assert code <= names
    for kind, ending in (("shaders", ".glsl"), ("models", ".glb")):
        assets = files_below(ROOT / kind)
        assert any(name.endswith(ending) for name in assets)
        assert {f"firefly_sample/_assets/{name}" for name in assets} <= names
    surplus = {name for name in names if not name.startswith(("firefly_sample/", "firefly_sample-"))}
    assert surplus == set()
    assert not any(name.endswith(".pyc") for name in names)


def test_metadata(wheel: Path) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    with ZipFile(wheel) as archive:
        info = f"firefly_sample-{project['version']}.dist-info"
        entry_points = archive.read(f"{info}/entry_points.txt").decode()
        metadata = archive.read(f"{info}/METADATA").decode()
        assert f"{info}/licenses/LICENSE" in archive.namelist()
    assert "[firefly_sample.scenes]\nforest = firefly_sample.scenes.forest:scene" in entry_points
    assert "[console_scripts]\nfirefly = firefly_sample.cli:main" in entry_points
    assert (ROOT / "README.md").read_text().strip() in metadata


def test_assets_are_found_in_the_installation(installed: Path, tmp_path: Path) -> None:
    code = "from firefly_sample.assets import asset_dir; print(asset_dir('shaders'), asset_dir('models'))"
    shaders, models = map(Path, run(installed / "bin" / "python", "-c", code, cwd=tmp_path).split())
    for folder in (shaders, models):
        assert folder.is_relative_to(installed)
        found = {path.relative_to(folder.parent).as_posix() for path in folder.rglob("*") if path.is_file()}
        assert found == files_below(ROOT / folder.name)


def test_forest_is_found_by_the_installed_command(installed: Path, tmp_path: Path) -> None:
    assert "forest" in run(installed / "bin" / "firefly", "scenes", cwd=tmp_path)
    code = "import firefly_sample.scenes as s; print(s.find_scene('forest').name, s.__file__)"
    name, where = run(installed / "bin" / "python", "-c", code, cwd=tmp_path).split()
    assert name == "forest"
    assert Path(where).is_relative_to(installed)


@pytest.mark.parametrize(
    "words",
    [
        ("measure", "start", "tests.cli.glade:glade", "--size", "8x6", "--rounds", "1"),
        ("capture", "tests.cli.glade:glade", "--size", "8x6", "-o", "out"),
        ("doctor",),  # it loads glfw, which starts Python to look at libraries
    ],
)
def test_nothing_that_lies_in_the_working_folder_is_run(
    installed: Path, tmp_path: Path, words: tuple[str, ...]
) -> None:
    """Neither by the command nor by a process that it starts: each module there would leave a file."""
    here = tmp_path / "here"
    here.mkdir()
    borrowed = {path.name.split(".")[0] for path in Path(sysconfig.get_path("purelib")).iterdir()}
    for name in borrowed | sys.stdlib_module_names | {"firefly_sample", "usercustomize"}:
        code = f"import os; os.mkdir({str(tmp_path / 'ran')!r}); raise SystemExit({name!r})\n"
        (here / f"{name}.py").write_text(code)
    # PYTHONPATH is how a scene that is not installed is found, also by the processes of a measurement
    run(installed / "bin" / "firefly", *words, cwd=here, PYTHONPATH=str(ROOT), DISPLAY=":4242")
    assert not (tmp_path / "ran").exists()
