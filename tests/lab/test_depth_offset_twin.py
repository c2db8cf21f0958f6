"""Depth offsets of the float64 reference: by closed form, and as a rasteriser applies them."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.lab.reference.layer_rays import surface_distance
from firefly_sample.lab.reference.raycast import cast_visibility
from firefly_sample.lab.reference.rays import pixel_rays
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.blended import SIZE as BLENDED
from tests.blended import add_lights, add_panes, backdrop, held
from tests.conftest import make_renderer
from tests.passes.test_depth_offset import METHODS, SIZE, decal_scene, each_order
from tests.scenes import geom_node, wall

LENSES = {
    "perspective": PerspectiveLens(fov=40, near=1, far=30),
    "orthographic": OrthographicLens(film_size=(4, 3), near=1, far=30),
}


@pytest.mark.parametrize("position_method", ["linear32f", "depth24"])
@pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)
@pytest.mark.parametrize("offset", [3, -2])
def test_a_step_is_the_slope_from_pixel_to_pixel(lens, offset, position_method):
    """Along the tilt of a wall, the depth moved by n is the depth n pixels further, but for a least step."""
    scene = Scene()
    path = scene.root.attach_new_node(geom_node("wall", wall(12.0)))
    path.set_pos(0, 10, 0)
    path.set_h(30)  # to the right it comes nearer or goes away, up it does not
    path.set_depth_offset(offset)
    scene.camera.node().lens = lens
    plan = build_plan(scene, Settings(position_method=position_method), (64, 48), ("visibility",))
    seen, rays = cast_visibility(plan), pixel_rays(plan.view)
    moved = surface_distance(plan, seen, rays)
    path.clear_depth_offset()
    own = surface_distance(build_plan(scene, plan.settings, (64, 48), ("visibility",)), seen, rays)
    middle = own[:, 20:44]
    nearer = offset if middle[0, 1] < middle[0, 0] else -offset
    expected = own[:, 20 + nearer : 44 + nearer]
    assert np.abs(moved[:, 20:44] - expected).max() <= 1e-4  # the least steps of 24 bits
    assert np.abs(middle - expected).min() > 0.05


@each_order
@pytest.mark.parametrize("position_method", METHODS)
@pytest.mark.parametrize("offset", [1, -1])
def test_rays_see_the_decals_that_a_rasteriser_sees(first, position_method, offset):
    settings = Settings(position_method=position_method)
    scene = decal_scene(first, offset)
    with make_renderer(SIZE, settings) as renderer:
        drawn = renderer.render(scene, outputs=("visibility",)).visibility
    plan = build_plan(scene, settings, SIZE, ("visibility",))
    assert (cast_visibility(plan) == drawn)[..., 0].all()


def test_layers_lie_as_in_exact_transparency():
    """Panes that cross each other and the wall behind them, all with offsets."""
    scene = add_lights(add_panes(backdrop(), 4))
    for number, path in enumerate(scene.root.get_children()):
        path.set_depth_offset((number * 5) % 7 - 3)
    with make_renderer(BLENDED) as renderer:
        moved = held(renderer, scene, transparency="exact")
        for path in scene.root.get_children():
            path.clear_depth_offset()
        plain = held(renderer, scene, transparency="exact")
    assert moved.codes() <= 1
    assert moved.chosen.mean() > 0.5
    assert (moved.frame["color"] != plain.frame["color"]).any(axis=-1).mean() > 0.02
