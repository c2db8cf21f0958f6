"""Sweeps of speed: sizes, counts of lights and methods, what is left out of them, and what they leave."""

from __future__ import annotations

import itertools
import json

import pytest
from PIL import Image

from firefly_sample.cli import main
from firefly_sample.errors import OutputError, ParameterError, SceneError, SettingsError
from firefly_sample.frame import Frame
from firefly_sample.lab.speed import measure_speed
from firefly_sample.lab.speed_report import figure_inches, speed_as_markdown
from firefly_sample.lab.speed_sweep import COUNTS, METHODS
from firefly_sample.renderer import Renderer
from tests.lab.walls import COUNTED, SIZE, counted, measure


def sweep(**options):
    return measure_speed(COUNTED, **{"sizes": [SIZE], "rounds": 1, "counts": (4, 1, 16, 4), **options})


def test_each_size_and_count_is_drawn_by_every_method_fewest_lights_first():
    result = sweep(sizes=[SIZE, (32, 24), SIZE])
    assert result["size"] == [[64, 48], [32, 24]]
    assert [(row["size"], row["lights"], row["method"]) for row in result["rows"]] == [
        (size, lights + 1, method)
        for size in ([64, 48], [32, 24])
        for lights in (1, 4, 16)
        for method in METHODS
    ]
    assert result["left_out"] == []
    for size in result["size"]:
        for lights in (1, 4, 16):
            rows = [row for row in result["rows"] if (row["size"], row["lights"]) == (size, lights + 1)]
            by_method = {row["method"]: row for row in rows}
            pixels = size[0] * size[1]
            assert by_method["fullscreen"]["shaded"] == by_method["loop"]["shaded"] == pixels * lights
            assert len({row["pairs"] for row in rows}) == 1
            assert 0 < rows[0]["pairs"] <= by_method["volumes"]["shaded"] <= by_method["original"]["shaded"]
    few, many = (row["pairs"] for row in (result["rows"][0], result["rows"][2 * len(METHODS)]))
    assert few < many


def test_rows_say_what_a_frame_costs_beside_its_passes():
    result = sweep(counts=(2, 9), methods=("volumes", "loop"))
    assert len(result["rows"]) == 4
    for row in result["rows"]:
        assert row["ms"] == pytest.approx(sum(row["passes"].values()))  # of one round
        assert row["host_ms"] > row["plan_ms"] > 0.0
        assert row["draw_calls"] == 3 == len(row["passes"])
        assert row["bytes_per_pixel"] >= 4 + 4 + 4 + 4
    before, after = result["rows"][0], result["rows"][2]
    assert before["method"] == after["method"] == "volumes"
    assert (before["slope"], before["growth"], after["growth"]) == (None, None, None)
    assert after["slope"] == pytest.approx(1e3 * (after["ms"] - before["ms"]) / 7)


def test_what_is_measured_is_a_frame_after_another():
    counted.times.clear()
    sweep(counts=(3,), methods=("volumes",), rounds=2, time=7.0)
    draws = 3
    assert counted.times[0::2] == pytest.approx([7.0 + 1 / 24] * draws)
    assert counted.times[1::2] == [7.0] * draws


def test_fragments_are_counted_and_read_back_in_the_first_round_alone(monkeypatch):
    draw, counting = Renderer.draw, []

    def watched(self, plan, read=True):
        counting.append(self.count_fragments)
        return draw(self, plan, read)

    monkeypatch.setattr(Renderer, "draw", watched)
    sweep(counts=(3,), rounds=2)
    assert counting == [True] * len(METHODS) + [False] * 2 * len(METHODS)


def test_a_new_method_is_an_entry(monkeypatch):
    """Clusters count what their lists hold, also where they were chosen by the frame."""
    monkeypatch.setitem(METHODS, "clustered", {"light_method": "clustered"})
    monkeypatch.setitem(METHODS, "auto", {"light_method": "auto"})
    rows = {row["method"]: row for row in sweep(counts=(40,))["rows"]}
    assert len(rows) == 6
    assert len({row["pairs"] for row in rows.values()}) == 1
    assert rows["clustered"]["pairs"] <= rows["clustered"]["shaded"] < rows["fullscreen"]["shaded"]
    assert rows["auto"]["shaded"] in (rows["clustered"]["shaded"], rows["volumes"]["shaded"])


