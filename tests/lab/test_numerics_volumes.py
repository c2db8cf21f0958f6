"""Meshes for lights and their depth tests, against theory."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firefly_sample.gpu.proxies import circumscribed_cone, circumscribed_cube, circumscribed_icosphere
from firefly_sample.lab.experiments import TABLES, proxies


def surface(mesh):
    return 0.5 * np.linalg.norm(np.cross(mesh[:, 1] - mesh[:, 0], mesh[:, 2] - mesh[:, 0]), axis=1).sum()


def test_proxies(bench):
    table = TABLES["proxies"].table(bench, views=5000)
    meshes = {"cube": circumscribed_cube()} | {f"icosphere{n}": circumscribed_icosphere(n) for n in range(4)}
    for name, mesh in meshes.items():
        # a convex body's mean silhouette is a quarter of its surface (Cauchy)
        assert table.value(name, "extra circumscribed") == pytest.approx(
            surface(mesh) / (4 * np.pi) - 1, abs=1e-3
        )
        shrunk = mesh / np.linalg.norm(mesh, axis=2).max()
        assert table.value(name, "missed inscribed") == pytest.approx(
            1 - surface(shrunk) / (4 * np.pi), abs=1e-3
        )
        assert table.value(name, "triangles") == len(mesh)
        assert table.value(name, "of a sphere's") == pytest.approx(
            1 + table.value(name, "extra circumscribed")
        )
    assert table.value("cube", "scale") == pytest.approx(math.sqrt(3.0), rel=1e-9)
    assert table.value("cube", "extra circumscribed") == pytest.approx(6.0 / math.pi - 1.0, abs=1e-3)
    assert table.value("cube", "missed inscribed") == pytest.approx(1.0 - 2.0 / math.pi, abs=1e-3)
    # circumradius over inradius of the icosahedron
    assert table.value("icosphere0", "scale") == pytest.approx(
        math.sqrt(15.0 - 6.0 * math.sqrt(5.0)), rel=1e-9
    )


def test_cones(bench):
    table = TABLES["proxies"].table(bench, views=5000)
    for row in table.rows[5:]:
        name, tangent = row[0], math.tan(math.radians(float(row[0].split()[1])))
        assert table.value(name, "scale") == pytest.approx(1.0 / math.cos(math.pi / 16), rel=1e-5)
        mesh = circumscribed_cone(16) * (tangent, 1.0, tangent)
        assert table.value(name, "of a sphere's") == pytest.approx(surface(mesh) / (4 * np.pi), rel=1e-3)
        exact = 0.25 * tangent * (tangent + math.hypot(1.0, tangent))
        extra = 1.0 + table.value(name, "extra circumscribed")
        assert table.value(name, "of a sphere's") == pytest.approx(exact * extra, rel=1e-9)
    # as large as the sphere where tan (tan + sec) is 4: at 53.13 degrees, the arc tangent of 4/3
    assert (
        table.value("cone, 45 degrees", "of a sphere's")
        < 1.0
        < table.value("cone, 60 degrees", "of a sphere's")
    )


@pytest.fixture(scope="module")
def tests_of_depth(bench):
    return TABLES["depth_tests"].table(bench, lights=8)


def test_which_pixels_are_in_reach():
    """A light at the distance u from a wall reaches a disc of 1 - u^2, seen at the wall's slant."""
    lights = 20
    half = 0.5 * lights * proxies.SPACING / proxies.FAR_AWAY
    positions, in_reach = proxies.far_lights(half, lights)
    assert positions.shape == (lights**2, 3)
    slant = 1.0 / math.hypot(1.0, proxies.SLOPE)
    expected = math.pi * (1.0 - 0.95**2 / 3.0) * slant / proxies.SPACING**2
    assert in_reach.mean() == pytest.approx(expected, rel=0.05)


def test_depth_tests_of_small_far_lights(tests_of_depth):
    strict, equal, behind, *reversed_float = (row[1:] for row in tests_of_depth.rows)
    assert all(a > b > 0.0 for a, b in zip(strict[1:], equal[1:], strict=True))
    # a step of depth is 0.06 units at 1e3 and 60 at 1e6, and the lights reach 1
    assert strict[0] < 0.06 < 0.5 < strict[-1]
    for row in (behind, *reversed_float):
        assert set(row) == {0.0}


def test_depth_clamp(bench):
    side = 200
    table = TABLES["depth_clamp"].table(bench, side=side)
    for name in ("around the camera", "around all that is seen"):
        assert table.value(name, "clamped") == side**2
    assert table.value("around the camera", "lost") == 0.0
    assert table.value("around all that is seen", "not clamped") == 0

    slope = math.tan(math.radians(30.0)) * ((np.arange(side) + 0.5) * 2.0 / side - 1.0)
    ray = np.stack([*np.meshgrid(slope, slope), np.ones((side, side))], axis=-1)
    for name in ("across the near plane", "across the far plane"):
        (_, away, _), reach = proxies.CUT[name]
        # the mesh lies between two spheres
        within = []
        for radius in (reach, 1.0705 * reach):
            square = (ray**2).sum(axis=-1)
            under = away**2 - square * (away**2 - radius**2)
            with np.errstate(invalid="ignore"):
                y = (away + np.sqrt(under)) / square
            within.append((np.count_nonzero(under >= 0.0), np.count_nonzero((y >= 1.0) & (y <= 100.0))))
        (least, kept_least), (most, kept_most) = within
        assert 0.99 * least <= table.value(name, "clamped") <= 1.01 * most
        if name == "across the near plane":
            assert 0.99 * kept_least <= table.value(name, "not clamped") <= 1.01 * kept_most
        assert 0.2 < table.value(name, "lost") < 1.0
