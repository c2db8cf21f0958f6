from typing import get_args

import numpy as np
import pytest

from firefly_sample.packing import (
    decode_albedo,
    decode_metallic_roughness,
    decode_normal,
    decode_specular,
    encode_albedo,
    encode_metallic_roughness,
    encode_normal,
    encode_specular,
    quantise_snorm16,
)
from firefly_sample.plan.targets import NORMAL_FORMATS
from firefly_sample.plan.variants import NormalFormat
from tests.glsl.harness import evaluate

EPS = float(np.finfo(np.float32).eps)


def directions(n=200_000):
    """Random unit vectors, the axes, and the octahedron's seams."""
    rng = np.random.default_rng(2)
    v = rng.normal(size=(n, 3))
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    angle = np.linspace(0, 2 * np.pi, 4001)
    seam = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    folds = np.concatenate([seam, seam[:, [0, 2, 1]], seam[:, [2, 0, 1]]])
    v = np.concatenate([axes, folds, folds + 1e-7 * rng.normal(size=folds.shape), v])
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def angles(a, b):
    """Degrees between unit vectors, without the loss of precision of arccos near 0."""
    return np.degrees(2 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)))


LINEAR = {"NORMAL_FORMAT": 0, "ALBEDO_FORMAT": 0}
ROOT = {"NORMAL_FORMAT": 0, "ALBEDO_FORMAT": 1}
SNORM16, UNORM16, UNORM8, SHIFTED, PLAIN, UNDECODED = (
    {"NORMAL_FORMAT": code, "ALBEDO_FORMAT": 0} for code in range(6)
)


@pytest.mark.parametrize(("packing", "one"), [(SNORM16, 32767), (UNORM16, 65535), (UNORM8, 127)], ids=str)
def test_decoding_loses_nothing_but_the_last_normalisation(device, packing, one):
    """Every stored pair of codes stands for a direction; up to normalize the shader's arithmetic is exact."""
    codes = np.round(encode_normal(directions()) * one)
    if packing is UNORM16:
        codes = 2 * np.round((codes + one) / 2) - one  # what an unsigned target can hold
    inputs = np.zeros((len(codes), 4), dtype=np.float32)
    inputs[:, :2] = {0: codes / one, 1: (codes + one) / 2 / one, 2: (codes + one) / 255}[
        packing["NORMAL_FORMAT"]
    ]
    result = evaluate(device, ["gbuffer"], "result.rgb = decode_normal(a);", inputs, packing)
    result = result[:, :3].astype(np.float64)
    lengths = np.linalg.norm(result, axis=1, keepdims=True)
    # components below 1, each rounded to half an ulp of up to 2^-25; in radians
    assert np.radians(angles(result / lengths, decode_normal(codes / one))).max() <= np.sqrt(3) * EPS / 4
    assert np.abs(lengths - 1).max() <= 2 * EPS


def test_encoding_matches_its_twin(device):
    inputs = np.zeros((len(directions()), 4), dtype=np.float32)
    inputs[:, :3] = directions()
    result = evaluate(device, ["gbuffer"], "result = encode_normal(a.xyz);", inputs, SNORM16)
    decoded = decode_normal(result[:, :2])
    exact = inputs[:, :3].astype(np.float64)
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    # compared as directions: on a seam two encodings mean the same direction
    assert np.radians(angles(decoded, exact)).max() <= 8 * EPS


def test_sixteen_bit_normals_err_as_the_table_says():
    v = directions(1_000_000)
    degrees = angles(decode_normal(quantise_snorm16(encode_normal(v))), v)
    assert degrees.max() <= 0.0037 * 1.05
    assert degrees.mean() <= 0.0013 * 1.05


TABLE = {
    "oct16": (0.0013, 0.0037),
    "rgb10a2": (0.042, 0.096),
    "rgba8": (0.170, 0.387),
    "oct8": (0.336, 0.95),
    "rgba16f": (0.0064, 0.0262),  # this driver cuts half floats off where others round
    "rgba32f": (7e-7, 2.8e-6),
}
"""Mean and largest error in degrees of 2e6 random directions, measured before the formats were chosen."""


@pytest.mark.parametrize("name", TABLE)
def test_normals_come_back_through_their_format_as_the_table_says(device, name):
    """A million, the axes and the octahedron's seams, through the driver's own target: within 5 per cent."""
    v = directions(1_000_000)
    inputs = np.zeros((len(v), 4), dtype=np.float32)
    inputs[:, :3] = v
    target, packing = NORMAL_FORMATS[name]
    code = {"NORMAL_FORMAT": get_args(NormalFormat).index(packing), "ALBEDO_FORMAT": 0}
    stored = evaluate(device, ["gbuffer"], "result = encode_normal(a.xyz);", inputs, code, target=target)
    body = "result.rgb = decode_normal(a);"
    back = evaluate(device, ["gbuffer"], body, stored, code)[:, :3].astype(np.float64)
    back /= np.linalg.norm(back, axis=1, keepdims=True)
    exact = inputs[:, :3].astype(np.float64)
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    degrees = angles(back, exact)
    mean, largest = TABLE[name]
    slack = 6e-6 if name == "rgba32f" else 0.0  # float32's own rounding of what goes in and comes out
    assert degrees.max() <= largest * 1.05 + slack
    assert degrees[-1_000_000:].mean() <= mean * 1.05 + slack
    axes = degrees[:6]
    if name in ("oct16", "oct8", "rgba16f", "rgba32f"):
        assert axes.max() <= 1e-5  # what has a code for 0 keeps the axes


