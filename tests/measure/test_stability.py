"""The extremes that ``firefly measure stability`` measures, each with each of its methods."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest

from firefly_sample.errors import SettingsError
from firefly_sample.measure import stability
from firefly_sample.measure.stability import EXPECTED, measure_case, measure_stability, reason_for
from firefly_sample.measure.stability_cases import ALL_CASES
from firefly_sample.measure.stability_cases.bench import Bench
from firefly_sample.measure.stability_cases.case import POSITIONS, Case
from firefly_sample.measure.stability_cases.scenes import wall_scene
from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.renderer import SoftwareDriverWarning
from firefly_sample.scene.lights import PointLight
from firefly_sample.settings import Settings

PAIRS = [(case, method) for case in ALL_CASES for method in case.methods]


@pytest.fixture(scope="module")
def bench():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SoftwareDriverWarning)
        made = Bench()
    with made:
        yield made


@pytest.fixture(scope="module")
def rows():
    """What has been measured so far, by case and method."""
    return {}


@pytest.mark.parametrize(("case", "method"), PAIRS, ids=[f"{case.name}: {method}" for case, method in PAIRS])
def test_every_extreme_holds_or_fails_as_expected(bench, rows, case, method):
    row = rows[case.name, method] = measure_case(bench, case, method)
    assert row["verdict"] != "fail", row
    if row["verdict"] == "expected":
        assert row["warning"].startswith(f"position={method}:")
        assert row["measured"] > row["bound"]


def test_each_expected_failure_occurs(rows):
    if len(rows) < len(PAIRS):
        pytest.skip("not every case was measured")
    for expected in EXPECTED:
        for method in expected.methods:
            found = [row for row in rows.values() if reason_for(row["case"], row["method"]) is expected]
            verdicts = [row["verdict"] for row in found if row["method"] == method]
            assert "expected" in verdicts, (expected, method)


def test_case_names_are_unique_and_those_of_positions_have_every_method():
    names = [case.name for case in ALL_CASES]
    assert len(names) == len(set(names))
    for case in ALL_CASES:
        assert not set(case.methods) & set(POSITIONS) or case.methods == POSITIONS, case.name


# --- Verdicts ---


def noise(bench, method):
    """Depth of 24 bits a million times as far away as the near plane: a plan that warns."""
    scene = wall_scene(10.0, near=1e-5)
    scene.root.attach_new_node(PointLight("light", radius=2.0)).set_pos(0, 9, 0)
    bench.draw(scene, Settings().with_changes(position=method), (16, 12))
    return 2.0


NOISE = Case("distance, f/n 1e+06", noise, 1.0)


def test_what_is_expected_must_be_warned_of(bench):
    row = measure_case(bench, NOISE, "depth24")
    assert row["verdict"] == "expected"
    assert row["warning"].startswith("position=depth24: at ")
    silent = replace(NOISE, run=lambda bench, method: 2.0)
    assert measure_case(bench, silent, "depth24")["verdict"] == "fail"


def test_a_warning_excuses_nothing_that_is_not_expected(bench):
    assert measure_case(bench, replace(NOISE, name="another"), "depth24")["verdict"] == "fail"
    assert measure_case(bench, NOISE, "linear32f")["verdict"] == "fail"


def test_an_expected_failure_that_holds_passes(bench):
    assert measure_case(bench, replace(NOISE, bound=3.0), "depth24")["verdict"] == "pass"


def test_a_value_that_is_no_number_fails_whatever_is_expected(bench):
    def broken(bench, method):
        noise(bench, method)
        bench.not_finite += 3
        return 0.0

    row = measure_case(bench, replace(NOISE, run=broken), "depth24")
    assert row["verdict"] == "fail"
    assert row["warning"] == "3 values of its pictures are no finite numbers"


def test_values_that_are_no_numbers_are_counted(bench, monkeypatch):
    drawn = bench.renderer.draw

    def spoiled(plan):
        frame = drawn(plan)
        frame.images["radiance"][0, 0] = np.nan, np.inf, 1.0
        return frame

    monkeypatch.setattr(bench.renderer, "draw", spoiled)
    row = measure_case(bench, NOISE, "depth24")
    assert row["verdict"] == "fail"
    assert row["warning"].startswith("2 values")


def test_an_error_is_a_failure_and_not_the_end(bench):
    def refused(bench, method):
        raise SettingsError("no")

    row = measure_case(bench, replace(NOISE, run=refused), "depth24")
    assert (row["verdict"], row["warning"]) == ("fail", "no")
    json.dumps(row, allow_nan=False)


def test_depth32f_without_clip_control_errs_by_the_law_of_depth24(bench, monkeypatch):
    case = next(case for case in ALL_CASES if case.name == NOISE.name)
    assert measure_case(bench, case, "depth32f")["verdict"] == "pass"
    monkeypatch.setattr(bench.renderer._device, "capabilities", Capabilities(clip_control=False))
    assert measure_case(bench, case, "depth32f")["verdict"] == "expected"
    for name in ("distance, f/n 10", "coverage at y/n 1e+09", "small far light at y/n 1e+09"):
        case = next(case for case in ALL_CASES if case.name == name)
        assert measure_case(bench, case, "depth32f")["verdict"] == "pass"


# --- What is chosen ---


@pytest.mark.filterwarnings("ignore::firefly_sample.renderer.SoftwareDriverWarning")
def test_the_measurement_has_the_keys_of_the_contract(monkeypatch):
    monkeypatch.setattr(stability, "ALL_CASES", (NOISE, replace(NOISE, name="other", methods=("float64",))))
    told = []
    result = measure_stability(["f/n"], ["depth16", "depth24"], lambda *count: told.append(count))
    assert result.keys() == {"driver", "cases"}
    assert [(row["case"], row["method"]) for row in result["cases"]] == [
        (NOISE.name, "depth24"),
        (NOISE.name, "depth16"),
    ]
    for row in result["cases"]:
        assert list(row) == ["case", "method", "bound", "measured", "verdict", "warning"]
    assert told == [(1, 2), (2, 2)]


@pytest.mark.parametrize(
    ("cases", "methods", "message"),
    [
        (["distence"], None, r"^there is no case 'distence' \(did you mean 'distance'\?\): give a part"),
        (
            None,
            ["depht24"],
            r"^there is no method 'depht24' \(did you mean 'depth24'\?\): choose from linear32f",
        ),
        (["spot"], ["float64"], r"^no case that is called 'spot' is measured with float64: leave one"),
    ],
)
def test_a_misspelt_name_is_one_line(cases, methods, message):
    with pytest.raises(SettingsError, match=message) as caught:
        measure_stability(cases, methods)
    assert "\n" not in str(caught.value)
