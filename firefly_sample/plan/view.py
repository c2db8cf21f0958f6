"""The camera of one frame, as a plan has it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.lens_constants import LensConstants

Float64 = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class View:
    """The camera of one frame.

    Attributes
    ----------
    size : (int, int)
        Samples across and down: the picture's size times the supersampling.
    lens : LensConstants
        Of the clip range and direction that this frame draws with.
    reverse : bool
        True if near is depth 1, far 0, in the [0, 1] clip range; False for OpenGL's own.
    near, far : float
        Scene units; far may be infinite.
    world_to_view, view_to_world : ndarray of float64, shape (4, 4)
        For row vectors.
    """

    size: tuple[int, int]
    lens: LensConstants
    reverse: bool
    near: float
    far: float
    world_to_view: Float64
    view_to_world: Float64
