"""Numerical extremes: far from the origin, near and far planes, huge and tiny lights, thin and wide cones.

What these hold, the docs promise: docs/lighting.md lists the bounds.
"""

import numpy as np
import pytest

from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene, VerticalGradient
from firefly_sample.scene.spotlight import Spotlight
from firefly_sample.settings import Settings
from tests.lit_scenes import lit_scene
from tests.reference import BOUNDS, compare
from tests.scenes import geom_node, wall, wall_scene


def both_ways(render, scene, settings, size=(96, 72)):
    """The radiance by volumes and by full-screen passes."""
    volumes = render(scene, settings, size, ("radiance",)).radiance
    everywhere = render(scene, settings.with_changes(lights="fullscreen"), size, ("radiance",)).radiance
    return volumes, everywhere


# --- Far from the origin ---


def rounded(scene):
    """Put every node of the top level on a grid of 2^-16, so that any offset up to 2^36 is exact."""
    for child in scene.root.get_children():
        child.set_pos(*np.round(np.array(child.get_pos()) * 2**16) / 2**16)
        node = child.node()
        if isinstance(node, PointLights):
            arrays = node.arrays
            node.set_arrays(np.round(arrays.positions * 2**16) / 2**16, arrays.colors, arrays.radii)
    return scene


@pytest.mark.parametrize("power", [20, 30])
def test_a_scene_and_its_camera_moved_together_look_the_same(render, power):
    """By a million and by a billion units: within 1e-4 of the picture's largest value, no pixel excepted."""
    near = render(rounded(lit_scene(material="everything")), None, (160, 120), ("radiance",)).radiance
    scene = rounded(lit_scene(material="everything"))
    for child in scene.root.get_children():
        child.set_pos(*(np.array(child.get_pos()) + 2.0**power * np.array([1, 1, -1])))
    far = render(scene, None, (160, 120), ("radiance",)).radiance
    assert np.abs(far - near).max() <= 1e-4 * near.max()


# --- Volumes, wherever they lie ---


def plane_and_light(kind, place, reach):
    scene = wall_scene(cells=8, near=1.0, far=100.0)
    scene.root.find("wall").set_p(-80)  # faces the eye and the sky
    if kind == "point":
        light = PointLight("l", radius=reach)
    else:
        light = Spotlight("l", radius=reach)
        light.set_cone(*{"narrow": (8, 12), "wide": (30, 50), "wider": (60, 85)}[kind])
    path = scene.root.attach_new_node(light)
    path.set_pos(*place)
    path.look_at(0, 12, -1)
    return scene


@pytest.mark.parametrize(
    ("place", "reach"),
    [
        ((0, 0.5, 0.5), 30.0),
        ((0, -3, 2), 30.0),
        ((0, 99, 40), 120.0),
        ((0, 9, 2), 1e3),
        ((0, 9, 2), 1e20),
        ((0, 9, 2), 1e300),
        ((30, 9, 5), 60.0),
    ],
    ids=[
        "camera inside",
        "behind the camera",
        "across the far plane",
        "holds the view",
        "1e20",
        "1e300",
        "beside",
    ],
)
@pytest.mark.parametrize("kind", ["point", "narrow", "wide", "wider"])
@pytest.mark.parametrize("position", BOUNDS)
def test_no_pixel_is_missed_however_a_volume_lies(render, kind, place, reach, position):
    volumes, everywhere = both_ways(render, plane_and_light(kind, place, reach), Settings(position=position))
    assert volumes.max() > 0
    assert np.array_equal(volumes, everywhere)


