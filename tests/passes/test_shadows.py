"""Shadow maps: where their edges are, what they leave alone, and when they are drawn."""

import itertools

import numpy as np
import pytest

from firefly_sample.errors import LightError
from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lights import DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import LARGEST_ATLAS, Settings
from tests.conftest import make_renderer
from tests.reference import compare
from tests.scenes import geom_node, wall
from tests.shadows import (
    KINDS,
    map_coordinates,
    occluded,
    outside_hull,
    shadowed_scene,
    silhouette,
    world_triangles,
)

STEEP = (-3.0, -4.0, 5.5)
LOW = (-6.0, 2.0, 2.0)
GRAZING = (-7.0, -2.0, 0.9)
TAPS = (1, 4, 16)
REACH = {1: 0.71, 4: 1.42, 16: 2.83}
"""Texels from where a filter looks things up to the farthest texel that it asks."""


class Shaded:
    """A scene drawn with and without its shadows: the lit share of every pixel, and where the pixels are."""

    def __init__(self, renderer, scene, taps, size=(320, 240)):
        light = scene.root.find("**/light").node()
        renderer.settings = Settings(shadow_taps=taps)
        renderer.resize(size)
        self.plan = renderer.plan(scene, 0.0, ("light", "position_world", "id"))
        frame = renderer.draw(self.plan)
        self.places = renderer.surface(self.plan).image("position_world").reshape(-1, 3)
        resolution = light.get_shadow_resolution()
        light.set_shadow_caster(False)
        self.unshadowed = renderer.render(scene, 0.0, ("light",)).light[..., 0].ravel()
        light.set_shadow_caster(True, resolution)
        self.shadowed = frame.light[..., 0].ravel()
        self.lit = self.unshadowed > 1e-3
        self.share = np.where(self.lit, self.shadowed / np.maximum(self.unshadowed, 1e-9), 1.0)
        names = [name.split("/")[-1] for name in self.plan.id_names]
        self.on = {name: frame.id.ravel() == index for index, name in enumerate(names)}


@pytest.fixture(scope="module")
def renderer():
    """For pictures that are held against closed forms, each of another scene."""
    with make_renderer(reuse=False) as made:
        yield made


def corners_of(scene, name):
    path = scene.root.find(f"**/{name}")
    matrix = path.get_net_transform().get_mat()
    return path.node().geoms[0][0].vertices @ matrix[:3, :3] + matrix[3, :3]


# --- Where the edges are ---


