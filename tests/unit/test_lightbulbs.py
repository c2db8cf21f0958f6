"""The light-bulb scene: what it is made of, what its parameters do, and what it costs."""

import numpy as np
import pytest

from firefly_sample.errors import ParameterError
from firefly_sample.pipeline import build_plan
from firefly_sample.plan.report import plan_as_dict
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.lights import DirectionalLight, PointLights
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.scenes.lightbulbs import BULB_RADIUS, BULB_REACH, SPACING, LightbulbsScene
from firefly_sample.settings import Settings
from firefly_sample.viewer.orbit import OrbitCamera


@pytest.fixture(scope="module")
def scene() -> LightbulbsScene:
    return LightbulbsScene()


def bulbs_of(scene, time=0.0):
    """Positions and colours of the lights in world space."""
    node = scene.root.find("**/bulb lights").node()
    assert isinstance(node, PointLights)
    return node.evaluate(time)


def cats_of(scene):
    """Each cat's vertices in world space: (cats, vertices, 3)."""
    cats = scene.root.find("cats").get_children()
    (geom, _), *_ = cats[0].node().geoms
    nets = np.array([cat.get_net_transform().get_mat() for cat in cats])
    return np.einsum("vi,nij->nvj", geom.vertices, nets[:, :3, :3]) + nets[:, None, 3, :3]


def test_there_are_four_hundred_cats_and_bulbs(scene):
    assert len(scene.root.find("cats").get_children()) == 400
    assert len(scene.root.find("bulbs").get_children()) == 400
    assert len(bulbs_of(scene)) == 400
    assert {path.get_name() for path in scene.root.find("planets").get_children()} == {
        "gas giant",
        "ringed planet",
        "ocean planet",
        "rocky planet",
        "moon",
    }


@pytest.mark.parametrize(("columns", "rows"), [(1, 1), (7, 3), (2, 11)])
def test_both_counts_can_be_set(columns, rows):
    made = build_scene(find_scene("lightbulbs"), columns=columns, rows=rows)
    assert len(made.root.find("cats").get_children()) == len(bulbs_of(made)) == columns * rows
    low, high = made.root.find("plinth").get_tight_bounds()
    assert high - low == pytest.approx([2.3 * columns, 2.3 * rows, 3.0])
    build_plan(made)


@pytest.mark.parametrize("count", [1, 20, 100])
def test_planets_and_stars_stay_around_the_plinth_and_in_sight(count):
    made = LightbulbsScene(columns=count, rows=count)
    low, high = made.root.find("plinth").get_tight_bounds()
    for planet in made.root.find("planets").get_children():
        first, last = planet.get_tight_bounds(made.root)
        assert ((first > high) | (last < low)).any(), planet.get_name()
    eye = made.camera.get_pos(made.root)
    stars = made.root.find("stars").node().evaluate(0.0)
    assert np.linalg.norm(stars.positions - eye, axis=1).max() < 1.25 * made.lens.get_far()
    # straight ahead, none is beyond the far plane
    matrix = made.camera.get_net_transform().get_mat()
    ahead = (stars.positions - eye) @ matrix[1, :3]
    in_sight = np.abs((stars.positions - eye) @ matrix[0, :3]) < 0.5 * ahead
    assert in_sight.any()
    assert ahead[in_sight].max() <= made.lens.get_far()


def test_cats_stand_on_the_plinth_each_on_its_own_slab(scene):
    cats = cats_of(scene)
    assert np.abs(cats[..., 2].min(axis=1)).max() < 0.01
    low, high = scene.root.find("plinth").get_tight_bounds()
    assert high[2] == pytest.approx(0.0, abs=1e-6)
    assert (cats[..., :2] > low[:2]).all()
    assert (cats[..., :2] < high[:2]).all()
    slabs = np.floor((cats[..., :2] - low[:2]) / 2.3)
    assert (slabs == slabs[:, :1]).all()
    assert len({tuple(slab) for slab in slabs[:, 0].astype(int)}) == 400


