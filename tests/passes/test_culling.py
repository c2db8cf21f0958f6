"""Every way to find the pixels that lights reach gives the same picture, on the real driver."""

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from firefly_sample.pipeline import build_plan
from firefly_sample.plan.cluster_lookup import list_lengths
from firefly_sample.plan.lights import lighting
from firefly_sample.plan.report import plan_as_dict
from firefly_sample.scene.falloff import Falloff
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import CHOICES, Settings
from tests.conftest import make_renderer
from tests.lit_scenes import lit_scene
from tests.scenes import ball, ball_scene, geom_node, wall_scene

METHODS = ("clustered", "fullscreen", "loop")
SIZE = (96, 72)


@pytest.fixture(scope="module")
def renderer():
    with make_renderer(SIZE) as made:
        yield made


def pictures(renderer, scene, time=0.0, **changes):
    """The radiance by each method, volumes first."""
    found = []
    for method in ("volumes", *METHODS):
        renderer.settings = Settings(light_method=method, **changes)
        frame = renderer.render(scene, time, ("radiance",))
        assert frame.lights.dropped == 0
        found.append(frame["radiance"].astype(np.float64))
    return found


def assert_same(found):
    # in a picture that is nearly all dark that percentile is 0: lit pixels may be off by as much of their own
    bound = 5e-6 * np.maximum(np.percentile(found[0], 99.9), found[0])
    for name, other in zip(METHODS, found[1:], strict=True):
        over = np.abs(found[0] - other) - bound
        where = np.unravel_index(over.argmax(), other.shape)
        assert over[where] <= 0.0, (name, where, found[0][where], other[where])


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("forest", {"fireflies": 60}),
        ("forest", {"fireflies": 40, "mist": True}),
        ("lightbulbs", {"columns": 6, "rows": 6, "sun": True}),
        ("smoke", {}),
    ],
    ids=str,
)
def test_all_methods_agree_on_every_scene(name, parameters):
    scene = build_scene(find_scene(name), **parameters)
    with make_renderer((160, 120)) as renderer:
        assert_same(pictures(renderer, scene, 5.0))


def random_scene(seed, lens):
    """Balls on a floor among lights of all kinds: inside and outside the view, across its planes."""
    rng = np.random.default_rng(seed)
    scene = ball_scene(40, seed % 1000, radius=float(rng.uniform(0.5, 6.0)))
    scene.camera.node().lens = lens
    scene.camera.set_pos(*rng.uniform((-3, -6, 0), (3, 6, 5)))
    scene.camera.set_hpr(*rng.uniform((-40, -40, -20), (40, 20, 20)))
    for index in range(6):
        spot = Spotlight(f"spot {index}", rng.uniform(0.2, 1.0, 3))
        spot.get_lens().set_fov(float(rng.choice([1.0, 20.0, 70.0, 150.0])))
        spot.set_attenuation(tuple(rng.uniform(0.1, 1.0, 3)))
        spot.set_max_distance(float(rng.choice([2.0, 8.0, 40.0])))
        path = scene.root.attach_new_node(spot)
        path.set_pos(*rng.uniform((-6, -2, 0), (6, 16, 5)))
        path.look_at(*rng.uniform((-3, 6, -1), (3, 14, 1)))
    lamp = PointLight("endless", rng.uniform(0.1, 0.5, 3))
    lamp.set_attenuation((1.0, 0.1, 0.0))
    scene.root.attach_new_node(lamp).set_pos(*rng.uniform((-3, 0, 1), (3, 12, 4)))
    scene.root.attach_new_node(DirectionalLight("sun", (0.1, 0.1, 0.05))).set_hpr(20, -50, 0)
    return scene


