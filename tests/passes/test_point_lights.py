import numpy as np
import pytest

from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.scene.lights import AmbientLight, PointLight, PointLights
from firefly_sample.settings import Settings
from tests.conftest import make_renderer
from tests.reference import BOUNDS, compare
from tests.scenes import ball_scene, orthographic_wall, wall_scene


def against_reference(scene, settings, size=(160, 120), time=0.0, capabilities=None):
    """Largest difference of the frame from float64 shading of its G-buffer, over the 99.9th percentile."""
    return compare(scene, settings, size, time, capabilities).error()


@pytest.mark.parametrize("position", BOUNDS)
@pytest.mark.parametrize("seed", range(3))
def test_the_frame_is_what_float64_says(position, seed):
    scene = ball_scene(120, seed, ambient=(0.02, 0.03, 0.05))
    assert against_reference(scene, Settings(position_method=position)) <= BOUNDS[position]


@pytest.mark.parametrize("position", BOUNDS)
def test_a_driver_without_clip_control_and_snorm_draws_the_same(position):
    """What the plan falls back to: a standard 24-bit depth and normals in RG16."""
    old = Capabilities(clip_control=False, snorm_targets=False)
    bound = BOUNDS["depth24" if position == "depth32f" else position]
    assert (
        against_reference(ball_scene(120, 0), Settings(position_method=position), capabilities=old) <= bound
    )


@pytest.mark.parametrize("position", BOUNDS)
def test_an_orthographic_frame_is_what_float64_says(position):
    scene = orthographic_wall()
    rng = np.random.default_rng(1)
    scene.root.attach_new_node(
        PointLights("l", rng.uniform((-8, 6, -6), (8, 12, 6), (50, 3)), (1, 0.8, 0.6), 3.0)
    )
    # depth is linear: its constants round to half an ulp of the whole span, 99, seen from 0.01 R = 0.03
    law = 2.0**-24 * 99 / 0.03
    bound = BOUNDS[position] if position == "linear32f" else law
    assert against_reference(scene, Settings(position_method=position)) <= bound


@pytest.mark.parametrize(
    "changes",
    [{"light_method": "fullscreen"}, {"light_method": "loop"}, {"volume_depth_test": False}],
    ids=lambda changes: "-".join(map(str, changes.values())),
)
def test_every_way_to_draw_lights_gives_the_same_picture(render, changes):
    scene = ball_scene(100)
    volumes = render(scene, Settings(light_method="volumes"), (320, 240), ("radiance",)).radiance
    other = render(
        scene, Settings(**{"light_method": "volumes"} | changes), (320, 240), ("radiance",)
    ).radiance
    # the same sums in other orders; a pixel at a volume's rim must not be missed
    assert np.abs(volumes - other).max() <= 5e-6 * np.percentile(volumes, 99.9)


@pytest.mark.parametrize("count", [1, 64, 256, 1000])
@pytest.mark.parametrize("method", ["volumes", "fullscreen", "loop"])
def test_a_pile_of_lights_is_one_light(render, count, method):
    """Renderers that stop at 4, 8 or 256 lights fail here."""
    scene = wall_scene()
    path = scene.root.attach_new_node(PointLight("one", (1, 0.8, 0.6), 6.0))
    path.set_pos(0.3, 8, 0.2)
    size = (64, 48)
    one = render(scene, Settings(light_method=method), size, ("radiance",)).radiance.astype(np.float64)
    path.remove_node()
    spot = np.tile([0.3, 8, 0.2], (count, 1))
    scene.root.attach_new_node(PointLights("many", spot, np.array([1, 0.8, 0.6]) / count, 6.0))
    frame = render(scene, Settings(light_method=method), size, ("radiance",))
    assert frame.lights == type(frame.lights)(count, count, 0)
    lit = one > 0
    assert np.array_equal(lit, frame.radiance > 0)
    assert (np.abs(frame.radiance[lit] - one[lit]) <= (2e-8 * count + 1e-6) * one[lit]).all()


