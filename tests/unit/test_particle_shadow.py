"""Where a cloud lies in the slices of its light, and what a plan has because of it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.errors import SceneError, SettingsError
from firefly_sample.pipeline import build_plan
from firefly_sample.plan.particles.cloud import gather_particles
from firefly_sample.plan.particles.shadow import GUARD, MOST_OPAQUE, blur_weights, optical_depths, slice_grid
from firefly_sample.plan.particles.visible import see_particles
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import DirectionalLight, Spotlight
from firefly_sample.scene.particles import ParticleNode, ParticleShadow
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.clouds import ball_of, cloud_scene, puff, volume_of
from tests.scenes import wall_scene

PARTICLE_PASSES = {"particle_shadow_slices", "particle_shadow_sums", "particle_light", "particles"}


def names(plan):
    return [step.name for step in plan.passes]


def test_slices_fill_a_grid():
    for slices in (8, 16, 32, 64, 128, 256):
        across, up = slice_grid(slices)
        assert across * up == slices
        assert up <= across <= 2 * up
    assert slice_grid(64) == (8, 8)
    for slices in range(8, 257):
        across, up = slice_grid(slices)
        assert slices <= across * up < slices + across
        assert across <= 4 * up


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_optical_depths_are_finite_and_grow_with_alpha(one, other):
    low, high = optical_depths(np.array(sorted((one, other))))
    assert 0.0 <= low <= high < 16.7
    assert math.isclose(-math.expm1(-low), min(one, other, MOST_OPAQUE), rel_tol=1e-12, abs_tol=1e-300)


@pytest.mark.parametrize("kernel", ["box", "gaussian"])
@pytest.mark.parametrize("blur", [0.0, 0.3, 1.0, 4.5, 32.0])
def test_blur_weights_are_even_and_sum_to_one(kernel, blur):
    weights = blur_weights(blur, kernel)
    assert len(weights) == 2 * math.ceil(blur) + 1
    np.testing.assert_allclose(weights.sum(), 1.0, rtol=1e-14)
    np.testing.assert_array_equal(weights, weights[::-1])
    assert (np.diff(weights[: len(weights) // 2 + 1]) >= 0).all()


def test_a_box_blur_of_whole_texels_has_equal_weights():
    np.testing.assert_allclose(blur_weights(2.0, "box"), [0.2] * 5)


@given(
    st.sampled_from(["sun", "spot"]),
    st.integers(0, 99),
    st.floats(0.01, 100.0),
    st.floats(0.0, 8.0),
    st.sampled_from([8, 30, 64, 256]),
    st.sampled_from([48, 128]),
)
def test_a_cloud_lies_within_the_guard_of_its_tile(kind, seed, size, blur, slices, tile):
    """Every disc, as wide as the blur makes it, whichever way the light looks."""
    rng = np.random.default_rng(seed)
    light = DirectionalLight("sun") if kind == "sun" else Spotlight("spot")
    scene = Scene()
    path = scene.root.attach_new_node(light)
    way = rng.normal(size=3)
    path.set_pos(*(way / np.linalg.norm(way) * size * rng.uniform(1.6, 9.0)))
    path.look_at(0, 0, 0)
    node = ParticleNode("c", size * ball_of(50, seed), size * rng.uniform(0.0, 0.3, 50), 0.5)
    node.set_shadow(ParticleShadow(light, blur=blur))
    scene.root.attach_new_node(node)
    scene.camera.set_pos(0, -3 * size, 0)
    particle_shadow = volume_of(scene, Settings(particle_shadow_slices=slices, particle_shadow_tile=tile))
    guard = GUARD + math.ceil(blur)
    for axis in (0, 1):
        assert (particle_shadow.positions[:, axis] - particle_shadow.radii >= guard - 1e-6).all()
        assert (particle_shadow.positions[:, axis] + particle_shadow.radii <= tile - guard + 1e-6).all()
    assert (particle_shadow.positions[:, 2] >= 0.0).all()
    assert (particle_shadow.positions[:, 2] <= slices).all()


def test_slices_begin_at_the_light():
    node = ParticleNode("c", [(0, 0, 0.9), (0, 0, 0), (0, 0, -0.9)], 0.1, 0.5)
    light = DirectionalLight("sun")
    light.set_direction((0, 0, -1))
    particle_shadow = volume_of(cloud_scene(node, light))
    np.testing.assert_allclose(particle_shadow.positions[:, 2], [64 * 0.05, 32.0, 64 * 0.95])
    np.testing.assert_allclose(particle_shadow.positions[:, :2], 64.0)
    np.testing.assert_allclose(particle_shadow.radii, 0.1 * 0.5 * (128 - 2 * GUARD))


def test_a_spotlight_sees_discs_by_their_distance():
    node = ParticleNode("c", [(0, 0, 0.5), (0.3, 0, -0.5)], 0.1, 0.5)
    light = Spotlight("lamp")
    scene = cloud_scene(node, light)
    path = scene.root.find("lamp")
    path.set_pos_hpr(0, 0, 4, 0, -90, 0)
    node.set_bounding_sphere(1.0)
    particle_shadow = volume_of(scene)
    np.testing.assert_allclose(particle_shadow.radii[0] / particle_shadow.radii[1], 4.5 / 3.5)
    middle, aside = particle_shadow.positions
    np.testing.assert_allclose(middle[:2], 64.0)
    np.testing.assert_allclose(np.linalg.norm(aside[:2] - 64.0) / particle_shadow.radii[1], 3.0)
    np.testing.assert_allclose(particle_shadow.positions[:, 2], [16.0, 48.0])


def test_a_given_sphere_stays_where_it_is():
    node = puff()
    node.set_bounding_sphere(2.0, (0.1, 0, 0))
    scene = cloud_scene(node)
    view = volume_of(scene).view
    assert view.per_unit == 64 / 4.0
    node.set_arrays(node.arrays.positions[:5], 0.1, 0.5, (1, 1, 1))
    again = volume_of(scene).view
    np.testing.assert_array_equal(again.world_to_slices, view.world_to_slices)
    assert again.per_unit == view.per_unit


def test_what_leaves_the_given_sphere_is_told():
    node = puff(radius=0.1)
    node.set_bounding_sphere(0.5)
    plan = build_plan(cloud_scene(node), Settings(), (64, 48))
    (warning,) = plan.warnings
    assert warning.startswith("particles 'puff': ")
    assert "leave the bounding sphere that was given" in warning
    radius = float(warning.split("bounding radius of ")[1].split(",")[0])
    node.set_bounding_sphere(radius)
    assert build_plan(cloud_scene(node), Settings(), (64, 48)).warnings == ()


def test_a_spotlight_within_the_cloud_is_an_error():
    node = puff()
    scene = cloud_scene(node, Spotlight("lamp"))
    scene.root.find("lamp").set_pos(0.5, 0, 0)
    with pytest.raises(SceneError, match="light 'lamp': the light is within the particles' bounding sphere"):
        build_plan(scene)


def test_a_blur_needs_room_in_its_tile():
    scene = cloud_scene(puff(), blur=30.0)
    build_plan(scene, Settings(particle_shadow_tile=128))
    with pytest.raises(
        SceneError, match=r"light 'sun': a blur of 30 leaves 0 texels .* particle_shadow_tile of 72"
    ):
        build_plan(scene, Settings(particle_shadow_tile=64))
    build_plan(scene, Settings(particle_shadow_tile=72))


def test_a_light_that_is_not_there_is_told_and_a_hidden_one_is_not():
    scene = cloud_scene(puff())
    path = scene.root.find("sun")
    path.hide()
    hidden = build_plan(scene)
    assert hidden.warnings == ()
    assert hidden.particle_shadow is None
    path.detach_node()
    away = build_plan(scene)
    assert away.particle_shadow is None
    assert [w for w in away.warnings if "light 'sun', which casts the shadows of particles" in w]


def test_several_lights_or_one_twice_are_errors():
    scene = cloud_scene(puff())
    other = DirectionalLight("moon")
    scene.root.attach_new_node(other)
    second = ParticleNode("steam", [(0, 0, 2)], 0.1, 0.5)
    second.set_shadow(ParticleShadow(other))
    scene.root.attach_new_node(second)
    with pytest.raises(
        SceneError, match=r"'puff' and 'steam' have different particle shadows.* the same light$"
    ):
        build_plan(scene)
    sun = scene.root.find("sun").node()
    second.set_shadow(ParticleShadow(sun, darkness=0.5, tint=0.25))  # these are each particle's own
    assert len(build_plan(scene).particle_shadow) == 401
    scene.root.attach_new_node("elsewhere").attach_new_node(sun)
    with pytest.raises(SceneError, match=r"light 'sun', .*, is 2 times in the scene"):
        build_plan(scene)


def test_clouds_in_one_light_shadow_each_other():
    scene = cloud_scene(ParticleNode("low", [(0, 0, 0)], 0.1, 0.5))
    high = ParticleNode("high", [(0.4, -0.1, 1)], 0.1, 0.5)
    high.set_shadow(scene.root.find("low").node().get_shadow())
    scene.root.attach_new_node(high)
    particle_shadow = build_plan(scene).particle_shadow
    np.testing.assert_allclose(particle_shadow.positions[0, :2], particle_shadow.positions[1, :2], atol=0.05)
    assert particle_shadow.positions[1, 2] < particle_shadow.positions[0, 2]


def test_what_a_particle_takes_is_its_alpha_by_darkness_and_tint():
    colors = [(1.0, 0.5, 0.0)]
    node = ParticleNode("c", [(0, 0, 0)], 0.1, 0.5, colors)
    particle_shadow = volume_of(cloud_scene(node, darkness=2.0))
    np.testing.assert_allclose(particle_shadow.strengths, [[2 * math.log(2.0)] * 3])
    assert not particle_shadow.tinted
    particle_shadow = volume_of(cloud_scene(node, tint=1.0))
    np.testing.assert_allclose(particle_shadow.strengths, [[0.0, -math.log(0.75), math.log(2.0)]], atol=1e-15)
    assert particle_shadow.tinted
    particle_shadow = volume_of(cloud_scene(node, darkness=3.0), Settings(particle_shadows="blend"))
    np.testing.assert_allclose(particle_shadow.strengths, [[1.5] * 3])


def test_attenuation_is_by_distance_from_the_light_or_its_plane():
    node = ParticleNode("c", [(0, 0, 0), (3, 0, 0), (0, 0, 1.5)], 0.1, 0.5)
    scene = cloud_scene(node, attenuation="point")
    path = scene.root.find("sun")
    path.node().set_direction((0, 0, -1))
    path.set_pos(0, 0, 4 - 2)
    scene.camera.set_pos(0, -20, 0)
    scene.camera.look_at(0, 0, 0)
    fades = lambda: build_plan(scene).particles.attenuations  # noqa: E731
    np.testing.assert_allclose(fades(), [1 / 4, 1 / 13, 1.0])
    node.change_shadow(attenuation="plane", power=3.0)
    np.testing.assert_allclose(fades(), [1 / 8, 1 / 8, 1.0])
    node.change_shadow(attenuation="none")
    np.testing.assert_allclose(fades(), 1.0)


def test_one_node_may_do_without_shadows_that_another_has():
    scene = cloud_scene(puff())
    other = ParticleNode("steam", [(0, 0, 2)], 0.1, 0.5)
    other.set_shadow(replace(scene.root.find("puff").node().get_shadow(), enabled=False, show_texture=True))
    scene.root.attach_new_node(other)
    plan = build_plan(scene)
    assert len(plan.particle_shadow) == 400
    assert plan.particle_shadow.show
    assert (plan.particle_shadow.rows[400:] == -1).all()
    other.change_shadow(kernel="gaussian", power=3.0)
    with pytest.raises(SceneError, match=r"give them the same kernel, power$"):
        build_plan(scene)


def test_only_what_leaves_the_sphere_of_all_is_told():
    scene = cloud_scene(puff())  # around it a sphere of about 1.1
    for place in ((0.5, 0, 0), (9, 0, 0), (0, 9, 0)):
        node = ParticleNode("stray", [place], 0.2, 0.5)
        node.set_shadow(scene.root.find("puff").node().get_shadow())
        node.set_bounding_sphere(0.1)  # too small, but the other's holds the first one
        scene.root.attach_new_node(node)
    warnings = build_plan(scene).warnings
    assert len(warnings) == 2
    assert all("'stray': 1 of them" in warning for warning in warnings)


def test_particles_are_drawn_from_back_to_front_among_dots():
    node = ParticleNode("c", [(0, 0, 0), (0, 2, 0), (0, 1, 0)], 0.1, 0.5)
    scene = cloud_scene(node, ground=False)
    scene.root.attach_new_node(Sprites("dots", [(0, 1.5, 0), (0, -1, 0)], (1, 1, 1), 0.1))
    plan = build_plan(scene)
    assert plan.particles.order.tolist() == [1, 3, 2, 0, 4]
    assert build_plan(scene, Settings(particle_order="unsorted")).particles.order.tolist() == [0, 1, 2, 3, 4]


def test_the_half_angle_axis_is_between_the_view_and_the_light():
    node = ParticleNode("c", [(0, 0, 0), (0, 0.5, 1.0)], 0.1, 0.5)
    light = DirectionalLight("sun")
    light.set_direction((0, 0, -1))
    scene = cloud_scene(node, light)
    scene.camera.set_pos_hpr(0, -5, 0, 0, 0, 0)
    order = lambda which: build_plan(scene, Settings(particle_order=which)).particles.order.tolist()  # noqa: E731
    assert order("view") == [1, 0]
    assert order("half_angle") == [0, 1]  # along (0, 1, -1), the higher one is before
    light.set_direction((0, -0.01, -1))  # towards the eye: away from it along the axis
    assert order("half_angle") == [1, 0]


@given(st.integers(0, 1000), st.sampled_from([2, 16, 4096, 65536, None]))
def test_slices_of_the_view_are_in_order(seed, slices):
    scene = cloud_scene(ParticleNode("c", ball_of(300, seed), 0.1, 0.5))
    plan = build_plan(scene, Settings(particle_order_depths=slices))
    depth = plan.particles.positions[plan.particles.order, 1]
    assert sorted(plan.particles.order.tolist()) == list(range(300))
    thickness = np.ptp(depth) / slices if slices else 2.0**-23 * depth.max()
    assert (np.diff(depth) <= thickness * (1 + 1e-9)).all()


def test_what_is_far_away_leaves_the_order_of_what_is_near():
    scene = cloud_scene(ParticleNode("c", ball_of(300), 0.1, 0.5))
    scene.camera.node().lens = PerspectiveLens(vfov=45, near=0.1, far=1e13)
    order = build_plan(scene).particles.order
    scene.root.attach_new_node(Sprites("star", [(0, 1e12, 0)], (1, 1, 1), 1e9))
    np.testing.assert_array_equal(build_plan(scene).particles.order, [300, *order])
    few = build_plan(scene, Settings(particle_order_depths=64)).particles.order
    assert few[0] == 300
    assert (few[1:100] != order[:99]).any()  # 64 slices of the particles alone


@given(st.floats(-50.0, 50.0), st.floats(0.01, 20.0))
def test_a_ball_counts_as_far_as_it_is_between_the_planes(y, radius):
    scene = cloud_scene(ParticleNode("c", [(0, y, 0)], radius, 0.5), ground=False)
    scene.camera.set_pos_hpr(0, 0, 0, 0, 0, 0)
    scene.camera.node().lens = PerspectiveLens(vfov=45, near=2.0, far=30.0)
    seen = build_plan(scene).particles
    expected = np.clip(0.5 + 0.5 * (y - 2.0) / radius, 0, 1) * np.clip(0.5 + 0.5 * (30.0 - y) / radius, 0, 1)
    found = seen.optical_depths.sum() / math.log(2.0)
    assert found == pytest.approx(expected, abs=1e-12)
    if len(seen):
        assert 2.0 < seen.drawn[0, 1] < 30.0
        assert seen.drawn[0, 1] == pytest.approx(np.clip(y, 2.0, 30.0), abs=1e-3)


def test_a_scene_without_particles_has_nothing_of_them():
    plan = build_plan(wall_scene())
    assert not PARTICLE_PASSES & set(names(plan))
    assert plan.particle_shadow is None
    assert len(plan.particles) == 0
    assert not [t.name for t in plan.targets if t.name.startswith(("particle_shadow", "particle"))]
    assert not getattr(plan.passes[-1].variant, "particles", False)
    invisible = wall_scene()
    for node in (
        ParticleNode("none"),
        ParticleNode("clear", [(0, 5, 0)], 1.0, 0.0),
        ParticleNode("p", [(0, 5, 0)], 0.0),
    ):
        invisible.root.attach_new_node(node)
    assert names(build_plan(invisible)) == names(plan)


def test_a_plan_has_what_its_particles_need():
    scene = cloud_scene(puff())
    plan = build_plan(scene)
    assert set(names(plan)) >= PARTICLE_PASSES
    assert "particle_shadow_blur_x" not in names(plan)
    assert plan.target("particle_shadow_scratch") is None
    assert plan.target_size("particle_shadow_atlas") == (1024, 1024)
    assert plan.target("particle_shadow_atlas").format == "r32f"
    blurred = build_plan(cloud_scene(puff(), blur=2.0, tint=0.5))
    assert names(blurred)[:4] == [
        "particle_shadow_slices",
        "particle_shadow_sums",
        "particle_shadow_blur_x",
        "particle_shadow_blur_y",
    ]
    assert blurred.target("particle_shadow_atlas").format == "rgba32f"
    loop = build_plan(scene, Settings(particle_shadows="loop"))
    assert "particle_shadow_sums" not in names(loop)
    assert "particle_shadow_slices" in names(loop)
    none = build_plan(scene, Settings(particle_shadows="none"))
    assert {"particle_light", "particles"} <= set(names(none))
    assert not {"particle_shadow_slices", "particle_shadow_sums"} & set(names(none))
    scene.root.find("puff").node().change_shadow(enabled=False)
    assert names(build_plan(scene)) == names(none)


def test_a_cloud_out_of_view_still_casts_its_shadow():
    scene = cloud_scene(puff())
    scene.camera.set_pos_hpr(0, -1.2, -1.2, 0, -80, 0)
    plan = build_plan(scene)
    assert len(plan.particles) == 0
    assert len(plan.particle_shadow) == 400
    assert "particle_shadow_slices" in names(plan)
    assert "particles" not in names(plan)


def test_only_the_light_that_particles_name_is_dimmed():
    scene = cloud_scene(puff())
    scene.root.attach_new_node(DirectionalLight("moon", (0.1, 0.1, 0.2)))
    plan = build_plan(scene)
    assert sorted((len(lights), lights.particle_shadowed) for lights in plan.lights) == [
        (1, False),
        (1, True),
    ]


def test_the_classic_look_leaves_particles_out_and_says_so():
    plan = build_plan(cloud_scene(puff()), Settings(look="classic"))
    assert not PARTICLE_PASSES & set(names(plan))
    assert "particles" in plan.warnings[-1]


def test_settings_that_contradict_are_refused():
    with pytest.raises(
        SettingsError, match=r"'particle_shadow_format' must be one of float32, float16 with .*optical_depth"
    ):
        Settings(particle_shadow_format="unorm8")
    with pytest.raises(SettingsError, match="'particle_shadow_reads' must be absent with particle_shadows="):
        Settings(particle_shadow_reads=10)
    with pytest.raises(SettingsError, match="'particle_shadow_slices' must be a whole number of 8 to 256"):
        Settings(particle_shadow_slices=4)


def test_nothing_is_gathered_twice_or_lost():
    scene = cloud_scene(puff(count=1000))
    cloud = gather_particles(_snapshot(scene), 0.0)
    lens = OrthographicLens(film_size=(9, 9), near=-9.0, far=9.0)
    seen = see_particles(cloud, np.eye(4), lens, np.zeros((0, 3)), Settings(), None)
    assert len(cloud) == len(seen) == 1000
    assert (seen.rows == -1).all()


def _snapshot(scene):
    from firefly_sample.plan.collect import collect

    return collect(scene.root, scene.camera_node.camera_mask)
