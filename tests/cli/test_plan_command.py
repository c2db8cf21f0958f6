"""``firefly plan``: JSON, a graph and a table of the same plan, without a driver."""

from __future__ import annotations

import json
import re

import pytest

from firefly_sample.cli import main
from firefly_sample.columns import align
from firefly_sample.pipeline import build_plan
from firefly_sample.plan.report import plan_as_dict, plan_as_dot, plan_as_text
from firefly_sample.settings import Settings
from tests.cli.command import GLADE, broken_gl, firefly
from tests.scenes import ball_scene


@pytest.fixture(scope="module")
def plan():
    return build_plan(ball_scene(ambient=(0.1, 0.1, 0.1)), Settings(position_method="depth32f"), (64, 48))


def printed(capsys, *arguments):
    assert main(["plan", *arguments]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    return out


def test_the_dictionary_is_the_plan(plan):
    told = plan_as_dict(plan)
    assert [step["name"] for step in told["passes"]] == [step.name for step in plan.passes]
    assert {target["name"]: target["bytes_per_pixel"] for target in told["targets"]} == {
        target.name: target.bytes_per_pixel for target in plan.targets
    }
    lights = next(step for step in told["passes"] if step["name"] == "point_lights")
    assert lights["reads"] == ["albedo", "normal", "depth"]
    assert lights["updates"] == ["radiance"]
    assert told["light_method"]["method"] == plan.culling.method == "clustered"
    assert told["light_method"]["estimated_pairs"].keys() == {"volumes", "clustered", "fullscreen"}
    assert (told["light_method"]["tiles"], told["light_method"]["tile"]) == ([8, 6], 8)
    assert told["lights"] == {"in_scene": 60, "in_view": plan.counts.in_view, "dropped": 0}
    assert all(entry["because"] for entry in told["passes"] + told["targets"])


def test_the_command_prints_what_the_library_says(capsys):
    told = json.loads(printed(capsys, GLADE, "--json", "--no-dusk", "--supersample", "1"))
    assert "ambient" not in [step["name"] for step in told["passes"]]
    assert told["lights"]["in_scene"] == 40
    assert told["warnings"] == []


def test_outputs_and_parameters_shape_the_plan(capsys):
    told = json.loads(printed(capsys, GLADE, "--json", "--outputs", "id", "--fireflies", "0", "--glass"))
    assert [step["name"] for step in told["passes"]] == ["geometry"]
    assert {target["name"] for target in told["targets"]} == {"depth", "id"}
    assert told["lights"] == {"in_scene": 0, "in_view": 0, "dropped": 0}
    assert "glass" in told["warnings"][0]


def test_the_graph_has_an_edge_for_each_use_of_a_target(plan):
    dot = plan_as_dot(plan)
    assert dot.startswith("digraph frame {\n")
    assert dot.endswith("}\n")
    edges = re.findall(r'^    "(.+?)" -> "(.+?)"(?: \[(.*)\])?;$', dot, re.MULTILINE)
    expected = set()
    for step in plan.passes:
        expected |= {(f"target {name}", f"pass {step.name}", "") for name in step.reads}
        expected |= {(f"pass {step.name}", f"target {name}", "") for name in step.writes}
        expected |= {
            (f"pass {step.name}", f"target {name}", "style=dashed, dir=both") for name in step.updates
        }
    assert set(edges) == expected
    nodes = set(re.findall(r'^    "((?:pass|target) \w+)" \[shape', dot, re.MULTILINE))
    assert nodes == {end for edge in edges for end in edge[:2]}
    assert dot.count('"') % 2 == 0


def test_the_graph_of_the_command(capsys):
    assert printed(capsys, GLADE, "--dot").startswith("digraph frame {\n")


def test_the_table_has_a_line_for_each_pass_and_target_and_their_sum(plan):
    text = plan_as_text(plan)
    passes, targets, *_ = text.split("\n\n")
    for table, entries in ((passes, plan.passes), (targets, plan.targets)):
        _, *lines = table.splitlines()
        assert [line.split()[0] for line in lines] == [entry.name for entry in entries]
        assert all(line.endswith(entry.because) for line, entry in zip(lines, entries, strict=True))
    total = sum(target.bytes_per_pixel for target in plan.targets)
    assert f"{total} bytes a pixel, {total * 64 * 48 / 2**20:.1f} MiB at 64x48; lights: " in text


def test_the_sum_counts_every_sample(plan):
    four = build_plan(ball_scene(), Settings(supersample=2), (64, 48))
    total = sum(target.bytes_per_pixel * (4 if target.per_sample else 1) for target in four.targets)
    text = plan_as_text(four)
    assert "BYTES A SAMPLE" in text
    assert f"{total} bytes a pixel" in text
    assert "BYTES A PIXEL" in plan_as_text(plan)


def test_no_driver_is_needed(tmp_path):
    done = firefly("plan", GLADE, "--json", cwd=tmp_path, env=broken_gl(tmp_path / "lib"))
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["passes"]


def test_columns():
    assert align([("a", "bb", "c"), ("dddd", "e", "long words")]) == "a     bb  c\ndddd  e   long words"
