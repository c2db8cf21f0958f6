"""Depth offsets: a decal hides the wall that it lies on, and is nowhere else than where it lies."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from firefly_sample.pipeline import build_plan
from firefly_sample.plan.targets import STORED_POSITIONS
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import PositionMethod, Settings
from tests.conftest import make_renderer
from tests.scenes import geom_node, wall

SIZE = (64, 48)
METHODS = get_args(PositionMethod)


@pytest.fixture(scope="module")
def render():
    with make_renderer(SIZE) as renderer:

        def draw(scene, *outputs, **settings):
            renderer.settings = Settings(**settings)
            return renderer.render(scene, outputs=outputs)

        yield draw


def decal_geom():
    """A triangle in the wall's plane that shares no corner with it, so that depths are rounded otherwise."""
    corners = np.array([(-1.37, 0, -1.11), (1.53, 0, -0.83), (0.19, 0, 1.31)])
    return Geom(corners, [(0, 1, 2)], [(0, -1, 0)] * 3, name="decal")


def decal_scene(first="wall", offset=1, orthographic=False, **material):
    """A tilted wall with a decal in its plane; the `first` of the two is drawn first."""
    scene = Scene()
    turned = scene.root.attach_new_node("turned")
    turned.set_pos(0.3, 9, 0.2)
    turned.set_hpr(35, 28, 13)
    nodes = {
        "wall": geom_node("wall", wall(6.0, cells=3), Material("plaster", (0, 0, 1, 1))),
        "decal": geom_node(
            "decal", decal_geom(), Material("paint", **{"base_color": (1, 1, 0, 1)} | material)
        ),
    }
    for name in (first, *(nodes.keys() - {first})):
        turned.attach_new_node(nodes[name])
    if offset:
        scene.root.find("turned/decal").set_depth_offset(offset)
    lens = PerspectiveLens(fov=32, near=0.5, far=80)
    scene.camera.node().lens = OrthographicLens(film_size=(5, 3.75), near=1, far=30) if orthographic else lens
    return scene


def alone(scene):
    """The same scene without its wall."""
    scene.root.find("turned/wall").hide()
    return scene


each_order = pytest.mark.parametrize("first", ["wall", "decal"])


@each_order
@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("position_method", METHODS)
def test_a_decal_is_seen_wherever_it_lies(render, first, orthographic, position_method):
    scene = decal_scene(first, orthographic=orthographic)
    lies = render(alone(scene), "id", position_method=position_method).id >= 0
    assert 250 < lies.sum() < 1000
    scene.root.find("turned/wall").show()
    frame = render(scene, "id", "color", position_method=position_method)
    names = np.array([*frame.id_names, "nothing"])[frame.id]
    assert ((names == "root/turned/decal") == lies).all()


@each_order
def test_one_away_from_the_camera_is_not_seen(render, first):
    scene = decal_scene(first, offset=-1)
    frame = render(scene, "id", "visibility")
    assert "root/turned/wall" in frame.id_names
    seen = {frame.id_names[number].split("/")[-1] for number in np.unique(frame.id[frame.id >= 0])}
    assert seen == {"wall"}


DATA = ("depth", "position", "position_world", "normal")


@pytest.mark.parametrize("offset", [1, 7, -3])
@pytest.mark.parametrize("position_method", METHODS)
def test_outputs_are_those_of_the_surface_itself(render, position_method, offset):
    """Where depths would be moved, positions are stored beside them."""
    method = "linear32f" if position_method not in STORED_POSITIONS else position_method
    plain = render(alone(decal_scene(offset=0)), *DATA, position_method=method)
    moved = render(alone(decal_scene(offset=offset)), *DATA, position_method=position_method)
    for name in DATA:
        assert np.array_equal(getattr(plain, name), getattr(moved, name), equal_nan=True), name


def lit(scene):
    scene.root.attach_new_node(AmbientLight("sky", (0.1, 0.2, 0.3)))
    sun = DirectionalLight("sun", (0.5, 0.4, 0.3))
    sun.set_direction((0.2, 1, -0.3))
    scene.root.attach_new_node(sun)
    for place in ((-1, 6, 1), (1, 7.5, 0), (0.5, 10.5, 2)):
        scene.root.attach_new_node(PointLight("lamp", (1, 1, 1), 4.0)).set_pos(*place)
    return scene