def test_the_slabs_of_the_texture_follow_the_counts():
    """A joint of the texture lies between cats, whatever the counts: five slabs to a repeat."""
    for columns, rows in ((20, 20), (7, 3), (1, 1)):
        made = LightbulbsScene(columns=columns, rows=rows)
        (geom, _), *_ = made.root.find("plinth").node().geoms
        top = (np.abs(geom.normals[:, 2]) > 0.99) & (geom.vertices[:, 2] > -1e-6)
        expected = (geom.vertices[top, :2] + 0.5) * (columns, rows) / 5
        turns = geom.texcoords[top] - expected
        assert np.abs(turns * 5 - np.round(turns * 5)).max() < 2e-3  # a whole number of slabs away


def test_a_bulb_reaches_about_four_cats(scene):
    """As the module's text says: every inner bulb four, one at the plinth's rim fewer."""
    cats, bulbs = cats_of(scene), bulbs_of(scene).positions
    middles = 0.5 * (cats.min(axis=1) + cats.max(axis=1))
    # the middle of a cat, which is lit if its bulb reaches it
    reached = (np.linalg.norm(middles[None] - bulbs[:, None], axis=2) < BULB_REACH).sum(axis=1)
    assert np.bincount(reached)[4] >= 300
    assert reached.max() == 4
    assert reached.mean() > 3.5


def test_the_first_row_has_bulbs_before_its_faces(scene):
    cats, bulbs = cats_of(scene), bulbs_of(scene).positions
    assert bulbs[:, 1].min() < cats[..., 1].min()


def test_a_bulb_is_a_sphere_around_its_light_and_shows_its_color(scene):
    for time in (0.0, 1.7):
        scene.update(time)
        lights = bulbs_of(scene, time)
        spheres = scene.root.find("bulbs").get_children()
        for path, place, color in zip(spheres, lights.positions, lights.colors, strict=True):
            net = path.get_net_transform().get_mat()
            assert net[3, :3] == pytest.approx(place, abs=1e-12)
            emission = path.node().material.emission
            assert emission / emission.max() == pytest.approx(color / color.max())
        node = spheres[0].node()
        assert isinstance(node, GeomNode)
        radii = np.linalg.norm(node.geoms[0][0].vertices, axis=1)
        assert radii == pytest.approx(BULB_RADIUS, abs=1e-6)


def test_colors_come_from_the_seed_and_the_bulbs_own_number():
    seven, eight = LightbulbsScene(seed=7, columns=4, rows=3), LightbulbsScene(seed=8, columns=4, rows=3)
    more = LightbulbsScene(seed=7, columns=4, rows=5)
    assert np.array_equal(bulbs_of(seven).colors, bulbs_of(more).colors[:12])
    assert not np.array_equal(bulbs_of(seven).colors, bulbs_of(eight).colors)
    assert len(np.unique(bulbs_of(more).colors, axis=0)) == 20


def test_bulbs_hover_each_at_its_own_pace_and_stop_when_told():
    made = LightbulbsScene(columns=5, rows=5)
    heights = np.array([bulbs_of(made, time).positions[:, 2] for time in np.linspace(0, 15, 400)])
    assert np.ptp(heights, axis=0).min() > 0.6
    assert np.abs(np.corrcoef(heights.T) - np.eye(25)).max() < 1.0
    assert bulbs_of(made, 1e9).positions[:, 2].min() > 1.0
    made.set("hover", False)
    still = [bulbs_of(made, time).positions for time in (0.0, 3.3)]
    assert np.array_equal(*still)
    made.update(3.3)
    places = [path.get_pos() for path in made.root.find("bulbs").get_children()]
    assert np.array(places) == pytest.approx(still[0])


