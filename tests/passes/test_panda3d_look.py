"""The look "panda3d": the formula of Panda3D's shader generator, against float64 and by hand.

tests/panda/test_look.py holds it against Panda3D's own pictures.
"""

import numpy as np
import pytest

from firefly_sample.errors import SettingsError
from firefly_sample.lab.reference.cache import reference_frame
from firefly_sample.lab.reference.surfaces import see_surfaces
from firefly_sample.pipeline import build_plan
from firefly_sample.plan.variants import defines
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from tests.conftest import borrow_renderer, make_renderer
from tests.lab.test_metallic_frames import noise
from tests.lit_scenes import KINDS
from tests.passes.test_metallic import image
from tests.reference import compare
from tests.scenes import ball, geom_node, wall, wall_scene
from tests.unit.test_plan import cost

LOOK = Settings(look="panda3d", cutoff_budget=0.0)
EXACT = LOOK.with_changes(albedo_format="rgba32f", normal_format="rgba32f")
METHODS = ("volumes", "clustered", "fullscreen", "loop")
SIZE = 96, 72
BOUND = 1e-6
"""Of display values, which are 1 at most."""
NEAREST = {"minfilter": "nearest", "magfilter": "nearest"}


def materials(rng):
    """Of every kind that the look distinguishes, in turn."""
    color = (*rng.uniform(0.2, 0.9, 3), 1.0)
    shine = {"specular": rng.uniform(0.1, 0.6, 3), "shininess": rng.uniform(2.0, 60.0)}
    texture = image(int(rng.integers(90, 256)), int(rng.integers(90, 256)), 200, 255)
    yield Material("matt", color)
    yield Material("shiny", color, ambient=rng.uniform(0, 1, 3), **shine)
    yield Material("local", color, local_viewer=True, **shine)
    yield Material("glowing", color, texture, emission=rng.uniform(0.0, 0.4, 3), local_viewer=True, **shine)
    yield Material("textured", color, texture, **shine)
    yield Material("metal", color, texture, metallic=0.4, roughness=0.7)
    yield Material("sign", color, texture, unlit=True)


def field(orthographic=False):
    """Balls of every material, every second one with a colour scale, under 200 lights of all kinds."""
    scene, rng, shape = Scene(), np.random.default_rng(3), ball(0.55)
    for row in range(3):
        for column, material in enumerate(materials(rng)):
            path = scene.root.attach_new_node(geom_node(f"{material.name} {row}", shape, material))
            path.set_pos_hpr_scale(1.3 * column - 3.9, 9 + 1.4 * row, -0.4, 20, 30, 0, 1.0, 0.7, 1.1)
            if (row + column) % 2:
                path.set_color_scale(*rng.uniform(0.4, 1.6, 3), 1.0)
    slab = Material("slab", (0.5, 0.4, 0.3, 1.0), specular=(0.2, 0.2, 0.2), shininess=8.0)
    scene.root.attach_new_node(geom_node("floor", wall(30.0, 8), slab)).set_pos_hpr(0, 10, -1, 0, -90, 0)
    places = rng.uniform((-6, 6, -0.8), (6, 16, 2), (160, 3))
    scene.root.attach_new_node(PointLights("lights", places, rng.uniform(0.3, 1.5, (160, 3)), 2.0))
    for kind in ("attenuated", "sun", "spots"):
        KINDS[kind](scene.root, rng)
    scene.root.attach_new_node(AmbientLight("sky", (0.1, 0.12, 0.15)))
    scene.camera.set_pos_hpr(0, 0, 5, 0, -25, 0)
    scene.camera.node().lens = (
        OrthographicLens(film_size=(12, 9), near=1, far=60)
        if orthographic
        else PerspectiveLens(vfov=40, near=0.5, far=100)
    )
    return scene


def compared_field(settings, **kind):
    """The frame of the field against float64, and the pixels' differences."""
    compared = compare(field(**kind), settings, SIZE)
    assert {"tint", "gloss"} <= {target.name for target in compared.plan.targets}
    assert compared.chosen.sum() >= 0.9 * compared.covered.sum()
    different = np.abs(compared.frame.radiance - compared.expected).max(axis=-1)
    return compared, different[compared.chosen]


