"""pyrender in a process of its own."""

from __future__ import annotations

import pytest

from tests.conftest import make_renderer
from tests.interop.oracle import SIZE, start_pyrender


@pytest.fixture(scope="session")
def draw_with_pyrender():
    """``draw_with_pyrender(scene, size, flags, point_size)``: the colour and depth of a pyrender Scene."""
    with start_pyrender() as draw:
        yield draw


@pytest.fixture(scope="module")
def renderer():
    with make_renderer(SIZE) as made:
        yield made