def test_lights_reach_models_by_themselves_and_leave_when_detached_or_hidden(render):
    scene = wall_scene()
    light = scene.root.attach_new_node(PointLight("lamp", (1, 1, 1), 8.0))
    light.set_pos(0, 7, 0)
    with make_renderer((32, 24)) as renderer:

        def brightness():
            return renderer.render(scene, 0.0, ("radiance",)).radiance.max()

        lit = brightness()
        assert lit > 0.1
        light.hide()
        assert brightness() == 0
        light.show()
        assert brightness() == lit
        light.detach_node()
        assert brightness() == 0
        light.reparent_to(scene.root)
        assert brightness() == lit
        # a model that comes later is lit too, with nothing switched on for it
        later = scene.root.find("wall").copy_to(scene.root)
        scene.root.find("wall").detach_node()
        assert brightness() == lit
        later.set_y(7.5)
        assert brightness() > lit


@pytest.mark.parametrize(
    ("place", "radius", "why"),
    [
        ((0, 0.5, 0), 30.0, "the camera inside, across the near plane"),
        ((0, -3, 0), 14.0, "behind the camera"),
        ((0, 99, 40), 98.0, "across the far plane"),
        ((0, 9, 0), 1e3, "holds the whole view"),
        ((0, 9, 0), 1e20, "beyond what float32 spheres can place"),
        ((0, 9, 0), 1e300, "beyond float32"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
@pytest.mark.parametrize("position", BOUNDS)
def test_no_pixel_is_missed_however_a_volume_lies(render, place, radius, why, position):
    scene = wall_scene(cells=8, near=1.0, far=100.0)
    scene.root.find("wall").set_p(-80)  # faces the eye and the sky
    scene.root.attach_new_node(PointLights("l", [place], (1, 1, 1), radius))
    size = (96, 72)
    volumes = render(scene, Settings(position_method=position), size, ("radiance",)).radiance
    everywhere = render(
        scene, Settings(position_method=position, light_method="fullscreen"), size, ("radiance",)
    ).radiance
    assert volumes.max() > 0
    assert np.array_equal(volumes, everywhere)


@pytest.mark.parametrize("gap", [0.0, 1e-25, 1e-12])
def test_a_light_on_the_surface_is_finite(render, gap):
    scene = wall_scene()
    scene.root.attach_new_node(PointLights("l", [(0.0, 10.0 - gap, 0.0)], (1, 1, 1), 2.0))
    frame = render(scene, None, (65, 49), ("radiance",))
    assert np.isfinite(frame.radiance).all()


def test_a_light_smaller_than_a_pixel_lights_its_pixel(render):
    """Where a pixel's centre lies in range, volumes and full screen agree."""
    scene = wall_scene()
    scene.root.attach_new_node(PointLights("l", [(0.0, 9.995, 0.0)], (1, 1, 1), 0.02))
    a = render(scene, Settings(), (65, 49), ("radiance",)).radiance
    b = render(scene, Settings(light_method="fullscreen"), (65, 49), ("radiance",)).radiance
    assert np.array_equal(a, b)
    assert np.flatnonzero(a.sum(axis=2)).tolist() == [24 * 65 + 32]


def test_lights_without_reach_or_color_cost_nothing(render):
    scene = wall_scene()
    scene.root.attach_new_node(
        PointLights("l", [(0, 9, 0)] * 3, [(0, 0, 0), (1, 1, 1), (1, 1, 1)], [5, 0, 5])
    )
    frame = render(scene, None, (16, 12), ("color",))
    assert (frame.lights.in_scene, frame.lights.in_view, frame.lights.dropped) == (3, 1, 0)


def test_a_scene_and_camera_far_away_give_the_picture_at_the_origin(render):
    near = render(ball_scene(60), None, (160, 120), ("radiance",)).radiance
    for offset in (1e6, 1e9):
        scene = ball_scene(60)
        for child in list(scene.root.get_children()):
            child.set_pos(child.get_pos() + np.array([offset, offset, -offset]))
        far = render(scene, None, (160, 120), ("radiance",)).radiance
        # places on a grid of 1.2e-7 at 1e9; silhouettes may move by a pixel, so compare shares
        relative = np.abs(far - near) / near.max()
        assert np.mean(relative.max(axis=2) > 1e-4) <= 1e-3


def test_two_ambient_lights_add_up(render):
    scene = wall_scene(color=(0.25, 0.25, 0.25, 1.0))
    scene.root.attach_new_node(AmbientLight("a", (0.1, 0.2, 0.3)))
    scene.root.attach_new_node(AmbientLight("b", (0.4, 0.3, 0.2)))
    frame = render(scene, None, (8, 6), ("radiance", "albedo"))
    assert frame.radiance == pytest.approx(0.5 * frame.albedo, rel=1e-6)
