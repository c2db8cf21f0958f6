"""Random Panda3D scenes beside Panda3D's own pictures; random changes beside new conversions."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from firefly_sample import Renderer, Settings
from firefly_sample.interop.panda3d import GraphMirror, from_panda3d
from tests.panda.agreement import agreement
from tests.panda.random_changes import change
from tests.panda.random_scenes import Choices, build

SIZE = (160, 120)
OUTPUTS = ("color", "color_alpha", "depth")


@pytest.fixture(scope="module")
def draw():
    """A function that draws a scene of ours."""
    with Renderer(SIZE, Settings(look="panda3d")) as renderer:
        yield lambda scene: renderer.render(scene, outputs=OUTPUTS)


@pytest.fixture(autouse=True)
def quiet():
    """Lenses and materials at random have losses that are named."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


@pytest.mark.parametrize("seed", [*range(8), 9, 13, 16, 24])
def test_a_random_scene_is_panda3ds(by_panda, draw, seed):
    theirs, ours = by_panda(build, seed), draw(from_panda3d(*build(seed)))
    # what blends writes no depth
    theirs = theirs._replace(depth=np.where(theirs.color[..., 3] > 0, 0.0, theirs.depth))
    found = agreement(theirs, ours)
    assert found.covered > 0.0
    assert found.strays == 0
    assert found.edges <= 4
    assert found.mean <= 0.1
    differ = np.abs(theirs.color[..., :3].astype(int) - ours.color).max(axis=2) > 1
    assert not _inner(differ).any()  # at most edges within a picture differ


@pytest.mark.parametrize("seed", [0, 41])
def test_an_update_after_a_random_change_draws_what_a_new_conversion_does(draw, seed):
    root, camera = build(seed)
    choices = Choices(10_000 + seed)
    mirror = GraphMirror(root, camera)
    draw(mirror.update())
    for _ in range(5):
        name = change(choices, root, camera)
        updated, new = draw(mirror.update()), draw(from_panda3d(root, camera))
        for output in OUTPUTS:
            assert np.array_equal(updated.images[output], new.images[output]), name


def _inner(pixels: np.ndarray) -> np.ndarray:
    """Pixels among those with all of their eight neighbours."""
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(pixels, 1), (3, 3))
    return windows.all(axis=(2, 3))
