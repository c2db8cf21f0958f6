import numpy as np
import pytest

from firefly_sample.errors import SceneError
from firefly_sample.lab.reference.shading import tone_curve
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene, VerticalGradient
from firefly_sample.settings import Settings
from firefly_sample.srgb import linear_to_srgb
from tests.scenes import ball_scene, orthographic_wall, wall_scene


def codes(radiance, settings):
    """The sRGB codes that a picture must have, before rounding."""
    return linear_to_srgb(tone_curve(radiance * settings.exposure, settings.tone_curve)) * 255


@pytest.mark.parametrize("settings", [Settings(), Settings(tone="none"), Settings(exposure=3.5)], ids=str)
def test_the_picture_is_the_radiance_through_exposure_curve_and_srgb(render, settings):
    scene = ball_scene(80, ambient=(0.01, 0.02, 0.03))
    scene.root.attach_new_node(Sprites("dots", [(0, 6, 0), (1, 5, 0)], (5, 3, 1), 0.5))
    scene.background = (0.001, 0.01, 0.02)
    frame = render(scene, settings, (160, 120), ("color", "radiance"))
    exact = codes(frame.radiance.astype(np.float64), settings)
    # rounding to the nearest code, and a few ulp of the driver's pow before it
    assert np.abs(frame.color - exact).max() <= 0.5 + 1e-2
    assert len(np.unique(frame.color)) > 100


def test_the_background_is_exact_where_nothing_is_drawn_and_only_there(render):
    scene = wall_scene(size=4.0, color=(0.0, 0.0, 0.0, 1.0))
    scene.background = (0.125, 0.25, 2.0)
    frame = render(scene, None, (80, 60), ("radiance", "id"))
    empty = frame.id == -1
    assert 0.2 < empty.mean() < 0.95
    assert (frame.radiance[empty] == (0.125, 0.25, 2.0)).all()
    assert (frame.radiance[~empty] == 0).all()


def test_a_gradient_follows_the_elevation_of_the_ray(render):
    low, high = np.array((0.1, 0.2, 0.3)), np.array((0.0, 0.0, 0.1))
    scene = Scene(background=VerticalGradient(tuple(low), tuple(high)))
    scene.camera.set_hpr(40, 10, 25)
    scene.lens.set_fov(70)
    frame = render(scene, None, (60, 60), ("radiance",))
    ndc = (np.arange(60) + 0.5) / 30 - 1
    rays = scene.lens.constants().view_from_distance(ndc[None], -ndc[:, None], 1.0)
    rays = rays @ scene.camera.get_net_transform().get_mat()[:3, :3]
    elevation = rays[..., 2] / np.linalg.norm(rays, axis=-1)
    t = np.sqrt(np.maximum(elevation, 0))[..., None]
    assert elevation.min() < 0 < elevation.max()
    assert np.abs(frame.radiance - (low + (high - low) * t)).max() <= 1e-5


def test_an_orthographic_gradient_is_one_color(render):
    scene = orthographic_wall()
    scene.root.find("wall").detach_node()
    scene.background = VerticalGradient((0, 0, 0), (1, 1, 1))
    scene.camera.set_p(30)
    frame = render(scene, None, (8, 6), ("radiance",))
    assert frame.radiance == pytest.approx(np.sqrt(0.5), abs=1e-6)


def test_supersampling_averages_linear_radiance(render):
    scene = ball_scene(40, ambient=(0.02, 0.02, 0.02))
    large = render(scene, Settings(), (160, 120), ("radiance",)).radiance.astype(np.float64)
    average = large.reshape(60, 2, 80, 2, 3).mean(axis=(1, 3))
    frame = render(scene, Settings(supersample=2), (80, 60), ("color", "radiance"))
    assert np.abs(frame.radiance - average).max() <= 1e-6 * average.max()
    assert np.abs(frame.color - codes(average, Settings())).max() <= 0.5 + 1e-2


def test_one_pixel_and_odd_sizes_render(render):
    for size in ((1, 1), (1, 7), (13, 1)):
        frame = render(ball_scene(5), None, size, ("color", "depth"))
        assert frame.color.shape == (size[1], size[0], 3)
        assert frame.depth.shape == (size[1], size[0])


@pytest.mark.parametrize("exposure", [2.0, (2.0, 1.0, 0.5)])
def test_a_scenes_exposure_multiplies_the_settings_and_leaves_radiance_alone(render, exposure):
    scene = ball_scene(80, ambient=(0.01, 0.02, 0.03))
    plain = render(scene, None, (80, 60), ("radiance",)).radiance
    scene.exposure = exposure
    frame = render(scene, Settings(exposure=3.0), (80, 60), ("color", "radiance"))
    assert np.array_equal(frame.radiance, plain)
    exact = codes(plain.astype(np.float64) * exposure, Settings(exposure=3.0))
    assert np.abs(frame.color - exact).max() <= 0.5 + 1e-2
    classic = render(scene, Settings(look="classic"), (80, 60)).color
    scene.exposure = 1.0
    assert np.array_equal(render(scene, Settings(look="classic"), (80, 60)).color, classic)
    scene.exposure = (1.0, 0.0, 1.0)
    with pytest.raises(SceneError, match="exposure"):
        render(scene)
