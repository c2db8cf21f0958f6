"""A trade measured on a small scene: complete, resumable, and true where the truth is known."""

import io
import json
from functools import partialmethod

import numpy as np
import pytest
from PIL import Image

from firefly_sample.cli import main
from firefly_sample.errors import MissingPackageError, SettingsError
from firefly_sample.lab.trade import (
    AMPLIFY,
    difference_picture,
    front_of,
    measure_trade,
    pareto_figure,
    trade_as_markdown,
)
from firefly_sample.lab.trade import (
    _row as measured_row,
)
from firefly_sample.lab.trade_bench import TradeBench
from firefly_sample.lab.variations import COMBINATIONS, Variation, signature, variations
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.lights import PointLight
from firefly_sample.settings import PRESETS, Settings
from tests.blended import add_lights, add_panes, add_squares, backdrop
from tests.cli.command import GLADE
from tests.conftest import make_renderer
from tests.lit_scenes import lit_scene
from tests.scenes import ball_scene, wall_scene

LIGHTS = 24
"""So few that they are drawn as volumes, which more settings are about."""
SMALL = {"size": (64, 48), "seconds": 0.0, "time": 1.0, "parameters": {"fireflies": LIGHTS}}
DARK = {**SMALL, "size": (32, 24), "parameters": {"fireflies": 0}}
"""Ambient light alone: a dozen rows, where it does not matter what they are of."""


