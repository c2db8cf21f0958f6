"""Alpha of vertex colours takes part in what is cut out: times the texture's and the material's, as in glTF.

A card's alpha rises evenly from 0 on its left to 1 on its right, so that what is left of it begins where
alpha is the cut-off: a column that is known.
"""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.lab.reference.frame import render_reference
from firefly_sample.lab.reference.raycast import cast_visibility
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings
from tests.conftest import make_renderer
from tests.scenes import geom_node, wall

WIDTH = 64
LEFT, RIGHT = 0.0, 1.0
ALPHA = np.array([LEFT, RIGHT, RIGHT, LEFT])
CORNERS = [(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)]
UV = [(0, 0), (1, 0), (1, 1), (0, 1)]


@pytest.fixture(scope="module")
def render():
    with make_renderer((WIDTH, WIDTH)) as renderer:

        def draw(scene, settings=None, outputs=("id",)):
            renderer.settings = settings or Settings()
            return renderer.render(scene, outputs=outputs)

        yield draw


def card(alphas=ALPHA, rgb=(1, 1, 1)):
    colors = None if alphas is None else [(*rgb, alpha) for alpha in alphas]
    return Geom(CORNERS, [(0, 1, 2), (0, 2, 3)], texcoords=UV, colors=colors, name="card")


def card_scene(material, geom=None):
    scene = Scene(background=(0, 0, 1))
    scene.root.attach_new_node(geom_node("card", geom or card(), material))
    scene.camera.set_pos(0, -5, 0)
    scene.camera.node().lens = OrthographicLens(film_size=(2, 2), near=1, far=20)
    return scene


def half_texture(alpha):
    """All of one alpha."""
    return Texture(np.full((4, 4, 4), (255, 255, 255, alpha), dtype=np.uint8))


def columns_left(frame):
    """From which column on there is something, in all rows alike."""
    there = frame.id >= 0
    assert (there == there[0]).all()
    first = int(np.argmax(there[0])) if there.any() else WIDTH
    assert not there[0, :first].any()
    assert there[0, first:].all()
    return first


CASES = {  # material, and where alpha times what else there is reaches the cut-off, of the card's width
    "vertices": (Material("m", alpha_mode="mask", alpha_cutoff=0.25), 0.25),
    "vertices, three quarters": (Material("m", alpha_mode="mask", alpha_cutoff=0.75), 0.75),
    "blended": (Material("m", alpha_mode="blend", alpha_cutoff=0.5), 0.5),
    "material": (Material("m", (1, 1, 1, 0.5), alpha_mode="mask", alpha_cutoff=0.25), 0.5),
    "texture": (Material("m", texture=half_texture(204), alpha_mode="mask", alpha_cutoff=0.4), 0.5),
    "all three": (
        Material("m", (1, 1, 1, 0.5), half_texture(204), alpha_mode="mask", alpha_cutoff=0.1),
        0.25,
    ),
    "too much": (Material("m", (1, 1, 1, 0.4), alpha_mode="mask", alpha_cutoff=0.45), 1.0),
    "opaque": (Material("m", alpha_mode="opaque"), 0.0),
}
BLENDED = CASES["blended"][0]
"""Data outputs leave it out; its shadow is cut out."""
each_case = pytest.mark.parametrize(("material", "share"), CASES.values(), ids=CASES)


@each_case
def test_the_product_of_all_alphas_is_cut_out(render, material, share):
    frame = render(card_scene(material))
    assert columns_left(frame) == (WIDTH if material is BLENDED else share * WIDTH)


@each_case
def test_the_twin_cuts_out_the_same(material, share):
    plan = build_plan(card_scene(material), size=(WIDTH, WIDTH), outputs=("visibility",))
    seen = cast_visibility(plan)[..., 0] >= 0
    expected = np.arange(WIDTH) >= share * WIDTH
    assert (seen == (expected & (material is not BLENDED))).all()


