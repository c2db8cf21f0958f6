"""The look "panda3d" beside Panda3D's own pictures, which its shader generator shades per pixel."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from firefly_sample.settings import Settings
from tests.conftest import borrow_renderer
from tests.panda.agreement import agreement
from tests.panda.look_scenes import DESCRIPTIONS, ours, theirs
from tests.panda.oracle import SIZE

LOOK = Settings(look="panda3d")


@pytest.mark.parametrize("name", DESCRIPTIONS)
def test_the_picture_is_panda3ds(by_panda, name):
    other = by_panda(theirs, name)
    with borrow_renderer(SIZE, LOOK) as renderer:
        frame = renderer.render(ours(name), outputs=("color", "color_alpha"))
    covered = frame.color_alpha[..., 3] > 0
    found = agreement(other, SimpleNamespace(color=frame.color, depth=np.where(covered, 1.0, np.inf)))
    assert found.covered > 0.19
    assert found.strays == 0
    assert found.mean <= 0.2
    assert found.largest <= 1
