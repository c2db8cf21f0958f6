"""The locks hold what pyproject.toml asks for, with hashes, and name no host."""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from importlib.metadata import Distribution, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
EXTRAS = PROJECT["project"]["optional-dependencies"]
BASE = [*PROJECT["project"]["dependencies"], *PROJECT["build-system"]["requires"]]
LOCKS = {
    "requirements.lock": BASE,
    "requirements-window.lock": [*BASE, *EXTRAS["window"]],
    "requirements-measure.lock": [*BASE, *EXTRAS["measure"]],
    "requirements-cluster.lock": [*BASE, *EXTRAS["cluster"]],
    "requirements-formats.lock": [*BASE, *EXTRAS["formats"]],
    "requirements-video.lock": [*BASE, *EXTRAS["video"]],
    "requirements-exr.lock": [*BASE, *EXTRAS["exr"]],
    "requirements-datasets.lock": [*BASE, *EXTRAS["datasets"]],
    "requirements-panda3d.lock": [*BASE, *EXTRAS["panda3d"]],
    "requirements-test.lock": [
        *BASE,
        *EXTRAS["window"],
        *EXTRAS["measure"],
        *EXTRAS["cluster"],
        *EXTRAS["formats"],
        *EXTRAS["video"],
        *EXTRAS["exr"],
        *EXTRAS["datasets"],
        *EXTRAS["panda3d"],
        *PROJECT["dependency-groups"]["test"],
    ],
}


def pins(name: str) -> dict[str, list[Requirement]]:
    """The pinned requirements of a lock, by name; several where they depend on the version of Python."""
    found: dict[str, list[Requirement]] = {}
    for line in (ROOT / name).read_text().splitlines():
        if line and not line.startswith(" "):
            requirement = Requirement(line.removesuffix("\\"))
            found.setdefault(canonicalize_name(requirement.name), []).append(requirement)
    return found


@pytest.mark.parametrize(("lock", "wanted"), LOCKS.items())
def test_lock_satisfies_the_project(lock: str, wanted: list[str]) -> None:
    locked = pins(lock)
    for text in wanted:
        asked = Requirement(text)
        for pin in locked[canonicalize_name(asked.name)]:
            (version,) = pin.specifier
            assert version.operator == "=="
            assert asked.specifier.contains(version.version), f"{text}: {pin}"


def test_there_is_no_other_lock() -> None:
    assert {path.name for path in ROOT.glob("requirements*")} == LOCKS.keys()


@pytest.mark.parametrize(
    ("smaller", "larger"),
    [
        ("requirements.lock", "requirements-window.lock"),
        ("requirements.lock", "requirements-measure.lock"),
        ("requirements.lock", "requirements-cluster.lock"),
        ("requirements.lock", "requirements-formats.lock"),
        ("requirements.lock", "requirements-video.lock"),
        ("requirements.lock", "requirements-exr.lock"),
        ("requirements.lock", "requirements-datasets.lock"),
        ("requirements.lock", "requirements-panda3d.lock"),
        ("requirements-window.lock", "requirements-test.lock"),
        ("requirements-measure.lock", "requirements-test.lock"),
        ("requirements-cluster.lock", "requirements-test.lock"),
        ("requirements-formats.lock", "requirements-test.lock"),
        ("requirements-video.lock", "requirements-test.lock"),
        ("requirements-exr.lock", "requirements-test.lock"),
        ("requirements-datasets.lock", "requirements-test.lock"),
        ("requirements-panda3d.lock", "requirements-test.lock"),
    ],
)
def test_versions_are_the_same_in_every_lock(smaller: str, larger: str) -> None:
    """So that one is added to another, and tests run with what users get."""
    more = pins(larger)
    assert all(more[name] == pin for name, pin in pins(smaller).items())


def test_drawing_installs_nothing_for_windows_measuring_or_tests() -> None:
    """Nothing is locked but what the dependencies ask for themselves."""
    assert (
        pins("requirements.lock")
        .keys()
        .isdisjoint(
            canonicalize_name(Requirement(text).name)
            for text in (
                *EXTRAS["window"],
                *EXTRAS["measure"],
                *EXTRAS["cluster"],
                *EXTRAS["formats"],
                *EXTRAS["pyrender"],
                *EXTRAS["panda3d"],
                "scipy",
                "fonttools",
            )
        )
    )


def megabytes(lock: str) -> dict[str, float]:
    """What each package of a lock takes here, in 1e6 bytes."""
    wanted = [
        name
        for name, found in pins(lock).items()
        if any(pin.marker is None or pin.marker.evaluate() for pin in found)
    ]
    return {name: sum(sizes_of(distribution(name))) / 1e6 for name in wanted}


def sizes_of(package: Distribution) -> Iterator[int]:
    folder = str(package.locate_file(""))
    for file in package.files or ():
        if file.suffix == ".pyc":  # pip may leave compiling to the first import
            continue
        with suppress(OSError):
            yield os.stat(f"{folder}/{file}").st_size


def test_run_sh_says_how_large_what_it_installs_is() -> None:
    base = megabytes("requirements.lock")
    sizes = {"base": sum(base.values()), "test": sum(megabytes("requirements-test.lock").values())}
    for extra in EXTRAS.keys() - {"pyrender"}:
        added = {
            name: size for name, size in megabytes(f"requirements-{extra}.lock").items() if name not in base
        }
        sizes[extra] = sum(added.values())
    told = dict(
        re.findall(r'^    (\w+)\) echo ".*\(about (\d+) MB', (ROOT / "run.sh").read_text(), re.MULTILINE)
    )
    assert told.keys() == sizes.keys()
    for lock, size in sizes.items():
        assert float(told[lock]) == pytest.approx(size, rel=0.2, abs=0.5), lock


@pytest.mark.parametrize("lock", LOCKS)
def test_hashes_and_nothing_else(lock: str) -> None:
    pin = re.compile(r"[a-z0-9.-]+==[^ /]+( ; [a-z0-9_ .'<>=!()]+)? \\", re.IGNORECASE)
    digest = re.compile(r"    --hash=sha256:[0-9a-f]{64}( \\)?")
    lines = (ROOT / lock).read_text().splitlines()
    assert lines
    for line in lines:
        assert pin.fullmatch(line) or digest.fullmatch(line), line
