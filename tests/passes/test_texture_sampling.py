"""Wrap modes and filters of textures: known texels, and every combination against the float64 twin.

An emission texture on a plane that emits white light shows its samples in the output "emission", in float32.
"""

from __future__ import annotations

from itertools import product
from typing import get_args

import numpy as np
import pytest

from firefly_sample.lab.reference.frame import render_reference
from firefly_sample.lab.reference.raycast import cast_visibility
from firefly_sample.lab.reference.surfaces import see_surfaces
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import MagFilter, MinFilter, Texture, Wrap
from firefly_sample.settings import Settings
from firefly_sample.srgb import srgb_to_linear
from tests.conftest import make_renderer
from tests.lab.float64 import edges
from tests.scenes import geom_node, wall

WRAPS, MINFILTERS, MAGFILTERS = map(get_args, (Wrap, MinFilter, MagFilter))
WRAP_PAIRS = list(product(WRAPS, repeat=2))
each_wrap = pytest.mark.parametrize("wrap", WRAPS)
SIZE = (64, 48)


@pytest.fixture(scope="module")
def render():
    with make_renderer(SIZE) as renderer:

        def draw(scene, outputs, size=SIZE, settings=None):
            renderer.size, renderer.settings = size, settings or Settings()
            plan = renderer.plan(scene, 0.0, outputs)
            return renderer.draw(plan), plan

        yield draw


def card_scene(material, texcoords, hpr=(0, 0, 0), lens=None):
    """A card as large as the picture, with these texture coordinates at the lower left and upper right."""
    low, high = np.array(texcoords, dtype=float)
    plain = wall(2.0)
    geom = Geom(plain.vertices, plain.triangles, plain.normals, low + plain.texcoords * (high - low))
    scene = Scene(background=(0, 0, 1))
    path = scene.root.attach_new_node(geom_node("card", geom, material))
    path.set_hpr(*hpr)
    scene.camera.set_pos(0, -5, 0)
    scene.camera.node().lens = lens or OrthographicLens(film_size=(2, 2), near=1, far=20)
    return scene


def glowing(pixels, **sampling):
    return Material("glow", emission=(1, 1, 1), emission_texture=Texture(pixels, **sampling))


def colors(width, height, seed=0):
    """Opaque texels of random colours."""
    pixels = np.random.default_rng(seed).integers(0, 256, (height, width, 4), dtype=np.uint8)
    pixels[..., 3] = 255
    return pixels


def tiled(rows, wrap):
    """Five copies of an image along its first axis, the third of them the image itself."""
    if wrap == "repeat":
        return np.concatenate([rows] * 5)
    if wrap == "mirror":
        return np.concatenate([rows, rows[::-1], rows, rows[::-1], rows])
    return np.concatenate(
        [np.repeat(rows[:1], 2 * len(rows), 0), rows, np.repeat(rows[-1:], 2 * len(rows), 0)]
    )


def tiled_both(pixels, wrap_u, wrap_v):
    upright = tiled(pixels[::-1], wrap_v)[::-1]  # v goes up
    return tiled(upright.swapaxes(0, 1), wrap_u).swapaxes(0, 1)


@pytest.mark.parametrize(("wrap_u", "wrap_v"), WRAP_PAIRS)
def test_the_nearest_texels_are_known_beyond_the_image(render, wrap_u, wrap_v):
    """Five copies each way, four pixels by three per texel."""
    pixels = colors(3, 4)
    material = glowing(pixels, wrap_u=wrap_u, wrap_v=wrap_v, magfilter="nearest")
    frame, _ = render(card_scene(material, [(-2, -2), (3, 3)]), ("emission",), (60, 60))
    codes = tiled_both(pixels, wrap_u, wrap_v).repeat(3, 0).repeat(4, 1)[..., :3]
    exact = np.round(srgb_to_linear(codes / 255.0) * 65535) / 65535
    assert np.abs(frame["emission"] - exact).max() <= 1e-7


