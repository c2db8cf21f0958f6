"""Whole frames in float64, against the GPU's: what is left is what the settings promise."""

import numpy as np
import pytest

from firefly_sample.errors import SettingsError
from firefly_sample.lab.reference.frame import reference_settings, render_reference
from firefly_sample.lab.reference.particles import add_sprites
from firefly_sample.lab.reference.raycast import cast_visibility
from firefly_sample.lab.reference.shade import each_light, shade_lights
from firefly_sample.lab.reference.shading import highlight
from firefly_sample.lab.reference.surfaces import see_surfaces
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene, VerticalGradient
from firefly_sample.settings import Settings
from tests.lab.float64 import draw, edges, plan_of
from tests.lit_scenes import KINDS, lit_scene
from tests.scenes import ball_scene, orthographic_wall, wall_scene
from tests.shadows import shadowed_scene


def difference(frame, reference):
    """Largest difference of a pixel's channels over the 99.9th percentile of the reference."""
    apart = np.abs(frame["radiance"].astype(np.float64) - reference.radiance).max(axis=-1)
    return apart / np.percentile(reference.radiance, 99.9)


@pytest.mark.parametrize("orthographic", [False, True], ids=["perspective", "orthographic"])
@pytest.mark.parametrize("material", ["matte", "everything"])
def test_a_frame_is_its_reference_but_for_the_g_buffers_rounding(material, orthographic):
    """All kinds of light. The bound is that of 16-bit normals, times what a highlight makes of them."""
    scene = lit_scene(material=material, orthographic=orthographic)
    settings = Settings(cutoff_budget=0.0)
    frame, plan, albedo, ambient = draw(scene, settings)
    reference = render_reference(plan, frame["visibility"], albedo=albedo, ambient_albedo=ambient)
    apart = difference(frame, reference)
    # a light closer than its size in pixels, or a hard cone's edge, is float32's to err at single pixels
    assert np.percentile(apart, 99) <= (2e-5 if material == "matte" else 4e-4)
    assert np.percentile(apart, 99.9) <= 2e-3
    bias = frame["radiance"].mean(dtype=np.float64) / reference.radiance.mean() - 1
    assert abs(bias) <= 1e-5
    codes = np.abs(frame["color"].astype(int) - reference.color)
    assert np.percentile(codes, 99.9) <= 1


def test_with_albedo_of_its_own_eight_bits_are_what_it_errs_by():
    frame, plan, _, _ = draw(ball_scene(60))
    apart = difference(frame, render_reference(plan, frame["visibility"]))
    # half a step of 8 bits in the square root of the albedo, of what is at most 1
    assert 1e-5 < np.percentile(apart, 99) <= 1 / 255
    assert np.percentile(apart, 99.9) <= 2 / 255


@pytest.mark.parametrize("budget", [Settings().budget, 0.5])
def test_the_budget_is_all_that_cutting_off_costs(budget):
    scene = lit_scene(("attenuated",))
    frame, plan, albedo, ambient = draw(scene, Settings(cutoff_budget=budget))
    reference = render_reference(plan, frame["visibility"], albedo=albedo, ambient_albedo=ambient)
    apart = reference.radiance - frame["radiance"]
    rounding = 1e-4 * reference.radiance.max()
    assert -rounding <= apart.min()
    assert apart.max() <= budget + rounding
    assert budget < 0.1 or apart.max() > 0.01


def test_rays_make_a_frame_without_any_rasteriser():
    scene = lit_scene(("ramp", "sun"), "shiny")
    frame, plan, _, _ = draw(scene)
    cast = cast_visibility(plan)
    reference = render_reference(plan, cast)
    same = (cast == frame["visibility"]).all(axis=-1)
    assert same.mean() > 0.99
    assert np.percentile(difference(frame, reference)[same], 99) <= 5e-3


@pytest.mark.parametrize("kind", ["sun", "spot", "point"])
def test_shadow_maps_differ_from_rays_on_edges_alone(kind):
    scene = shadowed_scene(kind, (-4.0, 3.0, 5.0), resolution=1024)
    frame, plan, albedo, ambient = draw(scene, Settings(cutoff_budget=0.0))
    reference = render_reference(plan, frame["visibility"], albedo=albedo, ambient_albedo=ambient)
    without = render_reference(plan, frame["visibility"], albedo=albedo, shadows=False)
    hidden = (without.radiance - reference.radiance).max(axis=-1) > 0.01
    wrong = difference(frame, reference) > 1e-3
    assert 0.01 < hidden.mean() < 0.6
    assert wrong.mean() <= 0.02
    assert (wrong & ~_beside_an_edge(hidden) & ~edges(frame["visibility"])).mean() <= 2e-3


def _beside_an_edge(mask):
    """Pixels with both inside and outside within two pixels."""
    near = [np.roll(mask, (i, j), (0, 1)) for i in range(-2, 3) for j in range(-2, 3)]
    return np.any(near, axis=0) & ~np.all(near, axis=0)