# --- Against the reference ---


@pytest.mark.parametrize("orthographic", [False, True])
@pytest.mark.parametrize("method", METHODS)
def test_all_lights_by_each_method_are_what_float64_says(method, orthographic):
    compared, different = compared_field(LOOK.with_changes(light_method=method), orthographic=orthographic)
    assert compared.plan.light_method.name == method
    bright = compared.expected[compared.chosen].max(axis=-1)
    assert 0.02 < (bright == 1.0).mean() < 0.98  # on both sides of the limit
    assert different.max() <= BOUND


@pytest.mark.parametrize(
    ("method", "coarser"),
    [("depth32f", 2), ("stored32f", 1), ("stored16f", 1), ("depth24", 60), ("depth16", 60)],
)
def test_from_every_position_method(method, coarser):
    _, different = compared_field(LOOK.with_changes(position_method=method))
    assert different.max() <= coarser * BOUND


@pytest.mark.parametrize("orthographic", [False, True])
def test_forward_shading_is_the_same_light(orthographic):
    compared, _ = compared_field(EXACT, orthographic=orthographic)
    with borrow_renderer(SIZE, EXACT.with_changes(light_method="forward")) as renderer:
        drawn = renderer.render(field(orthographic=orthographic), outputs=("radiance",)).radiance
    different = np.abs(drawn - compared.expected).max(axis=-1)[compared.chosen]
    assert different.max() <= 5e-5  # the G-buffer rounds highlights' colours and exponents to sixteen bits


def test_a_frame_with_blended_surfaces_of_every_method_is_its_reference(tmp_path):
    """Panes of every material beside each other, so that weights do not count; half of them show backs."""
    scene, rng = field(), np.random.default_rng(5)
    scene.root.find("lights").detach_node()
    for index, material in enumerate(materials(rng)):
        pane = Material(
            f"pane {index}",
            (*material.base_color[:3], 0.6),
            alpha_mode="blend",
            double_sided=True,
            emission=(0.1, 0.2, 0.0),
            unlit=material.unlit,
            metallic=material.metallic,
            roughness=material.roughness,
            specular=material.specular,
            shininess=material.shininess,
            local_viewer=material.local_viewer,
            texture=image(200, 90, 120, 180) if index % 2 else None,
        )
        path = scene.root.attach_new_node(geom_node(pane.name, wall(0.9, 4), pane))
        path.set_pos_hpr(1.2 * index - 3.6, 7.5, 0.3, 180.0 * (index % 2) + 10.0, 0.0, 0.0)
        if index % 3:
            path.set_color_scale(0.5, 1.4, 0.9, 0.8)
    for method in ("sorted", "exact", "weighted"):
        with make_renderer(SIZE, EXACT.with_changes(transparency=method)) as renderer:
            plan = renderer.plan(scene, 0.0, ("color",))
            assert len(plan.blended.batches) == 7
            reference = reference_frame(renderer, scene, folder=tmp_path)
            frame = renderer.render(scene, outputs=("radiance", "color"))
        different = np.abs(frame.radiance - reference.radiance).max(axis=-1)
        assert np.percentile(different, 90) <= 1e-5
        assert np.percentile(different, 99) <= 2.0**-12  # half floats hold the tint of opaque surfaces
        assert np.abs(frame.color.astype(int) - reference.color).max() <= 1


