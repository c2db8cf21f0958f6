"""The light that exposures are measured by is that of the float64 reference, which shades by its own code."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.lab.reference.shade import GBuffer, shade_lights
from firefly_sample.plan.collect import collect
from firefly_sample.plan.lights.incident import count_pairs, incident_light
from firefly_sample.plan.lights.light_set import gather_lights
from firefly_sample.plan.surface_points import sample_surfaces
from firefly_sample.scene.node import ALL_CAMERAS
from firefly_sample.settings import Settings
from tests.lit_scenes import KINDS, lit_scene
from tests.scenes import ball_scene


def lit_points(scene, count=1000):
    snapshot = collect(scene.root, ALL_CAMERAS)
    return sample_surfaces(snapshot.instances, count), gather_lights(snapshot, 0.0)[0]


def reference(points, sets, settings):
    """The light on white surfaces at points, by the reference; reaches are the lights' ends."""
    n = len(points)
    gbuffer = GBuffer(
        position=points.positions,
        normal=points.normals,
        to_eye=points.normals,
        albedo=np.ones((n, 3)),
        specular=np.zeros((n, 3)),
        shininess=np.zeros(n),
        metallic=np.full(n, -1.0),
        roughness=np.ones(n),
    )
    limited = [lights.take(np.arange(len(lights)), reaches=lights.ends) for lights in sets]
    return shade_lights(gbuffer, limited, settings)[1]


SETTINGS = {
    "default": Settings(),
    "gltf": Settings(range_falloff="gltf"),
    "clamped": Settings(clamp_light=True),
    "pyrender": Settings(look="pyrender"),
}


@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_light_is_the_references(kind, settings):
    points, sets = lit_points(lit_scene((kind,)))
    exact = reference(points, sets, settings)
    light = incident_light(points.positions, points.normals, sets, settings)
    assert exact.max() > 0.05
    assert np.abs(light - exact).max() < 1e-12 * max(exact.max(), 1.0)


def test_many_lights_are_the_references_too():
    points, sets = lit_points(ball_scene(lights=3000, radius=1.5))
    exact = reference(points, sets, Settings())
    light = incident_light(points.positions, points.normals, sets, Settings())
    assert np.abs(light - exact).max() < 1e-12 * exact.max()
    assert 0 < count_pairs(points.positions, sets) < 0.2 * len(points) * 3000
