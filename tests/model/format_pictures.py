"""Pictures of models from the front, whose pixels have known colours."""

from __future__ import annotations

import numpy as np

from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import AmbientLight
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Scene

SIZE = 64
"""Width and height in pixels of a picture, which shows x and z of -4 to 4."""


def front(model: NodePath, scale: float = 1.0) -> Scene:
    """A scene of a model under white ambient light: its pixels are the display colours of its materials."""
    scene = Scene()
    model.reparent_to(scene.root)
    model.set_scale(scale)
    scene.root.attach_new_node(AmbientLight("white", (1.0, 1.0, 1.0)))
    scene.camera.set_pos(0, -50, 0)
    scene.camera.node().lens = OrthographicLens(film_size=(8, 8), near=1, far=100)
    return scene


def covered(corners: np.ndarray) -> np.ndarray:
    """The pixels (SIZE, SIZE) whose centre lies in a triangle (3, 2) of x and z."""
    axis = (np.arange(SIZE) + 0.5) * 8 / SIZE - 4
    x, z = np.meshgrid(axis, -axis)
    inside = np.ones((SIZE, SIZE), dtype=int)
    signs = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        signs.append((end[0] - start[0]) * (z - start[1]) - (end[1] - start[1]) * (x - start[0]))
    positive, negative = (inside.astype(bool) for _ in range(2))
    for sign in signs:
        positive &= sign > 0
        negative &= sign < 0
    return positive | negative
