"""Shadows of particles on the GPU against their float64 twin, and against exact sums."""

from functools import cache
from itertools import pairwise
from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as search
from hypothesis import strategies as st

from firefly_sample.errors import GpuError
from firefly_sample.lab.clouds import CLOUDS, from_above, shadow_errors, slices_of
from firefly_sample.lab.reference.particle_shadow import exact_taken, slice_sums, sliced_light
from firefly_sample.scene.lights import DirectionalLight, Spotlight
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.settings import Settings
from tests.clouds import ball_of, cloud_scene, light_on, puff, volume_of
from tests.conftest import make_renderer

FINE = {"normal_format": "rgba32f", "albedo_format": "rgba32f"}
METHODS = {
    "optical_depth": Settings(),
    "stepped": Settings(particle_shadow_interpolation=False),
    "few slices": Settings(particle_shadow_slices=10, particle_shadow_tile=64),
    "half floats": Settings(particle_shadow_format="float16"),
    "blend": Settings(particle_shadows="blend"),
    "blend, 8 bits": Settings(particle_shadows="blend", particle_shadow_format="unorm8"),
    "blend, stepped": Settings(particle_shadows="blend", particle_shadow_interpolation=False),
    "loop": Settings(particle_shadows="loop"),
    "loop of one": Settings(particle_shadows="loop", particle_shadow_reads=1),
    "loop of ten": Settings(particle_shadows="loop", particle_shadow_reads=10),
}


@pytest.fixture(scope="module")
def drawn():
    """``drawn(scene, settings, outputs, size)``: the plan, the slices that it drew, shape
    (slices, tile, tile, 3), None if they are not asked for, the light on each particle, and the frame."""
    with make_renderer() as renderer:

        def draw(scene, settings, outputs=("radiance", "particle_shadow_atlas"), size=(64, 48)):
            renderer.settings = settings
            renderer.resize(size)
            plan = renderer.plan(scene, 0.0, outputs)
            frame = renderer.draw(plan)
            lit = plan.target("particle_light") is not None
            light = light_on(renderer, plan) if lit else np.zeros((0, 3))
            slices = (
                slices_of(plan, frame["particle_shadow_atlas"])
                if "particle_shadow_atlas" in outputs
                else None
            )
            return plan, slices, light, frame

        yield draw


def shares(plan, light):
    """What of the only light the particles got, from their radiance."""
    (lights,) = plan.lights
    return (light / plan.particles.colors - plan.ambient) / lights.colors[0] / plan.particles.fades[:, None]


@pytest.mark.parametrize("name", METHODS)
def test_slices_and_lookups_are_those_of_the_twin(drawn, name):
    settings = METHODS[name]
    plan, slices, light, _ = drawn(cloud_scene(puff(2000)), settings)
    particle_shadow = plan.particle_shadow
    rounding = {"float16": 5e-4 * 64, "unorm8": 0.5 / 255 * 64}.get(settings.particle_shadow_format, 4e-6)
    most = 1.0 if settings.particle_shadow_format == "unorm8" else np.inf
    expected = np.minimum(slice_sums(particle_shadow), most)
    np.testing.assert_allclose(slices, expected, atol=rounding, rtol=0)
    found = sliced_light(
        particle_shadow, slices, particle_shadow.places[plan.particles.rows], plan.particles.rows
    )
    np.testing.assert_allclose(shares(plan, light), found, atol=4e-6)


