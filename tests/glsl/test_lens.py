import math
from types import SimpleNamespace

import numpy as np
import pytest

from firefly_sample.gpu.blocks import view_values
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from tests.glsl.harness import evaluate

EPS = float(np.finfo(np.float32).eps)
LENSES = {
    "forest": PerspectiveLens(fov=(39.32, 30.0), near=50, far=500),
    "off axis": PerspectiveLens(fov=60.0, aspect_ratio=1.6, near=0.1, far=1e4),
    "infinite": PerspectiveLens(fov=60.0, near=0.5, far=math.inf),
    "orthographic": OrthographicLens(film_size=(40, 30), near=1, far=500),
}
LENSES["off axis"].set_film_offset(0.2, -0.1)
CLIPS = [("gl", False), ("zero_to_one", False), ("zero_to_one", True)]


def block_of(lens, clip, reverse, size=(800, 600)):
    """The View block of a lens."""
    constants, turned = (
        lens.constants(clip, reverse),
        {"world_to_view": np.eye(4), "view_to_world": np.eye(4)},
    )
    return view_values(SimpleNamespace(lens=constants, size=size, near=lens.get_near(), **turned))


def defines_of(lens):
    return {"ORTHOGRAPHIC": int(isinstance(lens, OrthographicLens))}


def points_in(lens, n=20000):
    """Points of the view volume, log-uniform in distance, float32."""
    rng = np.random.default_rng(3)
    far = min(lens.get_far(), 1e6 * lens.get_near())
    y = np.exp(rng.uniform(math.log(lens.get_near()), math.log(far), n))
    ndc = rng.uniform(-1, 1, (n, 2))
    points = np.zeros((n, 4), dtype=np.float32)
    points[:, :3] = lens.constants().view_from_distance(ndc[:, 0], ndc[:, 1], y)
    return points


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize(("clip", "reverse"), CLIPS)
def test_clip_space_matches_the_projection_matrix(device, name, clip, reverse):
    lens = LENSES[name]
    points = points_in(lens)
    blocks = {"View": block_of(lens, clip, reverse)}
    result = evaluate(device, ["lens"], "result = view_to_clip(a.xyz);", points, defines_of(lens), blocks)
    matrix = lens.get_projection_mat(clip, reverse)
    homogeneous = np.concatenate([points[:, :3].astype(np.float64), np.ones((len(points), 1))], axis=1)
    # each coordinate is a sum of products of rounded numbers: bounded by the sum of their sizes
    scale = np.abs(homogeneous) @ np.abs(matrix)
    assert (np.abs(result - homogeneous @ matrix) <= 3 * EPS * scale + 1e-30).all()


@pytest.mark.parametrize("name", LENSES)
def test_view_from_distance_inverts_the_projection(device, name):
    lens = LENSES[name]
    rng = np.random.default_rng(4)
    inputs = np.zeros((20000, 4), dtype=np.float32)
    inputs[:, :2] = rng.uniform(-1, 1, (20000, 2))
    inputs[:, 2] = points_in(lens)[:, 1]
    blocks = {"View": block_of(lens, "gl", False)}
    body = "result.xyz = view_from_distance(a.xy, a.z);"
    result = evaluate(device, ["lens"], body, inputs, defines_of(lens), blocks)
    exact = lens.constants().view_from_distance(*inputs[:, :3].astype(np.float64).T)
    size = np.linalg.norm(exact, axis=1, keepdims=True)
    assert (np.abs(result[:, :3] - exact) <= 4 * EPS * size).all()


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize(("clip", "reverse"), CLIPS)
def test_distance_from_depth_errs_as_the_law_says(device, name, clip, reverse):
    """|dy|/y <= (d_depth + d_w) * |dy/d_depth| / y, plus the roundings of the division."""
    lens = LENSES[name]
    constants = lens.constants(clip, reverse)
    rng = np.random.default_rng(5)
    y = points_in(lens)[:, 1].astype(np.float64)
    inputs = np.zeros((len(y), 4), dtype=np.float32)
    inputs[:, 0] = constants.depth_from_distance(y)
    inputs[:, 1] = rng.uniform(size=len(y))
    if not reverse:
        inputs = inputs[inputs[:, 0] < 0.999]  # beyond it a standard depth has no bits left to compare with
    depth = inputs[:, 0].astype(np.float64)
    exact = constants.distance_from_depth(depth)
    blocks = {"View": block_of(lens, clip, reverse)}
    body = "result.r = distance_from_depth(a.x);"
    result = evaluate(device, ["lens"], body, inputs, defines_of(lens), blocks)[:, 0]
    d_w = EPS / 2 * abs(constants.w_fold)  # the constant's own rounding, and that of the sum
    shifted = np.abs(depth + constants.w_fold)
    allowed = (d_w + EPS / 2 * shifted) / shifted + 3 * EPS
    assert (np.abs(result - exact) <= allowed * np.abs(exact)).all()


def test_ndc_of_pixel_centres(device):
    inputs = np.zeros((800, 4), dtype=np.float32)
    inputs[:, 0] = np.arange(800) + 0.5
    inputs[:, 1] = np.minimum(np.arange(800), 599) + 0.5
    lens = LENSES["forest"]
    blocks = {"View": block_of(lens, "gl", False)}
    result = evaluate(device, ["lens"], "result.xy = ndc_from_pixel(a.xy);", inputs, defines_of(lens), blocks)
    exact = inputs[:, :2].astype(np.float64) / (400, 300) - 1
    assert np.abs(result[:, :2] - exact).max() <= 6.1e-8
