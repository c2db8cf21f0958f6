"""What float32 takes of a number, packed into a byte: unpacked by the driver and by its twin."""

import numpy as np

from firefly_sample.gpu.light_records import packed_rests, rests
from tests.glsl.harness import evaluate


def test_the_driver_unpacks_what_was_packed(device):
    rng = np.random.default_rng(0)
    values = rng.normal(size=(60_000, 3)) * 10.0 ** rng.uniform(-20.0, 30.0, (60_000, 3))
    values[:3] = [[0.0, -0.0, 1e-20], [2.0**24 + 0.5, -(2.0**24) - 0.5, 256.0 - 1e-8], [3e38, -3e38, 1.0]]
    rows = np.concatenate([values, packed_rests(values)[:, None]], axis=1)
    found = evaluate(device, ["rests"], "result = vec4(rests(a.xyz, a.w), 0.0);", rows)[:, :3]
    assert np.array_equal(found, rests(values).astype(np.float32))
