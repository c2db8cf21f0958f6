"""Settings chosen by error, by codes and by time, held against what they then do."""

import json
import math
from functools import partialmethod

import pytest

from firefly_sample.cli import main
from firefly_sample.errors import SettingsError
from firefly_sample.lab import choice as choosing
from firefly_sample.lab import choose
from firefly_sample.lab.choice import MARGIN, Option, options_of, predictions
from firefly_sample.lab.trade_bench import TradeBench
from firefly_sample.scene.lights import DirectionalLight
from firefly_sample.scene.material import Material
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings
from tests.blended import add_panes, backdrop
from tests.cli.command import GLADE
from tests.conftest import make_renderer
from tests.scenes import geom_node, wall, wall_scene

SMALL = {"size": (64, 48), "times": (1.0,)}
FIXED = {
    "position_method": "linear32f",
    "accumulation_format": "rgba32f",
    "light_resolution": "full",
    "volume_proxy": "icosphere1",
}
"""Settings that stay where the search is not what is tested: it is shorter by as many dimensions."""
FEW = {**SMALL, "given": FIXED}
FIXED_WORDS = [word for name, value in FIXED.items() for word in (f"--{name.replace('_', '-')}", value)]
"""The same on a command line."""


@pytest.fixture(autouse=True)
def briefly(monkeypatch):
    """Time as few pairs of frames as may be: these tests are of errors, whatever the times are."""
    for name in ("SECONDS_ALONE", "SECONDS_TOGETHER"):
        monkeypatch.setattr(choosing, name, 0.0)
    monkeypatch.setattr(TradeBench, "time_of", partialmethod(TradeBench.time_of, least=1))


# --- The search ---


def test_options_are_what_nothing_of_their_dimension_beats():
    measured = [
        Option({}, 5e-4, 1.0, 0.0),
        Option({"normal_format": "oct8"}, 1e-3, 0.9, 0.01),
        Option({"normal_format": "rgba32f"}, 1e-4, 1.2, 0.01),
        Option({"normal_format": "rgba8"}, 1e-2, 1.1, 0.01),  # slower and worse than the base
        Option({"normal_format": "rgb10a2"}, 6e-4, 0.99, 0.05),  # its time is not told apart: it only errs
    ]
    assert options_of(measured) == [
        Option({"normal_format": "oct8"}, pytest.approx(9e-4), 0.9),
        Option({}, pytest.approx(4e-4), 1.0),
        Option({"normal_format": "rgba32f"}, 0.0, 1.2),
    ]


def test_predictions_add_errors_and_multiply_times():
    dimensions = [
        [Option({"normal_format": "oct8"}, 3e-3, 0.9), Option({}, 0.0, 1.0)],
        [Option({"albedo_format": "sqrt8"}, 1e-3, 0.8), Option({}, 2e-4, 1.0)],
    ]
    found = list(predictions(dimensions, 1e-4))
    assert len(found) == 4
    both = next(p for p in found if len(p.changes) == 2)
    assert math.isclose(both.error, 4.1e-3)
    assert math.isclose(both.ratio, 0.72)
    neither = next(p for p in found if not p.changes)
    assert math.isclose(neither.error, 3e-4)


# --- Choosing ---


@pytest.mark.parametrize("bound", [1e-1])
def test_what_is_chosen_holds_its_bound_on_frames_it_was_not_chosen_on(bound):
    steps = []
    choice = choose(GLADE, max_error=bound, **SMALL, progress=lambda *step: steps.append(step))
    assert choice.chosen.error <= MARGIN * bound
    assert choice.chosen in choice.candidates
    assert steps == sorted(steps)
    assert all(done <= total for done, total in steps)
    scene = build_scene(find_scene(GLADE))
    with make_renderer((64, 48)) as renderer:
        for time in (2.0, 5.0, 11.0):
            assert TradeBench(renderer, scene, time, Settings()).draw(choice.settings).errors.largest <= bound


def test_an_impossible_bound_says_the_best_that_can_be_had():
    with pytest.raises(
        SettingsError,
        match=r"^no settings meet max_error 1e-12 on this scene with position_method, .* fixed: the best",
    ):
        choose(GLADE, max_error=1e-12, **FEW)


