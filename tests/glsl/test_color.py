import numpy as np
import pytest

from firefly_sample.lab.reference.shading import power_decoded, power_encoded, tone_curve
from firefly_sample.srgb import linear_to_srgb, srgb_to_linear
from tests.glsl.harness import evaluate


def test_srgb_encoding_matches_its_twin(device):
    # every 8-bit code's own value, the seam, and a dense ramp with both ends outside 0..1
    x = np.concatenate(
        [srgb_to_linear(np.arange(256) / 255), [0.0031308, 0.0031309], np.linspace(-0.1, 1.1, 5000)]
    )
    inputs = np.repeat(x[:, None], 4, axis=1).astype(np.float32)
    result = evaluate(device, ["color"], "result.rgb = linear_to_srgb(a.rgb);", inputs, {"TONE": 0})
    # pow errs by a few ulp of float32; a code is 1/255, so this is 3e-4 of a code
    assert np.abs(result[:, 0] - linear_to_srgb(inputs[:, 0])).max() <= 1.2e-6
    assert np.array_equal(np.round(result[:256, 0] * 255), np.arange(256))


@pytest.mark.parametrize(("number", "name"), [(0, "none"), (1, "exponential")])
def test_tone_curve_matches_its_twin(device, number, name):
    x = np.concatenate([[0.0, -1.0, 1e-30, 0.01, 1e30], np.geomspace(1e-8, 1e3, 5000)])
    inputs = np.repeat(x[:, None], 4, axis=1).astype(np.float32)
    result = evaluate(device, ["color"], "result.rgb = tone_curve(a.rgb);", inputs, {"TONE": number})[:, 0]
    expected = tone_curve(inputs[:, 0], name)
    assert (np.abs(result - expected) <= 2e-5 * expected).all()
    assert np.isfinite(result).all()


@pytest.mark.parametrize("name", ["power_encoded", "power_decoded", "srgb_to_linear"])
def test_codes_of_looks_match_their_twins(device, name):
    twin = {"power_encoded": power_encoded, "power_decoded": power_decoded, "srgb_to_linear": srgb_to_linear}
    x = np.concatenate([np.arange(256) / 255, [0.04045, 0.04046], np.geomspace(1e-8, 1.0, 5000)])
    if name == "power_encoded":
        x = np.concatenate([x, [-1.0, 1.5, 1e30]])
    inputs = np.repeat(x[:, None], 4, axis=1).astype(np.float32)
    result = evaluate(device, ["codes"], f"result.rgb = {name}(a.rgb);", inputs)[:, 0]
    # pow errs by a few ulp of float32; a code is 1/255, so this is 3e-4 of a code
    assert np.abs(result - twin[name](inputs[:, 0])).max() <= 1.2e-6


def test_srgb_twins_are_inverses():
    x = np.linspace(0, 1, 10001)
    assert (
        np.abs(srgb_to_linear(linear_to_srgb(x)) - x).max() < 1e-7
    )  # the standard's pieces do not quite meet