def test_ratios_are_to_the_first_method_where_the_chosen_is_not_measured():
    result = sweep(counts=(5,), methods=("loop", "fullscreen", "loop"))
    assert [row["method"] for row in result["rows"]] == ["loop", "fullscreen"]
    assert (result["chosen"], result["rows"][0]["ratio"]) == ("loop", 1.0)


def test_a_scene_has_the_lights_that_its_parameter_says_or_as_many_as_it_may():
    given = measure_speed(COUNTED, parameters={"lamps": 7}, sizes=[SIZE], rounds=1, methods=["volumes"])
    assert [row["lights"] for row in given["rows"]] == [8]
    swept = sweep(counts=None, methods=["volumes"])
    assert [row["lights"] for row in swept["rows"]] == [count + 1 for count in COUNTS if count <= 40]
    none = sweep(counts=(0, 2), methods=["volumes"])
    assert [(row["lights"], row["pairs"] > 0) for row in none["rows"]] == [(1, False), (3, True)]


def slow(monkeypatch, seconds):
    """Frames that take what a function of (size, lights in view, settings) says."""
    draw = Renderer.draw

    def timed(self, plan, read=True):
        frame = draw(self, plan, read)
        fields = {name: getattr(frame, name) for name in Frame.__dataclass_fields__}
        took = 1e3 * seconds(plan.size, plan.counts.in_view, plan.settings.light_method)
        return Frame(**fields | {"milliseconds": {"all": took}})

    monkeypatch.setattr(Renderer, "draw", timed)


def test_what_would_take_too_long_is_left_out_and_said_to_be(monkeypatch):
    """A second a light: 16 would take longer than ten, which the line through 4 and 8 says."""
    slow(monkeypatch, lambda size, lights, method: lights if method == "fullscreen" else 1.0)
    calls = []
    result = sweep(
        counts=(4, 8, 16, 32), sizes=[SIZE, (32, 24)], longest=10.0, progress=lambda *call: calls.append(call)
    )
    drawn = {(*row["size"], row["lights"] - 1) for row in result["rows"] if row["method"] == "fullscreen"}
    # it is no quicker at more pixels; fewer are another matter, and foreseen again
    assert drawn == {(64, 48, 4), (64, 48, 8), (32, 24, 4), (32, 24, 8)}
    assert [row["method"] for row in result["rows"]].count("loop") == 8
    assert [(left["size"], left["lights"], left["method"]) for left in result["left_out"]] == [
        (size, lights, "fullscreen") for size in ([64, 48], [32, 24]) for lights in (16, 32)
    ]
    assert result["left_out"][0]["because"] == "a frame would take about 16 s, more than 10 s"
    assert result["left_out"][1]["because"] == "too long already with 16 at 64x48"
    total = 2 * 4 * 2 * len(METHODS)
    assert calls[-1] == (total, total)
    assert [done for done, _ in calls] == sorted({done for done, _ in calls})


def test_what_took_too_long_is_left_out_also_at_more_pixels(monkeypatch):
    slow(monkeypatch, lambda size, lights, method: 6.0 if method == "volumes" and lights > 2 else 1.0)
    result = sweep(counts=(1, 3, 5), sizes=[(32, 24), SIZE])
    rows = {(*row["size"], row["lights"] - 1, row["method"]): row for row in result["rows"]}
    assert {key for key in rows if key[3] == "volumes"} == {(32, 24, 1, "volumes"), (64, 48, 1, "volumes")}
    assert rows[32, 24, 3, "loop"]["ratio"] is None
    assert rows[32, 24, 1, "loop"]["ratio"] == 1.0
    # the original is drawn with the same setting
    assert {left["method"] for left in result["left_out"]} == {"volumes", "original"}
    assert [left["because"] for left in result["left_out"] if left["method"] == "volumes"] == [
        "a frame took 6 s, more than 5 s",
        "too long already with 3 at 32x24",
        "too long already with 3 at 32x24",
        "too long already with 3 at 32x24",
    ]


def test_what_is_foreseen_goes_by_the_quickest_frames(monkeypatch):
    """One frame in three is quick: a line through the medians would say 20 s."""
    turns = itertools.cycle([1.0, 1.0, 4.0, 4.0])
    slow(monkeypatch, lambda size, lights, method: next(turns) * (2.0 if lights > 1 else 1.0) / 8.0)
    result = sweep(counts=(1, 2, 40), rounds=3, methods=("volumes",), longest=6.0)
    assert [row["ms"] for row in result["rows"]] == [500.0, 1000.0, 1000.0]
    assert [left["lights"] for left in result["left_out"]] == []


