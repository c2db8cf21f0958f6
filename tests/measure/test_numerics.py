"""The tables of figures against what theory says they must be; times are not asserted."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from firefly_sample.cli import main
from firefly_sample.gpu.probe import accumulate
from firefly_sample.gpu.proxies import circumscribed_cone, circumscribed_cube, circumscribed_icosphere
from firefly_sample.measure import (
    numerics_angles,
    numerics_depth,
    numerics_frames,
    numerics_lights,
    numerics_shading,
    numerics_volumes,
)
from firefly_sample.measure.numerics import NAMES
from firefly_sample.measure.numerics_cost import PAIRS, cost
from firefly_sample.measure.numerics_filtering import filtering
from firefly_sample.measure.numerics_gbuffer import (
    albedo,
    conversions,
    degrees_between,
    normal_bounds,
    normals,
    stored_normals,
)
from firefly_sample.measure.numerics_proxies import proxies
from firefly_sample.measure.numerics_rates import rates
from firefly_sample.measure.numerics_reach import exact_reach, reach
from firefly_sample.measure.numerics_table import EPS, Table
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.srgb import linear_to_srgb
from tests.conftest import make_renderer
from tests.reference import BOUNDS

DOCS = Path(__file__).parents[2] / "docs" / "numerics.md"


def holds_its_bounds(table: Table) -> bool:
    """Whether each figure is at most the bound beside it."""
    for row in table.rows:
        for column, bound in enumerate(row):
            if table.columns[column].endswith("bound") and bound is not None:
                assert row[column - 1] <= bound, (table.name, row[0], table.columns[column])
    return True


@pytest.fixture(scope="module")
def depth(device):
    return numerics_depth.depth(device, 40_000)


def test_depth_errs_as_the_law_says(depth):
    assert holds_its_bounds(depth)
    for name in (
        "depth24",
        "depth24, not folded",
        "standard, D32F",
        "standard, D32F, not folded",
        "reversed in -1..1, D32F",
        "reversed in 0..1, D24",
    ):
        for ratio in ("10", "1e3"):
            # the law adds up the worst of each rounding
            assert depth.value(name, ratio) > depth.value(name, f"{ratio} bound") / 7.0


def test_sixteen_bits_err_by_half_a_step_where_the_last_depths_lie(depth):
    """Nothing else matters beside a step of 1/65535, at whichever side a driver rounds."""
    for name in ("10", "1e3"):
        worth = (numerics_depth.RATIOS[name] - 1.0) / 65535  # times y/|E|, at y = f
        found = depth.value("depth16", name)
        assert 0.45 * worth <= found <= 1.01 * worth / (1.0 - worth)


@pytest.mark.parametrize("ratio", ["10", "1e3", "1e6"])
def test_float_depth_errs_as_float32_arithmetic_does(depth, ratio):
    """The same steps in NumPy lose as much, to a factor of two."""
    f = numerics_depth.RATIOS[ratio]
    lens = PerspectiveLens(fov=60.0, near=1.0, far=f).constants()
    y = np.exp(np.random.default_rng(0).uniform(np.log(1.003), np.log(0.997 * f), 40_000)).astype(np.float32)
    b, d, e, w = (np.float32(value) for value in (lens.b, lens.d, lens.y_fold, lens.w_fold))
    stored = np.float32(0.5) * ((b * y + d) / y) + np.float32(0.5)
    expected = np.abs((e / (stored + w)).astype(float) / y - 1.0).max()
    assert 0.5 * expected <= depth.value("standard, D32F", ratio) <= 2.0 * expected


def test_what_errs_alike_at_any_far_plane(depth):
    for name in ("depth32f", "depth32f, infinite far", "linear32f", "stored32f", "linear32f, tilted"):
        errors = [depth.value(name, ratio) for ratio in numerics_depth.RATIOS]
        assert EPS <= min(errors) <= max(errors) <= 8.0 * EPS
        assert max(errors) <= 1.5 * min(errors)
    assert depth.value("depth32f, tilted", "1e9") <= 8.0 * EPS


def test_what_ends(depth):
    for name in ("depth16", "depth24", "standard, D32F", "inverse_matrix"):
        assert depth.value(name, "1e9") == math.inf
    for name in ("stored16f", "linear in R16F"):
        for ratio in ("10", "1e3"):
            # half a step at least: 2^-11, just above a power of two
            assert 0.9 * 2.0**-11 <= depth.value(name, ratio) <= 2.0**-10 + 4.0 * EPS
            assert depth.value(name, f"{ratio} bound") == 2.0**-10 + 4.0 * EPS


@pytest.mark.parametrize("name", ["1e6", "1e9"])
def test_half_floats_end_at_65504(depth, device, name):
    """Drivers that cut off keep the largest; others turn what is larger into infinity."""
    size = (numerics_depth.WIDTH, 40)
    ratio = numerics_depth.RATIOS[name]
    y, _ = numerics_depth.distances(ratio, size)
    lens = PerspectiveLens(fov=numerics_depth.FOV, near=1.0, far=ratio).constants()
    index = np.arange(len(y))
    x, z = ((index % size[0] + 0.5) * 2.0 / size[0] - 1.0), ((index // size[0] + 0.5) * 2.0 / size[1] - 1.0)
    places = lens.view_from_distance(x, z, y)
    for way, true in (("linear in R16F", places[:, 1:2]), ("stored16f", places)):
        lost = true - np.clip(true, -numerics_depth.LARGEST_HALF, numerics_depth.LARGEST_HALF)
        expected = (np.linalg.norm(lost, axis=1) / np.linalg.norm(true, axis=1)).max()
        if device.software:
            assert depth.value(way, name) == pytest.approx(expected, abs=2.0**-10)
        else:
            assert depth.value(way, name) in (math.inf, pytest.approx(expected, abs=2.0**-10))
        assert depth.value(way, f"{name} bound") is None


def test_the_inverse_matrix_is_no_better_and_errs_far_from_the_origin(depth):
    assert depth.value("inverse_matrix", "1e3") >= 0.5 * depth.value("depth24", "1e3")
    # a place 10,000 units off has steps of 2^-10, beside distances from 1 on
    assert 2.0**-11 <= depth.value("inverse_matrix, 1e4 off", "10") <= 0.02


def test_normals(device):
    table = normals(device, 200_000)
    assert holds_its_bounds(table)
    for name, bound in normal_bounds().items():
        largest = math.radians(table.value(name, "max deg"))
        if name not in ("rgba16f", "rgba32f"):
            assert largest >= 0.9 * bound
            # the error of N.L is the chord of the angle
            assert table.value(name, "max N.L") == pytest.approx(2.0 * math.sin(0.5 * largest), rel=1e-4)
    for name, steps in (("rgba8", 255), ("rgb10a2", 1023)):
        # errors of +-1/steps in each coordinate, two thirds of whose squares lie across the normal
        rms = math.degrees(math.sqrt(2.0 / 3.0) / steps)
        assert 0.9 * rms <= table.value(name, "mean deg") <= rms
    assert table.value("oct16", "bytes") == table.value("rgba8", "bytes") == 4


def test_normals_of_any_length_have_an_angle(device):
    angle = np.radians([1e-6, 1e-3, 45.0, 90.0, 179.0, 180.0])
    a = np.tile([0.0, 0.0, 3.0], (len(angle), 1))
    b = 0.1 * np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], axis=1)
    assert degrees_between(a, b) == pytest.approx(np.degrees(angle), rel=1e-9)
    # the axes are exact on the octahedron
    axes = np.concatenate([np.eye(3), -np.eye(3)]).astype(np.float32)
    assert (stored_normals(device, axes, "plain", "rgba32f") == axes).all()
    if device.capabilities.snorm_targets:
        assert (stored_normals(device, axes, "snorm16", "rg16_snorm") == axes).all()


def test_albedo(device):
    table = albedo(device, 100_000)
    assert holds_its_bounds(table)
    for name in ("sqrt10", "sqrt8", "rgba8"):
        assert table.value(name, "at 0.01") >= 0.9 * table.value(name, "at 0.01 bound")
    for name, steps in (("sqrt10", 1023), ("sqrt8", 255)):
        root, half = np.linspace(0.0, 1.0, 100_000), 0.5 / steps
        expected = 255.0 * (linear_to_srgb((root + half) ** 2) - linear_to_srgb(root**2)).max()
        assert 0.9 * expected <= table.value(name, "codes") <= 1.001 * expected
    assert table.value("rgba8", "codes") == pytest.approx(0.5 * 12.92, rel=0.01)  # sRGB's slope at 0
    assert table.value("rgba32f", "codes") == table.value("rgba32f", "at 0.01") == 0.0


def test_conversions(device):
    table = conversions(device, 200_000)
    for name in ("rgba8", "rg16_snorm", "rgba16"):
        assert table.value(name, "steps") <= 0.5 + 65535 * EPS
        assert table.value(name, "not nearest") == 0.0
    if device.software:  # what Mesa's llvmpipe does
        # floor(1024 x) is not the nearest of 1023 where x and the fraction of 1024 x are half apart
        assert table.value("rgb10_a2", "not nearest") == pytest.approx(0.25, abs=0.01)
        for name in ("rgba16f", "r11f_g11f_b10f"):
            assert table.value(name, "steps") <= 1.0
            assert table.value(name, "not nearest") == pytest.approx(0.5, abs=0.01)
        assert 0.05 < table.value("sRGB, encoding", "not nearest") < 0.08
        assert 1.0e-3 < table.value("sRGB, decoding", "absolute") < 1.3e-3


def test_the_blender_adds_as_numpy_does(device):
    """One pass after the other, each sum rounded once."""
    _, parts = numerics_lights.seen_lights(500)
    expected = np.add.accumulate(parts.astype(np.float32), axis=0)[-1]
    found = accumulate(device, np.repeat(parts[..., None], 3, axis=2), "rgba32f")
    assert (found == expected[:, None]).all()


def test_accumulation(device):
    table = numerics_lights.accumulation(device, 2048)
    assert holds_its_bounds(table)
    largest = [table.value(name, "largest") for name in ("rgba32f", "rgba16f", "r11g11b10f", "rgba8")]
    assert largest == sorted(largest)
    assert largest[0] <= 2e-6
    assert abs(table.value("rgba32f", "bias")) <= 1e-8
    nearest = table.value(numerics_lights.NEAREST_HALF, "largest")
    assert 0.01 < nearest < 0.5 * largest[1] or not device.software


def test_piles(device):
    table = numerics_lights.piles(device, 64)
    assert holds_its_bounds(table)
    for count in ("1,000", "10,000"):
        single, batches = (table.value(f"{count}, {way}", "largest") for way in ("blending", "batches of 64"))
        assert 8.0 * batches < single
    assert 1e-5 < table.value("1,000, blending", "largest") < 2e-5
    assert 1e-4 < table.value("10,000, blending", "largest") < 2e-4


def test_cutoff():
    table = numerics_lights.cutoff(places=1000)
    assert holds_its_bounds(table)
    for name, threshold in (
        ("threshold 5/256", 5 / 256),
        ("threshold 1e-3", 1e-3),
        ("threshold 1.5e-4", 1.5e-4),
    ):
        reach = table.value(name, "reach")
        assert 1.0 / (1.0 + 0.7 * reach + 1.8 * reach**2) == pytest.approx(threshold, rel=1e-12)
    dropped = [row[2] for row in table.rows]
    assert dropped == sorted(dropped, reverse=True)
    assert 0.7 < dropped[0] < 0.85
    assert table.value("budget 1.5e-4", "codes") <= 0.5


def surface(mesh):
    return 0.5 * np.linalg.norm(np.cross(mesh[:, 1] - mesh[:, 0], mesh[:, 2] - mesh[:, 0]), axis=1).sum()


def test_proxies():
    table = proxies(views=5000)
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


def test_cones():
    table = proxies(views=5000)
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
def tests_of_depth(device):
    return numerics_volumes.depth_tests(device, 8)


def test_which_pixels_are_in_reach():
    """A light that is u before a wall reaches a disc of 1 - u^2, seen at the wall's slant."""
    lights = 20
    half = 0.5 * lights * numerics_volumes.SPACING / numerics_volumes.FAR_AWAY
    places, in_reach = numerics_volumes.far_lights(half, lights)
    assert places.shape == (lights**2, 3)
    slant = 1.0 / math.hypot(1.0, numerics_volumes.SLOPE)
    expected = math.pi * (1.0 - 0.95**2 / 3.0) * slant / numerics_volumes.SPACING**2
    assert in_reach.mean() == pytest.approx(expected, rel=0.05)