@pytest.mark.parametrize(
    "shadow",
    [
        {"blur": 2.0},
        {"blur": 0.7},
        {"blur": 3.5, "kernel": "gaussian"},
        {"darkness": 2.5},
        {"tint": 0.7},
        {"tint": 1.0, "blur": 1.0},
        {"attenuation": "point"},
        {"attenuation": "plane", "power": 0.5},
        {"interpolate": False},
    ],
)
@pytest.mark.parametrize("kind", ["sun", "spot"])
def test_what_a_shadow_says_is_done_as_in_the_twin(drawn, shadow, kind):
    node = puff(800, colors=np.random.default_rng(3).uniform(0.1, 1.0, (800, 3)))
    lamp = None
    if kind == "spot":
        lamp = Spotlight("lamp", (3, 2, 1))
        lamp.set_cone(20, 40)
    plan, slices, light, _ = drawn(cloud_scene(node, lamp, **shadow), Settings(particle_shadow_slices=16))
    particle_shadow = plan.particle_shadow
    np.testing.assert_allclose(slices, slice_sums(particle_shadow), atol=4e-6, rtol=2e-6)
    found = sliced_light(
        particle_shadow, slices, particle_shadow.places[plan.particles.rows], plan.particles.rows
    )
    if kind == "sun":
        np.testing.assert_allclose(shares(plan, light), found, atol=1e-5)
    else:
        (lights,) = plan.lights
        unshadowed = light_of(plan, lights)
        expected = (plan.ambient + unshadowed * found * plan.particles.fades[:, None]) * plan.particles.colors
        np.testing.assert_allclose(light, expected, atol=2e-5)


def light_of(plan, lights):
    """What the first light of a set would bring to particles without any shadow, shape (n, 3)."""
    from firefly_sample.lab.reference.shade import OneLight

    one = OneLight(lights, 0)
    to_light, distance = one.directions(plan.particles.positions)
    return one.strength(to_light.T, distance, plan.settings)[:, None] * lights.colors[0]


def test_the_ground_gets_what_the_last_slice_lets_through():
    """At each pixel of the floor, and of a wall that stands in the cloud, as the twin has it."""
    from firefly_sample.scene.geom import Geom
    from firefly_sample.scene.material import Material
    from tests.scenes import geom_node

    scene = cloud_scene(puff(3000))
    corners = [(-2, 0.3, -1.3), (2, 0.3, -1.3), (2, 0.3, 1.0), (-2, 0.3, 1.0)]
    wall = geom_node("wall", Geom(corners, [(0, 1, 2), (0, 2, 3)]), Material("wall", (0.7, 0.7, 0.7, 1)))
    scene.root.attach_new_node(wall)
    with make_renderer((160, 120), Settings(**FINE)) as renderer:
        plan = renderer.plan(scene, 0.0, ("light", "position", "normal", "particle_shadow_atlas", "radiance"))
        frame = renderer.draw(plan)
        position = renderer.surface(plan).position()
    known = np.isfinite(position).all(axis=-1)
    to_world = plan.view.view_to_world
    places = plan.particle_shadow.view.place(position[known] @ to_world[:3, :3] + to_world[3, :3])
    left = sliced_light(plan.particle_shadow, slices_of(plan, frame["particle_shadow_atlas"]), places)
    (sun,) = plan.lights
    facing = np.maximum(frame["normal"][known] @ -sun.directions[0], 0.0)[:, None]
    expected = plan.ambient + facing * sun.colors[0] * left
    np.testing.assert_allclose(frame["light"][known], expected, atol=3e-4)
    floor = places[:, 2] >= plan.particle_shadow.view.slices
    inside = (places[:, 2] > 1) & ~floor
    assert floor.sum() > 1000
    assert inside.sum() > 1000
    assert left[floor].min() < 0.3
    assert np.ptp(left[inside]) > 0.3


def test_lights_that_are_not_named_shine_through():
    scene = cloud_scene(puff(2000, alpha=0.9))
    moon = DirectionalLight("moon", (0.2, 0.2, 0.4))
    moon.set_direction((0, 0, -1))
    scene.root.attach_new_node(moon)
    with make_renderer((64, 48)) as renderer:
        both = renderer.render(scene, outputs=("light",))["light"]
        scene.root.find("sun").hide()
        alone = renderer.render(scene, outputs=("light",))["light"]
    darkest = both.sum(axis=-1) - alone.sum(axis=-1)
    covered = alone.any(axis=-1)
    assert darkest[covered].min() < 1e-3  # none of the sun in the middle of the shadow
    assert np.median(darkest[covered]) > 3.0