def test_sun_bulbs_hover_and_shadows_are_switched_separately():
    made = LightbulbsScene(columns=3, rows=3)
    sun = made.root.find("sun")

    def state():
        plan = build_plan(made, size=(64, 48))
        kinds = {lights.kind: len(lights) for lights in plan.lights}
        spheres = made.root.find("bulbs").get_children()
        glows = any(path.node().material.emission.any() for path in spheres)
        return kinds.get("point", 0) > 0, kinds.get("directional", 0) > 0, glows, bool(plan.shadows.maps)

    assert state() == (True, False, True, False)
    made.set("sun", True)
    assert state() == (True, True, True, True)
    made.set("shadows", False)
    assert state() == (True, True, True, False)
    made.set("bulbs", False)
    assert state() == (False, True, False, False)
    made.set("sun", False)
    assert state() == (False, False, False, False)
    assert isinstance(sun.node(), DirectionalLight)
    for name in ("seed", "columns", "cats"):
        with pytest.raises(ParameterError, match=f"no live parameter '{name}'"):
            made.set(name, 3)
    with pytest.raises(ParameterError, match="sun must be true or false"):
        made.set("sun", 1)


def test_from_far_enough_all_four_hundred_lights_are_drawn():
    made = LightbulbsScene()
    made.camera.set_pos(20.0, -75.0, 30.0)
    made.camera.look_at(0.0, 0.0, 0.0)
    (lights,) = build_plan(made).lights
    assert len(lights) == 400


def test_all_cats_are_one_draw_and_all_bulbs_another(scene):
    plan = build_plan(scene, size=(320, 240))
    counts = {}
    for batch in plan.batches:
        (kind,) = {plan.id_names[i].split("/")[1] for i in batch.ids}
        counts.setdefault(kind, []).append(len(batch.ids))
    assert len(counts["cats"]) == len(counts["bulbs"]) == len(counts["plinth"]) == 1
    assert counts["cats"][0] > 250


def names(plan):
    told = plan_as_dict(plan)
    return [step["name"] for step in told["passes"]], {
        target["name"]: target["bytes_per_pixel"] for target in told["targets"]
    }


GBUFFER = {"depth": 4, "albedo": 4, "normal": 4, "distance": 4, "specular": 8, "emission": 16}
PICTURE = {"radiance": 16, "color": 4}


def test_its_plan_has_exactly_its_passes_and_targets(scene):
    assert names(build_plan(scene)) == (
        ["geometry", "ambient", "point_lights", "sprites", "resolve"],
        {**GBUFFER, **PICTURE},
    )
    sunny = LightbulbsScene(sun=True)
    assert names(build_plan(sunny)) == (
        ["shadow_maps", "geometry", "ambient", "directional_lights", "point_lights", "sprites", "resolve"],
        {"shadow_atlas": 4, **GBUFFER, **PICTURE},
    )
    sunny.set("bulbs", False)
    assert names(build_plan(sunny)) == (
        ["shadow_maps", "geometry", "ambient", "directional_lights", "sprites", "resolve"],
        {"shadow_atlas": 4, **{k: v for k, v in GBUFFER.items() if k != "emission"}, **PICTURE},
    )
    sunny.set("shadows", False)
    # highlights through a perspective lens need a pixel's direction, not its distance
    without = {k: v for k, v in GBUFFER.items() if k not in ("emission", "distance")}
    assert names(build_plan(sunny)) == (
        ["geometry", "ambient", "directional_lights", "sprites", "resolve"],
        {**without, **PICTURE},
    )


@pytest.mark.parametrize(("columns", "rows"), [(20, 20), (1, 1), (60, 40)])
def test_a_viewer_turns_around_the_cats(columns, rows):
    pivot = OrbitCamera(LightbulbsScene(columns=columns, rows=rows)).pivot
    assert np.abs(pivot[:2]).max() < 0.05 * SPACING * max(columns, rows)
    assert 0.0 < pivot[2] < 0.1 * SPACING * max(columns, rows) + 1.0


def test_a_frame_is_a_function_of_time_alone(scene):
    def matrices(time):
        plan = build_plan(scene, Settings(), (64, 48), time=time)
        return [batch.model_to_view.tobytes() for batch in plan.batches], [
            lights.positions.tobytes() for lights in plan.lights
        ]

    first = matrices(2.5)
    matrices(9.0)
    assert matrices(2.5) == first
    assert matrices(9.0) != first
