"""What tests of the float64 reference share: plans with nothing cut off, and a GPU's pictures of the same."""

from __future__ import annotations

import numpy as np

from firefly_sample.lab.reference.frame import reference_settings
from firefly_sample.pipeline import build_plan
from firefly_sample.settings import Settings
from tests.conftest import borrow_renderer


def plan_of(scene, size=(64, 48), outputs=("color", "visibility"), time=0.0, **settings):
    """A reference's plan."""
    return build_plan(scene, reference_settings(Settings(**settings)), size, outputs, time)


def draw(scene, settings=None, size=(160, 120), outputs=("radiance", "color", "visibility"), time=0.0):
    """A GPU's frame, the reference's plan of the same moment, and reflectances as they were stored."""
    settings = settings or Settings()
    with borrow_renderer(size, settings) as renderer:
        plan = renderer.plan(scene, time, (*outputs, "albedo", "position"))
        frame = renderer.draw(plan)
        surface = renderer.surface(plan)
        albedo, ambient = surface.albedo(), surface.ambient_albedo()
        renderer.settings = reference_settings(settings)
        exact = renderer.plan(scene, time, outputs)
    return frame, exact, albedo, ambient


def edges(visibility):
    """Pixels with a neighbour that sees another triangle."""
    result = np.zeros(visibility.shape[:2], dtype=bool)
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        height, width = result.shape
        here = (slice(0, height - down), slice(max(-right, 0), width - max(right, 0)))
        there = (slice(down, height), slice(max(right, 0), width + min(right, 0)))
        other = (visibility[here] != visibility[there]).any(axis=-1)
        result[here] |= other
        result[there] |= other
    return result


def covering(plan, instance=0, triangle=0):
    """A visibility in which every pixel sees one triangle."""
    width, height = plan.view.size
    return np.tile(np.array([instance, triangle], dtype=np.int32), (height, width, 1))