@pytest.mark.parametrize("method", ["optical_depth", "blend", "loop"])
@pytest.mark.parametrize("name", CLOUDS)
def test_light_never_rises_with_depth(drawn, name, method):
    """Along ways through the cloud, in what the GPU has drawn; a loop over the nearest ten may."""
    settings = Settings(particle_shadows=method)
    node = CLOUDS[name](1500)
    plan, slices, _, _ = drawn(from_above(node), settings)
    depth = np.linspace(-1, 65, 400)
    for x, y in np.random.default_rng(0).uniform(20, 108, (12, 2)):
        places = np.column_stack([np.full(400, x), np.full(400, y), depth])
        left = sliced_light(plan.particle_shadow, slices, places)
        assert left[0].tolist() == [1.0] * 3
        assert (np.diff(left, axis=0) <= 1e-7).all()


def test_what_is_opaque_lets_nothing_through_and_stays_finite(drawn):
    node = ParticleNode("c", [(0, 0, 0.5), (0, 0, -0.5)], [0.5, 0.1], 1.0)
    node.set_bounding_sphere(1.2)
    plan, slices, light, frame = drawn(from_above(node), Settings())
    assert np.isfinite(slices).all()
    assert np.isfinite(frame["radiance"]).all()
    left = shares(plan, light)
    assert left[0] == pytest.approx(1.0, abs=1e-6)
    assert (np.abs(left[1]) < 1e-6).all()


@pytest.mark.parametrize("shadow", [{}, {"blur": 1.0}, {"blur": 2.5, "kernel": "gaussian"}, {"blur": 9.0}])
@pytest.mark.parametrize("radius", [0.005, 0.02, 0.05, 0.3])
def test_one_particle_does_not_shadow_itself(drawn, radius, shadow):
    """Wherever its middle lies between texels, opaque as it is."""
    rng = np.random.default_rng(0)
    for changes in ({}, {"particle_shadow_interpolation": False}, {"particle_shadows": "loop"}):
        settings = Settings(particle_shadow_slices=16, **changes)
        for place in rng.uniform(-0.3, 0.3, (3, 3)):
            node = ParticleNode("c", [place], radius, 1.0)
            node.set_bounding_sphere(1.0)
            scene = from_above(node)
            node.change_shadow(**shadow)
            plan, _, light, _ = drawn(scene, settings, ("radiance",))
            np.testing.assert_allclose(shares(plan, light), 1.0, atol=2e-5)


@pytest.mark.parametrize("slices", [8, 64])
def test_a_particle_in_the_middle_of_its_own_sphere_does_not_shadow_itself(drawn, slices):
    """It lies where two slices meet: rounding must not put it into one, to be looked up from the other."""
    settings = Settings(particle_shadow_slices=slices, particle_shadow_tile=32)
    for place in np.random.default_rng(1).normal(size=(40, 3)) * 0.4:
        scene = cloud_scene(ParticleNode("c", [place], 0.05 + abs(place[0]), 1.0))
        plan, _, light, _ = drawn(scene, settings, ("radiance",), (8, 6))
        np.testing.assert_allclose(shares(plan, light), 1.0, atol=2e-5)


def test_particles_in_one_slice_share_its_light(drawn):
    """In a sheet in a slice's middle nobody is before anybody: each keeps what half of the others leave."""
    middle = -0.5 / 32
    flat = np.column_stack([np.random.default_rng(0).uniform(-0.5, 0.5, (500, 2)), np.full(500, middle)])
    node = ParticleNode("c", flat, 0.1, 0.2)
    node.set_bounding_sphere(1.0)
    plan, slices, light, _ = drawn(from_above(node), Settings())
    assert np.unique(np.floor(plan.particle_shadow.places[:, 2])).size == 1
    below = plan.particle_shadow.places + np.array([0, 0, 1.0])
    whole = sliced_light(plan.particle_shadow, slices, below)
    np.testing.assert_allclose(shares(plan, light), np.sqrt(whole / (1 - 0.2)), rtol=0.02)
    assert whole.min() < 0.5