LENSES = st.one_of(
    st.builds(
        lambda fov, near, far: PerspectiveLens(vfov=fov, near=near, far=far),
        st.sampled_from([15.0, 60.0, 130.0]),
        st.sampled_from([1e-2, 1.0, 4.0]),
        st.sampled_from([12.0, 100.0, np.inf]),
    ),
    st.builds(
        lambda width, near: OrthographicLens(film_height=width, near=near, far=40.0),
        st.sampled_from([6.0, 24.0]),
        st.sampled_from([-5.0, 1.0]),
    ),
)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(LENSES, st.integers(0, 2**32 - 1))
# a steep surface comes out beyond the far plane
@example(PerspectiveLens(vfov=130.0, near=0.01, far=12.0), 72678)
def test_all_methods_agree_on_generated_scenes(renderer, lens, seed):
    assert_same(pictures(renderer, random_scene(seed, lens)))


@pytest.mark.parametrize(
    "changes",
    [
        {"light_resolution": "half"},
        {"position_method": "depth32f"},
        {"position_method": "stored32f"},
        {"specular_model": "blinn_phong"},
        {"clamp_light": True},
        {"supersample": 2},
        {"interpolation": "float64", "normal_format": "rgba32f", "albedo_format": "rgba32f"},
    ],
    ids=str,
)
def test_all_methods_agree_under_every_setting(renderer, changes):
    assert_same(pictures(renderer, lit_scene(material="everything"), **changes))


def shadowed_scene(shadows):
    scene = ball_scene(10)
    for index, node in enumerate((PointLight("lamp", (1, 1, 1)), Spotlight("spot", (1, 0.8, 0.6)))):
        node.set_attenuation((1.0, 0.0, 0.02))
        node.set_max_distance(12.0)
        if isinstance(node, Spotlight):
            node.get_lens().set_fov(60.0)
        if shadows:
            node.set_shadow_caster(True, 128)
        path = scene.root.attach_new_node(node)
        path.set_pos(3.0 * index - 1.0, 7, 4)
        path.look_at(0, 10, 0)
    return scene


@pytest.mark.parametrize("taps", [1, 4, 16])
def test_lights_with_shadows_take_part(renderer, taps):
    found = pictures(renderer, shadowed_scene(True), shadow_taps=taps)
    assert_same(found)
    assert np.abs(pictures(renderer, shadowed_scene(False))[1] - found[1]).max() > 0.01


@pytest.mark.parametrize("count", [1, 64, 128, 256, 1000, 10_000])
def test_a_pile_of_lights_is_one_light_to_2e6_however_many(renderer, count):
    """max_distance is fixed: the same reach for each, so that nothing is cut off that one light has."""

    def drawn(many):
        scene = wall_scene()
        spot = np.tile([0.3, 8, 0.2], (many, 1))
        lights = PointLights("many", spot, np.array([1, 0.8, 0.6]) / many, 6.0, attenuation=(1.0, 0.2, 0.3))
        scene.root.attach_new_node(lights)
        renderer.settings = Settings(light_method="clustered", cutoff_budget=0.0)
        frame = renderer.render(scene, 0.0, ("radiance",))
        assert (frame.lights.in_view, frame.lights.dropped) == (many, 0)
        return frame["radiance"].astype(np.float64)

    one, pile = drawn(1), drawn(count)
    lit = one > 0
    assert lit.any()
    assert np.array_equal(lit, pile > 0)
    assert (np.abs(pile - one)[lit] / one[lit]).max() <= 2e-6


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(LENSES, st.integers(0, 2**32 - 1))
def test_a_pixels_list_is_its_twins(renderer, lens, seed):
    """What the driver finds in a cell, by its own logarithm, is what NumPy finds by the edges."""
    renderer.settings = Settings(light_method="clustered")
    plan = renderer.plan(random_scene(seed, lens), 0.0, ("overdraw", "depth"))
    frame = renderer.draw(plan)
    if not plan.batches:
        return
    distance = renderer.surface(plan).distance()
    row, column = np.mgrid[: SIZE[1], : SIZE[0]]
    expected = sum(list_lengths(cells, column, SIZE[1] - 1 - row, distance) for cells in plan.clusters)
    suns = sum(len(lights) for lights in plan.lights if lights.kind == "directional")
    drawn = np.isfinite(distance)  # in perspective nothing else is walked; orthographic, 0 is a distance too
    assert np.array_equal(frame["overdraw"][drawn], (expected + suns)[drawn])