def test_depth_tests_of_small_far_lights(tests_of_depth):
    strict, equal, behind, *reversed_float = (row[1:] for row in tests_of_depth.rows)
    assert all(a > b > 0.0 for a, b in zip(strict[1:], equal[1:], strict=True))
    # a step of depth is 0.06 units at 1e3 and 60 at 1e6, and the lights reach 1
    assert strict[0] < 0.06 < 0.5 < strict[-1]
    for row in (behind, *reversed_float):
        assert set(row) == {0.0}


def test_depth_clamp(device):
    side = 200
    table = numerics_volumes.depth_clamp(device, side)
    for name in ("around the camera", "around all that is seen"):
        assert table.value(name, "clamped") == side**2
    assert table.value("around the camera", "lost") == 0.0
    assert table.value("around all that is seen", "not clamped") == 0

    slope = math.tan(math.radians(30.0)) * ((np.arange(side) + 0.5) * 2.0 / side - 1.0)
    ray = np.stack([*np.meshgrid(slope, slope), np.ones((side, side))], axis=-1)
    for name in ("across the near plane", "across the far plane"):
        (_, away, _), reach = numerics_volumes.CUT[name]
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


def test_the_edge_of_a_cone(device):
    table = numerics_angles.cones(device, 10_000)
    for degrees in numerics_angles.HALF_ANGLES:
        name = f"{degrees:g} degrees"
        from_cosine, from_sine = table.rows[[row[0] for row in table.rows].index(name)][1:]
        angle = math.radians(degrees)
        # a cosine is off by a few 2^-24 of 1; a sine by as much, and its square by twice that over the sine
        assert from_cosine <= 4.0 * EPS / (1.0 - math.cos(angle))
        assert from_sine <= 4.0 * EPS * (1.0 + 1.0 / math.sin(angle))
        if degrees <= 10.0:
            assert from_sine < 0.1 * from_cosine
    assert table.value("0.01 degrees", "1 - cosine") > 1.0