def test_what_leaves_the_sphere_neither_crosses_tiles_nor_turns_into_anything(drawn):
    """Discs at the rim, beside it, before and behind: tiles hold what the twin says, and all stays finite."""
    places = [(1.0, 0, 0), (1.4, 0, 0), (0, 0, 3.0), (0, 0, -3.0), (30, 0, 0), (0, 0, 0)]
    node = ParticleNode("c", places, 0.5, 0.5)
    node.set_bounding_sphere(1.0)
    plan, slices, light, frame = drawn(from_above(node), Settings())
    np.testing.assert_allclose(slices, slice_sums(plan.particle_shadow), atol=1e-6)
    assert np.isfinite(frame["radiance"]).all()
    left = shares(plan, light)
    assert (left <= 1.0 + 1e-6).all()
    middle = plan.particles.rows.tolist().index(5)
    assert left[middle, 0] == pytest.approx(0.5, abs=2e-3)  # by the one above it, in the first slice


def test_a_spotlight_from_any_side_agrees_with_the_twin(drawn):
    for place in ((3, 0, 0), (0, 0, -1.6), (-1, 4, 2)):
        lamp = Spotlight("lamp", (1, 1, 1))
        lamp.set_cone(60, 60)
        scene = cloud_scene(puff(500), lamp, ground=False)
        path = scene.root.find("lamp")
        path.set_pos(*place)
        path.look_at(0, 0, 0)
        plan, slices, _, _ = drawn(scene, Settings(particle_shadow_slices=16), ("particle_shadow_atlas",))
        np.testing.assert_allclose(slices, slice_sums(plan.particle_shadow), atol=4e-6, rtol=2e-6)


def test_a_texture_above_the_drivers_limit_is_an_error():
    scene = cloud_scene(puff(10))
    with make_renderer((8, 8), Settings(particle_shadow_slices=256, particle_shadow_tile=1024)) as renderer:
        plan = renderer.plan(scene)
        renderer._device.max_size = 8192
        with pytest.raises(GpuError, match="16384x16384 texels, above this driver's limit of 8192 a side"):
            renderer.draw(plan)


SMOOTH = [Settings(particle_shadow_slices=count) for count in (16, 32, 64, 128, 256)]
STEPPED = [settings.with_changes(particle_shadow_interpolation=False) for settings in SMOOTH]
BLEND = Settings(particle_shadows="blend")
BLEND_8_BITS = BLEND.with_changes(particle_shadow_format="unorm8")
ASKED = {
    "blob": [Settings(), *SMOOTH, *STEPPED],
    "sheets": [Settings()],
    "faint": [Settings(), BLEND, BLEND_8_BITS],
}


@pytest.fixture(scope="module")
def errors_of():
    """``errors_of(name)``: the largest and the rms error of the light in a cloud, by the settings `ASKED`."""
    with make_renderer((64, 48)) as renderer:

        @cache
        def errors(name):
            asked = list(dict.fromkeys(ASKED[name]))
            return dict(zip(asked, shadow_errors(renderer, CLOUDS[name](), asked), strict=True))

        yield errors


@pytest.mark.parametrize(
    ("name", "largest", "rms"),
    [("blob", 0.014, 0.0025), ("sheets", 0.36, 0.030), ("faint", 0.11, 0.0075)],
)
def test_sixty_four_slices_err_by_no_more_than_was_measured_before_design(errors_of, name, largest, rms):
    found = errors_of(name)[Settings()]
    assert found[0] <= largest
    assert found[1] <= rms


def test_adding_alphas_errs_by_more_the_more_there_are(errors_of):
    errors = errors_of("faint")
    assert errors[Settings()][1] < 0.1 * errors[BLEND][1]
    assert errors[BLEND_8_BITS][0] > 0.9  # alphas below half a code are nothing at all