def test_the_background_costs_nothing():
    """Where nothing is drawn no light is walked, whatever reaches there."""
    scene = ball_scene(60)
    with make_renderer((160, 120), Settings(light_method="clustered")) as renderer:
        frame = renderer.render(scene, 0.0, ("overdraw", "depth"))
    drawn = np.isfinite(frame["depth"])
    assert drawn.any()
    assert not drawn.all()
    assert frame["overdraw"][drawn].max() > 0
    assert not frame["overdraw"][~drawn].any()


def test_the_forests_cells_shade_few_pairs_in_vain():
    """Per lit pair at most 1.6; volumes with a depth test shade more than twice as many."""
    from firefly_sample.lab.reference.shade import count_pairs

    scene = build_scene(find_scene("forest"))
    with make_renderer((800, 600), count_fragments=True) as renderer:
        plan = renderer.plan(scene, 5.0, ("color", "position", "overdraw"))
        assert plan.culling.method == "clustered"
        frame = renderer.draw(plan)
        pairs = count_pairs(renderer.surface(plan).position(), plan.lights)
        assert frame.shaded == frame["overdraw"].sum(dtype=np.float64)
        assert pairs < frame.shaded <= 1.6 * pairs
        renderer.settings = Settings(light_method="volumes")
        assert renderer.render(scene, 5.0).shaded > 2 * frame.shaded


@pytest.mark.parametrize(("near", "far", "y"), [(1.0, 100.0, 10.003), (0.1, 1e4, 100.3)])
@pytest.mark.parametrize("position", CHOICES["position_method"])
def test_a_surface_that_is_decoded_elsewhere_is_lit_there(renderer, position, near, far, y):
    """The nearest point of a ball, by depths that put it up to a hundredth of its distance before itself."""
    scene = Scene()
    scene.root.attach_new_node(
        geom_node("ball", ball(0.1 * y), Material("clay", (0.8, 0.8, 0.8, 1)))
    ).set_pos(0, 1.1 * y, 0)
    scene.root.attach_new_node(PointLights("l", [(0, 0.9 * y, 0)], [(1, 1, 1)], y))
    scene.camera.node().lens = PerspectiveLens(vfov=20.0, near=near, far=far)
    found = []
    for method in ("clustered", "fullscreen"):
        renderer.settings = Settings(light_method=method, position_method=position)
        found.append(renderer.render(scene, 0.0, ("radiance",))["radiance"])
    assert found[1].any()
    assert np.abs(found[0] - found[1]).max() <= 1e-6 * found[1].max()


# --- auto ---


def test_a_light_before_an_empty_view_is_no_trouble():
    scene = wall_scene(distance=40.0)
    scene.root.attach_new_node(PointLight("lamp", (1, 1, 1), 5.0)).set_pos(0, -5, 0)
    scene.camera.set_h(180.0)
    told = plan_as_dict(build_plan(scene))
    assert told["light_method"]["method"] == "volumes"
    assert "estimated_pairs" not in told["light_method"]


def test_a_light_that_holds_the_view_is_a_volume_for_auto():
    scene = wall_scene()
    scene.root.attach_new_node(PointLight("lamp", (1, 1, 1), 500.0))
    assert build_plan(scene).culling.method == "volumes"


def test_one_light_is_drawn_as_a_volume_and_many_by_cells():
    few, many = build_plan(ball_scene(1)), build_plan(ball_scene(500))
    assert few.culling.method == "volumes"
    assert not few.clusters
    assert many.culling.method == "clustered"
    assert sum(len(c.lights) for c in many.clusters) == many.counts.in_view
    for plan in few, many:
        assert plan.culling.shaded.keys() == {"volumes", "clustered", "fullscreen"}
        assert plan.culling.shaded["fullscreen"] == plan.counts.in_view * 800 * 600


def test_the_original_look_adds_light_by_light():
    assert build_plan(ball_scene(500), Settings(look="classic")).culling.method == "volumes"


