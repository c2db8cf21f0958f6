"""What is computed on the CPU for the GPU: mipmaps, proxies, blocks, rows."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from firefly_sample.gpu.blocks import BLOCKS, block_dtype, block_glsl, pixel_slopes
from firefly_sample.gpu.light_records import (
    RECORDS,
    light_rows,
    light_texels,
    record_dtype,
    record_fields,
    record_glsl,
)
from firefly_sample.gpu.proxies import circumscribed_cone, circumscribed_icosphere
from firefly_sample.mipmaps import alpha_coverage, mip_chain
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.light import Falloff

ALL = {"LIGHT_METHOD": 0, "SPECULAR_MODEL": 1, "FALLOFF": 1, "SHADOW_TAPS": 4}
"""Defines of a variant whose record has every field."""


def leaf_texture(size=128):
    """Thin strokes with soft, noisy edges: coverage about 30%, all of it edges."""
    rng = np.random.default_rng(0)
    pixels = rng.uniform(0.2, 0.8, (size, size, 4)).astype(np.float32)
    y, x = np.mgrid[:size, :size]
    pixels[..., 3] = np.clip(
        0.2 + 0.5 * np.sin(x * 1.9 + y * 1.3) + rng.uniform(-0.1, 0.1, (size, size)), 0, 1
    )
    return pixels


def test_mipmaps_keep_the_share_of_leaf_that_passes():
    pixels = leaf_texture()
    coverage = alpha_coverage(pixels[..., 3], 0.5)
    assert 0.2 < coverage < 0.4
    levels = mip_chain(pixels, 0.5)
    assert [level.shape[0] for level in levels] == [128, 64, 32, 16, 8, 4, 2, 1]
    for level in levels:
        texels = level.shape[0] * level.shape[1]
        kept = alpha_coverage(np.round(level[..., 3] * 65535) / 65535, 0.5)
        assert abs(kept - coverage) <= 0.5 / texels + 1e-9


def test_hard_edged_alpha_comes_as_close_as_its_ties_allow():
    pixels = leaf_texture()
    pixels[..., 3] = pixels[..., 3] >= 0.5
    coverage = alpha_coverage(pixels[..., 3], 0.5)
    plain = pixels[..., 3].reshape(64, 2, 64, 2).mean(axis=(1, 3))
    ties = max(np.mean(plain == value) for value in np.unique(plain))
    assert abs(alpha_coverage(mip_chain(pixels, 0.5)[1][..., 3], 0.5) - coverage) <= ties / 2 + 1 / 4096


def test_plain_averaging_would_have_lost_it():
    """The test above can fail: without rescaling, small levels lose every texel."""
    alpha = leaf_texture()[..., 3]
    small = alpha.reshape(16, 8, 16, 8).mean(axis=(1, 3))
    assert alpha_coverage(small, 0.5) == 0


def test_colors_of_what_is_cut_away_do_not_bleed_in():
    pixels = np.zeros((2, 2, 4), dtype=np.float32)
    pixels[0, 0] = (0.2, 0.6, 0.1, 1.0)
    pixels[0, 1:, :3] = pixels[1, :, :3] = 1.0  # white where alpha is 0
    assert mip_chain(pixels, 0.5)[1][0, 0, :3] == pytest.approx((0.2, 0.6, 0.1), abs=1e-3)


@pytest.mark.parametrize("shape", [(1, 1), (5, 3), (1, 8), (7, 1), (320, 480)])
def test_odd_sizes_go_down_as_opengl_does_and_keep_the_average(shape):
    pixels = np.random.default_rng(0).uniform(size=(*shape, 4)).astype(np.float32)
    levels = mip_chain(pixels, None)
    assert levels[-1].shape == (1, 1, 4)
    for a, b in itertools.pairwise(levels):
        assert b.shape[:2] == tuple(max(1, side // 2) for side in a.shape[:2])
    assert levels[-1][0, 0] == pytest.approx(pixels.mean(axis=(0, 1)), abs=1e-5)


@pytest.mark.parametrize(("subdivisions", "scale"), [(0, 1.2584), (1, 1.0705), (2, 1.0181), (3, 1.0045)])
def test_icospheres_hold_the_unit_sphere_and_no_more(subdivisions, scale):
    triangles = circumscribed_icosphere(subdivisions)
    assert triangles.shape == (20 * 4**subdivisions, 3, 3)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    distance = np.einsum("ij,ij->i", normals, triangles[:, 0])
    assert distance.min() >= 1.0
    assert distance.min() <= 1.0 + 2e-6
    assert np.linalg.norm(triangles, axis=2).max() == pytest.approx(scale, abs=6e-5)
    # closed: every edge is used once in each direction
    keys = np.round(triangles, 6) + 0.0
    edges = [(tuple(t[i]), tuple(t[(i + 1) % 3])) for t in keys for i in range(3)]
    assert sorted(edges) == sorted((b, a) for a, b in edges)


@pytest.mark.parametrize("block", BLOCKS)
def test_a_blocks_dtype_and_text_come_from_one_table(device, block):
    """The driver's own std140 layout has the size and the offsets of the dtype."""
    fields = list(BLOCKS[block])
    uses = " + ".join(f"u_{name}" for name in fields)
    with device:
        program = device.ctx.program(
            vertex_shader="#version 330 core\nvoid main() { gl_Position = vec4(0.0); }",
            fragment_shader=f"#version 330 core\n{block_glsl(block)}\nout vec4 o;\n"
            f"void main() {{ o = {uses}; }}",
        )
        assert program[block].size == block_dtype(block).itemsize
        program.release()
    assert [block_dtype(block).fields[name][1] for name in fields] == [16 * i for i in range(len(fields))]


