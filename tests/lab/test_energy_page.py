"""The figures of docs/lighting.md on energy and ambient light are those of the formula."""

import re
from pathlib import Path

import numpy as np
import pytest

from firefly_sample.lab.reference.metallic import ambient_reflectance
from tests.lab.hemisphere import energy, tilted

PAGE = Path(__file__, "../../../docs/lighting.md").resolve().read_text()
ROUGHNESS = (0.05, 0.2, 0.3, 0.5, 0.7, 1.0)


def mean_over_views(base, metallic, roughness):
    """The share of uniform light that is reflected into all directions: a mean over views by their cosine."""
    place, weight = np.polynomial.legendre.leggauss(8)
    cosine = 0.5 * (place + 1.0)
    shares = [
        sum(energy((base,) * 3, metallic, roughness, tilted(np.degrees(np.arccos(c)))))[0] for c in cosine
    ]
    return float((weight * cosine) @ shares)


@pytest.mark.parametrize(("surface", "base", "metallic"), [("plastic", 0.5, 0.0), ("metal", 0.9, 1.0)])
def test_the_table_of_ambient_light(surface, base, metallic):
    (row,) = [line for line in PAGE.splitlines() if line.startswith(f"| {surface}, base colour {base} |")]
    ours, *exact = map(float, row.strip("| ").split("|")[1:])
    assert ours == pytest.approx(ambient_reflectance((base,) * 3, metallic)[0], abs=1e-9)
    expected = [mean_over_views(base, metallic, roughness) for roughness in ROUGHNESS]
    assert exact == pytest.approx(expected, abs=6e-4)


def test_a_plastic_may_reflect_more_than_arrives_and_a_metal_never():
    said = re.search(r"reflects (\S+) of\s+uniform light at 45 degrees, (\S+) at 75 and (\S+) at 89\.", PAGE)
    assert said is not None
    for figure, degrees in zip(said.groups(), (45, 75, 89), strict=True):
        plastic = sum(energy((1.0,) * 3, 0.0, 0.05, tilted(degrees)))[0]
        assert plastic == pytest.approx(float(figure), abs=0.5 * 10.0 ** -len(figure.split(".")[1]))
        assert plastic > 1.0
        assert energy((1.0,) * 3, 1.0, 0.05, tilted(degrees))[1][0] <= 1.0 + 1e-3