@pytest.fixture(scope="module", autouse=True)
def briefly():
    """Time as few pairs of frames as may be: nothing here asks how long they took."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(TradeBench, "time_of", partialmethod(TradeBench.time_of, least=1))
        yield


@pytest.fixture
def unplotted(monkeypatch):
    """Leave the figure empty, which takes longer to draw than a few rows to measure."""
    monkeypatch.setattr("firefly_sample.lab.trade.pareto_figure", lambda result, file: None)


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trade")
    return folder, measure_trade(GLADE, folder, **SMALL)


def test_every_row_is_complete_and_the_default_comes_first(measured):
    folder, result = measured
    assert json.loads((folder / "trade.json").read_text()) == result
    rows = {row["name"]: row for row in result["rows"]}
    assert len(rows) == len(result["rows"])
    assert next(iter(rows)) == "default"
    assert {
        "forward shading",
        "light_method=loop",
        "preset fast",
        "preset accurate",
        "position_method=depth16",
    } <= rows.keys()
    assert set(COMBINATIONS) <= rows.keys()
    for row in result["rows"][:-1]:
        assert row["milliseconds"] > 0
        assert row["time_ratio"] > 0
        assert row["bytes_per_pixel"] > 0
        assert row["errors"]["not_finite"] == 0, row
        assert row["errors"]["uncovered"] == 0, row
    assert result["rows"][-1]["name"] == "texture filtering"
    assert result["reference"]["left_out"] <= 0.02


def test_what_is_claimed_of_the_presets_holds(measured):
    rows = {row["name"]: row for row in measured[1]["rows"]}
    default, accurate = rows["default"]["errors"], rows["preset accurate"]["errors"]
    assert default["codes"] <= 1
    assert abs(default["bias"]) <= 1e-3
    assert accurate["largest"] <= 2e-4
    assert accurate["percentile_99"] <= 2e-5
    assert abs(accurate["bias"]) <= 1e-5
    # what gives the same picture, gives the same errors
    for same in ("volume_proxy=cube", "volume_proxy=icosphere3", "volumes without depth test"):
        assert rows[same]["errors"] == default
    assert (
        abs(rows["light_method=loop"]["errors"]["largest"] - default["largest"]) <= 1e-6
    )  # another order of sums
    assert rows["preset fast"]["bytes_per_pixel"] > 0
    assert rows["light_method=fullscreen"]["fragments"] == LIGHTS * 64 * 48
    assert rows["volume_proxy=icosphere3"]["fragments"] < rows["volume_proxy=cube"]["fragments"]


def test_bytes_are_those_of_the_targets(measured):
    rows = {row["name"]: row["bytes_per_pixel"] for row in measured[1]["rows"] if "milliseconds" in row}
    # depth, albedo, normal, distance, radiance, color
    assert rows["default"] == 4 + 4 + 4 + 4 + 16 + 4
    assert rows["position_method=depth16"] == rows["default"] - 2 - 2
    assert rows["normal_format=oct8"] == rows["default"] - 2
    assert rows["accumulation_format=r11g11b10f"] == rows["default"] - 12
    assert rows["light_resolution=half"] == rows["default"] + (4 + 16) / 4
    assert rows["forward shading"] == 4 + 1 + 16 + 4


def test_the_report_has_a_line_a_row_and_pictures(measured):
    folder, result = measured
    table = (folder / "trade.md").read_text()
    assert table == trade_as_markdown(result)
    assert len([line for line in table.splitlines() if line.startswith("| ")]) == 1 + len(result["rows"])
    with Image.open(folder / "pareto.png") as image:
        assert image.size[0] > 800
        assert np.asarray(image.convert("L")).std() > 5
    pictures = list(folder.glob("difference-*.png"))
    assert len(pictures) == 4
    for path in pictures:
        with Image.open(path) as image:
            assert image.size == (128, 48)


def test_an_interrupted_measurement_goes_on_and_another_one_begins_anew(tmp_path, unplotted):
    steps = []

    def stop(done, total):
        steps.append((done, total))
        if (tmp_path / "trade.json").exists() and len(
            json.loads((tmp_path / "trade.json").read_text())["rows"]
        ) == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        measure_trade(GLADE, tmp_path, **DARK, progress=stop)
    before = json.loads((tmp_path / "trade.json").read_text())["rows"]
    assert len(before) == 4
    assert steps == sorted(steps)
    result = measure_trade(GLADE, tmp_path, **DARK)
    assert result["rows"][:4] == before  # not measured again: times never repeat to the last bit
    assert "unfinished" not in result
    with pytest.raises(KeyboardInterrupt):
        measure_trade(GLADE, tmp_path, **DARK, progress=stop)  # a finished one is no beginning
    other = json.loads((tmp_path / "trade.json").read_text())
    (tmp_path / "trade.json").write_text(json.dumps({**other, "unfinished": "another"}))
    with pytest.raises(KeyboardInterrupt):
        measure_trade(GLADE, tmp_path, **DARK, progress=stop)
    assert json.loads((tmp_path / "trade.json").read_text())["rows"][0] != other["rows"][0]


def test_what_is_missing_is_told_before_anything_is_measured(tmp_path, monkeypatch):
    for module in ("embreex", "flip_evaluator", "matplotlib"):
        monkeypatch.setattr(
            "firefly_sample.lab.measuring.find_spec",
            lambda name, gone=module: None if name == gone else name,
        )
        with pytest.raises(MissingPackageError, match=r"-m pip install .*embreex"):
            measure_trade(GLADE, tmp_path / "new", **SMALL)
    assert not (tmp_path / "new").exists()


def test_an_interruption_of_the_report_loses_no_row(tmp_path, monkeypatch, unplotted):
    def stop(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("firefly_sample.lab.trade.pareto_figure", stop)
        with pytest.raises(KeyboardInterrupt):
            measure_trade(GLADE, tmp_path, **DARK)
    before = json.loads((tmp_path / "trade.json").read_text())
    assert "unfinished" in before
    assert measure_trade(GLADE, tmp_path, **DARK)["rows"] == before["rows"]


def test_times_and_sizes_that_make_no_sense_are_refused(tmp_path):
    for seconds in (float("nan"), -1.0):
        with pytest.raises(SettingsError, match="seconds must be a number of 0 or more"):
            measure_trade(GLADE, tmp_path, **{**SMALL, "seconds": seconds})


def test_a_damaged_file_is_no_reason_to_stop(tmp_path, unplotted):
    (tmp_path / "trade.json").write_text("{")
    assert (
        measure_trade("tests.cli.glade:empty", tmp_path, **SMALL | {"parameters": {}})["rows"][0]["name"]
        == "default"
    )


def test_a_scene_of_nothing_has_little_to_choose(tmp_path, unplotted):
    result = measure_trade("tests.cli.glade:empty", tmp_path, **SMALL | {"parameters": {}})
    assert [row["name"] for row in result["rows"]] == ["default", "texture filtering"]
    assert result["rows"][0]["errors"]["largest"] == 0


def test_samples_and_the_classic_look_have_no_reference():
    with pytest.raises(SettingsError, match="'supersample' must be 1"):
        measure_trade(GLADE, settings=Settings(supersample=2))
    with pytest.raises(SettingsError, match="look 'classic'"):
        measure_trade(GLADE, settings=Settings(look="classic"))


# --- What is compared ---


def names_of(scene, settings=None):
    settings = settings or Settings()
    return {v.name for v in variations(build_plan(scene, settings), settings)}


def test_only_what_a_frame_can_show_is_compared():
    points = names_of(ball_scene(5))
    assert "volume_proxy=cube" in points
    assert not any(
        name.startswith(("shadow", "cutoff", "specular_model", "range_falloff")) for name in points
    )
    dark = names_of(ball_scene(0, ambient=(1, 1, 1)))
    assert not any(name.startswith(("position_method", "normal_format", "light_method")) for name in dark)
    assert "albedo_format=rgba8" in dark
    everything = names_of(lit_scene(material="everything"))
    assert {"specular_model=blinn_phong", "cutoff_threshold=5/256"} <= everything
    fading = wall_scene()
    lamp = PointLight("lamp")
    lamp.set_attenuation((1, 0, 1))
    lamp.set_shadow_caster(True, 256)
    fading.root.attach_new_node(lamp).set_pos(0, 5, 0)
    names = names_of(fading)
    assert {"shadow_taps=16", "shadow_resolution=4096", "cutoff_budget=1e-06"} <= names
    assert "range_falloff=gltf" not in names  # it has no end
    lamp.set_max_distance(9.0)
    assert "range_falloff=gltf" in names_of(fading)


def test_a_base_without_volumes_has_none_to_compare():
    names = names_of(ball_scene(5), Settings(light_method="forward"))
    assert not any(
        name.startswith(("volume", "position_method", "normal_format", "light_resolution")) for name in names
    )


def test_on_another_base_presets_are_still_themselves_and_every_other_choice_is_there():
    base = Settings.preset("fast", exposure=2.0, light_resolution="half")
    found = {v.name: v for v in variations(build_plan(ball_scene(5), base), base)}
    accurate = base.with_changes(**found["preset accurate"].changes)
    assert accurate == Settings.preset("accurate", exposure=2.0)
    assert {
        "normal_format=oct16",
        "albedo_format=sqrt10",
        "light_resolution=full",
        "forward shading",
    } <= found.keys()
    assert "normal_format=oct8" not in found
    assert found["forward shading"].changes == {"light_method": "forward", "light_resolution": "full"}


def test_no_combination_comes_twice_and_the_base_is_not_its_own_variation():
    base = Settings(position_method="depth24", normal_format="oct8")
    found = variations(build_plan(ball_scene(5), base), base)
    settings = [base.with_changes(**v.changes) for v in found]
    assert len(set(settings)) == len(settings)
    assert settings[0] == base
    assert all(PRESETS[name] is not v.changes for v in found for name in PRESETS)


# --- Blended surfaces ---


def glass_scene(crossing):
    scene = add_panes(add_lights(backdrop(), ("sun",)), 6, crossing=crossing, kinds=({}, {"unlit": True}))
    return add_squares(scene, count=0, dots=5)


def test_each_way_to_draw_blended_surfaces_is_compared_where_there_are_some():
    names = names_of(glass_scene(True))
    assert {"transparency=exact", "transparency=weighted"} <= names
    assert "transparency=sorted" not in names  # the base's
    assert "transparency=sorted" in names_of(glass_scene(True), Settings(transparency="exact"))
    assert not any(name.startswith("transparency") for name in names_of(ball_scene(5)))
    keys = [
        signature(build_plan(glass_scene(True), Settings(transparency=method)))
        for method in ("sorted", "exact", "weighted", "sorted")
    ]
    assert len(set(keys)) == 3
    plain = [
        signature(build_plan(ball_scene(5), Settings(transparency=method))) for method in ("sorted", "exact")
    ]
    assert plain[0] == plain[1]


@pytest.mark.parametrize("crossing", [False, True], ids=["apart", "crossing"])
def test_the_errors_of_blended_surfaces_are_those_of_their_method(crossing):
    with make_renderer((48, 36)) as renderer:
        bench = TradeBench(renderer, glass_scene(crossing), 0.0, Settings())
        assert bench.agreed.mean() > 0.8
        methods = ("sorted", "exact", "weighted")
        errors = {name: bench.draw(Settings(transparency=name)).errors for name in methods}
    assert errors["exact"].codes <= 1
    assert errors["exact"].largest <= 2e-3
    assert (errors["sorted"].codes <= 1) == (not crossing)
    assert errors["weighted"].codes > 10
    assert all(each.uncovered == each.not_finite == 0 for each in errors.values())


def test_more_layers_than_allowed_are_a_row_that_is_not_drawn():
    with make_renderer((32, 24)) as renderer:
        bench = TradeBench(renderer, glass_scene(True), 0.0, Settings(transparency_layers=2))
        row = measured_row(bench, Variation("exact", "alone", {"transparency": "exact"}), 0.0)
    assert row["skipped"].startswith("a pixel has more than 2 blended layers: raise transparency_layers")
    assert "errors" not in row


# --- Its parts ---


def row(ratio, error):
    return {"time_ratio": ratio, "errors": {"largest": error}}


def test_the_front_is_what_nothing_beats():
    best, fast, beaten, slow = row(2.0, 1e-4), row(0.5, 1e-1), row(2.5, 1e-3), row(1.0, 1e-2)
    assert front_of([best, fast, beaten, slow]) == [fast, slow, best]
    assert front_of([row(1.0, 1e-3), row(1.0, 1e-4)]) == [row(1.0, 1e-4)]


def test_a_difference_picture_amplifies_and_leaves_out():
    color, reference = np.full((2, 2, 3), 50, np.uint8), np.full((2, 2, 3), 50, np.uint8)
    color[0, 0], color[1, 1] = 53, 0
    compared = np.array([[True, True], [True, False]])
    picture = difference_picture(color, reference, compared)
    assert picture.shape == (2, 4, 3)
    assert (picture[:, :2] == color).all()
    assert (picture[0, 2] == 3 * AMPLIFY).all()
    assert picture[1, 3].max() == 0  # not compared
    color[1, 0] = 250
    assert difference_picture(color, reference, compared)[1, 2].min() == 255


def test_a_plot_of_one_row_is_drawn():
    result = {
        "scene": "s",
        "size": [4, 3],
        "rows": [{"name": "default", "group": "default", "spread": 0.1, **row(1.0, 1e-3)}],
    }
    file = io.BytesIO()
    pareto_figure(result, file)
    assert file.getvalue().startswith(b"\x89PNG")


def test_a_bench_times_pairs_and_leaves_the_renderer_usable():
    with make_renderer((32, 24)) as renderer:
        bench = TradeBench(renderer, ball_scene(5), 0.0, Settings())
        timing = bench.time_of(Settings(light_method="loop"), seconds=0.0, least=4)
        assert timing.pairs == 4
        assert timing.milliseconds > 0
        assert timing.spread >= 0
        drawn = bench.draw(Settings(normal_format="rgba32f", albedo_format="rgba32f"))
        assert drawn.errors.largest <= 2e-4
        assert not renderer.count_fragments


def test_the_command_prints_the_table_or_the_json(tmp_path, capsys):
    words = [
        "measure",
        "trade",
        "tests.cli.glade:empty",
        "--size",
        "16x12",
        "-o",
        str(tmp_path),
        "--seconds",
        "0",
    ]
    assert main(words) == 0
    assert "| default |" in capsys.readouterr().out
    assert main([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"][0]["name"] == "default"
    assert main([*words, "--look", "classic"]) == 2  # an option that this command does not have