def test_errors_fall_with_slices(errors_of):
    """In steps, by half for each doubling. Between slices, faster, until what is left is the order of
    particles within a slice, which nobody knows: the error of a random order falls by the root of 2."""
    errors = errors_of("blob")
    stepped, smooth = ([errors[settings][1] for settings in some] for some in (STEPPED, SMOOTH))
    assert all(after <= 0.6 * before for before, after in pairwise(stepped))
    assert all(after <= 0.75 * before for before, after in pairwise(smooth))
    assert all(fine < 0.6 * coarse for fine, coarse in zip(smooth, stepped, strict=True))


def test_a_cloud_without_grain_loses_three_quarters_of_its_error_with_each_doubling():
    """Slices hold exactly what a normal distribution takes, optical depth 2: interpolation alone errs."""
    depth = np.linspace(-1.0, 1.0, 4001)[1:-1]

    def taken(z):
        return 2.0 * np.array([NormalDist(0.0, 0.3).cdf(value) for value in z])

    rms = []
    for count in (16, 32, 64, 128, 256):
        particle_shadow = volume_of(
            from_above(puff(8)), Settings(particle_shadow_slices=count, particle_shadow_tile=16)
        )
        ends = taken(np.linspace(-1.0, 1.0, count + 1))
        slices = np.broadcast_to((ends[1:] - ends[0])[:, None, None, None], (count, 16, 16, 3))
        places = np.column_stack([np.full((len(depth), 2), 8.0), (depth + 1.0) * 0.5 * count])
        difference = sliced_light(particle_shadow, slices, places)[:, 0] - np.exp(-(taken(depth) - ends[0]))
        rms.append(np.sqrt((difference**2).mean()))
    assert all(after <= 0.27 * before for before, after in pairwise(rms))


@given(
    st.integers(0, 10**6),
    st.integers(1, 400),
    st.floats(0.001, 0.3),
    st.sampled_from([8, 30, 64]),
    st.sampled_from(["sun", "spot"]),
)
@search(max_examples=30)
def test_in_any_cloud_light_is_between_that_before_a_slice_and_behind_it(
    drawn, seed, count, alpha, slices, kind
):
    """That is all that slices lose: the order within one. And what is between texels: some hundredths."""
    rng = np.random.default_rng(seed)
    node = ParticleNode("c", ball_of(count, seed), rng.uniform(0.15, 0.4, count), alpha * rng.random(count))
    lamp = Spotlight("lamp") if kind == "spot" else None
    settings = Settings(particle_shadow_slices=slices)
    plan, atlas, _, _ = drawn(
        cloud_scene(node, lamp, ground=False), settings, ("particle_shadow_atlas",), (8, 6)
    )
    particle_shadow = plan.particle_shadow
    places = np.column_stack([rng.uniform(0, 128, (300, 2)), rng.uniform(0, slices, 300)])
    found = sliced_light(particle_shadow, atlas, places)
    ends = [
        np.exp(-exact_taken(particle_shadow, np.column_stack([places[:, :2], depth])))
        for depth in (np.floor(places[:, 2]), np.ceil(places[:, 2]))
    ]
    assert (found <= ends[0] + 0.03).all()
    assert (found >= ends[1] - 0.03).all()


def test_many_particles_are_drawn(drawn):
    """All of them, in one draw: their sum is known."""
    count = 300_000
    node = ParticleNode("c", 0.5 * ball_of(count), 0.05, 1e-4)
    plan, slices, _, _ = drawn(from_above(node), Settings(particle_shadow_tile=32, particle_shadow_slices=8))
    particle_shadow = plan.particle_shadow
    # a disc of (1 - r^2)^2 has the area pi R^2 / 3
    expected = (particle_shadow.strengths[:, 0] * particle_shadow.radii**2).sum() * np.pi / 3
    np.testing.assert_allclose(slices[-1, ..., 0].sum(), expected, rtol=2e-3)