def test_stored_albedo_is_exact_for_each_of_its_codes(device):
    codes = np.arange(256) / 255.0
    inputs = np.repeat(codes[:, None], 4, axis=1).astype(np.float32)
    result = evaluate(device, ["gbuffer"], "result.rgb = decode_albedo(a.rgb);", inputs, ROOT)
    assert np.abs(result[:, 0] - decode_albedo(codes)).max() <= EPS
    again = evaluate(device, ["gbuffer"], "result.rgb = encode_albedo(a.rgb);", result, ROOT)
    assert np.array_equal(np.round(again[:, 0] * 255), np.arange(256))
    assert np.abs(encode_albedo(decode_albedo(codes)) - codes).max() < 1e-15


def test_classic_keeps_the_original_faults(device):
    """Normals are stored as n/2 + 1/2 in OpenGL's view axes, (x, z, -y) of ours, and never decoded."""
    inputs = np.zeros((8, 4), dtype=np.float32)
    inputs[:, :3] = directions(8)[-8:]
    body = "result.rgb = decode_normal(encode_normal(a.xyz));"
    result = evaluate(device, ["gbuffer"], body, inputs, UNDECODED)
    assert np.abs(result[:, :3] - (inputs[:, (0, 2, 1)] * (0.5, 0.5, -0.5) + 0.5)).max() <= EPS


def test_specular_and_shininess_match_their_twin(device):
    rng = np.random.default_rng(4)
    given = rng.uniform(0, 1, (50_000, 4))
    given[:, 3] = 10.0 ** rng.uniform(-3, 6, len(given))
    given[:6, 3] = (0, 1, 32, 1e4, 1e6, 2)
    inputs = given.astype(np.float32)
    defines = LINEAR
    stored = evaluate(device, ["gbuffer"], "result = encode_specular(a.rgb, a.a);", inputs, defines)
    assert np.abs(stored - encode_specular(inputs)).max() <= 2 * EPS
    codes = np.round(stored.astype(np.float64) * 65535) / 65535
    decoded = evaluate(device, ["gbuffer"], "result = decode_specular(a);", codes.astype(np.float32), defines)
    expected = decode_specular(codes.astype(np.float32))
    assert np.abs(decoded[:, :3] - expected[:, :3]).max() <= 2 * EPS
    # exp2 of up to 20, whose rounding counts 20 ln 2 times
    assert (np.abs(decoded[:, 3] - expected[:, 3]) <= 20 * EPS * (1 + expected[:, 3])).all()
    assert decoded[0, 3] == 0.0
    # sixteen bits of logarithm: half a step of 20 ln 2 / 65535
    relative = np.abs(decode_specular(codes)[:, 3] - inputs[:, 3]) / (1 + inputs[:, 3])
    assert relative.max() <= 1.07e-4


def test_metallic_and_roughness_match_their_twin(device):
    """Every code of sixteen bits, and what is not metallic, which is stored as 0."""
    codes = np.arange(65536)
    given = np.zeros((65536, 4), dtype=np.float32)
    given[:, 0], given[:, 1] = codes / 65535, codes[::-1] / 65535
    metallic, roughness = decode_metallic_roughness(given[:, :2])
    decoded = evaluate(device, ["gbuffer"], "result.rg = decode_metallic(a.xy);", given, LINEAR)
    assert np.abs(decoded[1:, 0] - metallic[1:]).max() <= EPS
    assert np.array_equal(decoded[1:, 1], roughness[1:].astype(np.float32))
    assert decoded[0, 0] < 0.0
    assert (metallic[0], roughness[0]) == (-1.0, 1.0)
    assert (metallic[1], metallic[-1]) == (0.0, 1.0)
    given[:, :2] = np.stack([metallic, roughness], axis=1)
    stored = evaluate(device, ["gbuffer"], "result.rg = encode_metallic(a.x, a.y);", given, LINEAR)
    assert np.array_equal(np.round(stored[1:, 0] * 65535.0), codes[1:])
    twin = encode_metallic_roughness(metallic, roughness)
    assert np.array_equal(np.round(twin[:, 0] * 65535.0), codes)
    assert np.abs(stored[1:, :2] - twin[1:]).max() <= EPS
