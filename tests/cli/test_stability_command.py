"""``firefly measure stability``: its table, its JSON and its exit code."""

from __future__ import annotations

import json

import pytest

from firefly_sample.cli import main
from firefly_sample.commands.measure_stability import stability_as_text
from firefly_sample.lab import stability


def row(case="distance, f/n 1e+06", method="depth24", verdict="pass", warning=""):
    return {
        "case": case,
        "method": method,
        "bound": 1e-6,
        "measured": 3.5e-7,
        "verdict": verdict,
        "warning": warning,
    } | ({"reason": "few codes are left"} if verdict == "expected" else {})


def test_json_of_what_was_chosen(capsys):
    arguments = (
        "measure",
        "stability",
        "--case",
        "NDC",
        "--case",
        "strength 0",
        "--method",
        "shader,depth24",
    )
    assert main([*arguments, "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result.keys() == {"driver", "cases"}
    assert {(found["case"].split(",")[0], found["method"]) for found in result["cases"]} == {
        ("NDC", "shader"),
        ("strength 0", "depth24"),
    }
    for found in result["cases"]:
        assert found.keys() == {"case", "method", "bound", "measured", "verdict", "warning"}
        assert found["verdict"] == "pass"
        assert 0.0 <= found["measured"] <= found["bound"]


def test_the_table_names_each_case_once_and_gives_reasons():
    rows = [
        row(method="linear32f"),
        row(verdict="expected", warning="position_method=depth24: noise"),
        row(case="other", verdict="fail"),
    ]
    lines = stability_as_text({"driver": "a driver", "cases": rows}).splitlines()
    assert lines[0] == "a driver"
    assert lines[1].split() == ["CASE", "METHOD", "BOUND", "MEASURED", "VERDICT", "WARNING"]
    assert lines[2].split() == ["distance,", "f/n", "1e+06", "linear32f", "1e-06", "3.5e-07", "pass"]
    assert lines[3].split() == [
        "depth24",
        "1e-06",
        "3.5e-07",
        "expected",
        "position_method=depth24:",
        "noise",
    ]
    assert lines[4].startswith("other")
    assert lines[5] == "expected: few codes are left"
    assert lines[-1] == "1 pass, 1 expected, 1 fail"


@pytest.mark.parametrize(("verdict", "code"), [("pass", 0), ("expected", 0), ("fail", 1)])
def test_only_a_failure_is_one(monkeypatch, capsys, verdict, code):
    result = {"driver": "a driver", "cases": [row(), row(verdict=verdict)]}
    monkeypatch.setattr(stability, "measure_stability", lambda **_: result)
    assert main(["measure", "stability"]) == code
    assert capsys.readouterr().out.count("distance") >= 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--case", "distence"), "there is no case 'distence' (did you mean 'distance'?)"),
        (("--method", "linear32f,depht24"), "there is no method 'depht24' (did you mean 'depth24'?)"),
    ],
)
def test_a_misspelt_name_is_one_line(capsys, arguments, message):
    assert main(["measure", "stability", *arguments]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"firefly: {message}")
    assert err.count("\n") == 1


def test_it_is_no_command_of_a_scene(capsys):
    assert main(["measure", "stability", "forest"]) == 2
    assert capsys.readouterr().err.startswith("firefly:")