@pytest.mark.parametrize("ratio", [1e3, 1e6, 1e9])
@pytest.mark.parametrize("kind", ["point", "spot"])
@pytest.mark.parametrize("position", BOUNDS)
def test_a_small_far_light_misses_no_pixel(render, kind, ratio, position):
    """Reach 1 at y/near up to 1e9, where depth buffers have few codes left or none."""
    y = 1000.0
    scene = Scene()
    scene.camera.node().lens = PerspectiveLens(fov=0.15, near=y / ratio, far=3 * y)
    scene.root.attach_new_node(geom_node("wall", wall(60.0, 8))).set_pos_hpr(0, y, 0, 0, -20, 0)
    light = PointLight("l", radius=1.0) if kind == "point" else Spotlight("l", radius=1.0)
    path = scene.root.attach_new_node(light)
    path.set_pos(0, y - (0.3 if kind == "spot" else 0), 0.1)
    volumes, everywhere = both_ways(render, scene, Settings(position=position))
    assert np.array_equal(volumes, everywhere)
    if position != "depth24":  # its positions are noise here: what is lit is, too
        assert (volumes > 0).any(axis=2).mean() > 0.001


@pytest.mark.parametrize("reach", [1e20, 1e36, 1e38, np.inf])
@pytest.mark.parametrize("kind", ["point", "spot"])
def test_endless_reach_is_a_full_screen_and_a_number(render, kind, reach):
    scene = wall_scene(cells=4, material=Material("m", specular=(0.5, 0.5, 0.5), shininess=20))
    light = PointLight("l") if kind == "point" else Spotlight("l")
    light.set_max_distance(reach)
    scene.root.attach_new_node(light).set_pos(1, 3, 1)
    volumes, everywhere = both_ways(render, scene, Settings())
    assert np.isfinite(volumes).all()
    assert volumes.max() > 0.1
    assert np.array_equal(volumes, everywhere)


@pytest.mark.parametrize("size", [(65, 49), (64, 48)])
@pytest.mark.parametrize("kind", ["point", "spot"])
def test_a_light_smaller_than_a_pixel_is_sampled_like_anything(render, kind, size):
    """Lights of every size below a pixel: what float64 finds at the pixels' centres, and nothing else."""
    for reach in (0.02, 0.1, 0.3):
        scene = wall_scene(cells=4)
        light = PointLight("l", radius=reach) if kind == "point" else Spotlight("l", radius=reach)
        scene.root.attach_new_node(light).set_pos(0.003, 10 - 0.4 * reach, 0.002)
        volumes, everywhere = both_ways(render, scene, Settings(), size)
        assert np.array_equal(volumes, everywhere)
        compared = compare(scene, Settings(), size)
        assert np.array_equal(compared.frame.light > 0, compared.expected_light > 0)


# --- Light on the surface ---


@pytest.mark.parametrize("gap", [0.0, 1e-25, 1e-12, 1e-6])
@pytest.mark.parametrize("attenuation", [None, (1, 0, 1), (0, 0, 1), (0, 1, 0)])
@pytest.mark.parametrize("kind", ["point", "spot"])
def test_a_light_on_the_surface_is_finite(render, kind, attenuation, gap):
    material = Material("m", specular=(1, 1, 1), shininess=1e4)
    scene = wall_scene(material=material)
    light = PointLight("l", radius=2.0) if kind == "point" else Spotlight("l", radius=2.0)
    if attenuation is not None:
        light.set_attenuation(attenuation)
    scene.root.attach_new_node(light).set_pos(0, 10 - gap, 0)
    for settings in (Settings(), Settings(specular="blinn_phong"), Settings(lights="loop")):
        frame = render(scene, settings, (65, 49), ("radiance", "light"))
        assert np.isfinite(frame.radiance).all()
        assert np.isfinite(frame.light).all()


@pytest.mark.parametrize("color", [0.0, 1e-30, 1e30])
def test_black_and_blinding_lights(render, color):
    scene = wall_scene(cells=4, color=(1, 1, 1, 1))
    light = PointLight("l", (color,) * 3)
    light.set_attenuation((1, 0, 1))
    scene.root.attach_new_node(light).set_pos(0, 5, 0)
    frame = render(scene, None, (17, 13), ("radiance", "color"))
    assert np.isfinite(frame.radiance).all()
    if color == 1e30:
        assert frame.radiance[6, 8] == pytest.approx([1e30 / 26] * 3, rel=1e-4)
        assert (frame.color == 255).all()


# --- Cones ---


