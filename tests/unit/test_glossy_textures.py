"""Specular-glossiness textures as those of metallic-roughness materials: sizes, filters and wrap modes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.scene import glossy_textures
from firefly_sample.scene.glossy_textures import (
    INEXACT,
    ONE_SAMPLER,
    GlossyMaterial,
    Image,
    to_metallic_material,
)
from firefly_sample.scene.texture import Sampling
from firefly_sample.srgb import linear_to_srgb, srgb_to_linear

PLAIN = Sampling("repeat", "repeat", "linear_mipmap_linear", "linear")
BLACK = (0.0, 0.0, 0.0, 1.0)
CODES = st.integers(0, 255)


def image(pixels, **sampling):
    return Image(np.asarray(pixels, np.uint8), PLAIN._replace(**sampling))


def grey(row):
    """A picture of one row of greys with the same alpha."""
    return np.repeat(np.asarray(row, np.uint8)[None, :, None], 4, axis=2)


@given(st.lists(st.tuples(*[CODES] * 4), min_size=1, max_size=6), st.floats(0.0, 1.0))
def test_a_metal_keeps_its_specular_texture(row, gloss):
    """Without a diffuse colour, the base colour is the specular one."""
    source = GlossyMaterial(BLACK, (1.0, 1.0, 1.0), gloss, None, image([row]))
    made = to_metallic_material(source)
    assert made.losses == []
    pixels = np.array([row])
    np.testing.assert_array_equal(made.texture.pixels[..., :3], pixels[..., :3])
    np.testing.assert_array_equal(made.texture.pixels[..., 3], 255)
    shine = made.metallic_roughness_texture
    roughness = made.roughness if shine is None else shine.pixels[..., 1] / 255
    np.testing.assert_allclose(
        roughness + 0.0 * pixels[..., 3], 1.0 - gloss * pixels[..., 3] / 255, atol=0.51 / 255
    )
    assert made.metallic == 1.0
    assert shine is None or (shine.pixels[..., 2] == 255).all()


def test_a_dielectric_needs_no_second_texture():
    row = np.random.default_rng(1).integers(0, 256, (1, 50, 4), np.uint8)
    made = to_metallic_material(GlossyMaterial((1.0, 1.0, 1.0, 0.5), (0.04, 0.04, 0.04), 0.25, image(row)))
    shown = 255 * linear_to_srgb(0.96 * srgb_to_linear(row[..., :3] / 255))
    np.testing.assert_allclose(made.texture.pixels[..., :3], shown, atol=0.51)
    np.testing.assert_array_equal(made.texture.pixels[..., 3], row[..., 3])
    assert (made.base_color, made.metallic, made.losses) == ((1.0, 1.0, 1.0, 0.5), 0.0, [])
    assert made.roughness == pytest.approx(0.75, abs=0.5 / 255)
    assert made.metallic_roughness_texture is None


@pytest.mark.parametrize(
    ("sampling", "shares"),
    [
        ({"wrap_u": "clamp"}, (0.0, 0.0, 1 / 3, 2 / 3, 1.0, 1.0)),
        ({"wrap_u": "mirror"}, (0.0, 0.0, 1 / 3, 2 / 3, 1.0, 1.0)),
        ({"wrap_u": "repeat"}, (1 / 3, 0.0, 1 / 3, 2 / 3, 1.0, 2 / 3)),
        ({"magfilter": "nearest"}, (0.0, 0.0, 0.0, 1.0, 1.0, 1.0)),
    ],
    ids=str,
)
def test_the_smaller_texture_is_enlarged_as_its_sampler_says(sampling, shares):
    """A black texel and a white one beside six: places -1/3, 0, 1/3, 2/3, 1 and 4/3 from centre to centre."""
    specular = image(grey([0, 255]), **sampling)
    made = to_metallic_material(
        GlossyMaterial(BLACK, diffuse_image=image(grey([255] * 6)), specular_image=specular)
    )
    np.testing.assert_allclose(made.texture.pixels[0, :, 0], 255 * linear_to_srgb(shares), atol=0.51)
    roughness = made.metallic_roughness_texture.pixels[0, :, 1]
    np.testing.assert_allclose(roughness, 255 * (1 - np.array(shares)), atol=0.51)


def test_each_side_is_that_of_the_larger_texture():
    tall, wide = np.full((5, 2, 4), 255), np.full((3, 4, 4), 255)
    made = to_metallic_material(GlossyMaterial(diffuse_image=image(tall), specular_image=image(wide)))
    assert made.texture.pixels.shape == (5, 4, 4)


def test_blocks_of_rows_make_one_picture(monkeypatch):
    rng = np.random.default_rng(2)
    images = (image(rng.integers(0, 256, size, np.uint8)) for size in ((7, 5, 4), (3, 11, 4)))
    source = GlossyMaterial(BLACK, (0.5, 0.75, 1.0), 0.5, *images)
    whole = to_metallic_material(source)
    monkeypatch.setattr(glossy_textures, "_BLOCK", 20)
    parts = to_metallic_material(source)
    np.testing.assert_array_equal(whole.texture.pixels, parts.texture.pixels)
    shines = (made.metallic_roughness_texture.pixels for made in (whole, parts))
    np.testing.assert_array_equal(*shines)


def test_losses_are_named():
    red, cyan = [[(255, 0, 0, 255)]], [[(0, 188, 188, 255)]]
    made = to_metallic_material(
        GlossyMaterial(diffuse_image=image(red), specular_image=image(cyan, wrap_v="clamp"))
    )
    assert made.losses == [INEXACT, ONE_SAMPLER]
    assert made.texture.sampling == PLAIN
    assert to_metallic_material(GlossyMaterial((1, 0, 0, 1), (0, 0.5, 0.5))).losses == [INEXACT]


@given(st.lists(st.tuples(*[CODES] * 4), min_size=1, max_size=9))
def test_the_mean_is_that_of_light(row):
    texels = np.array(row) / 255
    expected = [*srgb_to_linear(texels[:, :3]).mean(axis=0), texels[:, 3].mean()]
    np.testing.assert_allclose(image([row]).mean(), expected, rtol=1e-12)