def test_codes_are_a_bound_too():
    choice = choose(GLADE, max_codes=1, **FEW)
    assert choice.chosen.codes <= 1
    assert choice.asked == "max_codes 1"
    both = choose(GLADE, max_codes=2, max_error=1e-2, **FEW)
    assert both.chosen.codes <= 2
    assert both.chosen.error <= MARGIN * 1e-2


def test_a_budget_gives_the_most_accurate_within_it_and_says_where_there_is_none():
    choice = choose(GLADE, budget_ms=1e6, **FEW)
    assert choice.chosen.error == min(candidate.error for candidate in choice.candidates)
    assert choice.chosen.error <= 2e-4
    with pytest.raises(SettingsError, match=r"^no settings draw this scene in 1e-06 ms: the fastest takes"):
        choose(GLADE, budget_ms=1e-6, **FEW)


def test_settings_that_are_given_stay_and_samples_come_back():
    given = {"position_method": "depth24", "supersample": 2, "albedo_format": "sqrt8"}
    choice = choose(GLADE, max_error=1e-1, given=given, **SMALL)
    assert (choice.settings.position_method, choice.settings.supersample, choice.settings.albedo_format) == (
        "depth24",
        2,
        "sqrt8",
    )
    assert not choice.chosen.changes.keys() & given.keys()


@pytest.mark.parametrize("given", [{"light_method": "forward"}], ids=str)
def test_what_other_settings_rule_out_is_not_tried(given):
    choice = choose(GLADE, max_error=0.9, given=given, **SMALL)
    assert choice.settings.light_method == given["light_method"]
    assert not {"volume_proxy", "light_resolution"} & choice.chosen.changes.keys()


def glass(crossing):
    return add_panes(backdrop(), 6, crossing=crossing, kinds=({"unlit": True},))


def test_a_bound_chooses_how_blended_surfaces_are_drawn():
    """Layer by layer where they intersect; otherwise the order is as good."""
    choice = choose(glass(True), max_error=1e-3, **FEW)
    assert choice.settings.transparency == "exact"
    choice = choose(glass(False), max_error=1e-3, **FEW)
    assert choice.settings.transparency in ("sorted", "exact")
    assert choice.chosen.error <= 1e-3
    for given, told in (({"transparency": "weighted"}, "transparency"), ({"transparency_layers": 2}, "")):
        with pytest.raises(SettingsError, match=rf"with .*{told}.* fixed: the best have"):
            choose(glass(True), max_error=1e-3, **SMALL, given=FIXED | given)


def shadowed():
    """A card before a wall under a sun whose shadow map is far too coarse."""
    scene = wall_scene(cells=4, color=(0.5, 0.5, 0.5, 1))
    scene.root.attach_new_node(
        geom_node("card", wall(3.0), Material("card", (0.5, 0.5, 0.5, 1)))
    ).set_pos_hpr(0.3, 7, 0, 10, 20, 30)
    sun = DirectionalLight("sun", (1, 1, 1))
    sun.set_direction((0.5, 1, -0.6))
    sun.set_shadow_caster(True, 64)
    scene.root.attach_new_node(sun)
    return scene


def test_where_shadow_maps_err_most_the_best_that_can_be_had_has_finer_ones():
    with pytest.raises(SettingsError, match=r"the best have an error of .*, with .*shadow_resolution=4096"):
        choose(
            shadowed(), max_error=0.05, size=(96, 72), times=(0.0,), given={**FIXED, "normal_format": "oct16"}
        )  # a hard edge between two pixels


def test_a_bound_tighter_than_the_default_finds_the_cheapest_of_what_meets_it():
    choice = choose(GLADE, max_error=3e-4, **FEW)
    assert choice.chosen.error <= 3e-4
    tried = [candidate for candidate in choice.candidates if candidate.error <= 3e-4]
    assert len(tried) >= 2


def test_no_code_at_all_is_a_bound_as_well():
    """The picture rounds as float64 does but for values that lie on the edge of a code."""
    with pytest.raises(SettingsError, match=r"max_codes 0 .* and 1 codes, with .*albedo_format=rgba32f"):
        choose(GLADE, max_codes=0, **FEW)


