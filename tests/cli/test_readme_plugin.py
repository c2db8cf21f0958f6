"""The scene plugin that the README shows, by itself: a module as it is printed there, and no more."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from firefly_sample.cli import main
from firefly_sample.scenes import ENTRY_POINT_GROUP, build_scene, find_scene
from firefly_sample.viewer.controls import NAMED_KEYS

README = (Path(__file__).parents[2] / "README.md").read_text()
(MODULE,) = (text for text in re.findall(r"```python\n(.*?)```", README, re.DOTALL) if "plugin = " in text)


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    (tmp_path / "lamp.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    yield find_scene("lamp:plugin")
    del sys.modules["lamp"]


def test_it_is_animated_and_takes_a_live_parameter(plugin, render):
    scene = build_scene(plugin, height=1.0)
    at_0 = render(scene, time=0.0).color
    at_1 = render(scene, time=1.0).color
    assert at_0.max() > 50
    assert not np.array_equal(at_0, at_1)
    scene.set("height", 3.0)
    moved = render(scene, time=1.0)
    np.testing.assert_array_equal(moved.color, render(build_scene(plugin, height=3.0), time=1.0).color)
    assert not np.array_equal(moved.color, at_1)
    assert moved.warnings == ()
    np.testing.assert_array_equal(render(build_scene(plugin, height=1.0), time=1.0).color, at_1)


def test_it_has_an_option_and_keys(plugin, capsys):
    assert main(["capture", "lamp:plugin", "--height", "2", "--size", "8x6", "-q"]) == 0
    assert Path("captures/lamp/color_000000.png").exists()
    (height,) = plugin.parameters
    assert [height.step(0.5, key) for key in height.keys] == [0.6, 0.4]
    assert {key.key for key in height.keys} <= NAMED_KEYS.keys()


def test_the_lines_that_package_it_name_its_group():
    (lines,) = re.findall(r"```toml\n(.*?)```", README, re.DOTALL)
    assert tomllib.loads(lines)["project"]["entry-points"] == {
        ENTRY_POINT_GROUP: {"lamp": "my_package.lamp:plugin"}
    }
