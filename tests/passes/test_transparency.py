"""The three ways to draw blended surfaces against float64 rays that see every layer."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from firefly_sample.errors import SceneError
from firefly_sample.lab.reference.frame import reference_settings, render_reference
from firefly_sample.lab.reference.layer_rays import cast_layers
from firefly_sample.lab.reference.layers import shade_layers, weight_at, weighted_layers
from firefly_sample.lab.reference.particles import particle_light
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lights import AmbientLight, DirectionalLight
from firefly_sample.scene.material import Material, Texture
from firefly_sample.settings import Settings
from tests.blended import (
    KINDS_OF_GLASS,
    SIZE,
    add_lights,
    add_panes,
    add_squares,
    backdrop,
    bubbles,
    empty_scene,
    glass,
    held,
)
from tests.conftest import make_renderer
from tests.scenes import geom_node, wall, wall_scene

FEW = KINDS_OF_GLASS[:3]


@pytest.fixture(scope="module")
def renderer():
    with make_renderer(SIZE) as made:
        yield made


def radiance(renderer, scene, **settings):
    renderer.settings = Settings(**settings)
    return renderer.render(scene, outputs=("radiance",))["radiance"]


def most_layers(renderer, scene):
    """The largest number of layers in a pixel, opaque surfaces aside."""
    renderer.settings = reference_settings(Settings())
    plan = renderer.plan(scene, 0.0, ("color",))
    return cast_layers(plan, np.full(SIZE[::-1], np.inf)).most


# --- Against rays ---


@pytest.mark.parametrize(
    ("count", "kinds", "orthographic"),
    [(3, FEW, False), (12, FEW, True), (40, KINDS_OF_GLASS, False)],
    ids=["3", "12, orthographic", "40 of all kinds"],
)
def test_exact_is_what_rays_see_of_crossing_panes(renderer, count, kinds, orthographic):
    """Under lights of all kinds, with particles and dots between."""
    scene = add_squares(add_panes(add_lights(backdrop(orthographic)), count, kinds=kinds))
    assert most_layers(renderer, scene) >= count // 2
    assert held(renderer, scene, transparency="exact").codes() <= 1


@pytest.mark.parametrize("count", [3, 40])
def test_sorted_is_what_rays_see_where_nothing_intersects(renderer, count):
    scene = add_panes(add_lights(backdrop()), count, crossing=False, kinds=FEW)
    add_squares(scene, count=0)
    assert most_layers(renderer, scene) >= count // 2
    found = held(renderer, scene, transparency="sorted")
    assert not found.plan.blended.order.warnings
    assert found.codes() <= 1


def test_sorted_draws_particles_between_panes_that_do_not_cut_them(renderer):
    scene = add_lights(backdrop(), ("sun",))
    for index, y in enumerate((6.0, 9.0, 12.0)):
        scene.root.attach_new_node(
            geom_node(f"pane {index}", wall(20.0), glass(f"glass {index}", (0.9, 0.6, 0.3), 0.4))
        ).set_pos(0, y, 0)
        low, high = (-2, y - 2.0, -1.5), (2, y - 1.0, 1.5)
        add_squares(scene, 12, 5, index, low, high, radius=0.9)
    assert held(renderer, scene, transparency="sorted").codes() <= 1


@pytest.mark.parametrize("method", ["sorted", "exact"])
def test_both_sides_of_spheres_are_layers(renderer, method):
    scene = bubbles()
    assert most_layers(renderer, scene) == 6
    assert held(renderer, scene, transparency=method).codes() <= 1


@pytest.mark.parametrize(
    "changes",
    [
        {"position_method": "depth24"},
        {"position_method": "depth16"},
        {"position_method": "depth32f"},
        {"position_method": "stored32f"},
        {"position_method": "inverse_matrix"},
        {"light_method": "volumes"},
        {"light_method": "loop"},
        {"light_method": "forward"},
        {"supersample": 2},
    ],
    ids=lambda changes: "{}={}".format(*next(iter(changes.items()))),
)
@pytest.mark.parametrize("method", ["sorted", "exact"])
def test_other_settings_see_the_same_layers(renderer, method, changes):
    """Opaque surfaces are light alone here, so that no error of their positions is in the picture."""
    scene = add_panes(backdrop(), 5, crossing=method == "exact", kinds=FEW[:1])
    add_lights(scene, ("sun",))
    add_squares(scene, count=0)
    assert held(renderer, scene, transparency=method, **changes).codes() <= 1


@pytest.mark.parametrize("caster", ["opaque", "blended", "nearly clear"])
def test_layers_are_in_the_shadows_that_rays_see(renderer, caster):
    """A blended caster casts all of its shadow or none: its alpha is below the cut-off, or it is not."""
    scene = backdrop()
    sun = DirectionalLight("sun", (0.8, 0.8, 0.7))
    sun.set_direction((1, 1, -0.4))
    sun.set_shadow_caster(True, 1024)
    scene.root.attach_new_node(sun)
    scene.root.attach_new_node(AmbientLight("sky", (0.2, 0.2, 0.3)))
    made = {
        "opaque": Material("caster", double_sided=True),
        "blended": glass("caster", (1, 0.5, 0.5), 0.7),
        "nearly clear": glass("caster", (1, 0.5, 0.5), 0.3),
    }[caster]
    scene.root.attach_new_node(geom_node("caster", wall(1.6), made)).set_pos(-1, 7, 0.5)
    for index, y in enumerate((8.0, 9.5)):
        pane = geom_node(f"pane {index}", wall(20.0), glass(f"glass {index}", (0.7, 0.9, 0.8), 0.4))
        scene.root.attach_new_node(pane).set_pos(0, y, 0)
    found = held(renderer, scene, transparency="exact")
    sun.set_shadow_caster(False)
    bright = held(renderer, scene, transparency="exact")
    # maps err along the shadows' edges
    assert found.share_off() <= 0.04
    assert bright.codes() <= 1
    darker = (bright.reference.radiance - found.reference.radiance).max(axis=-1) > 0.02
    assert (darker.mean() > 0.02) == (caster != "nearly clear")


# --- Closed forms ---


def clear_panes(count, alpha, colors, distance=5.0, step=1.0):
    """Unlit panes that fill the view one behind the other, the nearest first; before a blue background."""
    scene = empty_scene()
    for index in range(count):
        made = glass(f"pane {index}", colors[index], alpha, unlit=True)
        scene.root.attach_new_node(geom_node(f"pane {index}", wall(4.0), made)).set_pos(
            0, distance + step * index, 0
        )
    return scene


@pytest.mark.parametrize("method", ["sorted", "exact", "weighted"])
@pytest.mark.parametrize("count", [1, 3, 12])
def test_equal_panes_let_through_a_power(renderer, method, count):
    """(1 - a)^n of the background is left, and 1 - (1 - a)^n is the panes' own; whatever the method."""
    scene = clear_panes(count, 0.3, np.tile((0.8, 0.4, 0.2), (count, 1)))
    left = 0.7**count
    expected = left * np.array([0.1, 0.2, 0.4]) + (1 - left) * np.array([0.8, 0.4, 0.2])
    assert np.abs(radiance(renderer, scene, transparency=method) - expected).max() <= 1e-6


