"""The float64 sampler: on textures whose samples are known, and against the GPU's."""

import numpy as np
import pytest

from firefly_sample.lab.reference.surfaces import see_surfaces
from firefly_sample.lab.reference.texture import Sampler, level_of_detail
from firefly_sample.mipmaps import texture_levels
from firefly_sample.scene.lens import OrthographicLens
from firefly_sample.scene.material import Material
from firefly_sample.scene.texture import Sampling, Texture
from firefly_sample.srgb import srgb_to_linear
from tests.lab.float64 import draw, edges, plan_of
from tests.scenes import wall_scene

FILTERING = {0.0: 6e-3, 60.0: 9e-3}
"""What llvmpipe's filtering errs by, at most, on smooth noise, by the tilt of its wall in degrees: tilted, it
mixes two levels, by a share that is the same for four pixels."""


def gray(alpha):
    """Black pixels with these alphas (height, width), the first row on top."""
    pixels = np.zeros((*np.shape(alpha), 4), dtype=np.uint8)
    pixels[..., 3] = alpha
    return pixels


def test_a_constant_is_constant_at_every_place_and_level():
    pixels = np.tile(np.array([200, 100, 50, 255], dtype=np.uint8), (12, 7, 1))
    rng = np.random.default_rng(0)
    color = Sampler(texture_levels(pixels, None)).sample(
        rng.uniform(-9, 9, (500, 2)), rng.uniform(-3, 9, 500)
    )
    exact = np.round(srgb_to_linear(np.array([200, 100, 50]) / 255.0) * 65535) / 65535
    assert np.abs(color[:, :3] - exact).max() <= 1e-15 + 1 / 65535 * 1e-3
    assert (color[:, 3] == 1.0).all()


def test_a_ramp_is_linear_between_texel_centres_and_repeats():
    values = np.arange(16) * 17
    sampler = Sampler(texture_levels(gray(np.tile(values, (4, 1))), None))
    u = np.linspace(0.5 / 16, 15.5 / 16, 301)
    exact = (u * 16 - 0.5) * 17 / 255
    # 17/255 is 4369/65535: the ramp has no rounding
    for shift in (-3.0, 0.0, 5.0):
        found = sampler.sample(np.stack([u + shift, np.full_like(u, 0.3)], axis=1), np.zeros(301))[:, 3]
        assert np.abs(found - exact).max() <= 1e-13
    # between the last texel and the first
    assert sampler.sample(np.array([[0.0, 0.3]]), np.zeros(1))[0, 3] == pytest.approx(0.5, abs=1e-15)


def test_v_goes_up():
    sampler = Sampler(texture_levels(gray([[255], [0]]), None))
    found = sampler.sample(np.array([[0.5, 0.75], [0.5, 0.25]]), np.zeros(2))[:, 3]
    assert found.tolist() == [1.0, 0.0]


def test_between_two_levels_colours_are_mixed_linearly():
    checker = np.indices((8, 8)).sum(axis=0) % 2 * 255
    sampler = Sampler(texture_levels(gray(checker), None))
    mean = texture_levels(gray(checker), None)[1][0, 0, 3] / 65535
    at = np.array([[0.5 / 8, 0.5 / 8]] * 5)
    fine = sampler.sample(at[:1], np.zeros(1))[0, 3]
    found = sampler.sample(at, np.array([-1.0, 0.25, 0.5, 1.0, 7.0]))[:, 3]
    exact = np.array([fine, fine + 0.25 * (mean - fine), fine + 0.5 * (mean - fine), mean, mean])
    assert np.abs(found - exact).max() <= 1e-15
    assert mean == pytest.approx(0.5, abs=1e-5)


def test_a_checker_far_away_is_its_mean():
    rng = np.random.default_rng(1)
    pixels = gray(rng.integers(0, 256, (32, 32)))
    found = Sampler(texture_levels(pixels, None)).sample(rng.uniform(size=(50, 2)), np.full(50, 5.0))[:, 3]
    assert found == pytest.approx(np.full(50, pixels[..., 3].mean() / 255), abs=1e-4)


