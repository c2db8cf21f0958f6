"""Measured speed: counts on a wall whose every pixel is known, and what times are made of."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest

from firefly_sample.cli import main
from firefly_sample.errors import SceneError, SettingsError
from firefly_sample.frame import Frame
from firefly_sample.lab.speed import measure_speed
from firefly_sample.lab.speed_sweep import METHODS
from firefly_sample.renderer import Renderer
from firefly_sample.settings import Settings
from tests.lab.walls import DISTANCE, NAME, PIXELS, SIZE, measure, places


def wall_positions():
    """Where each pixel's ray meets the wall, shape (pixels, 3)."""
    width, height = SIZE
    half = DISTANCE * np.tan(np.radians(30.0))  # the lens sees 60 degrees up and down
    x = half * width / height * ((np.arange(width) + 0.5) * 2 / width - 1)
    z = half * ((np.arange(height) + 0.5) * 2 / height - 1)
    x, z = (grid.ravel() for grid in np.meshgrid(x, z))
    return np.stack([x, np.full(PIXELS, DISTANCE), z], axis=1)


def pairs_of(seed, where="on"):
    positions, radii = places(seed, where)
    distance = np.linalg.norm(wall_positions()[:, None] - positions[None], axis=2)
    assert np.abs(distance / radii - 1.0).min() > 2e-6  # float32 must not decide
    return int((distance < radii).sum())


def rows_of(**options):
    return {row["method"]: row for row in measure(**options)["rows"]}


def test_counts_are_exact():
    rows = rows_of(seeds=(1, 2))
    assert rows.keys() == METHODS.keys()
    assert rows["fullscreen"]["shaded"] == rows["loop"]["shaded"] == 2 * PIXELS * 12
    pairs = pairs_of(1) + pairs_of(2)
    assert 0 < pairs < 2 * PIXELS * 12
    for row in rows.values():
        assert (row["lights"], row["pairs"]) == (14, pairs)
        assert row["shaded_per_pair"] == row["shaded"] / pairs
    assert pairs <= rows["volumes"]["shaded"] <= rows["original"]["shaded"] < rows["loop"]["shaded"]


def test_a_light_that_holds_the_view_counts_once_in_every_method():
    rows = rows_of(wide=True)
    assert rows["fullscreen"]["shaded"] == rows["loop"]["shaded"] == PIXELS * 13
    assert rows["volumes"]["pairs"] == pairs_of(0) + PIXELS


def test_the_original_shades_in_vain_what_ends_before_the_wall():
    rows = rows_of(where="before")
    assert rows["volumes"]["shaded"] == 0
    assert rows["volumes"]["shaded_per_pair"] is None
    assert rows["original"]["shaded"] > 0


def test_lights_behind_the_wall_cost_both_the_same():
    """Back faces behind the surface pass the depth test; nothing marks where a volume begins."""
    rows = rows_of(where="behind")
    assert rows["original"]["shaded"] == rows["volumes"]["shaded"] > 0
    assert rows["volumes"]["pairs"] == pairs_of(0, "behind") == 0


def test_progress_and_the_chosen_methods_ratio():
    calls = []
    result = measure(rounds=2, seeds=(1, 2), progress=lambda *call: calls.append(call))
    total = 2 * (2 + 1) * len(METHODS)
    assert calls == [(done, total) for done in range(1, total + 1)]
    (chosen,) = (row for row in result["rows"] if row["method"] == result["chosen"])
    assert chosen["ratio"] == 1.0
    assert (result["scene"], result["size"]) == ("walled", [64, 48])


def test_spread_does_not_mix_seeds(monkeypatch):
    """Frames that take 10, 11, 12 with one seed and 100, 110, 120 with the other spread by 1/11 each."""
    draw = Renderer.draw
    rounds = [base * step for base in (10, 100) for step in (9.9, 1.0, 1.1, 1.2)]  # 9.9: not timed
    turns = itertools.chain.from_iterable(itertools.repeat(ms, len(METHODS)) for ms in rounds)

    def timed(self, plan, read=True):
        frame = draw(self, plan, read)
        fields = {name: getattr(frame, name) for name in Frame.__dataclass_fields__}
        return Frame(**fields | {"milliseconds": {"all": next(turns)}})

    monkeypatch.setattr(Renderer, "draw", timed)
    for row in rows_of(rounds=3, seeds=(1, 2)).values():
        assert row["spread"] == pytest.approx(1 / 11)
        assert row["ms"] == pytest.approx((12 + 100) / 2)
        assert row["ratio"] == 1.0


def test_no_geometry_in_view():
    for row in rows_of(wall=False).values():
        assert (row["pairs"], row["shaded"], row["shaded_per_pair"]) == (0, 0, None)
        assert row["lights"] == 14


def test_an_empty_scene_on_the_command_line(capsys):
    assert main(["measure", "speed", "tests.cli.glade:empty", "--size", "8x6", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert all((row["pairs"], row["shaded_per_pair"]) == (0, None) for row in rows)


def test_supersampling_is_refused():
    with pytest.raises(SettingsError, match="'supersample' must be 1 to measure speed; got 2"):
        measure(settings=Settings(supersample=2))


def test_the_classic_look_is_measured_by_the_methods_that_it_has():
    classic = Settings(look="classic")
    methods = [row["method"] for row in measure(rounds=1, settings=classic)["rows"]]
    assert methods == ["volumes", "original", "auto", "fullscreen"]
    with pytest.raises(SettingsError, match=r"'light_method' must be one of.*look=classic.*got 'loop'"):
        measure(settings=classic, methods=("volumes", "loop"))


def test_nothing_to_measure():
    for nothing in ({"rounds": 0}, {"seeds": ()}):
        with pytest.raises(SceneError, match="nothing to measure"):
            measure(**nothing)
    with pytest.raises(SceneError, match="no parameter 'seed'"):
        measure_speed("tests.cli.glade:empty", seeds=(1,))


def test_options_of_the_methods_own_settings_are_left_out(capsys):
    assert main(["measure", "speed", NAME, "--help-all"]) == 0
    text = capsys.readouterr().out
    for option in ("--volume-depth-test", "--supersample"):
        assert option not in text
        assert main(["measure", "speed", NAME, option, "1"]) == 2
        assert option in capsys.readouterr().err
    assert all(option in text for option in ("--look", "--position-method", "--device", "--require-gpu"))


def test_a_parameter_has_the_same_option_as_elsewhere(capsys):
    for command in (("capture",), ("measure", "speed")):
        assert main([*command, "tests.cli.glade:crowded", "--help"]) == 0
        assert "--scene-size" in capsys.readouterr().out


def test_device_and_required_gpu(capsys, device):
    options = ["measure", "speed", NAME, "--size", "8x6"]
    assert main([*options, "--device", "77"]) == 1
    assert "no EGL device 77" in capsys.readouterr().err
    assert main([*options, "--require-gpu"]) == int(device.software)
    assert ("a GPU is required" in capsys.readouterr().err) == device.software
