"""Measurements take an automatic exposure once, and start from a scene's own settings."""

from __future__ import annotations

from functools import partialmethod

import pytest

from firefly_sample.lab.trade import measure_trade
from firefly_sample.lab.trade_bench import TradeBench
from firefly_sample.pipeline import build_plan
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings
from tests.cli.command import GLADE, manifest_of

METERED = "tests.cli.glade:metered"
SMALL = ("--size", "16x12", "--fireflies", "0")
"""Ambient light alone, which has the fewest rows."""


@pytest.fixture(autouse=True)
def briefly(tmp_path, monkeypatch):
    """Time as few pairs of frames as may be, and draw no plot."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(TradeBench, "time_of", partialmethod(TradeBench.time_of, least=1))
    monkeypatch.setattr("firefly_sample.lab.trade.pareto_figure", lambda result, file: None)


def planned(time):
    built = build_scene(find_scene(GLADE), fireflies=0)
    return build_plan(built, Settings(exposure="auto"), (16, 12), time=time).settings.exposure


def test_a_trade_starts_from_the_scenes_settings_and_is_measured_at_one_exposure(tmp_path):
    options = {"size": (16, 12), "seconds": 0.0, "time": 1.0, "parameters": {"fireflies": 0}}
    result = measure_trade(METERED, tmp_path / "trade", **options)
    expected = Settings(normal_format="oct8", exposure=planned(1.0))
    assert result["settings"] == expected.as_dict()
    assert expected.exposure != 1.0
    assert "exposure" not in {name for row in result["rows"] for name in row["settings"]}


def test_settings_chosen_by_error_leave_it_automatic(capsys):
    fixed = (
        "--position-method",
        "linear32f",
        "--accumulation-format",
        "rgba32f",
        "--light-resolution",
        "full",
    )
    manifest = manifest_of(capsys, GLADE, *SMALL, *fixed, "--exposure", "auto", "--max-error", 0.1)
    assert manifest["settings"]["exposure"] == "auto"
    assert manifest["exposure"] == planned(5.0)
