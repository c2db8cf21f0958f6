"""Parameters: what is said of their range, and texts that have choices."""

from __future__ import annotations

import pytest

from firefly_sample.errors import ParameterError
from firefly_sample.scene.parameter import KeyStep, Parameter


@pytest.mark.parametrize(
    ("kind", "minimum", "maximum", "text"),
    [
        (int, 0, 2**63 - 1, "between 0 and 9223372036854775807"),
        (int, -12345678, None, "-12345678 or more"),
        (int, None, 20_000_000, "at most 20000000"),
        (int, 0, 1e9, "between 0 and 1000000000"),
        (float, 0.0, 100.0, "between 0 and 100"),
        (float, 0.25, 1e30, "between 0.25 and 1e+30"),
        (float, None, float("inf"), "at most inf"),
        (float, None, None, "any number"),
    ],
)
def test_range_text(kind, minimum, maximum, text):
    assert Parameter("size", kind, 0, "A size.", minimum, maximum).range_text() == text


def test_an_error_has_the_exact_range():
    parameter = Parameter("seed", int, 0, "A seed.", 0, 2**63 - 1)
    with pytest.raises(ParameterError, match=r"seed must be between 0 and 9223372036854775807, got -1$"):
        parameter.check(-1, "glade")
    assert parameter.check(2**63 - 1, "glade") == 2**63 - 1


def test_a_text_with_choices():
    parameter = Parameter("up", str, "y", "An axis.", choices=("x", "y", "z"))
    assert parameter.check("z", "glade") == "z"
    with pytest.raises(ParameterError, match=r"'glade': up must be one of x, y, z, got 'Z'$"):
        parameter.check("Z", "glade")
    with pytest.raises(ParameterError, match="up must be text, got 1"):
        parameter.check(1, "glade")
    assert [parameter.step(value, KeyStep("u")) for value in "xyz"] == ["y", "z", "x"]
