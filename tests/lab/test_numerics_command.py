"""The command ``firefly measure numerics``, and its page."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest

from firefly_sample.cli import main
from firefly_sample.lab.experiments import TABLES
from firefly_sample.lab.experiments.experiment import Table

DOCS = Path(__file__).parents[2] / "docs" / "numerics.md"


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
    named = re.search(r"Names, separated by spaces or commas: ([\w, ]+)\. All if absent", text)
    assert named is not None
    assert tuple(named[1].split(", ")) == tuple(TABLES)


def test_the_page_has_the_tables_in_order():
    assert tuple(re.findall(r"^firefly measure numerics (\w+)$", DOCS.read_text(), re.MULTILINE)) == tuple(
        TABLES
    )
    assert tuple(re.findall(r"^```text\n(\w+): ", DOCS.read_text(), re.MULTILINE)) == tuple(TABLES)