def test_cones_hold_the_unit_cone_and_no_more():
    triangles = circumscribed_cone(16)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # outwards: the axis lies behind every face
    inside = np.array([0.0, 0.9, 0.0])
    assert (np.einsum("ij,ij->i", normals, triangles[:, 0] - inside) > 0).all()
    angle = np.linspace(0, 2 * np.pi, 1000)
    rim = np.stack([np.cos(angle), np.ones(1000), np.sin(angle)], axis=1)
    distance = np.einsum("ijk,ik->ij", triangles[:, :1] - rim[None], normals)
    assert distance.min() >= 0.0
    assert distance.min() <= 2e-6
    assert triangles[..., 1].min() == 0.0
    assert triangles[..., 1].max() == 1.0
    keys = np.round(triangles, 6) + 0.0
    edges = [(tuple(t[i]), tuple(t[(i + 1) % 3])) for t in keys for i in range(3)]
    assert sorted(edges) == sorted((b, a) for a, b in edges)


@pytest.mark.parametrize("record", RECORDS)
def test_texels_lose_no_light_at_any_count(record):
    fields = len(record_fields(record, ALL))
    for count in (0, 1, 255, 256, 257, 1000):
        rows = np.arange(count * fields * 4, dtype=np.float32).reshape(count, fields, 4)
        texels = light_texels(rows)
        assert texels.shape == (max(1, -(-count // 256)), 256 * fields, 4)
        assert np.array_equal(texels.reshape(-1, fields, 4)[:count], rows)


def lights_at(positions, **columns):
    return LightSet.make(
        "point", Falloff.RAMP_SQUARED, np.ones((len(positions), 3)), positions=positions, **columns
    )


def view_of(lens, size=(800, 600)):
    return SimpleNamespace(lens=lens.constants(), size=size, near=lens.get_near())


@pytest.mark.parametrize(
    "lens",
    [
        PerspectiveLens(fov=60, near=0.5, far=1e4, film_offset=(0.2, -0.1)),
        PerspectiveLens(fov=1e-3, near=1, far=1e9),
        OrthographicLens(film_size=(40, 30), near=-10, far=500, film_offset=(3, 1)),
    ],
)
def test_a_float32_and_a_rest_hold_where_a_light_is_seen_to_31_bits(lens):
    """What the shader adds up from them is the place across the view, to far more than a float32 has."""
    rng = np.random.default_rng(0)
    positions = rng.normal(size=(500, 3)) * 10.0 ** rng.uniform(-2, 4, (500, 1))
    view = view_of(lens)
    rows = light_rows("PointLight", {"LIGHT_METHOD": 0}, lights_at(positions), view)
    place, pixel, color = (rows[:, field].astype(np.float64) for field in range(3))
    assert np.array_equal(place[:, :3], positions.astype(np.float32))
    seen = pixel[:, :2] + pixel[:, 2:]
    y = place[:, 1] + color[:, 3]
    assert (np.abs(y - positions[:, 1]) <= 2.0**-31 * np.abs(positions[:, 1])).all()
    distance = np.maximum(place[:, 1], np.float32(view.near)) if view.lens.perspective else np.ones(500)
    slopes, half = np.array(pixel_slopes(view)), np.array(view.size) / 2
    offset = half * (1 + np.array([view.lens.x_offset, view.lens.z_offset]))
    across = (seen - offset) * slopes * distance[:, None]
    error = np.abs(across - positions[:, [0, 2]])
    assert (error <= 2.0**-31 * (np.abs(seen) + 2.0**-15 * offset) * slopes * distance[:, None]).all()


@pytest.mark.parametrize(
    "lens",
    [
        PerspectiveLens(fov=60, near=0.5, far=1e4, film_offset=(0.2, -0.1)),
        OrthographicLens(film_size=(40, 30), near=-10, far=500, film_offset=(3, 1)),
    ],
)
def test_where_shaders_fetch_lights_a_number_holds_what_float32_took_of_three(lens):
    """Decoded here by arithmetic, as shaders/include/rests.glsl does by bits; the same as in attributes."""
    rng = np.random.default_rng(1)
    positions = rng.normal(size=(500, 3)) * 10.0 ** rng.uniform(-2, 4, (500, 1))
    view, lights = view_of(lens), lights_at(positions, reaches=rng.uniform(1, 9, 500))
    fetched = {"LIGHT_METHOD": 4, "POSITION_SOURCE": 0}
    assert [field.name for field in record_fields("PointLight", fetched)] == ["seen", "tint"]
    seen, tint = light_rows("PointLight", fetched, lights, view).astype(np.float64).transpose(1, 0, 2)
    place, pixel, color = (
        light_rows("PointLight", {"LIGHT_METHOD": 0}, lights, view).astype(np.float64).transpose(1, 0, 2)
    )
    assert np.array_equal(seen, np.stack([pixel[:, 0], place[:, 1], pixel[:, 1], place[:, 3]], axis=1))
    assert np.array_equal(tint[:, :3], color[:, :3])
    packed = tint[:, 3]
    assert np.array_equal(packed, np.floor(packed))
    steps = np.stack([packed % 256, packed // 256 % 256, packed // 65536], axis=1) - 128
    assert steps.min() == -128
    assert steps.max() == 127
    rest = steps / 256 * 2.0 ** (np.floor(np.log2(np.abs(seen[:, :3]))) - 23)
    assert np.array_equal(rest, np.stack([pixel[:, 2], color[:, 3], pixel[:, 3]], axis=1))


def test_a_light_in_the_middle_and_one_beyond_all_numbers_have_no_rest():
    view = view_of(PerspectiveLens(fov=60, near=0.5, far=1e4), size=(2, 2))
    lights = lights_at(np.array([(0.0, 8.0, 0.0), (1e38, 1.0, 0.0)]))
    rows = light_rows("PointLight", {"LIGHT_METHOD": 4, "POSITION_SOURCE": 0}, lights, view)
    assert np.isfinite(rows[:, :, :3]).all()
    assert rows[0, 0, :3].tolist() == [1.0, 8.0, 1.0]
    assert rows[0, 1, 3] == 128 * (1 + 256 + 65536)


def test_records_have_only_what_a_variant_asks_for():
    bare = [field.name for field in record_fields("PointLight", {})]
    assert bare == ["place", "pixel", "color"]
    full = [field.name for field in record_fields("PointLight", ALL)]
    assert set(full) - set(bare) == {"specular", "fade", "shadow"}
    assert record_dtype("PointLight", ALL).itemsize == 16 * len(full)
    assert "in_specular" in record_glsl("Spotlight", ALL, "vert")
    assert "specular" not in record_glsl("Spotlight", {"LIGHT_METHOD": 0}, "vert")
    assert "fetch_light" in record_glsl("Spotlight", {"LIGHT_METHOD": 3}, "frag")
