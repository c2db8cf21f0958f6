"""The extremes that ``firefly measure stability`` measures, each with each of its methods."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from firefly_sample.cli import main
from firefly_sample.commands.measure_stability import stability_as_markdown, stability_as_text
from firefly_sample.errors import SettingsError
from firefly_sample.lab import stability
from firefly_sample.lab.experiments import CASES
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.cases import error_warning
from firefly_sample.lab.experiments.experiment import POSITIONS, Experiment
from firefly_sample.lab.experiments.scenes import wall_scene
from firefly_sample.lab.stability import EXPECTED, measure_case, measure_stability, reason_for
from firefly_sample.plan.frame_plan import Capabilities
from firefly_sample.scene.lights import PointLight
from firefly_sample.settings import Settings

COSTLY = "100,000 lights"
"""Takes as long as ten other cases: drawn here by float32 and by half-float positions alone. Fewer lights are
drawn by all, and the command draws these by all."""
assert COSTLY in {case.name for case in CASES}
ALL = [(case, method) for case in CASES for method in case.rows]


def is_quick(case: Experiment, method: str) -> bool:
    """Whether a pair is drawn without --all-methods, which draws them all, as the command does.

    Each case of positions is drawn by the default method, by those that fail there as expected, and by two
    others in turn, so that every method draws many cases. Other cases are drawn by all their methods.
    """
    if case.name == COSTLY:
        return method in ("linear32f", "stored16f")
    if case.rows != POSITIONS or method == "linear32f" or reason_for(case.name, method) is not None:
        return True
    turn = CASES.index(case)
    return (POSITIONS.index(method) - turn) % len(POSITIONS) in (0, 3)


PAIRS = [pair for pair in ALL if is_quick(*pair)]
QUICK = {(case.name, method) for case, method in PAIRS}


@pytest.fixture(scope="module")
def rows():
    """The rows measured so far, by case and method."""
    return {}


def test_every_method_draws_many_cases():
    for method in POSITIONS:
        assert sum(drawn == method for _, drawn in PAIRS) > sum(case.rows == POSITIONS for case in CASES) / 4


@pytest.mark.parametrize(("case", "method"), PAIRS, ids=[f"{case.name}: {method}" for case, method in PAIRS])
def test_every_extreme_holds_or_fails_as_expected(bench, rows, case, method):
    if not bench.can_draw(case.needs):
        pytest.skip(f"the driver lacks {case.needs}")
    row = rows[case.name, method] = measure_case(bench, case, method)
    assert row["verdict"] != "fail", row
    if row["verdict"] == "expected":
        assert row["warning"].startswith(f"position_method={method}:")
        assert not row["measured"] <= row["bound"]
        assert row["reason"] == str(reason_for(case.name, bench.law_of(method)))


def test_the_other_methods_hold_too(request, bench, rows):
    if not request.config.getoption("--all-methods"):
        pytest.skip("it takes a minute, and the command measures them: give --all-methods")
    for case, method in ALL:
        if (case.name, method) not in QUICK and bench.can_draw(case.needs):
            assert measure_case(bench, case, method)["verdict"] != "fail", (case.name, method)


def test_each_expected_failure_occurs(rows):
    if len(rows) < len(PAIRS):
        pytest.skip("not every case was measured")
    for expected in EXPECTED:
        for method in expected.methods:
            found = [row for row in rows.values() if reason_for(row["case"], row["method"]) is expected]
            verdicts = [row["verdict"] for row in found if row["method"] == method]
            assert "expected" in verdicts, (expected, method)


def test_case_names_are_unique_and_those_of_positions_have_every_method():
    names = [case.name for case in CASES]
    assert len(names) == len(set(names))
    for case in CASES:
        assert not set(case.rows) & set(POSITIONS) or case.rows == POSITIONS, case.name


# --- Verdicts ---


def noise(bench, method):
    """Depth of 24 bits a million times as far away as the near plane: a plan that warns."""
    scene = wall_scene(10.0, near=1e-5)
    scene.root.attach_new_node(PointLight("light", radius=2.0)).set_pos(0, 9, 0)
    bench.draw(scene, Settings().with_changes(position_method=method), (16, 12))
    return 2.0


NOISE = Experiment("distance, f/n 1e+06", noise, bound=1.0)


def test_what_is_expected_must_be_warned_of(bench):
    row = measure_case(bench, NOISE, "depth24")
    assert row["verdict"] == "expected"
    assert row["warning"].startswith("position_method=depth24: at ")
    silent = replace(NOISE, measure=lambda bench, method: 2.0)
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

    row = measure_case(bench, replace(NOISE, measure=broken), "depth24")
    assert row["verdict"] == "fail"
    assert row["warning"] == "3 values of its pictures are not finite"


def test_a_measurement_that_is_no_number_fails_whatever_is_expected(bench):
    def broken(bench, method):
        return math.nan * noise(bench, method)

    row = measure_case(bench, replace(NOISE, measure=broken), "depth24")
    assert (row["verdict"], row["warning"]) == ("fail", "the measured value is not a number")


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

    row = measure_case(bench, replace(NOISE, measure=refused), "depth24")
    assert (row["verdict"], row["warning"], row["measured"]) == ("fail", "no", math.inf)


def test_a_driver_that_lacks_something_is_no_warning_of_the_error():
    lacks = (
        "position_method=depth32f: the driver lacks ARB_clip_control, so depth is a standard 24-bit buffer"
    )
    error = "position_method=depth32f: at 9 units, near plane 1, the error of a position is about 1 unit"
    ends = "position_method=stored16f: half floats end at 65504 units"
    assert error_warning([lacks], "depth32f") == ""
    assert error_warning([lacks, ends, error], "depth32f") == error
    assert error_warning([error, ends], "stored16f") == ends
    assert error_warning([error, ends], "depth24") == ""


# --- Drivers that lack something ---


@pytest.fixture
def bench_lacking(bench, monkeypatch):
    """The bench as on another driver."""

    def lacking(**lacks):
        for device in (bench.renderer._device, bench.device):
            monkeypatch.setattr(device, "capabilities", replace(device.capabilities, **lacks))
        return bench

    return lacking


@pytest.mark.parametrize(
    "case",
    [case for case in CASES if "depth32f" in case.rows and case.name != COSTLY],
    ids=lambda case: case.name,
)
def test_depth32f_without_clip_control_has_the_law_of_depth24(bench_lacking, case):
    bench = bench_lacking(clip_control=False)
    assert bench.law_of("depth32f") == "depth24"
    row = measure_case(bench, case, "depth32f")
    allowed = reason_for(case.name, "depth24")
    assert row["verdict"] in ("pass", "expected"), row
    assert row["bound"] == case.bound_for("depth24")
    if row["verdict"] == "expected":
        assert row["warning"].startswith("position_method=depth32f: at ")
        assert row["reason"] == str(allowed)
        assert f"expected: {allowed}" in stability_as_text({"driver": "", "cases": [row]})


@pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")
def test_what_a_driver_cannot_draw_is_left_out(monkeypatch):
    monkeypatch.setattr(ExperimentBench, "capabilities", Capabilities(float64=False))
    rows = measure_stability(["thin triangles", "NDC, fov 90"])["cases"]
    assert [row["case"] for row in rows] == ["NDC, fov 90"]
    with pytest.raises(SettingsError, match=r"^this driver can draw none of these cases: firefly doctor"):
        measure_stability(["thin triangles"])


def test_normals_without_signed_targets(bench_lacking):
    case = next(case for case in CASES if case.name == "normals, a million")
    row = measure_case(bench_lacking(snorm_targets=False), case, "oct16")
    assert row["verdict"] == "pass"
    assert row["measured"] > 0.9 * row["bound"]


# --- What is printed ---

PAGE = " ".join((Path(__file__).parents[2] / "docs/stability.md").read_text(encoding="utf-8").split())


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_page_has_each_case(case):
    assert f"| {case.name} |" in PAGE or f" {case.name};" in PAGE or f" {case.name}. " in PAGE


def test_the_page_has_what_is_expected():
    for expected in EXPECTED:
        assert f"- {expected}" in PAGE


def row(case, method, measured, bound=1e-6, verdict="pass"):
    names = ("case", "method", "bound", "measured", "verdict", "warning")
    return dict(zip(names, (case, method, bound, measured, verdict, ""), strict=True))


def test_tables_of_the_page():
    rows = [
        row("far", "linear32f", 3.51e-7),
        row("far", "depth24", 2e-3, 4e-3),
        row("far", "depth16", math.inf, verdict="expected") | {"reason": "far with depth16: few codes"},
        row("near", "linear32f", 0.0),
        row("nearer", "linear32f", 0.0),
        row("rays", "shader", 0.0, 1e-7),
        row("rays", "loop", 2e-7, 1e-7, "fail"),
    ]
    assert stability_as_markdown({"driver": "a driver", "cases": rows}).splitlines() == [
        "a driver: 5 pass, 1 fail as expected, 1 fail otherwise.",
        "",
        "| case | bound | linear32f | depth24 | depth16 |",
        "|---|---|---|---|---|",
        "| far | 1.0e-6 | 3.5e-7 | 2.0e-3 (4.0e-3) | **inf** |",
        "",
        "Every method measured 0: near; nearer.",
        "",
        "| case | method | bound | measured |",
        "|---|---|---|---|",
        "| rays | shader | 1.0e-7 | 0 |",
        "| rays | loop | 1.0e-7 | 2.0e-7 fails |",
        "",
        "These fail as expected:",
        "",
        "- far with depth16: few codes",
    ]


def test_json_has_what_is_no_number_as_text(monkeypatch, capsys):
    rows = [row("far", "depth24", math.inf), row("far", "depth16", math.nan), row("far", "linear32f", 0.0)]
    monkeypatch.setattr(stability, "measure_stability", lambda **_: {"driver": "a driver", "cases": rows})
    assert main(["measure", "stability", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)["cases"]
    assert [found["measured"] for found in printed] == ["inf", "nan", 0.0]


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--case", ""], 1, "no case was named"),
        (["--method", ""], 1, "no method was named"),
        (["--method", ","], 1, "no method was named"),
        (["spot"], 2, "'spot' is not an option: choose a case with --case 'spot'"),
        (["--json", "--markdown"], 2, "--json and --markdown exclude each other"),
    ],
)
def test_what_makes_no_sense_is_one_line(capsys, arguments, code, message):
    assert main(["measure", "stability", *arguments]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"firefly: {message}")
    assert err.count("\n") == 1


# --- What is chosen ---


@pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")
def test_the_measurement_has_the_keys_of_the_contract(monkeypatch):
    monkeypatch.setattr(stability, "CASES", (NOISE, replace(NOISE, name="other", rows=("float64",))))
    told = []
    result = measure_stability(["f/n"], ["depth16", "depth24"], lambda *count: told.append(count))
    assert result.keys() == {"driver", "cases"}
    assert [(row["case"], row["method"]) for row in result["cases"]] == [
        (NOISE.name, "depth24"),
        (NOISE.name, "depth16"),
    ]
    for row in result["cases"]:  # both fail as expected
        assert list(row) == ["case", "method", "bound", "measured", "verdict", "warning", "reason"]
    assert told == [(1, 2), (2, 2)]


def chosen(monkeypatch, names, cases):
    """Names of the cases that are measured of those there are."""
    there_are = tuple(replace(NOISE, name=name, measure=lambda bench, method: 0.0) for name in names)
    monkeypatch.setattr(stability, "CASES", there_are)
    return [row["case"] for row in measure_stability(cases, ["depth24"])["cases"]]


@pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")
def test_a_whole_name_is_no_part_of_another(monkeypatch):
    names = ["f/n 10", "f/n 1000", "y/n 1000"]
    assert chosen(monkeypatch, names, ["f/n 10"]) == ["f/n 10"]
    assert chosen(monkeypatch, names, ["f/n 10", "y/n"]) == ["f/n 10", "y/n 1000"]
    assert chosen(monkeypatch, names, ["f/n"]) == ["f/n 10", "f/n 1000"]
    assert chosen(monkeypatch, names, ["*1000"]) == ["f/n 1000", "y/n 1000"]


@pytest.mark.parametrize(
    ("cases", "methods", "message"),
    [
        ([""], None, r"^no case was named: give a name, or a part of one"),
        (["spot", " "], None, r"^no case was named"),
        ([], None, r"^no case was named"),
        (None, [], r"^no method was named: choose from linear32f"),
        (None, [""], r"^no method was named"),
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
