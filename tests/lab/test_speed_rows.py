"""What rows of measured speed are made of, from draws whose times are given."""

import io

import pytest
from PIL import Image

from firefly_sample.errors import SceneError
from firefly_sample.lab.speed_report import (
    DPI,
    Draw,
    Draws,
    figure_inches,
    growth_figure,
    make_row,
    speed_as_markdown,
    with_slopes,
)
from firefly_sample.lab.speed_sweep import METHODS, LeftOut, predict
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scenes import find_scene
from firefly_sample.scenes.plugin import Plugin, lights_parameter

SIZE = (8, 6)


def draws(*seeds, **counts):
    """Draws of a pass that takes these milliseconds, and another that takes 1."""
    made = [[Draw({"lights": ms - 1.0, "rest": 1.0}, ms / 10, ms / 4) for ms in seed] for seed in seeds]
    return Draws(made, **counts)


def test_a_row_has_medians_over_all_draws_and_spreads_of_each_seed():
    own = draws((10, 11, 12), (100, 110, 120), shaded=300, draw_calls=7, bytes_per_pixel=36.0)
    chosen = draws((5, 11, 4), (50, 55, 480))
    row = make_row("loop", SIZE, 9, own, chosen, 100)
    assert row == {
        "size": [8, 6],
        "lights": 9,
        "method": "loop",
        "ms": 56.0,
        "spread": pytest.approx(1 / 11),
        "ratio": 2.0,  # of 2, 1, 3, 2, 2 and a quarter
        "passes": {"lights": 55.0, "rest": 1.0},
        "host_ms": 14.0,
        "plan_ms": 5.6,
        "draw_calls": 7,
        "bytes_per_pixel": 36.0,
        "shaded": 300,
        "pairs": 100,
        "shaded_per_pair": 3.0,
    }


def test_there_is_no_ratio_to_what_was_not_drawn_or_took_no_time():
    own = draws((2.0,))
    nothing = Draws([[Draw({}, 0.0, 0.0)]])
    assert make_row("loop", SIZE, 1, own, None, 0)["ratio"] is None
    row = make_row("loop", SIZE, 1, own, nothing, 0)
    assert (row["ratio"], row["shaded_per_pair"]) == (None, None)


def rows_of(method, *points, size=SIZE):
    return [{"size": list(size), "method": method, "lights": n, "ms": ms} for n, ms in points]


def test_slopes_are_microseconds_a_light_and_growths_their_ratios():
    straight = rows_of("loop", (1, 5.0), (5, 7.0), (105, 57.0))
    square = rows_of("volumes", (0, 0.0), (10, 1.0), (20, 4.0), (40, 16.0))
    mixed = [row for pair in zip(straight, square, strict=False) for row in pair] + square[3:]
    found = with_slopes(mixed)
    assert [row["lights"] for row in found] == [row["lights"] for row in mixed]
    by_method = {
        name: [(row["slope"], row["growth"]) for row in found if row["method"] == name]
        for name in ("loop", "volumes")
    }
    assert by_method["loop"] == [(None, None), (500.0, None), (500.0, 1.0)]
    assert by_method["volumes"] == [(None, None), (100.0, None), (300.0, 3.0), (600.0, 2.0)]
    assert with_slopes(found) == found


def test_sizes_do_not_mix_and_what_falls_or_stands_has_no_growth_after_it():
    small, large = rows_of("loop", (1, 5.0)), rows_of("loop", (9, 8.0), size=(80, 60))
    assert [row["slope"] for row in with_slopes(small + large)] == [None, None]
    falls = with_slopes(rows_of("loop", (1, 5.0), (2, 4.0), (3, 6.0), (3, 9.0), (5, 9.0)))
    assert [row["slope"] for row in falls] == [None, -1000.0, 2000.0, None, 0.0]
    assert [row["growth"] for row in falls] == [None] * 5


def test_predictions_lie_on_the_line_through_the_last_two():
    assert predict([], 10) is predict([(1, 5.0)], 10) is None
    assert predict([(0, 99.0), (10, 20.0), (30, 60.0)], 100) == 200.0
    assert predict([(10, 20.0), (30, 15.0)], 100) == 15.0