def test_the_level_is_the_longer_way_in_texels():
    right, down = (
        np.array([[0.25, 0.0], [0.0, 0.0], [1 / 64, 0.0]]),
        np.array([[0, 1 / 16], [0, 0.125], [0, 0]]),
    )
    found = level_of_detail(right, down, (64, 32))
    assert found == pytest.approx([4.0, 2.0, 0.0], abs=1e-14)


def test_a_surface_finds_its_level_by_exact_derivatives():
    """A wall straight on, under both lenses: the same number of texels to each pixel everywhere."""
    checker = np.indices((64, 64)).sum(axis=0) % 2 * 255
    pixels = np.repeat(checker[..., None], 4, axis=2).astype(np.uint8)
    pixels[..., 3] = 255
    for texels, mean in ((0.5, False), (2.0, True)):
        material = Material("checker", texture=Texture(pixels))
        scene = wall_scene(10.0, size=20.0, cells=3, material=material)
        scene.camera.node().lens = OrthographicLens(film_size=(10, 7.5), near=1, far=100)
        size = (int(10 * 64 / 20 / texels), int(7.5 * 64 / 20 / texels))
        plan = plan_of(scene, size)
        visibility = draw(scene, None, size)[0]["visibility"]
        albedo = see_surfaces(plan, visibility).gbuffer.albedo
        spread = albedo.max() - albedo.min()
        # a quarter of a texel beside their middles, neighbours differ by a quarter of what texels do
        assert spread == pytest.approx(0.0 if mean else 0.25, abs=1e-4)


@pytest.mark.parametrize("tilt", list(FILTERING))
def test_the_gpu_filters_alike(tilt):
    """A wall of smooth noise: what differs is the driver's filtering, and 8 bits of albedo."""
    rng = np.random.default_rng(2)
    coarse = np.kron(rng.integers(60, 200, (32, 32, 3)), np.ones((8, 8, 1)))
    smooth = sum(np.roll(coarse, (i, j), (0, 1)) for i in range(-4, 5) for j in range(-4, 5)) / 81
    pixels = np.concatenate([smooth, np.full((256, 256, 1), 255)], axis=2).astype(np.uint8)
    scene = wall_scene(10.0, size=30.0, cells=4, material=Material("noise", texture=Texture(pixels)))
    scene.root.find("wall").set_p(-tilt)
    frame, plan, stored, _ = draw(scene)
    surfaces = see_surfaces(plan, frame["visibility"])
    chosen = surfaces.covered & ~edges(frame["visibility"])
    assert chosen.mean() > 0.4
    difference = np.abs(surfaces.gbuffer.albedo - stored)[chosen]
    # a step of 8 bits in the square root is sqrt(albedo)/255
    assert difference.max() <= FILTERING[tilt] + np.sqrt(surfaces.gbuffer.albedo.max()) / 255
    assert difference.mean() <= 1.5e-3


def levels_of_constants(count):
    """Mipmap levels whose every texel is the level's number."""
    sides = [2**power for power in range(count - 1, -1, -1)]
    return [np.full((side, side, 4), number, dtype=np.uint16) for number, side in enumerate(sides)]


LEVELS = {  # of a level of detail, as OpenGL 3.3 defines it: sections 3.8.11 and 3.8.12
    "nearest": {-2.0: 0, 0.3: 0, 1.0: 0, 9.0: 0},
    "linear": {-2.0: 0, 0.3: 0, 1.0: 0, 9.0: 0},
    "nearest_mipmap_nearest": {-2.0: 0, 0.5: 0, 0.501: 1, 1.5: 1, 1.501: 2, 3.4: 3, 9.0: 4},
    "linear_mipmap_nearest": {-2.0: 0, 0.5: 0, 0.501: 1, 1.5: 1, 1.501: 2, 3.4: 3, 9.0: 4},
    "nearest_mipmap_linear": {-2.0: 0, 0.75: 0.75, 1.0: 1, 2.25: 2.25, 9.0: 4},
    "linear_mipmap_linear": {-2.0: 0, 0.25: 0.25, 1.0: 1, 2.25: 2.25, 9.0: 4},
}


