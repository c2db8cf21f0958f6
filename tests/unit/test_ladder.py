"""Metallic-roughness materials, blended surfaces and color_alpha cost a frame nothing until it has them."""

from dataclasses import replace

import numpy as np
import pytest

from firefly_sample.errors import OutputError, PlanError
from firefly_sample.passes.base import FullscreenPass
from firefly_sample.passes.geometry import surface_fields
from firefly_sample.passes.lights import LIGHT_PASSES, variant_for
from firefly_sample.pipeline import PASSES, build_plan
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.variants import defines
from firefly_sample.scene.lights import AmbientLight, PointLight
from firefly_sample.scene.material import Material, Texture
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings
from tests.scenes import geom_node, wall, wall_scene
from tests.unit.test_plan import cost

# --- The package's own scenes ---

DEFINES = {
    "particle_shadow_slices": "",
    "particle_shadow_sums": "",
    "geometry": """
        albedo normal distance ambient_albedo specular emission id visibility position_target normal_format
        albedo_format interpolation orthographic textured vertex_color cutout double_sided vertex_alpha
        emission_textured second_texcoords""",
    "ambient": "albedo_format emission light lit own radiance",
    "directional_lights": """
        albedo_format clamp_light falloff light light_method light_resolution normal_format orthographic
        particle_shadow position_source radiance range_falloff shadow_taps specular_model""",
    "particle_light": """
        attenuated falloff first light_kind orthographic particle_shadow range_falloff shadow_taps""",
    "particles": "orthographic packed position_source reverse surfaces",
    "sprites": "orthographic",
    "resolve": """
        color final_radiance gradient look marked masked orthographic packed particles radiance supersample
        tone""",
}
"""Names of all defines of each pass's shaders; those of every lighting pass are the same."""
LIT = {"depth": 4, "albedo": 4, "normal": 4, "distance": 4, "radiance": 16, "color": 4}
OWN = {
    "forest": ({"fireflies": 50}, "geometry ambient point_lights sprites resolve", LIT),
    "lightbulbs": (
        {"columns": 4, "rows": 4},
        "geometry ambient point_lights sprites resolve",
        LIT | {"specular": 8, "emission": 16},
    ),
    "smoke": (
        {},
        "particle_shadow_slices particle_shadow_sums geometry ambient directional_lights particle_light "
        "particles resolve",
        LIT | {"particle_shadow_atlas": 4, "particle_shadow_sum": 4, "particle_light": 16, "particles": 16},
    ),
    "spheres": ({}, "geometry ambient point_lights resolve", LIT),
}
"""Parameters, passes and targets of each scene, before there were such materials."""


def drawn_variants(plan, step):
    """The variants of a pass's shaders: the frame's, and those of its draws."""
    yield step.variant
    if step.name == "geometry":
        wanted = step.variant.emission, step.variant.normal, step.variant.ambient_albedo, False
        for batch in plan.batches:
            yield replace(step.variant, **surface_fields(batch.surface, *wanted))
    if step.name in LIGHT_PASSES:
        for lights in plan.lights:
            yield variant_for(step.variant, lights)


@pytest.mark.parametrize("name", OWN)
def test_the_own_scenes_have_the_passes_targets_and_defines_that_they_had(name):
    parameters, passes, targets = OWN[name]
    plan = build_plan(build_scene(find_scene(name), **parameters), None, (64, 48))
    assert [step.name for step in plan.passes] == passes.split()
    assert {target.name: target.bytes_per_pixel for target in plan.targets} == targets
    for step in plan.passes:
        expected = DEFINES["directional_lights" if step.name in LIGHT_PASSES else step.name]
        for variant in drawn_variants(plan, step):
            assert {key.lower() for key in defines(variant)} == set(expected.split()), step.name


# --- Metallic-roughness materials ---


def metal_scene(**maps):
    return wall_scene(material=Material("metal", metallic=0.5, roughness=0.4, **maps))


def image(*texel):
    return Texture(np.full((2, 2, 4), texel, dtype=np.uint8))


def lamp(scene):
    light = scene.root.attach_new_node(PointLight("lamp", (1, 1, 1), 5.0))
    light.set_pos(0, 8, 0)
    return light