@pytest.mark.parametrize(
    ("half", "bound"),
    [
        (89.9, 1e-5),
        (60, 1e-5),
        (53, 1e-5),
        (52.9, 1e-5),
        (1, 1e-4),
        (0.1, 1e-3),
        (0.01, 1e-2),
        (120, 1e-5),
        (180, 1e-5),
    ],
)
@pytest.mark.parametrize("soft", [0.0, 0.7])
def test_cones_from_a_hundredth_of_a_degree_to_the_whole_sphere(render, half, bound, soft):
    """Against float64, through a lens that is as narrow as the cone; and no pixel missed."""
    scene = Scene()
    fov = min(4 * half, 80.0)
    scene.camera.node().lens = PerspectiveLens(fov=fov, near=0.5, far=100)
    scene.root.attach_new_node(geom_node("wall", wall(60.0, 8))).set_pos_hpr(0, 10, 0, 20, -15, 0)
    light = Spotlight("l")
    light.set_cone(soft * half if soft else half, half)
    path = scene.root.attach_new_node(light)
    path.set_pos(0.3 * np.tan(np.radians(fov / 2)), 4, 0)
    path.look_at(0, 10, 0)
    compared = compare(scene, Settings())
    assert compared.error("light") <= bound
    assert (compared.expected_light > 0).mean() > 0
    volumes, everywhere = both_ways(render, scene, Settings(), (160, 120))
    assert np.array_equal(volumes, everywhere)


# --- What was never drawn ---


@pytest.mark.parametrize("far", [100.0, np.inf])
@pytest.mark.parametrize("lights", ["volumes", "fullscreen", "loop"])
@pytest.mark.parametrize("position", BOUNDS)
def test_the_background_is_exactly_the_background(render, position, lights, far):
    """Whatever passes over it: every kind of light, with highlights, shadows and no end; no NaN anywhere."""
    scene = lit_scene(material="everything")
    scene.root.find("**/floor").set_scale(0.2)
    for path in scene.root.find_all_matches("**/sun"):
        path.node().set_shadow_caster(True, 64)
    endless = PointLight("shadowed")
    endless.set_shadow_caster(True, 64)
    endless.set_attenuation((0, 0, 1))
    scene.root.attach_new_node(endless).set_pos(0, 6, 3)
    scene.background = (0.125, 0.25, 2.0)
    scene.camera.node().lens = PerspectiveLens(fov=50, near=0.5, far=far)
    frame = render(scene, Settings(position=position, lights=lights), (96, 72), ("radiance", "light", "id"))
    empty = frame.id == -1
    assert 0.2 < empty.mean() < 0.9
    assert (frame.radiance[empty] == (0.125, 0.25, 2.0)).all()
    assert (frame.light[empty] == 0).all()
    assert np.isfinite(frame.radiance).all()


def test_a_scene_of_lights_alone_is_its_background(render):
    scene = Scene(background=VerticalGradient((0.5, 0.25, 0.125), (0.5, 0.25, 0.125)))
    for light in (PointLight("p"), Spotlight("s"), DirectionalLight("d"), AmbientLight("a")):
        scene.root.attach_new_node(light)
    frame = render(scene, None, (8, 6), ("radiance", "light", "overdraw", "volumes", "shadow_atlas"))
    assert (frame.radiance == (0.5, 0.25, 0.125)).all()
    assert not frame.light.any()
    assert not frame.overdraw.any()
    assert not frame.volumes.any()
    assert frame.shadow_atlas.shape == (0, 0)


# --- Numbers of lights ---


def test_the_order_of_many_lights_hardly_matters(render):
    """Two thousand overlapping lights in two orders: float32 sums within 2e-8 N + 1e-6."""
    count = 2000
    rng = np.random.default_rng(3)
    places, colors = rng.uniform((-4, 6, -3), (4, 10, 3), (count, 3)), rng.uniform(0, 0.01, (count, 3))

    def picture(order):
        scene = wall_scene(cells=4)
        scene.root.attach_new_node(PointLights("l", places[order], colors[order], 6.0))
        return render(scene, None, (48, 36), ("radiance",)).radiance.astype(np.float64)

    one, other = picture(np.arange(count)), picture(rng.permutation(count))
    assert np.abs(one - other).max() <= (2e-8 * count + 1e-6) * one.max()