def test_a_method_that_was_too_long_once_is_not_tried_with_more():
    left = LeftOut(2.0)
    assert not left.foresees(SIZE, "loop", 10)
    left.learn(SIZE, "loop", 10, 100.0)
    assert not left.is_too_long(SIZE, "loop", 20, 2000.0)
    left.learn(SIZE, "loop", 20, 1100.0)
    assert not left.foresees(SIZE, "loop", 29)
    assert left.foresees(SIZE, "loop", 30)
    assert left.foresees((9, 6), "loop", 30)
    assert not left.foresees((7, 6), "loop", 1000)
    assert not left.foresees(SIZE, "volumes", 1000)
    assert left.is_too_long(SIZE, "volumes", 40, 2001.0)
    assert [(row["method"], row["lights"], row["because"]) for row in left.rows] == [
        ("loop", 30, "a frame would take about 2.1 s, more than 2 s"),
        ("loop", 30, "too long already with 30 at 8x6"),
        ("volumes", 40, "a frame took 2 s, more than 2 s"),
    ]


def result_of(*sizes):
    """A result in which the loop grows with its lights, volumes less, and the loop is left out once."""
    rows = []
    for size in sizes:
        for lights in (0, 1, 10, 1000):
            for method, ms in (("volumes", 6 + 0.01 * lights), ("loop", 3 + lights)):
                if (method, lights) != ("loop", 1000):
                    own = draws((ms, 1.1 * ms), shaded=3 * lights, draw_calls=4, bytes_per_pixel=36.0)
                    rows.append(make_row(method, size, lights, own, None, 2 * lights))
    left = [{"size": list(size), "lights": 1000, "method": "loop", "because": "slow"} for size in sizes]
    size = list(sizes[0]) if len(sizes) == 1 else [list(size) for size in sizes]
    head = {"scene": "s", "driver": "d", "chosen": "volumes", "size": size}
    return {**head, "rows": with_slopes(rows), "left_out": left}


def test_the_report_has_a_table_a_size_and_what_is_missing():
    one, two = speed_as_markdown(result_of(SIZE)), speed_as_markdown(result_of(SIZE, (16, 12)))
    assert one.count("\n| lights |") == one.count("\n## ") == 1
    assert two.count("\n| lights |") == two.count("\n## ") == 2
    assert "\n## 16x12\n" in two
    lines = [line for line in one.splitlines() if line.startswith("|")]
    assert len({line.count("|") for line in lines}) == 1
    assert len(lines) == 2 + 7
    assert "- loop with 1,000 lights at 8x6: slow" in one
    row = next(line for line in lines if line.startswith("| 1,000 | volumes |"))
    assert [cell.strip() for cell in row.strip("|").split("|")] == [
        *("1,000", "volumes", "16.80", "0.05", "-", "4.20", "1.68", "4", "36", "3,000", "2,000", "1.50"),
        *("10.5", "1.00"),
    ]


@pytest.mark.parametrize("sizes", [(SIZE,), (SIZE, (16, 12)), ((1, 1), (2, 2), (3, 3))])
def test_the_plot_has_a_panel_a_size(sizes):
    file = io.BytesIO()
    growth_figure(result_of(*sizes), file)
    file.seek(0)
    with Image.open(file) as image:
        expected = tuple(round(DPI * inches) for inches in figure_inches(len(sizes)))
        assert (image.format, image.size) == ("PNG", expected)
        assert len(image.convert("RGB").getcolors(1 << 24)) > 50


def test_a_plot_of_nothing_is_drawn():
    file = io.BytesIO()
    growth_figure({**result_of(SIZE), "rows": [], "left_out": []}, file)
    assert file.getvalue().startswith(b"\x89PNG")


def test_methods_have_colors_of_their_own():
    from firefly_sample.lab.speed_report import _COLORS

    assert METHODS.keys() <= _COLORS.keys()
    assert len(set(_COLORS.values())) == len(_COLORS)


# --- which parameter counts the lights ---


def plugin(*parameters, **options):
    return Plugin("p", "", tuple(parameters), lambda: None, **options)


def test_the_lights_are_counted_by_the_parameter_that_the_plugin_names():
    lights, lamps = Parameter("lights", int, 1, ""), Parameter("lamps", int, 1, "")
    assert lights_parameter(plugin(lamps, lights)) is lights
    assert lights_parameter(plugin(lamps, lights, lights_parameter="lamps")) is lamps
    assert lights_parameter(plugin(lamps)) is None
    assert lights_parameter(plugin(Parameter("lights", bool, True, ""))) is None
    assert lights_parameter(find_scene("tests.cli.glade:empty")) is None
    assert lights_parameter(find_scene("forest")).name == "fireflies"
    assert lights_parameter(find_scene("firefly_sample.scenes.spheres:scene")).name == "lights"
    for wrong in ("bulbs", "on"):
        with pytest.raises(SceneError, match=f"must name a parameter that is a whole number, got '{wrong}'"):
            lights_parameter(plugin(lights, Parameter("on", bool, True, ""), lights_parameter=wrong))