@pytest.mark.parametrize("magfilter", ["nearest", "linear"])
@pytest.mark.parametrize("minfilter", list(LEVELS))
def test_a_filter_takes_the_levels_that_the_specification_names(minfilter, magfilter):
    sampler = Sampler(levels_of_constants(5), Sampling("repeat", "repeat", minfilter, magfilter))
    given, expected = zip(*LEVELS[minfilter].items(), strict=True)
    rng = np.random.default_rng(6)
    found = sampler.sample(rng.uniform(-3, 3, (len(given), 2)), np.array(given)) * 65535
    assert found == pytest.approx(np.tile(np.array(expected)[:, None], 4), abs=1e-9)


@pytest.mark.parametrize("magfilter", ["nearest", "linear"])
@pytest.mark.parametrize("minfilter", list(LEVELS))
def test_minification_begins_at_level_0_or_at_a_half(minfilter, magfilter):
    """At a half if what is magnified linearly is minified by nearest texels of mipmaps."""
    texels = np.array([[0, 65535]], dtype=np.uint16)
    finest = np.repeat(texels[..., None], 4, axis=2)
    sampler = Sampler([finest, finest[:, :1]], Sampling("clamp", "clamp", minfilter, magfilter))
    later = magfilter == "linear" and minfilter.startswith("nearest_mipmap")
    border = 0.5 if later else 0.0
    at = np.array([[0.6, 0.5]] * 2)  # the nearest texel is 1, the mix of both 0.7
    magnified, minified = sampler.sample(at, np.array([border, border + 1e-9]))[:, 0]
    assert magnified == pytest.approx(0.7 if magfilter == "linear" else 1.0)
    within = 0.7 if minfilter.startswith("linear") else 1.0
    if minfilter == "nearest_mipmap_linear" and later:
        within *= 0.5  # half of the next level, which is 0
    assert minified == pytest.approx(0.0 if later and minfilter.endswith("nearest") else within, abs=1e-8)


BEYOND = {  # texels of an image of three, at these places
    "repeat": {-3: 0, -2: 1, -1: 2, 0: 0, 2: 2, 3: 0, 4: 1, 300_000: 0},
    "clamp": {-3: 0, -2: 0, -1: 0, 0: 0, 2: 2, 3: 2, 4: 2, 300_000: 2},
    "mirror": {-4: 2, -3: 2, -2: 1, -1: 0, 0: 0, 2: 2, 3: 2, 4: 1, 5: 0, 6: 0, 300_000: 0},
}


@pytest.mark.parametrize("wrap", list(BEYOND))
@pytest.mark.parametrize("magfilter", ["nearest", "linear"])
def test_beyond_the_image_texels_are_those_of_the_wrap_mode(wrap, magfilter):
    texels = np.repeat(np.arange(3, dtype=np.uint16)[None, :, None], 4, axis=2)
    place, expected = zip(*BEYOND[wrap].items(), strict=True)
    centres = (np.array(place) + 0.5) / 3
    for levels, turned in (([texels], False), ([texels.swapaxes(0, 1)], True)):
        modes = ("repeat", wrap) if turned else (wrap, "repeat")
        sampler = Sampler(levels, Sampling(*modes, "linear", magfilter))
        other = np.full_like(centres, 0.5)
        at = np.stack([other, centres] if turned else [centres, other], axis=1)
        found = sampler.sample(at, np.full(len(at), -1.0))[:, 0] * 65535
        assert found == pytest.approx(np.array(expected, dtype=float), abs=1e-9)