@pytest.mark.parametrize("method", ["volumes", "clustered", "fullscreen", "loop", "forward"])
def test_a_named_method_is_taken_as_it_is(method):
    plan = build_plan(ball_scene(3), Settings(light_method=method))
    assert (plan.culling.method, plan.culling.shaded) == (method, {})


def test_falloffs_of_both_kinds_have_lists_of_their_own():
    scene = ball_scene(20)
    lamp = PointLight("lamp", (1, 1, 1))
    lamp.set_attenuation((1, 0, 1))
    scene.root.attach_new_node(lamp).set_pos(0, 8, 2)
    plan = build_plan(scene, Settings(light_method="clustered"))
    assert {cells.lights.falloff for cells in plan.clusters} == {Falloff.RAMP_SQUARED, Falloff.ATTENUATION}


def swarm_scene(reaches):
    """Very small lights among the balls, on some of which most would shine if there were enough samples."""
    rng = np.random.default_rng(4)
    scene = ball_scene(lights=0)
    places = rng.uniform((-4, 5, -2), (4, 11, 2), (len(reaches), 3))
    scene.root.attach_new_node(PointLights("swarm", places, (40.0, 30.0, 20.0), reaches))
    return scene


@pytest.mark.parametrize("position", ["linear32f", "depth32f", "depth24"])
def test_lights_between_all_samples_are_left_out_and_missed_by_none(renderer, monkeypatch, position):
    """Drawn or not, a light that no line of sight meets gives the same bytes."""
    scene = swarm_scene(10.0 ** np.random.default_rng(5).uniform(-3, -0.5, 3000))
    renderer.settings = Settings(light_method="volumes", position_method=position)
    few = renderer.render(scene, 0.0, ("radiance", "overdraw"))
    monkeypatch.setattr(lighting, "OFF_RAY", frozenset(CHOICES["position_method"]))
    all_ = renderer.render(scene, 0.0, ("radiance", "overdraw"))
    assert few["radiance"].tobytes() == all_["radiance"].tobytes()
    assert few["radiance"].any()
    assert all_.lights.in_view - few.lights.in_view > 500


def test_of_a_swarm_too_small_to_be_seen_little_is_left(renderer):
    """A hundredth: what comes within a twentieth of a sample to a centre. The rest costs no vertex."""
    scene = swarm_scene(np.full(2000, 1e-5))
    renderer.settings = Settings()
    assert renderer.plan(scene).counts.in_view < 40
    # what puts surfaces beside their pixels' lines
    for changes in (
        {"position_method": "stored16f"},
        {"position_method": "stored32f"},
        {"light_method": "forward"},
    ):
        renderer.settings = Settings(**changes)
        assert renderer.plan(scene).counts.in_view > 1000


@pytest.mark.parametrize(
    ("size", "fov"), [((1, 1), 90.0), ((4, 3), 150.0), ((8, 6), 170.0), ((64, 48), 178.0)]
)
def test_where_samples_are_far_apart_no_spotlight_is_missed(monkeypatch, size, fov):
    """Balls that hold the eye are no smaller than a sample, however narrow their cones."""
    scene = wall_scene(distance=2.0, size=400.0, near=0.1, vfov=fov)
    rng = np.random.default_rng(2)
    sample = 2.0 * np.tan(np.radians(fov / 2.0)) / size[1]  # at 1; the wall is at 2, the lamps half-way
    for k in range(30):
        lamp = Spotlight(f"lamp {k}", (3, 2, 1))
        lamp.set_max_distance(float(rng.uniform(1.1, max(1.2, sample))))
        x, z = 2.0 * sample * (rng.integers(size) + 0.5 - 0.5 * np.array(size)) + rng.uniform(-0.2, 0.2, 2)
        scene.root.attach_new_node(lamp).set_pos(x, 1.0, z)
    with make_renderer(size, Settings(light_method="volumes")) as renderer:
        few = renderer.render(scene, 0.0, ("radiance",))["radiance"]
        monkeypatch.setattr(lighting, "OFF_RAY", frozenset(CHOICES["position_method"]))
        all_ = renderer.render(scene, 0.0, ("radiance",))["radiance"]
    assert few.any()
    assert few.tobytes() == all_.tobytes()
