"""Panda3D as an oracle, for the tests of this folder."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from tests.panda.oracle import Picture, start_panda


@pytest.fixture(scope="session")
def by_panda() -> Iterator[Callable[..., Picture]]:
    """``by_panda(build, *arguments, size=SIZE, auto=True)``: see `tests.panda.oracle.start_panda`."""
    with start_panda() as draw:
        yield draw
