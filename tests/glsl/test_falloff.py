import numpy as np

from firefly_sample.reference.falloff import falloff
from firefly_sample.scene.lights import Falloff
from tests.glsl.harness import evaluate


def test_ramp_squared_matches_its_twin(device):
    rng = np.random.default_rng(1)
    radius = 10.0 ** rng.uniform(-6, 20, 20000)
    distance = radius * rng.uniform(0, 1.2, 20000)
    inputs = np.stack([distance, radius, distance, radius], axis=1).astype(np.float32)
    inputs[0, :2], inputs[1, :2] = (0.0, 1.0), (1.0, 1.0)
    result = evaluate(device, ["falloff"], "result.r = falloff(a.x, a.y);", inputs, {"FALLOFF": 0})[:, 0]
    d, r = inputs[:, 0].astype(np.float64), inputs[:, 1].astype(np.float64)
    expected = falloff(Falloff.RAMP_SQUARED, d, r)
    # d/R is rounded once or twice (a reciprocal may be used): 2 eps of at most 1, doubled by the square
    assert np.abs(result - expected).max() <= 4 * np.finfo(np.float32).eps
    assert (result[0], result[1]) == (1.0, 0.0)
    assert (result[d >= r * (1 + 1e-6)] == 0.0).all()