@pytest.mark.parametrize("lights", ["forward", "clustered", "volumes"])
def test_every_way_to_light_cuts_out(render, lights):
    scene = card_scene(CASES["all three"][0])
    scene.root.attach_new_node(DirectionalLight("sun"))
    frame = render(scene, Settings(light_method=lights), ("radiance",))
    blue = (frame.radiance == (0, 0, 1)).all(axis=2)
    assert (blue == (np.arange(WIDTH) < WIDTH // 4)).all()


def test_the_classic_look_cuts_out(render):
    frame = render(card_scene(CASES["all three"][0]), Settings(look="classic"))
    assert columns_left(frame) == WIDTH // 4


def test_a_nodes_color_replaces_alpha_with_the_rest(render):
    """As Panda3D's flat colour replaces vertex colours; its own alpha counts."""
    scene = card_scene(CASES["vertices"][0])
    scene.root.find("**/card").set_color(1, 1, 1, 1)
    assert columns_left(render(scene)) == 0
    scene.root.find("**/card").set_color(1, 1, 1, 0.2)
    assert columns_left(render(scene)) == WIDTH


def test_alpha_that_changes_shows_at_once(render):
    scene = card_scene(CASES["vertices"][0])
    geom = scene.root.find("**/card").node().geoms[0][0]
    geom.set_colors([(1, 1, 1)] * 4)
    assert columns_left(render(scene)) == 0
    geom.set_colors([(1, 1, 1, 0.5 * alpha) for alpha in ALPHA])
    assert columns_left(render(scene)) == WIDTH // 2


def shadow_scene(material, geom=None):
    """The card before a wall, in light that comes along the view but for a way to the side: two apart."""
    scene = Scene()
    scene.root.attach_new_node(geom_node("wall", wall(20.0), Material("wall"))).set_pos(0, 1, 0)
    scene.root.attach_new_node(geom_node("card", geom or card(), material)).set_pos(-3, -1, 0)
    sun = DirectionalLight("sun")
    sun.set_direction((1.5, 1, 0))
    sun.set_shadow_caster(True, 1024)
    scene.root.attach_new_node(sun)
    scene.camera.set_pos(0, -5, 0)
    scene.camera.node().lens = OrthographicLens(film_size=(2, 2), near=1, far=20)
    return scene


@each_case
def test_shadows_are_of_what_is_left(render, material, share):
    scene = shadow_scene(material)
    frame = render(scene, Settings(shadow_taps=1), ("radiance",))
    dark = frame.radiance[WIDTH // 4 : -WIDTH // 4, :, 0] == 0.0
    edge = share * WIDTH
    sure = np.abs(np.arange(WIDTH) + 0.5 - edge) > 1.0  # of a texel and of the picture's own
    assert (dark[:, sure] == (np.arange(WIDTH) > edge)[sure]).all()


@each_case
def test_rays_to_the_light_meet_what_is_left(material, share):
    plan = build_plan(shadow_scene(material), size=(WIDTH, WIDTH), outputs=("visibility",))
    radiance = render_reference(plan, cast_visibility(plan)).radiance
    dark = radiance[WIDTH // 4 : -WIDTH // 4, :, 0] == 0.0
    assert (dark == (np.arange(WIDTH) >= share * WIDTH)).all()


@pytest.mark.parametrize("alphas", [None, np.ones(4)], ids=["none", "one"])
def test_a_scene_without_it_pays_nothing(alphas):
    scene = shadow_scene(CASES["vertices"][0], card(alphas))
    plan = build_plan(scene, size=(WIDTH, WIDTH))
    assert not any(batch.surface.vertex_alpha for batch in plan.batches)
    assert not any(batch.vertex_alpha for shadow in plan.shadows.maps for batch in shadow.casters or ())


def test_what_is_opaque_pays_nothing_for_alpha_that_it_has():
    plan = build_plan(shadow_scene(CASES["opaque"][0]), size=(WIDTH, WIDTH))
    assert not any(batch.surface.vertex_alpha for batch in plan.batches)
    assert not any(batch.vertex_alpha for shadow in plan.shadows.maps for batch in shadow.casters or ())
