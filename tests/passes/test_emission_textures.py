"""Emission textures: what a surface emits is known texel by texel, and who has none pays nothing."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.lab.reference.cache import reference_frame
from firefly_sample.lab.reference.frame import render_reference
from firefly_sample.lab.reference.surfaces import see_surfaces
from firefly_sample.pipeline import build_plan
from firefly_sample.plan.variants import defines
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings
from firefly_sample.srgb import srgb_to_linear
from tests.conftest import make_renderer
from tests.scenes import geom_node, wall

SIZE = (32, 32)
STRENGTH = np.array([3.0, 0.5, 1.0])
PIXELS = np.random.default_rng(4).integers(0, 256, (4, 4, 4), dtype=np.uint8)
LINEAR = np.round(srgb_to_linear(PIXELS[..., :3] / 255.0) * 65535) / 65535
AS_IT_IS = LINEAR.repeat(8, 0).repeat(8, 1)
TURNED = AS_IT_IS.swapaxes(0, 1)[::-1, ::-1]
"""Of the second texture coordinates, (v, u): the image mirrored about its rising diagonal."""


@pytest.fixture(scope="module")
def render():
    with make_renderer(SIZE) as renderer:

        def draw(scene, *outputs, **settings):
            renderer.settings = Settings(**settings)
            return renderer.render(scene, outputs=outputs)

        yield draw


def texture(pixels=PIXELS, **sampling):
    return Texture(pixels, **{"magfilter": "nearest"} | sampling)


def glowing(name="glow", *, pixels=PIXELS, **options):
    return Material(name, **{"emission": STRENGTH, "emission_texture": texture(pixels)} | options)


def card(second=True, colors=None):
    plain = wall(2.0)
    turned = plain.texcoords[:, ::-1] if second else None
    return Geom(
        plain.vertices,
        plain.triangles,
        plain.normals,
        plain.texcoords,
        colors and [colors] * 4,
        "card",
        texcoords_1=turned,
    )


def card_scene(material, geom=None):
    """A card that fills the picture."""
    scene = Scene(background=(0, 0, 1))
    scene.root.attach_new_node(geom_node("card", geom or card(), material))
    scene.camera.set_pos(0, -5, 0)
    scene.camera.node().lens = OrthographicLens(film_size=(2, 2), near=1, far=20)
    return scene


def lit(scene):
    """In light that meets the card head on, and ambient light."""
    sun = DirectionalLight("sun", (0.5, 0.25, 1.0))
    sun.set_direction((0, 1, 0))
    scene.root.attach_new_node(sun)
    scene.root.attach_new_node(AmbientLight("sky", (0.125, 0.25, 0.5)))
    return scene


SETS = {"first": (0, AS_IT_IS), "second": (1, TURNED)}
each_set = pytest.mark.parametrize(("texcoord", "texels"), SETS.values(), ids=SETS)


@each_set
def test_emission_is_the_factor_times_the_texel(render, texcoord, texels):
    frame = render(card_scene(glowing(emission_texcoord=texcoord)), "emission")
    assert np.abs(frame.emission - STRENGTH * texels).max() <= 3e-7


@each_set
@pytest.mark.parametrize("method", ["volumes", "clustered", "fullscreen", "loop", "forward"])
def test_it_is_added_to_the_light_that_falls_on_the_surface(render, texcoord, texels, method):
    base = np.array([0.0, 1.0, 1.0])
    scene = lit(card_scene(glowing(base_color=(*base, 1), emission_texcoord=texcoord)))
    frame = render(scene, "radiance", light_method=method)
    light = np.array([0.625, 0.5, 1.5])
    # base colours of 0 and 1 are exact in the G-buffer
    assert np.abs(frame.radiance - (STRENGTH * texels + base * light)).max() <= 2e-5


@each_set
def test_the_reference_adds_the_same(texcoord, texels):
    base = np.array([0.0, 1.0, 1.0])
    scene = lit(card_scene(glowing(base_color=(*base, 1), emission_texcoord=texcoord)))
    plan = build_plan(scene, Settings(cutoff_budget=0.0), SIZE, ("radiance", "visibility"))
    with make_renderer(SIZE) as renderer:
        visibility = renderer.render(scene, outputs=("visibility",)).visibility
    exact = render_reference(plan, visibility).radiance
    assert np.abs(exact - (STRENGTH * texels + base * np.array([0.625, 0.5, 1.5]))).max() <= 1e-12


@pytest.mark.parametrize("texcoord", [0, 1])
def test_without_second_texture_coordinates_the_first_are_used(render, texcoord):
    scene = card_scene(glowing(emission_texcoord=texcoord), card(second=False))
    assert np.abs(render(scene, "emission").emission - STRENGTH * AS_IT_IS).max() <= 3e-7


def test_base_colour_and_emission_have_textures_of_their_own(render):
    base = np.full((2, 2, 4), 255, dtype=np.uint8)
    base[:, 0, :3] = 0
    material = glowing(texture=texture(base), emission_texcoord=1)
    frame = render(card_scene(material), "albedo", "emission")
    assert np.abs(frame.emission - STRENGTH * TURNED).max() <= 3e-7
    assert (frame.albedo[:, :16] == 0).all()
    assert (frame.albedo[:, 16:] == 1).all()


def test_one_texture_serves_both(render):
    shared = texture()
    frame = render(card_scene(glowing(texture=shared, emission_texture=shared)), "albedo", "emission")
    assert np.abs(frame.emission - STRENGTH * AS_IT_IS).max() <= 3e-7
    assert np.abs(np.sqrt(frame.albedo) - np.sqrt(AS_IT_IS)).max() <= 0.51 / 255


def test_vertex_colours_and_flat_colours_do_not_tint_it(render):
    scene = card_scene(glowing(), card(colors=(0.5, 0.25, 0.0, 1.0)))
    assert np.abs(render(scene, "emission").emission - STRENGTH * AS_IT_IS).max() <= 3e-7
    scene.root.set_color(0, 0, 1)
    assert np.abs(render(scene, "emission").emission - STRENGTH * AS_IT_IS).max() <= 3e-7


def test_what_is_cut_out_emits_nothing(render):
    """By the base colour's alpha alone: the emission texture has a random one."""
    base = np.full((1, 2, 4), 255, dtype=np.uint8)
    base[:, 0, 3] = 0
    frame = render(card_scene(glowing(texture=texture(base), alpha_mode="mask")), "emission")
    assert (frame.emission[:, :16] == 0).all()
    assert np.abs(frame.emission - STRENGTH * AS_IT_IS)[:, 16:].max() <= 3e-7