def test_the_classic_look_cannot_be_chosen_for():
    with pytest.raises(SettingsError, match=r"^there is no reference for look 'classic'"):
        choose(GLADE, max_error=0.1, given={"look": "classic"}, **SMALL)


def test_the_evidence_marks_what_was_chosen():
    choice = choose(GLADE, max_error=1e-2, **FEW)
    head, titles, *rows = choice.evidence().splitlines()
    assert head.startswith("max_error 0.01: ")
    assert titles.split() == ["TIME", "SPREAD", "MS", "ERROR", "CODES", "SETTINGS"]
    assert len(rows) == len(choice.candidates)
    (marked,) = [line for line in rows if line.startswith("*")]
    assert marked.endswith(choice.chosen.name)


@pytest.mark.parametrize(
    "asked",
    [
        {},
        {"max_error": 1e-2, "budget_ms": 10.0},
        {"max_error": 0.0},
        {"max_error": float("nan")},
        {"budget_ms": -1.0},
        {"max_codes": -1},
        {"max_error": 0.1, "times": ()},
    ],
    ids=str,
)
def test_a_bound_that_makes_no_sense_is_refused(asked):
    with pytest.raises(SettingsError):
        choose(GLADE, **asked)


# --- On the command line ---


def test_capture_chooses_and_the_manifest_has_what_was_chosen(tmp_path, capsys):
    words = [
        "capture",
        GLADE,
        "--size",
        "48x36",
        "--frames",
        "0:9:4",
        "--max-error",
        "0.1",
        "-o",
        str(tmp_path),
    ]
    assert main([*words, "--position-method", "depth24", "--json"]) == 0
    out, err = capsys.readouterr()
    manifest = json.loads(out)
    assert manifest["settings"]["position_method"] == "depth24"
    assert manifest["settings"]["supersample"] == 2
    assert "max_error 0.1: " in err
    assert "largest errors at 5, 5.16667, 5.33333 s" in err
    (marked,) = [line for line in err.splitlines() if line.startswith("*")]
    for change in marked.split("  ")[-1].strip().split(", "):
        if change != "default":
            name, value = change.split("=")
            assert str(manifest["settings"][name]) == value


def test_a_bound_that_cannot_be_met_is_one_line(tmp_path, capsys):
    words = [
        "capture",
        GLADE,
        "--size",
        "32x24",
        "--max-error",
        "1e-12",
        "-o",
        str(tmp_path / "new"),
        "--quiet",
        *FIXED_WORDS,
    ]
    assert main(words) == 1
    err = capsys.readouterr().err.splitlines()
    assert next(line for line in err if "CPU" not in line).startswith("firefly: no settings meet")
    assert not (tmp_path / "new").exists()


def test_a_preset_is_an_option_and_what_is_given_besides_wins(tmp_path, capsys):
    words = ["capture", GLADE, "--size", "16x12", "-o", str(tmp_path), "--json"]
    assert main([*words, "--preset", "accurate", "--albedo-format", "sqrt8"]) == 0
    settings = json.loads(capsys.readouterr().out)["settings"]
    assert (settings["normal_format"], settings["albedo_format"]) == ("rgba32f", "sqrt8")
    assert main([*words, "--preset", "fats"]) == 2
    capsys.readouterr()
    assert main([*words, "--overwrite", "--preset", "fast", "--cutoff-budget", "1e-6"]) == 0
    settings = json.loads(capsys.readouterr().out)["settings"]
    assert (settings["cutoff_budget"], settings["cutoff_threshold"]) == (1e-6, None)  # what is given wins
    assert main([*words, "--preset", "fast", "--max-error", "0.1"]) == 1
    assert "--preset and --max-error both choose settings" in capsys.readouterr().err


def test_other_mistakes_are_told_before_the_search(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("firefly_sample.lab.choice.choose", lambda *_, **__: pytest.fail("it searched"))
    words = ["capture", GLADE, "--max-error", "0.1", "-o", str(tmp_path / "new")]
    for wrong in (["--outputs", "bogus"], ["--outputs", "color,depth", "--supersample", "2"]):
        assert main([*words, *wrong]) == 1
        assert "output" in capsys.readouterr().err