def test_highlights():
    """The slope of cos^m is sqrt(m / e) at its steepest, for large m."""
    table = numerics_angles.highlights()
    for name, off in normal_bounds().items():
        for column, m in numerics_angles.SHININESS.items():
            expected = off * math.sqrt(m / math.e)
            assert table.value(name, column) <= 1.02 * expected
            if expected < 0.05:
                assert table.value(name, column) == pytest.approx(expected, rel=0.03)


def test_reach():
    table = reach(samples=200)
    assert all(row[2] <= 6e-16 for row in table.rows)
    textbook = [row[1] for row in table.rows]
    assert textbook[0] < 1e-14
    assert textbook[2] > 1e-6
    assert min(textbook[3:]) >= 1.0  # no digit is left


def test_the_exact_reach():
    assert exact_reach(1.0, 0.0, 1.0, 26.0, 1.0) == 5
    assert exact_reach(1.0, 2.0, 0.0, 3.0, 0.5) == 2.5
    assert exact_reach(1.0, 0.0, 0.0, 2.0, 1.0).is_infinite()
    for intensity in (0.0, 1.0, 0.5):
        assert exact_reach(1.0, 1.0, 1.0, intensity, 1.0) == 0
    # k is 1e-30 of what it is the difference of
    assert float(exact_reach(1.0, 1.0, 1e-30, 1.0 + 2.0**-52, 1.0)) == 2.0**-52