def test_far_away_it_is_its_mean_in_linear_light_whatever_its_alpha(render):
    rng = np.random.default_rng(5)
    pixels = rng.integers(0, 256, (32, 32, 4), dtype=np.uint8)
    pixels[..., 3] = np.where(pixels[..., 0] > 127, 0, 255)  # what is bright is clear
    scene = card_scene(glowing(pixels=pixels, alpha_mode="mask", alpha_cutoff=0.5))
    scene.camera.node().lens = OrthographicLens(film_size=(64, 64), near=1, far=20)
    frame = render(scene, "emission", "id")
    seen = frame.id >= 0
    assert seen.sum() == 1
    mean = STRENGTH * srgb_to_linear(pixels[..., :3] / 255.0).mean(axis=(0, 1))
    assert np.abs(frame.emission[seen] - mean).max() <= 1e-4


def test_changes_show_at_once():
    material = glowing()
    scene = card_scene(material)
    other = PIXELS[::-1].copy()
    upside_down = AS_IT_IS[::-1]
    with make_renderer(SIZE) as renderer:

        def apart(expected):
            return np.abs(renderer.render(scene, outputs=("emission",)).emission - expected).max()

        assert apart(STRENGTH * AS_IT_IS) <= 3e-7
        assert apart(STRENGTH * AS_IT_IS) <= 3e-7  # the kept G-buffer
        material.emission_texture.set_pixels(other)
        assert apart(STRENGTH * upside_down) <= 3e-7
        material.emission_texture = texture()
        assert apart(STRENGTH * AS_IT_IS) <= 3e-7
        material.emission_texcoord = 1
        assert apart(STRENGTH * TURNED) <= 3e-7
        material.set_emission((0, 0, 2))
        assert apart((0, 0, 2) * TURNED) <= 3e-7
        material.set_emission((0, 0, 0))
        assert apart(0.0) == 0.0
        material.set_emission((1, 1, 1))
        material.emission_texture = None
        assert apart(1.0) == 0.0


def pair(one, other):
    """The card twice, below one another in the graph's order, beside one another in the picture."""
    scene = card_scene(one)
    geom = scene.root.find("card").node().geoms[0][0]
    scene.root.find("card").set_pos(-1, 0, 0)
    scene.root.attach_new_node(geom_node("other", geom, other)).set_pos(1, 0, 0)
    scene.camera.node().lens = OrthographicLens(film_size=(4, 4), near=1, far=20)
    return scene