def test_metals_cost_their_numbers_where_light_meets_them():
    scene = metal_scene()
    base = {"depth": 4, "albedo": 4, "color": 4}
    assert cost(scene) == (["geometry", "resolve"], base)
    sky = scene.root.attach_new_node(AmbientLight("sky", (0.1, 0.1, 0.1)))
    own = {**base, "ambient_albedo": 4, "radiance": 16}
    assert cost(scene) == (["geometry", "ambient", "resolve"], own)
    light = lamp(scene)
    both = {**LIT, "ambient_albedo": 4, "metallic_roughness": 4}
    passes = ["geometry", "ambient", "point_lights", "resolve"]
    assert cost(scene) == (passes, both)
    sky.hide()
    lit = {**LIT, "metallic_roughness": 4}
    assert cost(scene) == (["geometry", "point_lights", "resolve"], lit)
    # what a white surface would show, and data, need no material
    white = {name: LIT[name] for name in ("depth", "albedo", "normal", "distance")}
    assert cost(scene, outputs=("light",)) == (["geometry", "point_lights"], {**white, "light": 16})
    assert cost(scene, outputs=("normal",)) == (["geometry"], {"depth": 4, "albedo": 4, "normal": 4})
    # one of another model beside it changes nothing; without it, nothing is left
    card = scene.root.attach_new_node(geom_node("card", wall(1.0), Material("clay")))
    card.set_pos(0, 5, 0)
    assert cost(scene) == (["geometry", "point_lights", "resolve"], lit)
    scene.root.find("wall").hide()
    assert cost(scene) == (["geometry", "point_lights", "resolve"], LIT)
    light.hide()
    assert cost(scene) == (["geometry", "resolve"], base)


@pytest.mark.parametrize("output", ["metallic", "roughness"])
def test_their_outputs_cost_what_they_show(output):
    assert cost(metal_scene(), outputs=(output,)) == (["geometry"], {"depth": 4, "metallic_roughness": 4})
    with pytest.raises(OutputError, match=f"look 'classic' has no output '{output}'"):
        build_plan(metal_scene(), Settings(look="classic"), outputs=(output,))


def test_the_look_classic_has_no_metals():
    scene = metal_scene()
    lamp(scene)
    _, targets = cost(scene, Settings(look="classic"))
    assert "metallic_roughness" not in targets


def names_of(scene, outputs=("color",)):
    """The defines of the geometry pass beyond those that every frame has."""
    plan = build_plan(scene, None, (64, 48), outputs)
    (step,) = [step for step in plan.passes if step.name == "geometry"]
    frame = step.variant
    wanted = frame.emission, frame.normal, frame.ambient_albedo, frame.metallic_roughness
    found = set()
    for batch in plan.batches:
        found |= set(defines(replace(frame, **surface_fields(batch.surface, *wanted))))
    return {name.lower() for name in found} - set(DEFINES["geometry"].split())


def test_a_map_is_sampled_only_where_something_shows_it():
    normal = {"normal_texture": image(128, 128, 255, 255)}
    occlusion = {"occlusion_texture": image(9, 9, 9, 255)}
    rough = {"metallic_roughness_texture": image(9, 9, 9, 255)}
    scene = metal_scene(**normal, **occlusion, **rough)
    assert names_of(scene) == set()
    scene.root.attach_new_node(AmbientLight("sky", (0.1, 0.1, 0.1)))
    assert names_of(scene) == {"metallic", "metallic_map", "occlusion_map"}
    light = lamp(scene)
    everything = {"metallic", "metallic_map", "occlusion_map", "normal_map", "metallic_roughness"}
    assert names_of(scene) == everything
    scene.root.find("sky").hide()
    assert names_of(scene) == everything - {"occlusion_map"}
    assert names_of(scene, ("normal",)) == {"normal_map"}
    light.hide()
    assert names_of(scene) == set()


def test_a_second_texture_costs_its_define():
    assert names_of(metal_scene(modulate_texture=image(9, 9, 9, 255))) == {"modulate_map"}


def test_unlit_surfaces_cost_what_emission_costs():
    scene = wall_scene(material=Material("sign", unlit=True))
    expected = {"depth": 4, "albedo": 4, "emission": 16, "radiance": 16, "color": 4}
    assert cost(scene) == (["geometry", "ambient", "resolve"], expected)
    assert cost(scene, outputs=("depth",)) == (["geometry"], {"depth": 4, "distance": 4})


# --- Blended surfaces ---

LAYERS = {
    "layer": 16,
    "layer_depth": 4,
    "layer_place": 8,
    "layer_number": 8,
    "peeled_depth": 4,
    "peeled_place": 8,
    "peeled_number": 8,
}
METHODS = {
    "sorted": {"transparency": 16},
    "exact": {"transparency": 16, **LAYERS},
    "weighted": {"transparency": 16, "transparency_weight": 4},
}


def pane(alpha=0.5, texel=255, **material):
    """A lit wall, and a pane before it."""
    scene = wall_scene()
    lamp(scene)
    given = Material("pane", (1, 1, 1, alpha), image(9, 9, 9, texel), "blend", **material)
    scene.root.attach_new_node(geom_node("pane", wall(1.0), given)).set_pos(0, 5, 0)
    return scene