def test_powers(device):
    table = numerics_shading.powers(device, 20_000)
    assert holds_its_bounds(table)
    for name, m in numerics_shading.EXPONENTS.items():
        # what rounding a cosine near 1 to 2^-25 does to its power, and what the built-in logarithm adds
        assert m * 2.0**-26 <= table.value(name, "pow") <= m * 2.0**-21


def test_ndc(device):
    table = numerics_shading.ndc(device)
    for row in table.rows:
        assert row[-1] is None or max(row[1:-1]) <= row[-1]
    for size in table.columns[1:-1]:
        middle_first, middle_last, *interpolated = (row[table.columns.index(size)] for row in table.rows)
        assert middle_first < 0.6 * middle_last
        assert middle_last < min(interpolated)
        assert max(interpolated) < 1e-6


def test_far_from_origin(device):
    table = numerics_shading.far_from_origin(device, 50_000)
    assert holds_its_bounds(table)
    for row in table.rows:
        assert table.value(row[0], "world") >= 0.4 * table.value(row[0], "world bound")
    for column in ("view", "from pixels"):
        errors = [table.value(row[0], column) for row in table.rows]
        assert max(errors) <= 1.05 * min(errors)
        assert max(errors) <= 6e-6
    assert table.value("1e9", "world") > 1e6 * table.value("1e9", "view")


def test_filtering(device):
    table = filtering(device, 16)
    for bits in ("8 bits", "16 bits"):
        given, own = (
            table.value(f"{bits}, {way}", "largest")
            for way in ("trilinear", "trilinear, level by the driver")
        )
        assert given < own < 0.05
    if device.software:
        # weights of 8 bits in either direction, and the mean of what they weigh
        assert 1.0 / 256 < table.value("8 bits, bilinear", "largest") < 2.0 / 256
        assert table.value("16 bits, bilinear", "largest") < 3.0 * EPS


def test_cost_tells_a_ratio_of_each_pair(device):
    table = cost(device, rounds=2, size=(40, 30))
    assert [row[0] for row in table.rows] == list(PAIRS)
    assert all(ratio > 0.0 and spread >= 0.0 and ms > 0.0 for _, ratio, spread, ms in table.rows)


