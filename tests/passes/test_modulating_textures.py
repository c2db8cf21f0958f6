"""A second texture of the base colour: every product of its texels is known, and no other scene pays."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.lab.reference.frame import render_reference
from firefly_sample.lab.reference.raycast import cast_visibility
from firefly_sample.lab.reference.shade import each_light
from firefly_sample.lab.reference.shadow import ShadowRays
from firefly_sample.lab.reference.surfaces import see_surfaces
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings
from firefly_sample.srgb import srgb_to_linear
from tests.conftest import make_renderer
from tests.passes.test_emission_textures import card, card_scene, lit, texture
from tests.scenes import geom_node, wall

SIZE = (32, 32)
FIRST, SECOND = np.random.default_rng(7).integers(0, 256, (2, 4, 4, 4), dtype=np.uint8)
FIRST[..., 3], SECOND[..., 3] = 255, 255
EXACT = {"albedo_format": "rgba32f", "normal_format": "rgba32f", "cutoff_budget": 0.0}


def spread(texels):
    """A texel for each pixel of the card."""
    return texels.repeat(8, 0).repeat(8, 1)


def turned(texels):
    """The same of the second texture coordinates, (v, u): mirrored about the rising diagonal."""
    return spread(texels).swapaxes(0, 1)[::-1, ::-1]


def linear(pixels):
    return np.round(srgb_to_linear(pixels[..., :3] / 255.0) * 65535) / 65535


PLACED = {0: spread, 1: turned}


@pytest.fixture(scope="module")
def render():
    with make_renderer(SIZE) as renderer:

        def draw(scene, *outputs, **settings):
            renderer.settings = Settings(**settings)
            return renderer.render(scene, outputs=outputs)

        yield draw


def mapped(name="wall", *, first=FIRST, second=SECOND, **options):
    both = {"texture": texture(first), "modulate_texture": texture(second), "modulate_texcoord": 1}
    return Material(name, **both | options)


@pytest.mark.parametrize("texcoord", PLACED)
def test_the_texels_of_both_multiply_the_base_colour(render, texcoord):
    base = np.array([0.5, 1.0, 0.25])
    scene = card_scene(mapped(base_color=(*base, 1), modulate_texcoord=texcoord))
    frame = render(scene, "albedo", **EXACT)
    expected = base * spread(linear(FIRST)) * PLACED[texcoord](linear(SECOND))
    assert np.abs(frame.albedo - expected).max() <= 3e-7


def test_alone_it_takes_the_place_of_the_first(render):
    frame = render(card_scene(mapped(texture=None)), "albedo", **EXACT)
    assert np.abs(frame.albedo - turned(linear(SECOND))).max() <= 3e-7


@pytest.mark.parametrize("texcoord", PLACED)
def test_without_second_texture_coordinates_the_first_are_used(render, texcoord):
    scene = card_scene(mapped(modulate_texcoord=texcoord), card(second=False))
    frame = render(scene, "albedo", **EXACT)
    assert np.abs(frame.albedo - spread(linear(FIRST) * linear(SECOND))).max() <= 3e-7


KINDS = {
    "phong": {},
    "ambient": {"ambient": (0.5, 1.0, 0.25)},
    "unlit": {"unlit": True},
}
SUN, SKY = np.array([0.5, 0.25, 1.0]), np.array([0.125, 0.25, 0.5])


def shown(kind):
    """The radiance of the card of a kind in that light."""
    ambient = np.array(kind.get("ambient", (1.0, 1.0, 1.0)))
    factor = 1.0 if "unlit" in kind else SUN + SKY * ambient
    return factor * spread(linear(FIRST)) * turned(linear(SECOND))


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
@pytest.mark.parametrize("method", ["volumes", "clustered", "forward"])
def test_both_multiply_light(render, kind, method):
    frame = render(lit(card_scene(mapped(**kind))), "radiance", light_method=method, **EXACT)
    assert np.abs(frame.radiance - shown(kind)).max() <= 4e-4  # half floats


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_the_float64_twin_multiplies_them(kind):
    plan = build_plan(lit(card_scene(mapped(**kind))), Settings(cutoff_budget=0.0), SIZE, ("radiance",))
    assert np.abs(render_reference(plan, cast_visibility(plan)).radiance - shown(kind)).max() <= 1e-12


def test_the_float64_twin_takes_their_levels(render):
    """At every pixel of a tilted card, whose levels differ."""
    scene = card_scene(mapped())
    scene.root.find("card").set_hpr(20, -30, 10)
    plan = build_plan(scene, size=SIZE, outputs=("albedo", "visibility"))
    frame = render(scene, "albedo", "visibility", **EXACT)
    surfaces = see_surfaces(plan, frame.visibility)
    apart = np.abs(surfaces.gbuffer.albedo - frame.albedo).max(axis=-1)[surfaces.covered]
    assert np.percentile(apart, 98) <= 1e-6


@pytest.mark.parametrize("look", ["classic", "flat"])
def test_looks_that_take_codes_multiply_codes(render, look):
    scene = card_scene(mapped())
    if look == "classic":
        scene.root.attach_new_node(AmbientLight("sky", (1, 1, 1)))
    frame = render(scene, "color", look=look)
    expected = spread(FIRST[..., :3] / 255.0) * turned(SECOND[..., :3] / 255.0) * 255.0
    assert np.abs(frame.color - expected).max() <= (2.0 if look == "classic" else 0.51)


def test_the_pyrender_look_multiplies_what_codes_stand_for(render):
    """By its own curve, a power of 2.2."""
    frame = render(card_scene(mapped(unlit=True)), "color", look="pyrender")
    expected = (spread(linear(FIRST)) * turned(linear(SECOND))) ** (1 / 2.2) * 255.0
    assert np.abs(frame.color - expected).max() <= 1.01


@pytest.mark.parametrize("method", ["volumes", "forward"])
def test_the_panda3d_look_multiplies_light_by_the_codes_of_both(render, method):
    scene = lit(card_scene(mapped(specular=(0.5, 0.5, 0.5))))
    frame = render(scene, "color", look="panda3d", light_method=method)
    light, codes = (
        np.minimum(SUN + SKY, 1.0),
        spread(FIRST[..., :3] / 255.0) * turned(SECOND[..., :3] / 255.0),
    )
    shown = np.minimum(light * codes + 0.5 * SUN, 1.0)  # an exponent of 0: the highlight is everywhere
    assert np.abs(frame.color - 255.0 * shown).max() <= 1.51
    plan = build_plan(scene, Settings(look="panda3d", cutoff_budget=0.0), SIZE, ("color",))
    twin = render_reference(plan, cast_visibility(plan)).color
    assert np.abs(twin - 255.0 * shown).max() <= 0.51


# --- Alpha ---


def halves(clear, side):
    """A texture of which half is clear: its left one, or its lower one."""
    pixels = np.full((2, 2, 4), 255, dtype=np.uint8)
    part = pixels[:, 0] if side == "left" else pixels[1]
    part[:, 3] = clear
    return pixels


def test_the_product_of_alphas_cuts_out(render):
    material = mapped(
        first=halves(0, "left"), second=halves(0, "lower"), modulate_texcoord=0, alpha_mode="mask"
    )
    frame = render(card_scene(material), "id")
    assert (frame.id[:16, 16:] >= 0).all()
    assert (frame.id >= 0).sum() == 16 * 16


@pytest.mark.parametrize("method", ["sorted", "exact", "weighted"])
@pytest.mark.parametrize("first", [255, 128])
def test_the_product_of_alphas_blends(render, method, first):
    """The second alone makes a surface one to be blended."""
    material = mapped(
        first=halves(first, "left"),
        second=halves(51, "lower"),
        modulate_texcoord=0,
        alpha_mode="blend",
        unlit=True,
    )
    frame = render(card_scene(material), "radiance", transparency=method)
    alpha = spread2(halves(first, "left"), halves(51, "lower"))
    over_blue = np.stack([alpha, alpha, np.ones_like(alpha)], axis=-1)
    assert np.abs(frame.radiance - over_blue).max() <= 1e-3
    assert len(build_plan(card_scene(material), size=SIZE).blended.batches) == 1


def spread2(*images):
    """The product of the alphas of images of 2 x 2 texels, for each pixel."""
    alphas = [image[..., 3].repeat(16, 0).repeat(16, 1) / 255.0 for image in images]
    return alphas[0] * alphas[1]


def shading_card(texcoord):
    """A card before a floor, in light that meets both head on; the camera is between them."""
    material = mapped(
        first=halves(0, "left"),
        second=halves(0, "lower"),
        modulate_texcoord=texcoord,
        alpha_mode="mask",
        double_sided=True,
    )
    scene = Scene()
    floor = scene.root.attach_new_node(geom_node("floor", wall(4.0)))
    floor.set_y(2)
    scene.root.attach_new_node(geom_node("card", card(), material)).set_y(-1)
    sun = DirectionalLight("sun", (1, 1, 1))
    sun.set_direction((0, 1, 0))
    sun.set_shadow_caster(True, 256)
    scene.root.attach_new_node(sun)
    scene.camera.node().lens = OrthographicLens(film_size=(2, 2), near=1, far=20)
    return scene


@pytest.mark.parametrize("texcoord", [0, 1])
def test_shadow_maps_and_rays_go_through_what_the_product_cuts_out(render, texcoord):
    """The upper right quarter of the card is left; by (v, u), what is clear below is clear on the left."""
    scene = shading_card(texcoord)
    dark = np.zeros(SIZE, dtype=bool)
    dark[slice(0, 16) if texcoord == 0 else slice(None), 16:] = True
    inner = np.abs(np.arange(32) - 15.5) > 1  # the map's texels are narrower than a pixel
    inner = inner[:, None] & inner
    frame = render(scene, "radiance")
    assert (frame.radiance[inner & dark] == 0).all()
    assert (frame.radiance[inner & ~dark] > 0.99).all()
    plan = build_plan(scene, size=SIZE, outputs=("radiance", "visibility"))
    surfaces = see_surfaces(plan, cast_visibility(plan))
    (one,) = each_light(plan.lights)
    reached = ShadowRays(plan).lit(surfaces.gbuffer.position.reshape(-1, 3), one).reshape(SIZE)
    assert ((reached == 0) == dark).all()


# --- Changes and costs ---


def test_changes_show_at_once():
    material = mapped(texture=None)
    scene = card_scene(material)
    with make_renderer(SIZE, Settings(**EXACT)) as renderer:

        def apart(expected):
            return np.abs(renderer.render(scene, outputs=("albedo",)).albedo - expected).max()

        assert apart(turned(linear(SECOND))) <= 3e-7
        assert apart(turned(linear(SECOND))) <= 3e-7  # the kept G-buffer
        material.modulate_texture.set_pixels(FIRST)
        assert apart(turned(linear(FIRST))) <= 3e-7
        material.modulate_texcoord = 0
        assert apart(spread(linear(FIRST))) <= 3e-7
        material.modulate_texture = Texture(SECOND, magfilter="nearest")
        assert apart(spread(linear(SECOND))) <= 3e-7
        material.modulate_texture = None
        assert apart(1.0) == 0.0


def test_a_shadow_map_follows_the_second_texture(render):
    scene = shading_card(0)
    material = scene.root.find("card").node().geoms[0][1]
    assert render(scene, "radiance").radiance[8, 24, 0] == 0
    material.modulate_texture.set_pixels(halves(0, "lower")[::-1])
    frame = render(scene, "radiance")
    assert frame.radiance[8, 24, 0] > 0.99
    assert frame.radiance[24, 24, 0] == 0