@pytest.mark.parametrize("light_method", ["volumes", "clustered", "fullscreen", "loop", "forward"])
@pytest.mark.parametrize("offset", [1, 40, -40])
def test_light_is_that_of_the_surface_itself(render, light_method, offset):
    """Forty steps of this wall are more than two of its units: a lamp's volume would end before them."""
    settings = {"light_method": light_method, "position_method": "linear32f", "cutoff_budget": 0.0}
    plain = render(alone(lit(decal_scene(offset=0))), "radiance", **settings)
    moved = render(alone(lit(decal_scene(offset=offset))), "radiance", **settings)
    assert plain.radiance.max() > 0.5
    assert np.array_equal(plain.radiance, moved.radiance)


def test_offsets_do_not_move_shadows(render):
    def shadowed(offset):
        scene = lit(decal_scene(offset=offset))
        scene.root.find("sun").node().set_shadow_caster(True, 256)
        scene.root.find("turned/decal").set_pos(0, -1.5, 0)
        return render(scene, "radiance")

    assert np.array_equal(shadowed(0).radiance, shadowed(2).radiance)


@each_order
@pytest.mark.parametrize("method", ["sorted", "exact"])
def test_a_blended_decal_lies_over_a_blended_wall(render, first, method):
    """Both let through half of what is behind."""
    scene = decal_scene(first, alpha_mode="blend", unlit=True, base_color=(1, 1, 0, 0.5), double_sided=True)
    pane = Material("pane", (0, 0, 1, 0.5), alpha_mode="blend", unlit=True, double_sided=True)
    scene.root.find("turned/wall").set_material(pane)
    scene.root.find("turned/wall").show()
    frame = render(scene, "radiance", transparency=method)
    decal = frame.radiance[..., 0] > 0
    assert 250 < decal.sum() < 1000
    assert np.abs(frame.radiance[decal] - (0.5, 0.5, 0.25)).max() <= 1e-3


@each_order
@pytest.mark.parametrize("method", ["sorted", "exact", "weighted"])
@pytest.mark.parametrize("offset", [1, -1])
def test_a_blended_decal_on_an_opaque_wall(render, first, method, offset):
    scene = decal_scene(first, offset, alpha_mode="blend", unlit=True, base_color=(1, 1, 0, 0.5))
    scene.root.find("turned/wall").set_material(Material("plaster", (0, 0, 1, 1), unlit=True))
    frame = render(scene, "radiance", transparency=method)
    decal = frame.radiance[..., 0] > 0
    assert (decal.sum() > 250) == (offset > 0)
    assert np.abs(frame.radiance[decal] - (0.5, 0.5, 0.5)).max(initial=0) <= 1e-3


# --- Costs ---


def plan_of(scene, **settings):
    return build_plan(scene, Settings(**settings), SIZE, ("color",))


@pytest.mark.parametrize("position_method", METHODS)
def test_without_an_offset_nothing_is_different(position_method):
    """An offset of 0, and one of lines or edges, is none."""
    settings = {"position_method": position_method, "light_method": "volumes"}
    plain = plan_of(lit(decal_scene(offset=0)), **settings)
    zero, edges = lit(decal_scene(offset=1)), lit(decal_scene(offset=1))
    zero.root.find("turned/decal").set_depth_offset(0)
    edges.root.find("turned/decal").set_render_mode_wireframe()
    for scene in (zero, edges):
        plan = plan_of(scene, **settings)
        assert plan.passes == plain.passes
        assert plan.targets == plain.targets
        assert all(batch.depth_offset == 0 for batch in plan.batches)


def test_an_offset_costs_a_distance_and_says_why():
    plan = plan_of(lit(decal_scene()), position_method="depth32f", light_method="volumes")
    assert plan.target("distance") is not None
    assert (
        plan.target("depth").format
        == plan_of(lit(decal_scene(offset=0)), position_method="depth32f").target("depth").format
    )
    reason = "position_method=linear32f, since depth offsets move what a depth buffer holds"
    assert reason in str(plan.target("distance"))


def test_changes_show_at_once():
    scene = decal_scene("wall", offset=0)
    decal = scene.root.find("turned/decal")

    def seen(offset):
        decal.set_depth_offset(offset)
        frame = renderer.render(scene, outputs=("id",))
        return int((np.array([*frame.id_names, ""])[frame.id] == "root/turned/decal").sum())

    with make_renderer(SIZE) as renderer:
        counts = [seen(offset) for offset in (1, -1, 1, 1)]
    assert counts[0] == counts[2] == counts[3] > 250 > counts[1] == 0