@pytest.mark.parametrize("look", ["correct", "classic"])
@pytest.mark.parametrize(("wrap_u", "wrap_v"), WRAP_PAIRS)
def test_base_colours_are_sampled_alike_in_either_look(render, wrap_u, wrap_v, look):
    pixels = colors(3, 4)
    material = Material("card", texture=Texture(pixels, wrap_u=wrap_u, wrap_v=wrap_v, magfilter="nearest"))
    frame, _ = render(card_scene(material, [(-2, -2), (3, 3)]), ("albedo",), (60, 60), Settings(look=look))
    codes = tiled_both(pixels, wrap_u, wrap_v).repeat(3, 0).repeat(4, 1)[..., :3] / 255.0
    if look == "classic":
        assert np.abs(frame["albedo"] - codes).max() <= 1e-6
    else:
        assert np.abs(np.sqrt(frame["albedo"]) - np.sqrt(srgb_to_linear(codes))).max() <= 0.51 / 255


@each_wrap
def test_between_texel_centres_colours_are_mixed_and_edges_follow_the_wrap_mode(render, wrap):
    """Two texels, 0 and 1, sampled over five images by 80 pixels, which is 8 per texel."""
    pixels = np.zeros((1, 2, 4), dtype=np.uint8)
    pixels[0, 1, :3] = 255
    frame, _ = render(card_scene(glowing(pixels, wrap_u=wrap), [(-2, 0), (3, 1)]), ("emission",), (80, 4))
    texels = tiled(np.array([0.0, 1.0]), wrap)
    if wrap != "clamp":  # on to the next copy
        texels = np.concatenate([1 - texels[:1] if wrap == "repeat" else texels[:1], texels])
        centres = np.arange(-1, 10) + 0.5
    else:
        centres = np.arange(10) + 0.5
    at = (np.arange(80) + 0.5) / 8
    inside = (at > 0.5) & (at < 9.5)
    exact = np.interp(at, centres, texels)
    assert np.abs(frame["emission"][..., 0] - exact)[:, inside].max() <= 1e-6


def smooth(size, seed=1):
    """Noise that changes little from one texel to the next, repeating."""
    noise = np.random.default_rng(seed).normal(size=(*size, 3))
    across, up = (np.fft.fftfreq(count)[:, None] for count in size)
    kept = np.exp(-90.0 * (across**2 + up.T**2))[..., None]
    low = np.fft.ifft2(np.fft.fft2(noise, axes=(0, 1)) * kept, axes=(0, 1)).real
    low = (low - low.min()) / (low.max() - low.min())
    return np.concatenate([60 + 150 * low, np.full((*size, 1), 255)], axis=2).astype(np.uint8)


# name: span of texture coordinates, turn, and whether levels differ from pixel to pixel
VIEWS = {
    "magnified": (1.5, (0, 0, 0), False),
    "minified": (7.0, (0, 0, 0), False),
    "far away": (90.0, (0, 0, 0), False),
    "tilted": (9.0, (20, -60, 10), True),
}
LENS = PerspectiveLens(vfov=22.0, near=1.0, far=100.0)


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("magfilter", MAGFILTERS)
@pytest.mark.parametrize("minfilter", MINFILTERS)
def test_every_combination_is_sampled_as_the_specification_says(render, minfilter, magfilter, view):
    """Exactly, but for the driver's choice and mix of levels.

    llvmpipe takes one level for four pixels, and the share by which it mixes two levels is rough. It always
    minifies from level 0 on, also where the specification says 0.5: no pixel of these views is between them.
    """
    span, hpr, tilted = VIEWS[view]
    rough = glowing(
        colors(20, 24) if not tilted else smooth((40, 48)), minfilter=minfilter, magfilter=magfilter
    )
    scene = card_scene(rough, [(0.5 - span / 2,) * 2, (0.5 + span / 2,) * 2], hpr, LENS)
    for wrap_u, wrap_v in WRAP_PAIRS:
        rough.emission_texture.set_wrap_u(wrap_u)
        rough.emission_texture.set_wrap_v(wrap_v)
        frame, plan = render(scene, ("emission", "visibility"))
        surfaces = see_surfaces(plan, frame["visibility"])
        chosen = surfaces.covered & ~edges(frame["visibility"])
        assert chosen.mean() > 0.25
        apart = np.abs(surfaces.emission - frame["emission"]).max(axis=-1)[chosen]
        if view != "magnified" and minfilter.endswith("mipmap_linear"):
            assert apart.max() <= 0.04
        elif tilted and "mipmap" in minfilter:
            assert np.percentile(apart, 80) <= 1e-4
            assert apart.max() <= 0.2
        else:
            assert np.percentile(apart, 99) <= 3e-4  # texture coordinates are float32