def test_a_first_frame_may_take_long_since_it_compiles(monkeypatch):
    turns = itertools.chain([9.0], itertools.repeat(1.0))
    slow(monkeypatch, lambda size, lights, method: next(turns))
    result = sweep(counts=(3,))
    assert len(result["rows"]) == len(METHODS)
    assert all(row["ms"] == 1000.0 for row in result["rows"])


def test_files_are_left_in_a_folder(tmp_path, capsys):
    folder = tmp_path / "new" / "speed"
    options = ["--counts", "2,8", "--sizes", "32x24,16x12", "--methods", "volumes,loop", "--rounds", "1"]
    assert main(["measure", "speed", COUNTED, *options, "-o", str(folder), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert {path.name for path in folder.iterdir()} == {"speed.json", "speed.md", "growth.png"}
    assert json.loads((folder / "speed.json").read_text()) == result
    assert (folder / "speed.md").read_text() == speed_as_markdown(result)
    with Image.open(folder / "growth.png") as image:
        width, height = figure_inches(2)
        assert (image.format, image.size) == ("PNG", (round(110 * width), round(110 * height)))
    assert main(["measure", "speed", COUNTED, *options]) == 0
    text = capsys.readouterr().out
    assert "counted, 32x24" in text
    assert "counted, 16x12" in text


def test_an_interrupted_sweep_leaves_what_was_measured(tmp_path, monkeypatch):
    def stop(size, lights, method):
        if lights == 9:
            raise KeyboardInterrupt
        return 1.0

    slow(monkeypatch, stop)
    with pytest.raises(KeyboardInterrupt):
        sweep(folder=tmp_path, counts=(2, 9))
    rows = json.loads((tmp_path / "speed.json").read_text())["rows"]
    assert [row["lights"] for row in rows] == [3] * len(METHODS)


def test_bad_input_is_told_before_anything_is_drawn(monkeypatch):
    def never(*_):
        raise AssertionError("drawn")

    monkeypatch.setattr(Renderer, "draw", never)
    with pytest.raises(SettingsError, match=r"no method 'volume' \(did you mean 'volumes'\?\): choose"):
        sweep(methods=("loop", "volume"))
    with pytest.raises(SettingsError, match="the list of methods is empty: choose from volumes, original"):
        sweep(methods=())
    with pytest.raises(ParameterError, match="scene 'counted': lamps must be between 0 and 40, got 41"):
        sweep(counts=(1, 41))
    with pytest.raises(SceneError, match="the list of counts of lights is empty: give at least one"):
        sweep(counts=())
    with pytest.raises(SceneError, match="'lamps' and 'counts' both set the number of lights: give one of"):
        sweep(parameters={"lamps": 4})
    with pytest.raises(
        SceneError, match="'walled' has no parameter for its number of lights: leave 'counts'"
    ):
        measure(counts=(1, 2))
    with pytest.raises(OutputError, match="size must be two whole numbers of pixels"):
        sweep(sizes=[SIZE, (0, 4)])
    with pytest.raises(SceneError, match=r"nothing to measure: .* one size"):
        sweep(sizes=())
    for longest in (0.0, float("nan")):
        with pytest.raises(SettingsError, match="longest must be a number of seconds above 0"):
            sweep(longest=longest)


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--sizes", "640x360,big", "a size is WIDTHxHEIGHT in pixels, for example 800x600, got 'big'"),
        ("--counts", "1,many", "it must be a whole number, got 'many'"),
        ("--rounds", "1.5", "it must be a whole number, got '1.5'"),
    ],
)
def test_what_cannot_be_understood_is_named(capsys, option, value, message):
    assert main(["measure", "speed", COUNTED, option, value]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_one_size_may_be_called_a_size_and_a_scenes_own_parameter_is_not(capsys):
    words = ["measure", "speed", COUNTED, "--counts", "1", "--rounds", "1", "--json"]
    assert main([*words, "--size", "16x12"]) == 0
    assert json.loads(capsys.readouterr().out)["size"] == [16, 12]
    assert main(["measure", "speed", "tests.cli.glade:crowded", "--help"]) == 0
    assert "--scene-size" in capsys.readouterr().out
