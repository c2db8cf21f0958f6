import numpy as np
import pytest

from firefly_sample.lab.reference.shading import attenuation, ramp_squared, window
from tests.glsl.harness import evaluate

EPS = float(np.finfo(np.float32).eps)


def test_ramp_squared_matches_its_twin(device):
    rng = np.random.default_rng(1)
    radius = 10.0 ** rng.uniform(-6, 20, 20000)
    distance = radius * rng.uniform(0, 1.2, 20000)
    inputs = np.stack([distance, radius, distance, radius], axis=1).astype(np.float32)
    inputs[0, :2], inputs[1, :2] = (0.0, 1.0), (1.0, 1.0)
    result = evaluate(device, ["falloff"], "result.r = falloff(a.x, a.y);", inputs, {"FALLOFF": 0})[:, 0]
    d, r = inputs[:, 0].astype(np.float64), inputs[:, 1].astype(np.float64)
    # d/R is rounded once or twice (a reciprocal may be used): 2 eps of at most 1, doubled by the square
    assert np.abs(result - ramp_squared(d, r)).max() <= 4 * EPS
    assert (result[0], result[1]) == (1.0, 0.0)
    assert (result[d >= r * (1 + 1e-6)] == 0.0).all()


def test_attenuation_matches_its_twin(device):
    """Sums and products of numbers of 0 or more: a few roundings of the result."""
    rng = np.random.default_rng(2)
    inputs = np.zeros((40000, 4), dtype=np.float32)
    inputs[:, 0] = 10.0 ** rng.uniform(-6, 6, len(inputs))
    inputs[:, 1:] = 10.0 ** rng.uniform(-4, 4, (len(inputs), 3)) * rng.integers(0, 2, (len(inputs), 3))
    inputs[~inputs[:, 1:].any(axis=1), 1] = 1.0
    result = evaluate(
        device,
        ["falloff"],
        "result.r = falloff(a.x, vec4(a.yzw, 0.0));",
        inputs,
        {"FALLOFF": 1, "RANGE_FALLOFF": 0},
    )[:, 0]
    exact = inputs.astype(np.float64)
    expected = attenuation(exact[:, 0], exact[:, 1:].T)
    assert (np.abs(result - expected) <= 4 * EPS * expected).all()


@pytest.mark.parametrize(("number", "kind"), [(0, "karis"), (1, "gltf")])
def test_windows_match_their_twin(device, number, kind):
    rng = np.random.default_rng(3)
    end = 10.0 ** rng.uniform(-6, 6, 20000)
    inputs = np.stack([end * rng.uniform(0, 1.2, 20000), end, end, end], axis=1).astype(np.float32)
    inputs[0, :2], inputs[1, :2] = (0.0, 1.0), (1.0, 1.0)
    result = evaluate(
        device,
        ["falloff"],
        "result.r = falloff(a.x, vec4(1.0, 0.0, 0.0, 1.0 / a.y));",
        inputs,
        {"FALLOFF": 1, "RANGE_FALLOFF": number},
    )[:, 0]
    d, r = inputs[:, 0].astype(np.float64), inputs[:, 1].astype(np.float64)
    # (d/R)^4 of up to 1 has six roundings, the square doubles them
    assert np.abs(result - window(d, r, kind)).max() <= 12 * EPS
    assert (result[0], result[1]) == (1.0, 0.0)
    assert (result[d >= r * (1 + 1e-6)] == 0.0).all()


def test_windows_end_as_they_should():
    """Both are flat at the light; Karis' ends with slope 0, glTF's with slope -4 over R."""
    step = 1e-6
    for kind, slope in (("karis", 0.0), ("gltf", -4.0)):
        values = window(np.array([0.0, step, 1.0 - step, 1.0, 2.0]), 1.0, kind)
        assert values[0] == values[1] == 1.0
        assert (values[3] - values[2]) / step == np.float64(0) or abs(
            (values[3] - values[2]) / step - slope
        ) < 1e-4
        assert values[3] == values[4] == 0.0
    assert (window(np.array([1.0, 1e30]), np.inf, "karis") == 1.0).all()