@pytest.mark.parametrize("method", METHODS)
def test_blended_surfaces_cost_their_methods_targets(method):
    settings = Settings(transparency=method)
    scene = pane()
    passes = ["geometry", "point_lights", "transparency", "resolve"]
    assert cost(scene, settings) == (passes, {**LIT, **METHODS[method]})
    # each output and each material that adds nothing to it
    assert cost(scene, settings, ("depth",)) == (["geometry"], {"depth": 4, "distance": 4})
    classic = Settings(transparency=method, look="classic")
    assert "transparency" not in cost(scene, classic)[0]
    scene.root.find("pane").set_x(500)
    plain = ["geometry", "point_lights", "resolve"]
    assert cost(scene, settings) == (plain, LIT)
    assert cost(pane(alpha=1.0), settings) == (plain, LIT)  # it lets nothing through
    assert cost(pane(alpha=1.0, texel=254), settings) == (passes, {**LIT, **METHODS[method]})


@pytest.mark.parametrize(
    "material",
    [
        {"metallic": 1.0},
        {"specular": (1, 1, 1), "shininess": 20.0, "ambient": (1, 0, 0), "emission": (1, 1, 1)},
        {"unlit": True},
        {"occlusion_texture": image(9, 9, 9, 255)},
    ],
    ids=lambda material: next(iter(material)),
)
def test_materials_of_blended_surfaces_need_no_targets(material):
    """They are shaded as they are drawn; the surfaces behind them pay nothing."""
    scene = pane(**material)
    scene.root.attach_new_node(AmbientLight("sky", (0.1, 0.1, 0.1)))
    assert cost(scene) == (
        ["geometry", "ambient", "point_lights", "transparency", "resolve"],
        {**LIT, "transparency": 16},
    )


# --- color_alpha ---


def test_color_alpha_costs_its_pixels():
    scene = wall_scene()
    lamp(scene)
    passes = ["geometry", "point_lights", "resolve"]
    assert cost(scene, outputs=("color", "color_alpha")) == (passes, {**LIT, "color_alpha": 4})
    alone = {name: size for name, size in LIT.items() if name != "color"}
    assert cost(scene, outputs=("color_alpha",)) == (passes, {**alone, "color_alpha": 4})
    resolve = build_plan(scene, outputs=("color_alpha",)).passes[-1]
    assert set(defines(resolve.variant)) - {name.upper() for name in DEFINES["resolve"].split()} == {
        "COLOR_ALPHA"
    }


# --- The most targets that a pass can draw into ---


def everything():
    """Surfaces of both models, with colours for ambient light and emission of their own."""
    scene = wall_scene(material=Material("tin", specular=(1, 1, 1), ambient=(1, 0, 0), emission=(1, 1, 1)))
    metal = geom_node("metal", wall(1.0), Material("metal", metallic=1.0))
    scene.root.attach_new_node(metal).set_pos(0, 9, 0)
    scene.root.attach_new_node(AmbientLight("sky", (1, 1, 1)))
    lamp(scene)
    return scene


def test_a_pass_that_would_draw_into_nine_targets_is_refused_with_the_outputs_to_leave_out():
    """OpenGL 3.3 promises eight draw buffers; a ninth would fail when the shader is linked."""
    scene = everything()
    for outputs in (("color",), ("color", "id"), ("color", "visibility", "position", "normal", "emission")):
        _, targets = cost(scene, outputs=outputs)
        assert "metallic_roughness" in targets
    message = (
        r"pass 'geometry' would draw into 9 targets at once \(albedo, normal, .*\), and OpenGL 3.3 has 8: "
        "ask for some of the outputs id, visibility in another frame"
    )
    with pytest.raises(OutputError, match=message):
        build_plan(scene, outputs=("id", "color", "visibility", "emission"))
    # without the picture, only what is asked for is kept, and more of it can be left out
    data = ("normal", "depth", "specular", "metallic", "emission", "id", "visibility", "albedo")
    assert len(cost(scene, outputs=data)[1]) == 9  # with the depth buffer
    scene.root.find("metal").hide()
    assert "visibility" in cost(scene, outputs=("color", "id", "visibility"))[1]


class Many(FullscreenPass):
    """Makes nine targets for itself."""

    name = "many"
    colors = tuple(f"part_{k}" for k in range(9))

    def declare(self, needs):
        shapes = {name: lambda _: {"format": "rgba8"} for name in self.colors}
        reads = {name: ["it keeps them"] for name in self.colors}
        return Declaration("a test", writes=self.colors, updates=["color"], keeps=reads, targets=shapes)


def test_a_pass_from_outside_that_makes_nine_targets_is_told_so():
    with pytest.raises(PlanError, match=r"pass 'many' would draw into 10 targets .* let another pass make"):
        build_plan(wall_scene(), passes=(*PASSES, Many))