@pytest.mark.parametrize("method", ["sorted", "exact"])
@pytest.mark.parametrize("step", [0.5, 0.0], ids=["apart", "in one plane"])
def test_no_layer_is_lost(renderer, method, step):
    """Panes of different colours; of those in one plane, the one drawn first is the nearest to rays."""
    colors = np.random.default_rng(3).uniform(0, 1, (9, 3))
    scene = clear_panes(9, 0.4, colors, step=step)
    if step == 0.0 and method == "sorted":
        colors = colors[::-1]  # painted in the given order, the last is on top
    expected = 0.6**9 * np.array([0.1, 0.2, 0.4])
    expected = expected + (0.4 * 0.6 ** np.arange(9)) @ colors
    assert np.abs(radiance(renderer, scene, transparency=method) - expected).max() <= 1e-6


@pytest.mark.parametrize("position_method", ["linear32f", "depth16", "depth24", "depth32f", "stored16f"])
@pytest.mark.parametrize("method", ["sorted", "exact", "weighted"])
def test_a_pane_on_an_opaque_surface_is_before_it(renderer, method, position_method):
    """At equal depth, tilted, so that rounding is another one in each pixel."""
    scene = wall_scene(8.0, size=60.0, material=Material("wall", (0, 0, 0, 1)))
    board = scene.root.find("wall")
    board.set_hpr(30, 20, 10)
    board.attach_new_node(geom_node("pane", wall(60.0), glass("pane", (1, 0.5, 0.25), 0.5, unlit=True)))
    found = radiance(renderer, scene, transparency=method, position_method=position_method)
    assert np.abs(found - np.array([0.5, 0.25, 0.125])).max() <= 1e-6