@pytest.mark.parametrize("taps", TAPS)
@pytest.mark.parametrize("place", [STEEP, LOW], ids=["steep", "low"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_boxs_shadow_ends_within_a_texel_of_where_it_should(renderer, kind, place, taps):
    """Also where the box touches the floor: what lies deeper than a texel in the shadow is dark."""
    scene = shadowed_scene(kind, place)
    shaded = Shaded(renderer, scene, taps)
    box, seen = corners_of(scene, "box"), 0
    for shadow_map in shaded.plan.shadows.maps:
        at, _ = map_coordinates(shadow_map, shaded.places)
        corners, ahead = map_coordinates(shadow_map, box)
        if shadow_map.lens.perspective and ahead.min() <= 0.01:
            continue  # the box is beside this face of a cube
        inside = ((at > 3) & (at < shadow_map.tile.size - 3)).all(axis=1)
        chosen = shaded.on["floor"] & shaded.lit & inside
        if chosen.any():
            away = outside_hull(at[chosen], corners)
            wrong = (shaded.share[chosen] >= 0.5) != (away > 0)
            assert np.abs(away[wrong]).max(initial=0) <= 1.0
            seen += int((away < -1).sum())
    assert seen > 100  # there is a shadow, and it is in view


@pytest.mark.parametrize("taps", TAPS)
@pytest.mark.parametrize("kind", KINDS)
def test_lookups_are_those_of_the_float64_twin(kind, taps):
    compared = compare(shadowed_scene(kind, STEEP), Settings(shadow_taps=taps), (320, 240), shadows=True)
    difference = np.abs(compared.frame.light - compared.expected_light).max(axis=-1)[compared.covered]
    # a comparison may go the other way where both depths are equal to the last digits
    assert np.mean(difference > 1e-5) <= 1e-3
    assert (compared.expected_light[compared.covered] == 0).sum() > 300  # there is a shadow


def test_without_clip_control_shadows_are_as_good(render):
    """The fallback: standard 24-bit depth."""
    old = Capabilities(clip_control=False, snorm_targets=False)
    for kind in KINDS:
        compared = compare(
            shadowed_scene(kind, STEEP), Settings(), (160, 120), capabilities=old, shadows=True
        )
        difference = np.abs(compared.frame.light - compared.expected_light).max(axis=-1)[compared.covered]
        assert compared.plan.target("shadow_atlas").format == "depth24"
        assert np.mean(difference > 1e-4) <= 2e-3


# --- What they leave alone ---


@pytest.mark.parametrize("place", [STEEP, LOW, GRAZING], ids=["steep", "low", "grazing"])
@pytest.mark.parametrize("kind", KINDS)
def test_what_nothing_hides_is_as_bright_as_without_shadows(renderer, kind, place):
    """No acne, on a ball and a floor, however the light grazes them."""
    scene = shadowed_scene(kind, place, thing="ball", eye=(-6.0, -7.0, 4.0))
    filtered = {taps: Shaded(renderer, scene, taps, (160, 120)) for taps in TAPS}
    shaded = filtered[1]
    on_ball = shaded.lit & shaded.on["ball"]
    rays = shaded.places[on_ball]
    if kind == "sun":
        direction = scene.root.find("**/light").get_net_transform().get_mat()[1, :3]
        to_light, distance = np.tile(-direction, (len(rays), 1)), np.full(len(rays), 1e9)
    else:
        to_light = np.array(place) - rays
        distance = np.linalg.norm(to_light, axis=1)
        to_light = to_light / distance[:, None]
    free = on_ball.copy()
    free[on_ball] = ~occluded(rays, to_light, distance, world_triangles(scene))
    # the filter's own softness around the ball's shadow is no fault
    nearest = np.full(len(free), -np.inf)
    rim = silhouette(np.array([0.0, 0.0, 1.0]), 1.0, np.array(place), kind == "sun", (0, 0, 0))
    for shadow_map in shaded.plan.shadows.maps:
        at, ahead = map_coordinates(shadow_map, shaded.places)
        around, rim_ahead = map_coordinates(shadow_map, rim)
        inside = ((at >= 3) & (at <= shadow_map.tile.size - 3)).all(axis=1) & (ahead > -np.inf)
        if shadow_map.lens.perspective:
            inside &= ahead > 0
            if rim_ahead.min() <= 0.01:
                continue
        nearest = np.maximum(nearest, np.where(inside, outside_hull(at, around), -np.inf))
    for taps, shaded in filtered.items():
        clear = nearest > REACH[taps] + 0.1
        difference = np.abs(shaded.shadowed - shaded.unshadowed)
        for name, chosen in (("ball", free), ("floor", shaded.lit & clear & shaded.on["floor"])):
            assert chosen.sum() > 100, (name, taps)
            # where the ball meets the floor, a filter on one may ask texels of the other
            lifted = shaded.places[:, 2] > 0.15 if name == "ball" else True
            assert difference[chosen & lifted].max() <= 1e-5, (name, taps)


def test_a_light_without_anything_in_its_way_costs_nothing():
    scene = shadowed_scene("sun", STEEP)
    light = scene.root.find("**/light").node()
    for name in ("floor", "box"):
        scene.root.find(f"**/{name}").hide(0b10)
    light.camera_mask = 0b10  # sees nothing
    with make_renderer((32, 24)) as renderer:
        plan = renderer.plan(scene)
    assert plan.target("shadow_atlas") is None
    assert "shadow_maps" not in [step.name for step in plan.passes]


# --- What casts ---


def test_a_cut_out_casts_the_shadow_of_what_is_left_of_it(render):
    """A card with a hole in front of a light: the hole's light falls on the wall behind."""
    pixels = np.full((64, 64, 4), 255, dtype=np.uint8)
    pixels[16:48, 16:48, 3] = 0
    scene = shadowed_scene("sun", (0.0, 0.0, 9.0), eye=(0.0, -0.1, 14.0))
    scene.root.find("**/box").detach_node()
    material = Material("card", texture=Texture(pixels), alpha_mode="mask", double_sided=True)
    card = scene.root.attach_new_node(geom_node("card", wall(4.0), material))
    card.set_pos_hpr(0, 0, 3, 0, -90, 0)
    card.hide(0b1)  # from the camera, not from the light
    scene.camera.node().camera_mask = 0b1
    frame = render(scene, None, (64, 48), ("light", "position_world"))
    x, y = frame.position_world[..., 0], frame.position_world[..., 1]
    square = np.maximum(np.abs(x), np.abs(y))
    share = frame.light[..., 0]
    assert (share[square < 0.9] > 0.9).all()  # through the hole
    assert (share[(square > 1.1) & (square < 1.9)] == 0).all()  # the card
    assert (share[(square > 2.1) & (square < 4)] > 0.9).all()  # beside it
    material.set_base_color((1, 1, 1, 0.2))  # now all of it is below the cut-off
    assert (render(scene, None, (64, 48), ("light",)).light[..., 0][square < 4] > 0.9).all()


def test_a_mask_keeps_things_from_casting(render):
    """A bulb around its own light must not hide it."""
    scene = shadowed_scene("point", (0.0, 0.0, 4.0), thing="ball", eye=(0.0, -9.0, 9.0))
    scene.root.find("**/ball").set_pos(0, 0, 4)
    dark = render(scene, None, (32, 24), ("light",)).light.max()
    assert dark == 0.0
    light = scene.root.find("**/light").node()
    light.camera_mask = 0b100
    scene.root.find("**/ball").hide(0b100)
    assert render(scene, None, (32, 24), ("light",)).light.max() > 0.5


def test_each_light_of_a_node_of_many_casts_its_own_shadow(render):
    """Two lights of one node: each sees the box from its own side."""
    scene = shadowed_scene("sun", STEEP)
    scene.root.find("**/light").detach_node()
    places = [(-3.0, -4.0, 5.0), (4.0, -3.0, 4.0)]
    both = PointLights("both", places, [(1, 0, 0), (0, 1, 0)], 20.0)
    both.set_shadow_caster(True, 256)
    scene.root.attach_new_node(both)
    together = render(scene, None, (96, 72), ("light",)).light
    for channel, place in enumerate(places):
        alone = shadowed_scene("sun", STEEP)
        alone.root.find("**/light").detach_node()
        light = PointLight("light", (1, 1, 1), 20.0)
        light.set_shadow_caster(True, 256)
        alone.root.attach_new_node(light).set_pos(*place)
        expected = render(alone, None, (96, 72), ("light",)).light[..., 0]
        assert np.abs(together[..., channel] - expected).max() <= 1e-6


def test_a_wide_spotlight_has_six_maps_and_a_narrow_one_one():
    for half, count in ((10, 1), (60, 1), (61, 6), (120, 6)):
        scene = shadowed_scene("spot", STEEP)
        scene.root.find("**/light").node().set_cone(half, half)
        with make_renderer((32, 24)) as renderer:
            assert len(renderer.plan(scene).shadows.maps) == count


@pytest.mark.parametrize("half", [61.0, 90.0, 140.0])
def test_a_wide_spotlights_shadow_is_a_point_lights(render, half):
    scene = shadowed_scene("spot", STEEP)
    spot = scene.root.find("**/light").node()
    spot.set_cone(half, half)
    spot.set_radius(30.0)
    ours = render(scene, None, (96, 72), ("light",)).light
    scene.root.find("**/light").detach_node()
    point = PointLight("light", (1, 1, 1), 30.0)
    point.set_shadow_caster(True, 256)
    scene.root.attach_new_node(point).set_pos(*STEEP)
    theirs = render(scene, None, (96, 72), ("light",)).light
    inside = ours[..., 0] > 0
    assert np.array_equal(ours[inside], theirs[inside])
    assert inside.mean() > 0.2


def test_shadows_far_from_the_origin_are_where_they_are_at_it(render):
    """A scene and its camera moved together by 2^30: places stay exact, and so does the picture."""
    for kind in KINDS:
        near = render(shadowed_scene(kind, STEEP), None, (96, 72), ("light",)).light
        scene = shadowed_scene(kind, STEEP)
        for child in scene.root.get_children():
            child.set_pos(child.get_pos() + np.array([2.0**30, -(2.0**30), 2.0**30]))
        far = render(scene, None, (96, 72), ("light",)).light
        # the sun's map stands on another grid: edges may move by a part of a texel
        assert np.mean(np.abs(far - near).max(axis=-1) > 1e-4) <= (0.02 if kind == "sun" else 1e-3)


# --- When they are drawn ---


def drawn(renderer, scene, time=0.0):
    """How many maps the next frame draws."""
    renderer.render(scene, time, ("light",))
    return renderer._passes["shadow_maps"].drawn


@pytest.mark.parametrize(("kind", "maps"), [("sun", 1), ("spot", 1), ("point", 6)])
def test_a_map_is_drawn_again_only_when_the_light_or_a_caster_moved(kind, maps):
    scene = shadowed_scene(kind, STEEP)
    light, thing = scene.root.find("**/light"), scene.root.find("**/box")
    with make_renderer((64, 48)) as renderer:
        assert 1 <= drawn(renderer, scene) <= maps
        assert drawn(renderer, scene) == 0
        scene.root.find("**/floor").set_color((0.5, 0.2, 0.2, 1))
        assert drawn(renderer, scene) == 0  # a colour casts no shadow
        scene.camera.set_x(0.01)
        assert drawn(renderer, scene) == 0
        thing.set_x(0.1)
        assert drawn(renderer, scene) >= 1
        light.set_h(light, 1.0)
        light.set_x(light.get_x() + 0.1)
        assert drawn(renderer, scene) >= 1
        light.node().set_shadow_caster(True, 128)
        assert drawn(renderer, scene) >= 1
        assert drawn(renderer, scene) == 0
        renderer.resize((80, 60))
        assert drawn(renderer, scene) == 0  # the atlas stays
        renderer.render(scene, outputs=("id",))
        assert drawn(renderer, scene) == 0  # as it does beside a frame without light


def test_what_other_lights_do_draws_no_map_again():
    """An error budget is shared: when one light flickers, the reaches of all others change a little."""
    scene = shadowed_scene("point", STEEP)
    scene.root.find("**/light").node().set_attenuation((1, 0, 10))
    flame = PointLight("flame")
    flame.set_attenuation((1, 0, 1))
    scene.root.attach_new_node(flame).set_pos(0, -2, 4)
    with make_renderer((64, 48)) as renderer:
        assert drawn(renderer, scene) > 1
        reaches = set()
        for brightness in np.linspace(0.6, 1.6, 12):
            flame.set_color((brightness, 0.4, 0.1))
            plan = renderer.plan(scene, 0.0, ("light",))
            reaches |= {float(lights.reaches[0]) for lights in plan.lights if lights.shadowed}
            assert drawn(renderer, scene) == 0
    assert len(reaches) == 12


@pytest.mark.parametrize("half", [1e2, 1e4, 1e6])
def test_a_huge_thing_takes_no_shadow_from_small_ones(render, half):
    scene = shadowed_scene("point", (0.0, 0.0, 5.0))
    alone = render(scene, None, (64, 48), ("light",)).light
    scene.root.attach_new_node(geom_node("dome", wall(2.0 * half), Material("dome"))).set_y(half)
    assert np.array_equal(render(scene, None, (64, 48), ("light",)).light, alone)
    scene.root.find("**/light").node().set_shadow_caster(False)
    unshadowed = render(scene, None, (64, 48), ("light",)).light
    assert np.mean(unshadowed - alone > 0.5) > 0.005


def test_a_kept_map_is_not_taken_for_another_in_its_place():
    """A light goes, another takes its tile, the first comes back: nothing of the old content is believed."""
    scene = shadowed_scene("sun", STEEP)
    light = scene.root.find("**/light")
    other = DirectionalLight("other")
    other.set_shadow_caster(True, 256)
    other.set_direction((1, 0.2, -1))
    with make_renderer((64, 48)) as renderer:
        first = renderer.render(scene, 0.0, ("light",)).light
        light.detach_node()
        path = scene.root.attach_new_node(other)
        between = renderer.render(scene, 0.0, ("light",)).light
        path.detach_node()
        light.reparent_to(scene.root)
        again = renderer.render(scene, 0.0, ("light",)).light
    assert not np.array_equal(first, between)
    assert np.array_equal(first, again)


def test_the_suns_map_stands_still_and_then_moves_by_whole_texels():
    scene = shadowed_scene("sun", STEEP)
    scene.root.find("**/floor").set_scale(40)  # the view decides what the map must hold
    moves, maps = 400, []
    with make_renderer((64, 48)) as renderer:
        for step in range(moves):
            scene.camera.set_pos(0.02 * step, -9.0 + 0.011 * step, 7.0)
            (shadow_map,) = renderer.plan(scene).shadows.maps
            maps.append(shadow_map)
    changes = [(a, b) for a, b in itertools.pairwise(maps) if a.key != b.key]
    assert 1 <= len(changes) <= moves / 20
    for before, after in changes:
        assert np.array_equal(before.world_to_light[:3, :3], after.world_to_light[:3, :3])
        texel = 2.0 / before.lens.a / before.tile.size
        assert after.lens.a == before.lens.a
        moved = (after.world_to_light[3] - before.world_to_light[3])[[0, 2]] / texel
        assert np.abs(moved - np.round(moved)).max() < 1e-6


# --- The atlas ---


def test_what_does_not_fit_the_atlas_says_how_to_make_it_fit():
    scene = shadowed_scene("sun", STEEP)
    many = PointLights("bulbs", np.tile([0.0, 0.0, 3.0], (40, 1)), (1, 1, 1), 5.0)
    many.set_shadow_caster(True, 1024)
    scene.root.attach_new_node(many)
    with make_renderer((32, 24)) as renderer:
        with pytest.raises(
            LightError, match=r"'light', 'bulbs': their 241 shadow maps .* 8192x8192: give each 512 texels"
        ):
            renderer.plan(scene)
        renderer.settings = Settings(shadow_atlas=LARGEST_ATLAS)
        many.set_shadow_caster(True, 4096)
        with pytest.raises(
            LightError, match=r"give each 1024 texels \(set_shadow_caster\(True, resolution\)\)$"
        ):
            renderer.plan(scene)
        renderer.settings = Settings()
        many.set_shadow_caster(True, 512)
        assert len(renderer.plan(scene).shadows.maps) == 241
        renderer.settings = Settings(shadow_atlas=256)
        with pytest.raises(LightError, match=r"let fewer lights cast shadows|give each 16 texels"):
            renderer.plan(scene)


def test_resolutions_are_checked():
    light = Spotlight("lamp")
    for wrong in (0, 15, 16385, 2.5, "big", -1024):
        with pytest.raises(LightError, match="'lamp': a shadow map's resolution must be"):
            light.set_shadow_caster(True, wrong)
    light.set_shadow_caster(True)
    assert (light.is_shadow_caster(), light.get_shadow_resolution()) == (True, 1024)


def test_many_resolutions_share_an_atlas(render):
    """Lights of 16 to 512 texels at once: each shadow is what it is alone."""
    sizes = (16, 100, 256, 512, 33)
    scene = shadowed_scene("sun", STEEP)
    scene.root.find("**/light").detach_node()
    angles = np.linspace(0, 2 * np.pi, len(sizes), endpoint=False)
    paths = []
    for size, angle in zip(sizes, angles, strict=True):
        light = DirectionalLight(f"sun {size}")
        light.set_direction((np.cos(angle), np.sin(angle), -1.2))
        light.set_shadow_caster(True, size)
        paths.append(scene.root.attach_new_node(light))
    together = render(scene, None, (64, 48), ("light",)).light.astype(np.float64)
    total = np.zeros_like(together)
    for path in paths:
        for other in paths:
            other.show() if other == path else other.hide()
        total += render(scene, None, (64, 48), ("light",)).light
    assert np.abs(together - total).max() <= 1e-5


def test_a_degenerate_caster_is_harmless(render):
    """Triangles without area, and a node that flattens its model."""
    scene = shadowed_scene("sun", STEEP)
    before = render(scene, None, (64, 48), ("light",)).light
    scene.root.attach_new_node(geom_node("dust", Geom([(0, 0, 3)] * 3, [(0, 1, 2)])))
    scene.root.find("**/box").copy_to(scene.root).set_scale(1, 1, 1e-12)
    after = render(scene, None, (64, 48), ("light",)).light
    assert np.isfinite(after).all()
    assert np.mean(np.abs(after - before) > 1e-3) < 0.05