def test_rates_are_of_each_format(device):
    table = rates(device, rounds=2, size=(100, 80), blended=200, read=20)
    assert [row[0].partition(",")[0] for row in table.rows] == ["blending"] * 4 + ["reading"] * 2
    assert all(ns > 0.0 and ratio > 0.0 and spread >= 0.0 for _, ns, ratio, spread in table.rows)
    for row in table.rows[0], table.rows[4]:
        assert row[2:] == (1.0, 0.0)


@pytest.fixture(scope="module")
def counting():
    with make_renderer(count_fragments=True) as renderer:
        yield renderer


def test_frames(counting):
    table = numerics_frames.frames(counting, 3, (64, 48))
    assert [row[0] for row in table.rows] == list(numerics_frames.POSITIONS)
    for name, bound in BOUNDS.items():
        assert 0.0 < table.value(name, "median") <= table.value(name, "largest") <= bound
    for column in ("largest", "median"):
        errors = [row[table.columns.index(column)] for row in table.rows]
        assert errors == sorted(errors)
    assert table.value("linear32f", "largest") < 0.1 * table.value("depth32f", "largest")


def test_fragments(counting):
    table = numerics_frames.fragments(counting, 1, (100, 75))
    pairs = table.value("with", "pairs")
    assert table.value("without", "pairs") == pairs
    # volumes miss nothing, and without a test they are shaded wherever they are seen
    assert pairs < table.value("with", "shaded") < 0.5 * table.value("without", "shaded")
    for row in table.rows:
        assert row[3] == row[1] / pairs


def test_names_are_separated_by_spaces_or_commas(capsys):
    assert main(["measure", "numerics", "reach,proxies", "cutoff, reach", "--json"]) == 0
    tables = json.loads(capsys.readouterr().out)["tables"]
    assert [table["name"] for table in tables] == ["reach", "proxies", "cutoff"]


@pytest.mark.parametrize("given", ["", ",", "depth,,ndc", "depth,", " "])
def test_an_empty_name_is_refused_in_a_line(capsys, given):
    assert main(["measure", "numerics", given]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "there is a table without a name: choose from depth, normals, " in line


def test_the_command_prints_json(capsys):
    assert main(["measure", "numerics", "cutoff", "proxies", "cutoff", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result.keys() == {"driver", "tables"}
    assert [table["name"] for table in result["tables"]] == ["cutoff", "proxies"]
    for table in result["tables"]:
        assert table.keys() == {"name", "about", "columns", "rows"}
        assert all(len(row) == len(table["columns"]) for row in table["rows"])


def test_the_command_prints_tables(capsys):
    assert main(["measure", "numerics", "powers"]) == 0
    driver, _, about, head, *rows = capsys.readouterr().out.splitlines()
    assert driver
    assert about.startswith("powers: ")
    assert head.split() == ["exponent", "pow", "power_of_cosine", "power_of_cosine", "bound"]
    assert [row.split()[0] for row in rows] == ["32", "128", "1e3", "1e6"]


def test_what_is_infinite_is_a_text_in_json():
    table = Table("name", "about", ("a", "b"), [("row", math.inf)])
    assert json.loads(json.dumps(table.as_dict(), allow_nan=False))["rows"] == [["row", "inf"]]
    assert table.as_text() == [("a", "b"), ("row", "inf")]


def test_a_misspelt_table_is_a_line(capsys):
    assert main(["measure", "numerics", "powres"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "there is no table 'powres' (did you mean 'powers'?)" in line


def test_device_and_required_gpu(capsys, device):
    assert main(["measure", "numerics", "cutoff", "--device", "77"]) == 1
    assert "no EGL device 77" in capsys.readouterr().err
    assert main(["measure", "numerics", "cutoff", "--require-gpu"]) == int(device.software)
    assert ("a GPU is required" in capsys.readouterr().err) == device.software


def test_help_names_the_tables_that_there_are(capsys):
    assert main(["measure", "numerics", "--help"]) == 0
    text = " ".join(re.sub("[^\\w.,:]+", " ", capsys.readouterr().out).split())
    named = re.search(r"Names, separated by spaces or commas: ([\w, ]+)\. All when absent", text)
    assert named is not None
    assert tuple(named[1].split(", ")) == NAMES


def test_the_page_has_the_tables_in_order():
    assert tuple(re.findall(r"^firefly measure numerics (\w+)$", DOCS.read_text(), re.MULTILINE)) == NAMES
    assert tuple(re.findall(r"^```text\n(\w+): ", DOCS.read_text(), re.MULTILINE)) == NAMES