def test_the_alphas_of_color_texture_and_vertices_multiply(renderer):
    pixels = np.full((1, 4, 4), 255, dtype=np.uint8)
    pixels[0, :, 3] = 0, 51, 153, 255
    texture = Texture(pixels, wrap_u="clamp", minfilter="nearest", magfilter="nearest")
    geom = wall(2.0)
    alphas = np.where(geom.vertices[:, 2] > 0, 1.0, 0.0)  # 0 at the bottom, 1 on top
    colors = np.column_stack([np.ones((4, 3)), alphas])
    geom = Geom(geom.vertices, geom.triangles, geom.normals, geom.texcoords, colors)
    scene = empty_scene((0, 0, 0))
    made = glass("all three", (1, 1, 1), 0.5, texture=texture, unlit=True)
    scene.root.attach_new_node(geom_node("pane", geom, made)).set_pos(0, 5, 0)
    width, height = SIZE
    across = np.repeat([0.0, 0.2, 0.6, 1.0], width // 4)
    up = 0.5 + 0.75 * (0.5 - (np.arange(height) + 0.5) / height)  # the picture shows three quarters
    expected = 0.5 * across * up[:, None]
    for method in ("sorted", "exact", "weighted"):
        found = radiance(renderer, scene, transparency=method)
        assert np.abs(found - expected[..., None]).max() <= 1e-6, method


@pytest.mark.parametrize("method", ["sorted", "exact", "weighted"])
def test_a_pane_of_alpha_0_changes_nothing(renderer, method):
    scene = add_panes(backdrop(), 2, kinds=({"unlit": True},), crossing=False)
    before = radiance(renderer, scene, transparency=method)
    nothing = glass("nothing", (1, 1, 1), 0.0, unlit=True)
    scene.root.attach_new_node(geom_node("nothing", wall(4.0), nothing)).set_pos(0, 6, 0)
    assert np.abs(radiance(renderer, scene, transparency=method) - before).max() <= 1e-6


def test_a_blend_material_without_any_alpha_is_opaque(renderer):
    scene = clear_panes(1, 1.0, [(0.5, 0.25, 0.125)])
    renderer.settings = Settings()
    plan = renderer.plan(scene, 0.0, ("color", "id"))
    assert plan.blended is None
    assert len(plan.batches) == 1
    assert (renderer.draw(plan)["id"] == 0).all()


# --- Limits ---


def test_more_layers_than_allowed_name_both_ways_out(renderer):
    scene = clear_panes(5, 0.5, np.ones((5, 3)))
    renderer.settings = Settings(transparency="exact", transparency_layers=4)
    with pytest.raises(SceneError, match=r"raise transparency_layers.*transparency=sorted"):
        renderer.render(scene)
    renderer.settings = Settings(transparency="exact", transparency_layers=5)
    renderer.render(scene)


def test_layers_behind_opaque_surfaces_do_not_count(renderer):
    scene = clear_panes(5, 0.5, np.ones((5, 3)))
    scene.root.attach_new_node(geom_node("board", wall(4.0), Material("board"))).set_pos(0, 6.5, 0)
    renderer.settings = Settings(transparency="exact", transparency_layers=2)
    renderer.render(scene)


# --- Weighted ---


def test_weighted_does_not_depend_on_the_order(renderer):
    colors = np.random.default_rng(5).uniform(0, 1, (7, 3))
    scenes = []
    for order in (range(7), reversed(range(7))):
        scene = add_lights(empty_scene(), ("sun",))
        for index in order:
            pane = geom_node(
                f"pane {index}", wall(4.0), glass(f"glass {index}", colors[index], 0.1 * index + 0.1)
            )
            path = scene.root.attach_new_node(pane)
            path.set_pos(0, 5 + index, 0)
            path.set_hpr(10 * index - 30, 5 * index, 0)
        scenes.append(scene)
    one, other = (radiance(renderer, scene, transparency="weighted") for scene in scenes)
    assert np.abs(one - other).max() <= 1e-5 * one.max()


@pytest.mark.parametrize("squares", [False, True], ids=["surfaces", "particles"])
def test_weighted_is_its_formula(renderer, squares):
    """The float64 twin sums weights, which fall with the distance, over all layers and particles."""
    scene = add_panes(add_lights(backdrop(), ("sun", "attenuated")), 7, kinds=FEW)
    if squares:
        add_squares(scene, dots=0)
    found = held(renderer, scene, transparency="weighted")
    plan = found.exact
    bare = render_reference(replace(plan, blended=None, particles=see_nothing(plan)), found.cast)
    distance = np.where(np.isfinite(bare.position[..., 1]), bare.position[..., 1], np.inf)
    layers = cast_layers(plan, distance)
    shown = shade_layers(plan, layers, lambda places: None)
    expected = weighted_layers(bare.radiance, plan, distance, layers, shown, particle_light(plan))
    scale = np.percentile(expected, 99.9)
    off = np.abs(found.frame["radiance"] - expected)[found.chosen].max() / scale
    assert off <= 1e-5
    exact = np.abs(found.reference.radiance - expected)[found.chosen].max() / scale
    assert exact > 0.05  # it is another picture than that of rays


def see_nothing(plan):
    empty = plan.particles
    none = {field.name: getattr(empty, field.name)[:0] for field in fields(empty)}
    return type(empty)(**none)


def test_weights_fall_with_the_third_power():
    weights = weight_at([2.0, 3.0, 4.0, 6.0, 9.0], 2.0, 6.0)
    assert weights == pytest.approx([3000.0, 3000 * 0.75**3, 3000 / 8, 0.01, 0.01])


# --- What else a frame has ---


@pytest.mark.parametrize("method", ["sorted", "exact", "weighted"])
def test_data_outputs_keep_the_nearest_opaque_surface(renderer, method):
    scene = add_panes(add_lights(backdrop(), ("sun",)), 3, crossing=False, kinds=FEW[:1])
    names = ("depth", "id", "normal", "position", "albedo")
    renderer.settings = Settings(transparency=method)
    plan = renderer.plan(scene, 0.0, ("color", *names))
    frame = renderer.draw(plan)
    assert any("show the nearest opaque surface" in line for line in plan.warnings)
    bare = renderer.render(add_lights(backdrop(), ("sun",)), outputs=("color", *names))
    for name in names:
        assert (np.asarray(frame[name]) == np.asarray(bare[name])).all(), name
    assert (frame["color"] != bare["color"]).any()


def test_the_classic_look_draws_cut_outs_and_says_so(renderer):
    pictures = []
    for alpha_mode in ("blend", "mask"):
        scene = backdrop()
        made = Material("glass", (0.9, 0.5, 0.3, 0.7), alpha_mode=alpha_mode)
        scene.root.attach_new_node(geom_node("pane", wall(3.0), made)).set_pos(0, 8, 0)
        add_lights(scene, ("ramp",))
        renderer.settings = Settings(look="classic")
        plan = renderer.plan(scene, 0.0, ("color",))
        assert plan.blended is None
        told = [line for line in plan.warnings if "cut-outs: glass" in line]
        assert len(told) == (alpha_mode == "blend")
        pictures.append(renderer.draw(plan)["color"].copy())
    assert (pictures[0] == pictures[1]).all()


def test_the_order_is_kept_while_nothing_moves(renderer):
    scene = add_squares(add_panes(add_lights(backdrop(), ("sun",)), 4, kinds=FEW), 3, 3)
    renderer.settings = Settings()
    first, second = (renderer.plan(scene, 0.0, ("color",)).blended for _ in range(2))
    assert first.order is second.order
    scene.root.find("**/pane 1").set_y(scene.root, 4.0)
    moved = renderer.plan(scene, 0.0, ("color",)).blended
    assert moved.order is not first.order
    scene.camera.set_x(0.5)
    assert renderer.plan(scene, 0.0, ("color",)).blended.order is not moved.order


def test_blended_surfaces_alone_need_no_buffer_of_opaque_ones(renderer):
    scene = add_lights(clear_panes(2, 0.5, [(1, 0.5, 0.5), (0.5, 1, 0.5)]), ("sun",))
    renderer.settings = Settings()
    plan = renderer.plan(scene, 0.0, ("color",))
    names = {target.name for target in plan.targets}
    assert not names & {"albedo", "normal", "emission", "ambient_albedo", "metallic_roughness", "specular"}


def test_what_only_glass_needs_is_no_target_of_opaque_surfaces(renderer):
    """Emission, highlights and metal of blended surfaces are shaded at once."""
    scene = add_lights(backdrop(), ("sun",))
    renderer.settings = Settings()
    before = {target.name for target in renderer.plan(scene, 0.0, ("color",)).targets}
    add_panes(scene, 8)
    after = {target.name for target in renderer.plan(scene, 0.0, ("color",)).targets}
    assert after == before | {"transparency"}