@pytest.mark.parametrize("make", [wall_scene, orthographic_wall])
def test_dots_are_the_gpus(make):
    scene = make(10.0)
    scene.background = VerticalGradient((0.1, 0.2, 0.3), (0.0, 0.05, 0.4))
    scene.root.find("wall").set_scale(0.2)
    rng = np.random.default_rng(4)
    places = rng.uniform((-4, 3, -3), (4, 14, 3), (80, 3))
    radii = 10.0 ** rng.uniform(-3, 0, 80)  # from far below a pixel on
    scene.root.attach_new_node(Sprites("dots", places, rng.uniform(0, 2, (80, 3)), radii))
    frame, plan, albedo, _ = draw(scene, None, (129, 97))
    reference = render_reference(plan, frame["visibility"], albedo=albedo)
    assert len(plan.sprites) > 70
    assert np.abs(frame["radiance"] - reference.radiance).max() <= 3e-5
    empty = build_plan(Scene(), reference_settings(Settings()), (129, 97)).sprites
    bare = np.zeros((97, 129, 3))
    add_sprites(bare, empty, plan.view, np.full((97, 129), np.inf))
    assert not bare.any()


def test_the_background_of_nothing_is_exact():
    scene = Scene(background=VerticalGradient((0.1, 0.2, 0.3), (0.0, 0.0, 0.1)))
    scene.camera.set_hpr(20, 30, 10)
    scene.root.attach_new_node(Sprites("dots", [(0, 10, 4)], (1, 1, 1), 0.7))
    frame, plan, _, _ = draw_nothing(scene)
    reference = render_reference(plan, np.full((48, 64, 2), -1, dtype=np.int32))
    assert np.abs(frame["radiance"] - reference.radiance).max() <= 2e-6
    assert np.isnan(reference.position).all()
    assert (reference.light == 0).all()


def draw_nothing(scene):
    from tests.conftest import make_renderer

    with make_renderer((64, 48)) as renderer:
        plan = renderer.plan(scene, 0.0, ("radiance",))
        return renderer.draw(plan), plan, None, None


def test_numbers_are_the_same_with_any_number_of_threads():
    plan = plan_of(lit_scene(material="everything"), (200, 150))
    seen = cast_visibility(plan)
    calls = []
    one = render_reference(plan, seen, threads=1)
    many = render_reference(plan, seen, threads=4, progress=lambda done, total: calls.append((done, total)))
    assert one.radiance.tobytes() == many.radiance.tobytes()
    assert one.light.tobytes() == many.light.tobytes()
    assert calls == [(i + 1, len(calls)) for i in range(len(calls))]
    assert len(calls) == 6


@pytest.mark.parametrize("model", ["phong", "blinn_phong"])
@pytest.mark.parametrize("clamp", [False, True])
@pytest.mark.parametrize("kind", list(KINDS))
def test_lights_are_summed_as_the_formula_says(kind, model, clamp):
    """Tiles, boxes, and what is left out because it is 0, change nothing but the last digits."""
    plan = plan_of(lit_scene((kind,), "everything"), (40, 30), specular_model=model, clamp_light=clamp)
    surfaces = see_surfaces(plan, cast_visibility(plan))
    g = surfaces.gbuffer
    radiance, _ = shade_lights(g, plan.lights, plan.settings)
    expected = np.zeros_like(radiance)
    for one in each_light(plan.lights):
        to_light, distance = one.directions(np.nan_to_num(g.position).reshape(-1, 3))
        strength = one.strength(to_light.T, distance, plan.settings)
        n_dot_l = np.einsum("ij,ij->i", g.normal.reshape(-1, 3), to_light)
        reached = surfaces.covered.reshape(-1) & (n_dot_l > 0) & (distance < one.lights.reaches[one.row])
        if kind == "sun":
            reached = surfaces.covered.reshape(-1) & (n_dot_l > 0)
        shape = (30, 40, 1)
        shine = highlight(g.normal, to_light.reshape(30, 40, 3), g.to_eye, g.shininess, model)
        diffuse = one.lights.colors[one.row] * n_dot_l.reshape(shape)
        glint = g.specular * one.lights.specular_colors[one.row] * shine[..., None]
        if clamp:
            diffuse, glint = np.minimum(diffuse, 1.0), np.minimum(glint, 1.0)
        expected += (g.albedo * diffuse + glint) * np.where(reached, strength, 0.0).reshape(shape)
    assert expected.max() > 0.01
    assert np.abs(radiance - expected).max() <= 1e-13 * expected.max()


def test_nothing_is_cut_off_in_a_reference():
    settings = reference_settings(Settings(cutoff_threshold=0.01, supersample=2, tone="none"))
    assert (settings.cutoff_budget, settings.cutoff_threshold, settings.supersample) == (0.0, None, 1)
    assert settings.tone == "none"
    plan = plan_of(lit_scene(("attenuated",)))
    assert any(np.isinf(lights.reaches).any() for lights in plan.lights)


def test_what_has_no_reference_is_refused():
    scene = ball_scene(3)
    with pytest.raises(SettingsError, match="no reference for look 'classic'"):
        reference_settings(Settings(look="classic"))
    seen = np.full((6, 8, 2), -1, dtype=np.int32)
    with pytest.raises(SettingsError, match="no reference for look 'classic'"):
        render_reference(build_plan(scene, Settings(look="classic"), (8, 6)), seen)
    with pytest.raises(SettingsError, match="set 'supersample' to 1, not 2"):
        render_reference(build_plan(scene, Settings(supersample=2), (8, 6)), seen)


def test_an_orthographic_eye_is_everywhere():
    scene = lit_scene(("sun",), "shiny")
    scene.camera.node().lens = OrthographicLens(film_size=(16, 12), near=1, far=60)
    frame, plan, albedo, ambient = draw(scene)
    reference = render_reference(plan, frame["visibility"], albedo=albedo, ambient_albedo=ambient)
    assert np.percentile(difference(frame, reference), 99) <= 2e-4