def half_clear(wrap):
    """Left half clear, right half opaque."""
    pixels = np.full((1, 2, 4), 255, dtype=np.uint8)
    pixels[0, 0, 3] = 0
    texture = Texture(pixels, wrap_u=wrap, magfilter="nearest", minfilter="nearest")
    return Material("card", texture=texture, alpha_mode="mask", double_sided=True)


LEFT = {  # of u from -1 to 2, in halves of the image
    "repeat": (0, 1, 0, 1, 0, 1),
    "clamp": (0, 0, 0, 1, 1, 1),
    "mirror": (1, 0, 0, 1, 1, 0),
}


@each_wrap
@pytest.mark.parametrize("look", ["correct", "classic"])
def test_what_is_cut_out_follows_the_wrap_mode(render, wrap, look):
    scene = card_scene(half_clear(wrap), [(-1, 0), (2, 1)])
    frame, _ = render(scene, ("id",), (48, 48), Settings(look=look))
    assert ((frame["id"] >= 0) == np.repeat(LEFT[wrap], 8)).all()
    plan = build_plan(scene, size=(48, 48), outputs=("visibility",))
    assert ((cast_visibility(plan)[..., 0] >= 0) == np.repeat(LEFT[wrap], 8)).all()


def shadow_scene(wrap):
    """The card before a wall and out of view, in light from the side: its shadow fills the picture."""
    scene = card_scene(half_clear(wrap), [(-1, 0), (2, 1)])
    scene.root.find("card").set_pos(-3, -1, 0)
    scene.root.attach_new_node(geom_node("wall", wall(20.0), Material("wall"))).set_pos(0, 1, 0)
    sun = DirectionalLight("sun")
    sun.set_direction((1.5, 1, 0))
    sun.set_shadow_caster(True, 1024)
    scene.root.attach_new_node(sun)
    return scene


@each_wrap
def test_shadows_follow_the_wrap_mode(render, wrap):
    scene = shadow_scene(wrap)
    frame, _ = render(scene, ("radiance",), (48, 48), Settings(shadow_taps=1))
    columns = np.arange(48)
    sure = np.abs((columns + 4) % 8 - 3.5) < 3  # of a texel of the map and of the picture's own
    dark = frame["radiance"][12:-12, :, 0] == 0.0
    assert (dark == (np.repeat(LEFT[wrap], 8) == 1))[:, sure].all()
    plan = build_plan(scene, size=(48, 48), outputs=("visibility",))
    exact = render_reference(plan, cast_visibility(plan)).radiance
    assert ((exact[12:-12, :, 0] == 0.0) == (np.repeat(LEFT[wrap], 8) == 1)).all()


def test_sampling_that_changes_shows_at_once_also_in_shadows(render):
    scene = shadow_scene("repeat")
    texture = scene.root.find("card").node().geoms[0][1].texture
    outputs, settings = ("radiance",), Settings(shadow_taps=1)
    with make_renderer((48, 48), settings) as renderer:
        first = renderer.render(scene, outputs=outputs).radiance
        texture.set_wrap_u("mirror")
        changed = renderer.render(scene, outputs=outputs).radiance
    assert not np.array_equal(first, changed)
    assert np.array_equal(changed, render(shadow_scene("mirror"), outputs, (48, 48), settings)[0]["radiance"])


def test_two_textures_of_one_image_are_drawn_apart(render):
    """The same pixels on two cards side by side, nearest on the left and linear on the right."""
    pixels = np.zeros((1, 2, 4), dtype=np.uint8)
    pixels[0, 1, :3] = 255
    near, far = glowing(pixels, magfilter="nearest"), glowing(pixels, magfilter="linear")
    scene = card_scene(near, [(0, 0), (1, 1)])
    node = scene.root.find("card").node()
    scene.root.find("card").set_pos(-1, 0, 0)
    scene.root.attach_new_node(geom_node("other", node.geoms[0][0], far)).set_pos(1, 0, 0)
    scene.camera.node().lens = OrthographicLens(film_size=(4, 2), near=1, far=20)
    frame, plan = render(scene, ("emission",), (32, 16))
    assert len(plan.batches) == 2
    row = frame["emission"][8, :, 0]
    assert row[:16].tolist() == [0.0] * 8 + [1.0] * 8
    assert ((row[16:] > 0) & (row[16:] < 1)).all()