def test_what_one_call_cannot_draw_is_drawn_by_two(render):
    shared = texture()
    one = glowing(emission_texture=shared)
    others = {
        "factor": (Material("m", emission=(1, 0, 0), emission_texture=shared), 1),
        "no emission": (Material("m", emission_texture=shared), 1),
        "texture": (glowing(pixels=PIXELS[::-1]), 2),
        "sampling": (glowing(emission_texture=texture(wrap_u="clamp")), 2),
        "no texture": (glowing(emission_texture=None), 2),
        "set": (glowing(emission_texture=shared, emission_texcoord=1), 2),
    }
    for name, (other, batches) in others.items():
        scene = pair(one, other)
        assert len(build_plan(scene, size=SIZE).batches) == batches, name
        frame = render(scene, "emission")
        texels = np.ones_like(AS_IT_IS) if name == "no texture" else AS_IT_IS
        texels = {"texture": AS_IT_IS[::-1], "set": TURNED}.get(name, texels)
        halves = STRENGTH * AS_IT_IS, other.emission * texels
        for half, expected in zip(
            (frame.emission[8:24, :16], frame.emission[8:24, 16:]), halves, strict=True
        ):
            assert np.abs(half - expected[1::2, 1::2]).max() <= 3e-7, name


def program_texts(scene, *outputs):
    """Attributes and uniforms of every program that a frame used, and the bytes of its vertices."""
    with make_renderer(SIZE, reuse=False) as renderer:
        renderer.render(scene, outputs=outputs)
        gpu = renderer._gpu
        programs = {key[0]: program for key, program in gpu.programs._programs.items()}
        names = {stem: set(program.mgl) for stem, program in programs.items()}
        sizes = [kept.objects[0].size for kept in gpu.uploads._meshes.values()]
        return names, sizes, len(gpu.uploads._images)


FREE = {
    "no texture": (Material("m", emission=STRENGTH), ("color",)),
    "black emission": (Material("m", emission_texture=texture()), ("color",)),
    "emission that no output shows": (glowing(emission_texcoord=1), ("light",)),
}


@pytest.mark.parametrize(("material", "outputs"), FREE.values(), ids=FREE)
def test_a_frame_that_needs_none_pays_nothing(material, outputs):
    scene = lit(card_scene(material, card(second=False)))
    names, sizes, images = program_texts(scene, *outputs)
    assert "u_emission_texture" not in set().union(*names.values())
    assert sizes == [4 * (3 + 3 + 2) * 4]
    assert images == 0


def test_second_texture_coordinates_cost_their_bytes_and_no_attribute():
    names, sizes, images = program_texts(lit(card_scene(glowing(emission_texcoord=1))), "color")
    first, _, _ = program_texts(lit(card_scene(glowing(emission_texcoord=0))), "color")
    assert sizes == [4 * (3 + 3 + 4) * 4]
    assert names == first
    assert images == 1


def test_the_classic_look_leaves_emission_out(render):
    frame = render(card_scene(glowing(emission_texcoord=1)), "color", look="classic")
    assert (frame.color == 0).all()
    assert any("emission" in warning for warning in frame.warnings)


def test_defines_of_a_plain_surface_are_off():
    plan = build_plan(card_scene(Material("m", emission=STRENGTH)), size=SIZE)
    surface = plan.batches[0].surface
    assert not surface.emission_textured
    assert not surface.second_texcoords
    step = next(step for step in plan.passes if step.name == "geometry")
    assert (defines(step.variant)["EMISSION_TEXTURED"], defines(step.variant)["SECOND_TEXCOORDS"]) == (0, 0)


def test_the_float64_twin_samples_emission(render):
    """At every pixel of a tilted card, whose levels differ."""
    scene = card_scene(glowing(emission_texcoord=1))
    scene.root.find("card").set_hpr(20, -30, 10)
    plan = build_plan(scene, size=SIZE, outputs=("emission", "visibility"))
    frame = render(scene, "emission", "visibility")
    surfaces = see_surfaces(plan, frame.visibility)
    apart = np.abs(surfaces.emission - frame.emission).max(axis=-1)[surfaces.covered]
    assert np.percentile(apart, 98) <= 1e-6


def test_a_reference_takes_emission_as_the_driver_filters_it(tmp_path):
    """As base colours: what remains is the renderer's own error."""
    noise = np.random.default_rng(7).integers(0, 256, (64, 64, 4), dtype=np.uint8)
    scene = card_scene(Material("glow", emission=STRENGTH, emission_texture=Texture(noise)))
    scene.root.find("card").set_hpr(20, -40, 10)
    with make_renderer(SIZE) as renderer:
        frame = renderer.render(scene, outputs=("radiance", "visibility"))
        reference = reference_frame(renderer, scene, folder=tmp_path)
        plan = renderer.plan(scene, outputs=("visibility",))
    own = render_reference(plan, frame.visibility)
    assert np.abs(frame.radiance - reference.radiance).max() <= 1e-6
    assert np.abs(frame.radiance - own.radiance).max() > 1e-3
