"""What is computed on the CPU for the GPU: mipmaps, proxies, blocks, rows."""

import itertools

import numpy as np
import pytest

from firefly_sample.gpu.blocks import BLOCKS, block_dtype, block_glsl
from firefly_sample.gpu.mipmaps import alpha_coverage, mip_chain
from firefly_sample.gpu.proxies import circumscribed_icosphere
from firefly_sample.gpu.rows import light_texels


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
    fields = [name for name, _ in BLOCKS[block]]
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


def test_light_texels_lose_no_light_at_any_count():
    for count in (0, 1, 3, 4, 5, 100):
        rng = np.random.default_rng(count)
        positions, colors = rng.normal(size=(count, 3)), rng.uniform(size=(count, 3))
        radii = rng.uniform(size=count)
        flat = light_texels(positions, radii, colors, 8).reshape(-1, 4)[: 3 * count].astype(np.float64)
        assert np.array_equal(flat[0::3, 3], radii.astype(np.float32))
        assert np.array_equal(flat[1::3, :3], colors.astype(np.float32))
        # the two parts together are the place to 48 bits
        assert np.abs(flat[0::3, :3] + flat[2::3, :3] - positions).max(initial=0) <= 2.0**-48 * 8
