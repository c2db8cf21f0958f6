"""A frame holds what its scene, settings and outputs require, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from firefly_sample.errors import LightError, NodeError, OutputError, PlanError, SceneError
from firefly_sample.pipeline import build_plan
from firefly_sample.plan.frame_graph import check_passes
from firefly_sample.plan.frame_plan import Capabilities, PassPlan
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings
from tests.scenes import ball_scene, geom_node, new_planner, wall, wall_scene


def names(plan):
    return [step.name for step in plan.passes], {
        target.name: target.bytes_per_pixel for target in plan.targets
    }


def cost(scene, settings=None, outputs=("color",), capabilities=None):
    return names(build_plan(scene, settings, (64, 48), outputs, 0.0, capabilities))


def test_an_empty_scene_is_a_background():
    assert cost(Scene()) == (["resolve"], {"color": 4})


def test_each_feature_adds_exactly_its_cost():
    """The whole ladder, from nothing to a lit scene with every extra; each step names all that it adds."""
    scene = wall_scene()
    passes, targets = cost(scene)
    assert (passes, targets) == (["geometry", "resolve"], {"depth": 4, "albedo": 4, "color": 4})
    scene.root.attach_new_node(AmbientLight("moon", (0.01, 0.01, 0.02)))
    targets["radiance"] = 16
    assert cost(scene) == (["geometry", "ambient", "resolve"], targets)
    light = scene.root.attach_new_node(PointLight("lamp", (1, 1, 1), 5.0))
    light.set_pos(0, 8, 0)
    lit = {**targets, "normal": 4, "distance": 4}
    assert cost(scene) == (["geometry", "ambient", "point_lights", "resolve"], lit)
    dots = scene.root.attach_new_node(Sprites("dots", [(0, 5, 0)]))
    everything = ["geometry", "ambient", "point_lights", "sprites", "resolve"]
    assert cost(scene) == (everything, lit)
    assert cost(scene, outputs=("color", "id")) == (everything, {**lit, "id": 4})
    assert cost(scene, outputs=("color", "radiance")) == (everything, {**lit, "final_radiance": 16})
    assert cost(scene, outputs=("color", "depth", "normal", "position")) == (everything, lit)
    # and each leaves with what asked for it
    light.hide()
    dots.detach_node()
    assert cost(scene) == (["geometry", "ambient", "resolve"], targets)


def test_each_kind_of_light_and_of_material_adds_exactly_its_cost():
    """The ladder goes on: directional lights, spotlights, shadows, and what materials ask for."""
    material = Material("clay")
    scene = wall_scene(material=material)
    base = {"depth": 4, "albedo": 4, "color": 4}
    lit = {**base, "normal": 4, "radiance": 16}
    sun = DirectionalLight("sun")
    path = scene.root.attach_new_node(sun)
    path.set_p(-20)
    # no place is needed where light comes from everywhere alike
    assert cost(scene) == (["geometry", "directional_lights", "resolve"], lit)
    material.set_specular((0.1, 0.1, 0.1))
    shiny = {**lit, "specular": 8}
    assert cost(scene) == (["geometry", "directional_lights", "resolve"], shiny)
    sun.set_shadow_caster(True, 64)
    card = scene.root.attach_new_node(geom_node("card", wall(1.0)))
    card.set_pos(0, 5, 3)
    shadowed = {**shiny, "distance": 4, "shadow_atlas": 4}
    assert cost(scene) == (["shadow_maps", "geometry", "directional_lights", "resolve"], shadowed)
    sun.set_shadow_caster(False)
    card.detach_node()
    material.set_specular((0, 0, 0))
    spot = scene.root.attach_new_node(Spotlight("spot", radius=20.0))
    placed = {**lit, "distance": 4}
    assert cost(scene) == (["geometry", "directional_lights", "spotlights", "resolve"], placed)
    path.hide()
    assert cost(scene) == (["geometry", "spotlights", "resolve"], placed)
    spot.hide()
    material.set_ambient((1, 0, 0))  # there is no ambient light yet
    assert cost(scene) == (["geometry", "resolve"], base)
    scene.root.attach_new_node(AmbientLight("moon", (0.1, 0.1, 0.1)))
    own = {**base, "radiance": 16, "ambient_albedo": 4}
    assert cost(scene) == (["geometry", "ambient", "resolve"], own)
    material.set_ambient(None)
    material.set_emission((1, 1, 1))
    assert cost(scene) == (["geometry", "ambient", "resolve"], {**base, "radiance": 16, "emission": 16})
    scene.root.find("wall").hide()  # what is not in view asks for nothing
    assert cost(scene) == (["resolve"], {"color": 4})


def test_buffers_to_look_at_cost_what_they_show():
    scene = ball_scene(20, ambient=(0.1, 0.1, 0.1))
    passes, targets = cost(scene)
    assert cost(scene, outputs=("color", "light")) == (passes, {**targets, "light": 16})
    assert cost(scene, outputs=("light",)) == (
        ["geometry", "ambient", "point_lights"],
        {"depth": 4, "albedo": 4, "normal": 4, "distance": 4, "light": 16},
    )
    for name, size in (("overdraw", 4), ("volumes", 4), ("wireframe", 4)):
        assert cost(scene, outputs=(name,)) == (["geometry", name], {"depth": 4, name: size})
    assert cost(scene, outputs=("specular",)) == (["geometry"], {"depth": 4, "albedo": 4, "specular": 8})
    assert cost(scene, outputs=("emission",)) == (["geometry"], {"depth": 4, "albedo": 4, "emission": 16})
    assert cost(scene, outputs=("shadow_atlas",)) == ([], {})
    sun = DirectionalLight("sun")
    sun.set_shadow_caster(True, 64)
    scene.root.attach_new_node(sun).set_p(-50)
    assert cost(scene, outputs=("shadow_atlas",)) == (["shadow_maps"], {"shadow_atlas": 4})
    assert cost(scene, outputs=("id",)) == (["geometry"], {"depth": 4, "id": 4})  # nobody looks maps up


def test_the_forest_pays_for_a_sun_and_for_its_shadows_alone():
    scene = build_scene(find_scene("forest"), fireflies=50)
    targets = {"depth": 4, "albedo": 4, "normal": 4, "distance": 4, "radiance": 16, "color": 4}
    passes = ["geometry", "ambient", "point_lights", "sprites", "resolve"]
    assert cost(scene) == (passes, targets)
    sun = DirectionalLight("sun")
    scene.root.attach_new_node(sun).set_p(-50)
    sunny = ["geometry", "ambient", "directional_lights", "point_lights", "sprites", "resolve"]
    assert cost(scene) == (sunny, targets)
    sun.set_shadow_caster(True, 256)
    assert cost(scene) == (["shadow_maps", *sunny], {"shadow_atlas": 4, **targets})


def test_a_light_without_end_is_said_to_cost_a_full_screen():
    scene = wall_scene()
    for name in ("a", "b"):
        scene.root.attach_new_node(PointLight(name))
    scene.root.attach_new_node(PointLight("c", radius=30.0)).set_pos(0, 8, 0)
    plan = build_plan(scene)
    (step,) = [step for step in plan.passes if step.name == "point_lights"]
    assert "3 point lights in view, 2 of them without end: over the full screen" in step.because
    assert [lights.proxy for lights in plan.lights].count("fullscreen") == 1


def test_a_long_list_of_materials_is_cut():
    scene = wall_scene()
    for k in range(9):
        material = Material(f"m{k}", emission=(1, 1, 1))
        scene.root.attach_new_node(geom_node(f"card {k}", wall(1.0), material)).set_pos(0, 8, 0)
    reasons = {target.name: target.because for target in build_plan(scene).targets}
    assert reasons["emission"] == "emission of m0, m1, m2, m3 and 5 more"


def test_instances_with_different_colors_are_one_draw():
    """Materials that differ in colours alone share a draw; those with another texture do not."""
    scene = wall_scene()
    geom, texture = wall(1.0), Texture(np.full((2, 2, 4), 255, dtype=np.uint8))
    for k in range(6):
        material = Material(
            f"m{k}", (0.1 * k, 0.5, 0.5, 1), emission=(k, 0, 0), specular=(0.1, 0, 0), shininess=k
        )
        material.texture = texture if k % 2 else None
        scene.root.attach_new_node(geom_node(f"card {k}", geom, material)).set_pos(0, 5, 0)
    batches = [batch for batch in build_plan(scene).batches if batch.geom is geom]
    assert sorted(len(batch.ids) for batch in batches) == [3, 3]
    for batch in batches:
        numbers = batch.factors.speculars[:, 3]
        assert batch.factors.emissions[:, 0] == pytest.approx(numbers)
        assert batch.factors.base_colors[:, 0] == pytest.approx(0.1 * numbers)


def test_classic_says_what_it_leaves_out():
    scene = wall_scene(material=Material("m", specular=(1, 1, 1), emission=(1, 1, 1)))
    sun = DirectionalLight("sun")
    sun.set_shadow_caster(True)
    scene.root.attach_new_node(sun)
    plan = build_plan(scene, Settings(look="classic"))
    assert plan.warnings == (
        "look 'classic' leaves out, as the original does: highlights, emission, shadows",
    )
    assert names(plan)[0] == ["geometry", "directional_lights", "resolve"]
    for output in ("specular", "shininess", "emission"):
        with pytest.raises(OutputError, match=f"look 'classic' has no output '{output}'"):
            build_plan(scene, Settings(look="classic"), outputs=(output,))


def test_data_without_a_picture_computes_no_light():
    scene = ball_scene(20)
    assert cost(scene, outputs=("depth",)) == (["geometry"], {"depth": 4, "distance": 4})
    assert cost(scene, outputs=("id",)) == (["geometry"], {"depth": 4, "id": 4})
    # where no distance tells what was drawn, the albedo's alpha does: a depth may round to the clear value
    assert cost(scene, outputs=("normal",)) == (["geometry"], {"depth": 4, "albedo": 4, "normal": 4})
    for position in ("depth24", "depth32f"):
        assert cost(scene, Settings(position_method=position), ("depth",)) == (
            ["geometry"],
            {"depth": 4, "albedo": 4},
        )


@pytest.mark.parametrize("position", ["depth32f", "depth24"])
def test_position_from_depth_trades_the_distance_for_a_copy(position):
    scene = ball_scene(20)
    passes, targets = cost(scene, Settings(position_method=position))
    assert passes == ["geometry", "depth_copy", "point_lights", "resolve"]
    assert targets == {"depth": 4, "albedo": 4, "normal": 4, "depth_copy": 4, "radiance": 16, "color": 4}


def test_a_driver_without_clip_control_gets_a_standard_depth_and_a_warning():
    old = Capabilities(clip_control=False, snorm_targets=False)
    scene = ball_scene(20)
    plan = build_plan(scene, None, (64, 48), capabilities=old)
    assert (plan.target("depth").format, plan.target("normal").format) == ("depth24", "rg16")
    assert not plan.view.reverse
    assert plan.warnings == ()
    warned = build_plan(scene, Settings(position_method="depth32f"), (64, 48), capabilities=old)
    assert "ARB_clip_control" in warned.warnings[0]
    assert build_plan(scene, Settings(position_method="depth32f"), (64, 48)).warnings == ()


def pane(alpha=1.0, texel=255):
    texture = Texture(np.full((2, 2, 4), (9, 9, 9, texel)))
    scene = wall_scene(material=Material("pane", (1, 1, 1, alpha), texture, alpha_mode="blend"))
    scene.root.attach_new_node(AmbientLight("sky", (1, 1, 1)))
    return scene


def blended_warnings(scene, outputs=("id",), settings=None):
    """What is said about blended materials; nothing else is in these scenes."""
    return build_plan(scene, settings or Settings(), (64, 48), outputs).warnings


def test_blended_materials_that_data_leave_out_are_named():
    said = "outputs depth, id show the nearest opaque surface: blended materials are not in them: pane"
    tinted = pane()
    tinted.root.set_color(1, 1, 1, 0.5)
    for scene in (pane(alpha=0.99), pane(texel=254), tinted):
        assert blended_warnings(scene, ("color", "depth", "id")) == (said,)
        assert blended_warnings(scene, ("color",)) == ()
        assert "transparency" in cost(scene)[0]


def test_the_classic_look_names_blended_materials_as_cut_outs():
    (said,) = blended_warnings(pane(alpha=0.99), ("color",), Settings(look="classic"))
    assert said == (
        "look 'classic' draws blended materials as cut-outs: pane (nothing is drawn where alpha is below "
        "alpha_cutoff, 0.5 by default)"
    )


def test_blended_materials_that_let_nothing_through_are_opaque():
    """Exporters mark what is opaque as blended; what is changed afterwards is seen."""
    scene = pane()
    assert "transparency" not in cost(scene)[0]
    assert blended_warnings(scene) == ()
    ((_, material),) = scene.root.find("wall").node().geoms
    material.texture.set_pixels(np.full((2, 2, 4), 254))
    assert "transparency" in cost(scene)[0]
    material.texture.set_pixels(np.full((2, 2, 4), 255))
    assert "transparency" not in cost(scene)[0]
    material.set_base_color((1, 1, 1, 0.5))
    assert blended_warnings(scene) != ()


def test_only_the_blended_materials_that_let_something_through_are_named():
    scene = Scene()
    node = geom_node("panes", wall(), Material("clear", (1, 1, 1, 0.5), alpha_mode="blend"))
    node.add_geom(node.geoms[0][0], Material("solid", alpha_mode="blend"))
    node.add_geom(node.geoms[0][0], Material("leaf", (1, 1, 1, 0.2), alpha_mode="mask"))
    scene.root.attach_new_node(node)
    scene.root.attach_new_node(AmbientLight("sky", (1, 1, 1)))
    (said,) = blended_warnings(scene)
    assert said.endswith("blended materials are not in them: clear")
    assert len(build_plan(scene, Settings(), (64, 48), ("id",)).batches) == 2  # of solid and leaf


def test_a_flat_colour_makes_one_node_translucent_and_not_its_twin():
    scene = pane()
    scene.root.find("wall").copy_to(scene.root)
    first, second = scene.root.find_all_matches("wall")
    first.set_color(1, 1, 1, 1)
    second.set_color(1, 1, 1, 0.5)
    plan = build_plan(scene, Settings(), (64, 48), ("id",))
    assert [len(batch.ids) for batch in plan.batches] == [1]


def test_a_geom_without_triangles_costs_nothing():
    scene = Scene()
    scene.root.attach_new_node(geom_node("dust", Geom([(0, 5, 0)], np.zeros((0, 3), int))))
    scene.root.attach_new_node(PointLights("l", [(0, 5, 0)], (1, 1, 1), 5.0))
    assert cost(scene) == (["resolve"], {"color": 4})


def test_camera_masks_choose_what_is_seen():
    scene = wall_scene()
    scene.root.find("wall").hide(0b01)
    scene.camera.node().camera_mask = 0b01
    planner = new_planner()

    def batches():
        return planner.plan(scene, Settings(), (64, 48), ("color",), 0.0, Capabilities()).batches

    assert batches() == ()
    scene.camera.node().camera_mask = 0b10
    assert len(batches()) == 1


def test_what_stands_above_the_root_counts_also_when_it_changes():
    scene = wall_scene()
    above = NodePath("above")
    scene.root.reparent_to(above)
    planner = new_planner()

    def batches():
        return planner.plan(scene, Settings(), (64, 48), ("color",), 0.0, Capabilities()).batches

    assert batches()[0].model_to_view[0, 3, 1] == 10
    scene.root.find("wall").set_y(12)
    assert batches()[0].model_to_view[0, 3, 1] == 12
    above.hide()
    assert batches() == ()


def test_a_camera_under_scaled_and_sheared_parents_keeps_a_right_angled_view():
    scene = wall_scene()
    stretch = scene.root.attach_new_node("stretch")
    stretch.set_scale(3, 1, 0.5)
    scene.camera.reparent_to(stretch)
    scene.camera.set_hpr(20, 10, 5)
    plan = build_plan(scene)
    turn = plan.view.view_to_world[:3, :3]
    assert np.abs(turn @ turn.T - np.eye(3)).max() < 1e-15
    forward = scene.camera.get_net_transform().get_mat()[1, :3]
    assert np.abs(turn[1] - forward / np.linalg.norm(forward)).max() < 1e-15
    stretch.set_scale(-1, 1, 1)
    with pytest.raises(NodeError, match="mirrored"):
        build_plan(scene)


def test_every_target_and_pass_says_what_asked_for_it():
    plan = build_plan(ball_scene(20), outputs=("color", "id"))
    assert all(step.because for step in plan.passes)
    reasons = {target.name: target.because for target in plan.targets}
    assert reasons["id"] == "output id"
    assert "20 point lights" in reasons["normal"]


def test_lights_are_counted_never_dropped():
    scene = wall_scene()
    positions = [(0, 8, 0), (0, -500, 0), (0, 8, 0)]
    scene.root.attach_new_node(PointLights("l", positions, [(1, 1, 1), (1, 1, 1), (0, 0, 0)], 5.0))
    plan = build_plan(scene)
    assert (plan.counts.in_scene, plan.counts.in_view, plan.counts.dropped) == (3, 1, 0)
    assert sum(len(lights) for lights in plan.lights) == 1
    many = wall_scene()
    many.root.attach_new_node(PointLights("l", np.tile([0.0, 8, 0], (20000, 1)), (1, 1, 1), 5.0))
    assert build_plan(many).counts.in_view == 20000


def test_functions_of_time_are_evaluated_for_the_frame_and_not_kept():
    scene = wall_scene()
    node = PointLights("l", function=lambda t: ([(t, 8, 0)], (1, 1, 1), 5.0))
    scene.root.attach_new_node(node)
    planner = new_planner()
    for time in (1.0, 2.0, 1.0):
        plan = planner.plan(scene, Settings(), (64, 48), ("color",), time, Capabilities())
        assert plan.lights[0].positions[0, 0] == pytest.approx(time, abs=1e-12)
    assert len(node.arrays) == 0


def test_a_plan_keeps_the_material_that_it_was_made_with():
    material = Material("clay", (0.5, 0.5, 0.5, 1.0))
    scene = wall_scene(material=material)
    scene.root.set_color((0.5, 1.0, 1.0, 1.0))
    plan = build_plan(scene)
    material.set_base_color((1.0, 0.0, 0.0, 1.0))
    assert plan.batches[0].factors.base_colors.tolist() == [[0.25, 0.5, 0.5, 1.0]]
    assert build_plan(scene).batches[0].factors.base_colors.tolist() == [[0.5, 0.0, 0.0, 1.0]]


def test_a_still_scene_is_walked_once():
    scene = ball_scene(20)
    planner = new_planner()

    def snapshot():
        planner.plan(scene, Settings(), (64, 48), ("color",), 0.0, Capabilities())
        (kept,) = planner._snapshots.values()
        return kept

    first = snapshot()
    assert snapshot() is first
    scene.root.find("place 1").set_x(1)
    second = snapshot()
    assert second is not first
    scene.root.find("**/ball").node().geoms[0][0].set_vertices(np.zeros((642, 3)))
    assert snapshot() is not second


def test_batches_are_front_to_back_opaque_first():
    plan = build_plan(ball_scene(0))
    for batch in plan.batches:
        depths = batch.model_to_view[:, 3, 1]
        assert (np.diff(depths) >= -1e-9).all()
    cut = [batch.surface.cutout for batch in plan.batches]
    assert cut == sorted(cut)


def test_what_is_wrong_is_named():
    scene = wall_scene()
    with pytest.raises(OutputError, match="no output 'colour'"):
        build_plan(scene, outputs=("colour",))
    with pytest.raises(OutputError, match="'depth' is a sample"):
        build_plan(scene, Settings(supersample=2), outputs=("depth",))
    for size in ((0, 5), (5, -1), (2.5, 3), "big", (2**21, 1)):
        with pytest.raises(OutputError, match="size"):
            build_plan(scene, size=size)
    scene.background = "red"
    with pytest.raises(SceneError, match="background must be three numbers"):
        build_plan(scene)
    scene.background = (0.0, 0.0, 0.0)
    with pytest.raises(SceneError, match="time"):
        build_plan(scene, time=float("nan"))
    scene.root.attach_new_node(PointLights("swarm", function=lambda t: ([(0, 0, np.nan)], (1, 1, 1), 1.0)))
    with pytest.raises(LightError, match="'swarm': entry 0: its position is not finite"):
        build_plan(scene)
    flat = wall_scene()
    flat.camera.node()
    flat.camera.set_mat(np.diag([1.0, 0.0, 1.0, 1.0]))
    with pytest.raises(NodeError, match="camera"):
        build_plan(flat)


def test_inconsistent_passes_are_refused_by_name():
    plan = build_plan(ball_scene(5))
    geometry, lights, resolve = plan.passes
    with pytest.raises(PlanError, match="'point_lights' reads target 'albedo', which no pass wrote"):
        check_passes((lights, geometry, resolve), plan.targets)
    with pytest.raises(PlanError, match="'point_lights' reads target 'distance', which no pass wrote"):
        check_passes((replace(geometry, writes=("depth", "albedo", "normal")), lights, resolve), plan.targets)
    with pytest.raises(PlanError, match="'point_lights' samples target 'depth' while"):
        check_passes((geometry, replace(lights, reads=("depth",)), resolve), plan.targets)
    with pytest.raises(PlanError, match="'depth' is never written"):
        check_passes(
            (PassPlan("resolve", (), ("color",), (), "x"),),
            [t for t in plan.targets if t.name in ("color", "depth")],
        )
    with pytest.raises(PlanError, match="'fog', which this frame does not have"):
        check_passes((replace(geometry, updates=("fog",)),), plan.targets)
