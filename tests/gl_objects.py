"""The OpenGL device of a renderer, and the number of its objects.

A Renderer keeps its device private, because OpenGL calls of its users would disturb it. Tests of contexts and
of lifetime need it; this is the one place where they take it.
"""

from __future__ import annotations

from firefly_sample.gpu.device import Device
from firefly_sample.renderer import Renderer


def device_of(renderer: Renderer) -> Device:
    """Return a renderer's device."""
    return renderer._device


def count_objects(renderer: Renderer, highest: int = 4096) -> dict[str, int]:
    """Return the number of a renderer's GL objects with names up to `highest`, by kind."""
    with device_of(renderer) as device:
        return device.raw.count_objects(highest)
