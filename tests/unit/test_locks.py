"""The locks hold what pyproject.toml asks for, with hashes, and name no host."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
RUN = [
    *PROJECT["project"]["dependencies"],
    *PROJECT["project"]["optional-dependencies"]["window"],
    *PROJECT["project"]["optional-dependencies"]["measure"],
    *PROJECT["build-system"]["requires"],
]


def pins(name: str) -> dict[str, list[Requirement]]:
    """The pinned requirements of a lock, by name; several where they depend on the version of Python."""
    found: dict[str, list[Requirement]] = {}
    for line in (ROOT / name).read_text().splitlines():
        if line and not line.startswith(" "):
            requirement = Requirement(line.removesuffix("\\"))
            found.setdefault(canonicalize_name(requirement.name), []).append(requirement)
    return found


@pytest.mark.parametrize(
    ("lock", "wanted"),
    [
        ("requirements.lock", RUN),
        ("requirements-test.lock", [*RUN, *PROJECT["dependency-groups"]["test"]]),
    ],
)
def test_lock_satisfies_the_project(lock: str, wanted: list[str]) -> None:
    locked = pins(lock)
    for text in wanted:
        asked = Requirement(text)
        for pin in locked[canonicalize_name(asked.name)]:
            (version,) = pin.specifier
            assert version.operator == "=="
            assert asked.specifier.contains(version.version), f"{text}: {pin}"


def test_tests_run_with_the_versions_that_users_get() -> None:
    tested = pins("requirements-test.lock")
    assert all(tested[name] == pin for name, pin in pins("requirements.lock").items())


@pytest.mark.parametrize("lock", ["requirements.lock", "requirements-test.lock"])
def test_hashes_and_nothing_else(lock: str) -> None:
    pin = re.compile(r"[a-z0-9.-]+==[^ /]+( ; [a-z0-9_ .'<>=!()]+)? \\", re.IGNORECASE)
    digest = re.compile(r"    --hash=sha256:[0-9a-f]{64}( \\)?")
    lines = (ROOT / lock).read_text().splitlines()
    assert lines
    for line in lines:
        assert pin.fullmatch(line) or digest.fullmatch(line), line
