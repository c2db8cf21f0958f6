"""All keys on one plate, in the middle of the window."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from firefly_sample.viewer.controls import Binding, key_label
from firefly_sample.viewer.overlay import Rows, Section, columns_plate


def mouse_section(dragged: str) -> Section:
    """What the mouse does; `dragged` is what the scene does with its right button, if anything."""
    drags = (
        (("Right drag", dragged), ("Middle drag", "pan"))
        if dragged
        else (("Right drag", "pan (middle, too)"),)
    )
    return "Mouse", (("Left drag", "orbit"), *drags, ("Wheel", "nearer, farther"))


def help_plate(
    scene: str,
    scene_keys: Iterable[Binding],
    own_keys: Iterable[Binding],
    driver: str,
    size: tuple[int, int],
    scale: float,
    dragged: str = "",
) -> NDArray[np.uint8]:
    """What keys and mouse do, and the driver; smaller where a window of `size` has no room for it."""
    of_scene: Section = (f"Scene {scene}", _key_rows(scene_keys))
    mouse = mouse_section(dragged)
    window: Section = ("Window", _key_rows(own_keys))
    columns = ((of_scene,), (window, mouse)) if of_scene[1] else ((window,), (mouse,))
    plate = columns_plate(columns, driver, scale)
    fit = min(size[0] / plate.shape[1], size[1] / plate.shape[0])
    return plate if fit >= 1 else columns_plate(columns, driver, scale * fit)


def _key_rows(bindings: Iterable[Binding]) -> Rows:
    return tuple((key_label(binding.key), binding.help) for binding in bindings)
