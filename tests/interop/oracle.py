"""pyrender's OffscreenRenderer in a process of its own, and two pictures' agreement.

Its `delete` ends every EGL context of a process, and its context stays current. One process draws all scenes:
to start it takes longer than a hundred of them.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache

import numpy as np

SIZE = (160, 120)

LIT, FLAT = 0, 4096
"""pyrender's flags of an ordinary picture, and of one without light."""

BEND = 1e-2
"""A pixel is on an edge if 1/depth, which is linear over a plane, bends there by this share of itself."""


@contextmanager
def start_pyrender() -> Iterator:
    """A function that gives what pyrender's `render` returns for a Scene: its colour and its depth.

    It takes the size, the flags (`FLAT` is pyrender's: base colours without light), the size of points and,
    for a segmentation, each node's colour by its name. It raises what pyrender raises, and
    RuntimeError for an error of OpenGL.
    """
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=spawn, initializer=use_egl) as pool:
        yield lambda scene, size=SIZE, flags=FLAT, point_size=1.0, segments=None: pool.submit(
            _draw, scene, size, flags, point_size, segments
        ).result()


def use_egl() -> None:
    """Before a scene arrives, and pyrender with it."""
    os.environ["PYOPENGL_PLATFORM"] = "egl"


@cache
def _offscreen():
    import pyrender
    import pyrender.renderer as module

    storage = module.glRenderbufferStorageMultisample
    # Of four samples in a pixel its depth image would have one, 0.375 of a pixel beside the centre.
    module.glRenderbufferStorageMultisample = lambda target, samples, *rest: storage(target, 0, *rest)
    return pyrender.OffscreenRenderer(*SIZE)


def _draw(scene, size, flags, point_size, segments):
    from OpenGL.error import GLError

    offscreen = _offscreen()
    offscreen.viewport_width, offscreen.viewport_height = size
    offscreen.point_size = point_size
    colors = None if segments is None else {n: segments[n.name] for n in scene.nodes if n.name in segments}
    try:
        return offscreen.render(scene, flags, colors)
    except GLError as error:
        raise RuntimeError(str(error)) from None  # a GLError cannot be sent to another process
    finally:
        offscreen._renderer._reset_active_textures()  # else an error leaves fewer of them to the next scene


@dataclass(frozen=True)
class Agreement:
    """How two depth images agree.

    Attributes
    ----------
    covered : float
        Share of the picture that either covers.
    differing : float
        Share of the picture where one is covered and the other is not.
    stray : int
        How many of these are not on an edge.
    compared : float
        Share of what both cover that is not on an edge.
    error : float
        Largest relative difference of depth there.
    """

    covered: float
    differing: float
    stray: int
    compared: float
    error: float

    def __bool__(self) -> bool:
        return self.stray == 0 and self.error < 1e-4


def agreement(ours: np.ndarray, theirs: np.ndarray) -> Agreement:
    """Two depth images, shape (h, w): ours, infinite where nothing is, and pyrender's, 0 there."""
    a = np.where(np.isfinite(ours), 1.0 / ours.astype(np.float64), 0.0)
    b = np.divide(1.0, theirs, out=np.zeros(theirs.shape), where=theirs > 0, dtype=np.float64)
    edge = edges(a) | edges(b)
    differing = (a > 0) != (b > 0)
    both = (a > 0) & (b > 0)
    compared = both & ~edge
    error = np.abs(b[compared] / a[compared] - 1.0).max(initial=0.0)
    return Agreement(
        covered=float(((a > 0) | (b > 0)).mean()),
        differing=float(differing.mean()),
        stray=int((differing & ~edge).sum()),
        compared=float(compared.sum() / max(both.sum(), 1)),
        error=float(error),
    )


def edges(inverse: np.ndarray) -> np.ndarray:
    """Where one of a pixel's eight neighbours is covered and another is not, or the depth bends or breaks."""
    height, width = inverse.shape
    padded = np.pad(inverse, 1, mode="reflect", reflect_type="odd")
    shifts = [(1, 0), (0, 1), (1, 1), (1, -1)]
    edge = np.zeros(inverse.shape, dtype=bool)
    for row, column in shifts:
        before, after = (
            padded[1 + row * sign : 1 + row * sign + height, 1 + column * sign : 1 + column * sign + width]
            for sign in (-1, 1)
        )
        edge |= ((before > 0) != (inverse > 0)) | ((after > 0) != (inverse > 0))
        edge |= np.abs(before + after - 2.0 * inverse) > BEND * inverse
    return edge


def undo_perspective(theirs: np.ndarray, near: float, far: float) -> np.ndarray:
    """Distances from what pyrender makes of an orthographic camera's depth: it takes it for perspective."""
    ndc = (far + near - 2.0 * near * far / np.where(theirs > 0, theirs, near)) / (far - near)
    return np.where(theirs > 0, near + (0.5 * ndc + 0.5) * (far - near), 0.0)