def test_surfaces_are_those_of_the_reference():
    """Of a scene with textures whose texels are nearest ones, which filter without errors."""
    scene = field()
    noisy = Material(
        "noisy", (0.6, 0.7, 0.8, 1.0), noise(8, 50, **NEAREST), specular=(0.1, 0.2, 0.3), shininess=9.0
    )
    shape = ball(0.55)
    colors = np.random.default_rng(1).uniform(0.2, 1.0, shape.vertices.shape)
    texcoords = 0.3 * shape.vertices[:, [0, 2]]
    shape = Geom(shape.vertices, shape.triangles, shape.normals, texcoords, colors=colors)
    scene.root.attach_new_node(geom_node("noisy", shape, noisy)).set_pos(0, 7.5, 0.5)
    with make_renderer((160, 120), EXACT) as renderer:
        visibility = renderer.render(scene, outputs=("visibility",)).visibility
        plan = renderer.plan(scene, 0.0, ("albedo", "normal", "shininess", "radiance", "emission"))
        frame = renderer.draw(plan)
        surface = renderer.surface(plan)
        drawn, ambient, tint = surface.gbuffer(), surface.ambient_albedo(), surface.tint()
    seen = see_surfaces(plan, visibility)
    pairs = {
        "normal": (drawn.normal, seen.gbuffer.normal, 3e-5),
        "eye": (drawn.to_eye, seen.gbuffer.to_eye, 1e-12),
        "albedo": (drawn.albedo, seen.gbuffer.albedo, 3e-5),
        "ambient": (ambient, seen.ambient_albedo, 3e-5),
        "tint": (tint, seen.tint, 2.0**-10),  # half floats up to 2, cut off by some drivers
        "emission": (frame["emission"], seen.emission, 1e-6),
        "specular": (drawn.specular, seen.gbuffer.specular, 2e-5),
        "shininess": (drawn.shininess / 60.0, seen.gbuffer.shininess / 60.0, 1e-3),  # 15 bits of a logarithm
        "output albedo": (frame["albedo"], np.minimum(seen.gbuffer.albedo * seen.tint, 1.0), 2.0**-10),
    }
    inner = seen.covered & (np.abs(drawn.normal - seen.gbuffer.normal).max(axis=-1) < 1e-2)
    assert inner.sum() >= 0.99 * seen.covered.sum()
    for name, (one, other, bound) in pairs.items():
        assert np.abs(one - other)[inner].max() <= bound, name


# --- What it costs, and what it refuses ---


def lit_wall(material, light=(0.5, 0.5, 0.5), emitted=(0.0, 0.0, 0.0), scale=None):
    """A wall that faces the camera, under a sun from the eye and a sky."""
    scene = wall_scene(material=material)
    scene.root.attach_new_node(DirectionalLight("sun", light))
    scene.root.attach_new_node(AmbientLight("sky", (0.1, 0.2, 0.3)))
    if scale is not None:
        scene.root.find("wall").set_color_scale(*scale)
    return scene


def test_frames_without_its_features_have_the_targets_of_others():
    scene = lit_wall(Material("m", (0.4, 0.5, 0.6, 1.0), specular=(0.5, 0.5, 0.5), shininess=9.0))
    assert cost(scene, LOOK) == cost(scene, Settings(tone="none"))
    plain = build_plan(scene, LOOK, (8, 6))
    for step in plan_variants(plain):
        assert not {"TINT", "GLOSS", "SCALED", "LOCAL_VIEWERS"} & set(defines(step))


def plan_variants(plan):
    return [step.variant for step in plan.passes]


def test_textures_scales_and_highlights_add_exactly_their_targets():
    scene = lit_wall(Material("m", (0.4, 0.5, 0.6, 1.0)))
    passes, targets = cost(scene, LOOK)
    scene.root.find("wall").set_color_scale(0.5, 0.5, 0.5, 1.0)
    assert cost(scene, LOOK) == (passes, targets | {"tint": 8})
    scene.root.find("wall").node().geoms[0][1].set_specular((1.0, 1.0, 1.0))
    assert cost(scene, LOOK) == (passes, targets | {"tint": 8, "gloss": 16, "specular": 8})
    scene.root.find("wall").clear_color_scale()
    assert cost(scene, LOOK) == (passes, targets | {"specular": 8})


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ({"tone": "exponential"}, "has no tone curve"),
        ({"exposure": 2.0}, "has no exposure"),
        ({"clamp_light": True}, "shades as Panda3D's shader generator does"),
        ({"light_resolution": "half"}, "shades as Panda3D's shader generator does"),
        ({"interpolation": "float64"}, "shades as Panda3D's shader generator does"),
        ({"specular_model": "blinn_phong"}, "has highlights of its own"),
    ],
)
def test_what_it_does_not_have_is_refused(setting, says):
    with pytest.raises(SettingsError, match=f"with look=panda3d, which {says}"):
        Settings(look="panda3d", **setting)
