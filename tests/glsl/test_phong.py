"""Highlights against float64, at every shininess, where plain pow would lose its digits."""

import mpmath
import numpy as np
import pytest

from firefly_sample.lab.reference.shading import highlight, power_of_cosine
from tests.glsl.harness import evaluate

EPS = float(np.finfo(np.float32).eps)
SHININESS = (0.0, 0.5, 1.0, 8.0, 32.0, 128.0, 1e3, 1e4, 1e5, 1e6)


@pytest.mark.parametrize("m", SHININESS)
def test_a_power_keeps_its_digits_at_every_exponent(device, m):
    """From the angle's own sine, the error of the power is a few 1e-7 whatever the exponent."""
    rng = np.random.default_rng(5)
    # angles up to where the power has fallen to 1e-7, and some beyond a right angle
    widest = np.arccos(np.exp(np.log(1e-7) / max(m, 0.1)))
    angle = np.concatenate([rng.uniform(0, widest, 40000), rng.uniform(np.pi / 2, np.pi, 1000), [0.0]])
    inputs = np.stack([np.cos(angle), np.sin(angle) ** 2, np.full_like(angle, m), angle], 1).astype(
        np.float32
    )
    result = evaluate(
        device, ["phong"], "result.r = power_of_cosine(a.x, a.y, a.z);", inputs, {"SPECULAR_MODEL": 0}
    )[:, 0]
    sine2 = inputs[:, 1].astype(np.float64)
    exact = np.where(
        angle < np.pi / 2,
        np.exp(0.5 * np.float64(np.float32(m)) * np.log1p(-np.minimum(sine2, 1 - 1e-15))),
        0.0,
    )
    # a power of what is near a right angle depends on the cosine, not on the sine
    steep = (sine2 > 0.5) & (angle < np.pi / 2)
    exact = np.where(steep, np.maximum(inputs[:, 0], 0).astype(np.float64) ** m, exact)
    if m == 0.0:
        exact = np.ones_like(exact)
    assert np.abs(result - exact).max() <= 5e-7
    assert result[-1] == 1.0


def test_pow_would_have_lost_them(device):
    """The test above can fail: at 1e6 the built-in function errs by several percent."""
    angle = np.linspace(0, 3e-3, 10000)
    inputs = np.repeat(np.cos(angle)[:, None], 4, axis=1).astype(np.float32)
    result = evaluate(device, [], "result.r = pow(a.x, 1e6);", inputs)[:, 0]
    assert np.abs(result - np.cos(angle) ** 1e6).max() > 0.02


def test_the_twin_is_exact():
    with mpmath.workdps(50):
        for c in (1e-3, 0.3, 0.9, 0.9999999):
            for m in SHININESS:
                expected = float(mpmath.mpf(c) ** mpmath.mpf(m))
                assert power_of_cosine(c, m) == pytest.approx(expected, rel=1e-9)
    assert power_of_cosine(-0.5, 0.0) == power_of_cosine(0.0, 0.0) == 1.0
    assert power_of_cosine(-0.5, 2.0) == power_of_cosine(0.0, 0.1) == 0.0


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


@pytest.mark.parametrize(("number", "model"), [(1, "phong"), (2, "blinn_phong")])
@pytest.mark.parametrize("m", SHININESS[:-2])
def test_highlights_match_their_twin(device, number, model, m):
    """Of unit vectors as float32 has them: what matters is that the angle between them is not lost."""
    rng = np.random.default_rng(6)
    n = 30000
    to_light = unit(rng.normal(size=(n, 3)))
    # eyes near the mirrored light, where the highlight is
    normal = np.array([0.0, 0.0, 1.0])
    to_light[:, 2] = np.abs(to_light[:, 2])
    mirrored = 2.0 * to_light[:, 2:] * normal - to_light
    to_eye = unit(mirrored + rng.normal(size=(n, 3)) * 10.0 ** rng.uniform(-4, 0, (n, 1)))
    inputs = np.concatenate([to_light, to_eye[:, :1]], axis=1).astype(np.float32)
    others = np.concatenate([to_eye[:, 1:], np.zeros((n, 2))], axis=1).astype(np.float32)
    body = f"result.r = highlight(vec3(0, 0, 1), a.xyz, vec3(a.w, b.xy), a.z, {m!r});"
    result = evaluate(device, ["phong"], body, inputs, {"SPECULAR_MODEL": number}, more=others)[:, 0]
    light, eye = (
        inputs[:, :3].astype(np.float64),
        np.concatenate([inputs[:, 3:], others[:, :2]], 1).astype(float),
    )
    # the shader takes its vectors for unit vectors, and their lengths err by an eps or two
    expected = highlight(np.tile(normal, (n, 1)), unit(light), unit(eye), np.full(n, m), model)
    # 0.61 sqrt(m) times the rounding of the vectors' products, and the power's own error; what is left of the
    # half-way vector is short where the light grazes, and its rounding is not
    short = 1.0 if model == "phong" else np.linalg.norm(unit(light) + unit(eye), axis=1) / 2.0
    assert (np.abs(result - expected) <= 5e-7 + 1.5 * EPS * np.sqrt(m) / short).all()


def test_phong_and_blinn_phong_agree_where_the_light_is_mirrored_and_straight_on():
    normal = np.array([[0.0, 0.0, 1.0]])
    for model in ("phong", "blinn_phong"):
        assert highlight(normal, normal, normal, [50.0], model) == 1.0
        tilted = unit(np.array([[1.0, 0.0, 1.0]]))
        mirrored = tilted * (-1, 1, 1)
        assert highlight(normal, tilted, mirrored, [50.0], model) == pytest.approx(1.0)
    # a small tilt of the eye counts twice for Blinn-Phong's half angle: four times the exponent
    angle = 0.05
    eye = np.array([[np.sin(angle), 0.0, np.cos(angle)]])
    phong = highlight(normal, normal, eye, [100.0], "phong")
    blinn = highlight(normal, normal, eye, [400.0], "blinn_phong")
    assert phong == pytest.approx(blinn, rel=1e-3)
