"""Keys, parameters, the clock, what the corner says, and screenshots: everything that needs no window."""

from __future__ import annotations

import json
import os

import numpy as np
import pytest
from PIL import Image

from firefly_sample.capture.files import save_screenshot
from firefly_sample.errors import FireflyError, ParameterError, SceneError, ViewerError
from firefly_sample.frame import Frame, LightCounts
from firefly_sample.scene.parameter import KeyStep, Parameter
from firefly_sample.scenes import find_scene
from firefly_sample.viewer.controls import Binding, key_label, parameter_bindings
from firefly_sample.viewer.glfw_window import LARGEST, Window, check_display
from firefly_sample.viewer.performance import PERIOD, RateMeter
from firefly_sample.viewer.shown_scene import Clock, ShownScene, value_text
from tests.scenes import plain_camera
from tests.viewer.lamps import lamps

OWN = [Binding("v", "next view", lambda: None)]
COUNT, REACH, DUSK = lamps.parameters
UP, DOWN = COUNT.keys


def test_every_declared_key_steps_its_parameter():
    stepped = []
    bindings = parameter_bindings("lamps", lamps.parameters, OWN, lambda *step: stepped.append(step))
    assert [(b.key, b.help, b.repeats) for b in bindings] == [
        ("up", "more lamps", True),
        ("down", "fewer lamps", True),
        ("right", "brighter lamps", True),
        ("left", "dimmer lamps", True),
        ("d", "dusk or night", False),
    ]
    for binding in bindings:
        binding.act()
    assert stepped == [(p, key) for p in lamps.parameters for key in p.keys]


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        (("V",), r"'n' wants the key 'V', which is taken already \(next view\)"),
        (("k", "k"), "taken already"),
        (("pageup",), "must be a letter, a digit, or one of"),
        (("é",), "must be a letter"),
        (("",), "must be a letter"),
        (("escape",), "taken already"),
    ],
)
def test_keys_that_cannot_be_had(keys, said):
    parameter = Parameter("n", int, 1, "A number.", keys=tuple(KeyStep(key, 2.0) for key in keys))
    own = [*OWN, Binding("escape", "leave", lambda: None)]
    with pytest.raises(SceneError, match=said):
        parameter_bindings("s", [parameter], own, lambda *_: None)


def test_text_has_no_keys():
    parameter = Parameter("model", str, "a.glb", "A file.", keys=(KeyStep("m"),))
    with pytest.raises(SceneError, match="'model' wants the key 'm', but it is text"):
        parameter_bindings("s", [parameter], OWN, lambda *_: None)


def test_a_text_with_choices_has_keys():
    steps = []
    parameter = Parameter("up", str, "y", "An axis.", keys=(KeyStep("u", help="next"),), choices=("y", "z"))
    (binding,) = parameter_bindings("s", [parameter], OWN, lambda *step: steps.append(step))
    binding.act()
    assert (binding.key, binding.help, binding.repeats) == ("u", "next", False)
    assert steps == [(parameter, parameter.keys[0])]


def test_key_labels():
    assert [key_label(key) for key in ("v", "1", "up", "escape", "f1")] == ["V", "1", "Up", "Esc", "F1"]


@pytest.fixture
def shown(capsys):
    made = ShownScene(lamps, {"lamps": 10, "reach": 3.0, "dusk": True})
    capsys.readouterr()
    return made


def test_a_live_parameter_keeps_the_scene(shown, capsys):
    scene = shown.scene
    assert shown.step(COUNT, UP) == "lamps 11"
    assert shown.scene is scene
    assert shown.values == {"lamps": 11, "reach": 3.0, "dusk": True}
    assert json.loads(capsys.readouterr().out) == {"set": "lamps", "value": 11}


def test_a_parameter_that_is_not_live_builds_the_scene_anew(shown, capsys):
    shown.step(COUNT, UP)
    capsys.readouterr()
    scene = shown.scene
    assert shown.step(DUSK, DUSK.keys[0]) == "dusk off"
    assert shown.scene is not scene
    assert json.loads(capsys.readouterr().out) == {"build": {"lamps": 11, "reach": 3.0, "dusk": False}}


def test_a_parameter_at_its_limit_says_so(shown, capsys):
    shown.values["lamps"] = 200
    assert shown.step(COUNT, UP) == "lamps stays at 200 (between 0 and 200)"
    assert capsys.readouterr().out == ""


def test_a_value_that_the_scene_refuses_leaves_everything_as_it_was(shown, monkeypatch):
    def refuse(*_):
        raise ParameterError("no more lamps")

    monkeypatch.setattr(shown.scene, "set", refuse)
    before = shown.scene, shown.values
    with pytest.raises(ParameterError, match="no more lamps"):
        shown.step(COUNT, UP)
    assert (shown.scene, shown.values) == before


def test_values_for_people():
    assert value_text(REACH, 3.0 * 1.111**7) == "6.268 units"
    assert value_text(COUNT, 12345) == "12345"
    assert value_text(DUSK, False) == "off"


def test_the_clock_follows_the_wall_clock_and_stands_still():
    clock = Clock(5.0, now=100.0)
    assert clock.time(101.5) == 6.5
    clock.toggle(102.0)
    assert clock.paused
    assert [clock.time(now) for now in (102.0, 150.0)] == [7.0, 7.0]
    clock.toggle(200.0)
    assert not clock.paused
    assert clock.time(200.25) == 7.25


def test_the_meter_averages():
    meter = RateMeter()
    assert meter.add(0.0, 999.0)
    changes = [meter.add(PERIOD / 4 * i, 10.0 + i % 2) for i in range(1, 5)]
    assert changes == [False, False, False, True]
    assert meter.text == "10 fps, GPU 10.5 ms"
    assert not meter.add(PERIOD * 1.1, 1.0)
    meter.add(PERIOD + 2.0, 3.0)
    assert meter.text == "1.0 fps, GPU 2.0 ms"


def test_the_corner_says_counts_times_and_values(shown):
    frame = Frame({}, 12.34, (640, 480), {}, LightCounts(10, 7, 0), "driver", True, camera=plain_camera())
    assert shown.status_rows(frame, "24 fps", paused=True) == (
        ("time", "12.3 s, paused"),
        ("lights", "7 in view of 10"),
        ("frame", "24 fps"),
        ("picture", "640 x 480"),
        ("lamps", "10"),
        ("reach", "3 units"),
        ("dusk", "on"),
    )


def test_screenshots_never_overwrite(tmp_path):
    folder = tmp_path / "new" / "folder"
    pictures = [np.full((2, 3, 3), 10 * i, np.uint8) for i in range(3)]
    paths = [save_screenshot(folder, "forest", picture) for picture in pictures]
    assert [path.name for path in paths] == ["forest_0001.png", "forest_0002.png", "forest_0003.png"]
    for path, picture in zip(paths, pictures, strict=True):
        np.testing.assert_array_equal(np.asarray(Image.open(path)), picture)


def test_a_screenshot_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(FireflyError, match=r"cannot write into .*file: "):
        save_screenshot(tmp_path / "file", "forest", np.zeros((1, 1, 3), np.uint8))
    assert sorted(os.listdir(tmp_path)) == ["file"]
    with pytest.raises(FireflyError, match=r"cannot write .*no_0001\.png: "):
        save_screenshot(tmp_path, "such/folder/no", np.zeros((1, 1, 3), np.uint8))
    assert sorted(os.listdir(tmp_path)) == ["file"]


@pytest.mark.skipif(os.name != "posix", reason="only X11 has the variable DISPLAY")
@pytest.mark.parametrize(
    ("wayland", "said"), [(None, "no display"), ("wayland-0", "this Wayland session has no XWayland")]
)
def test_without_a_display(monkeypatch, wayland, said):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    if wayland:
        monkeypatch.setenv("WAYLAND_DISPLAY", wayland)
    with pytest.raises(ViewerError, match=f"{said}.*firefly capture.*xvfb-run"):
        check_display()


def test_without_glfw(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "glfw", None)
    with pytest.raises(ViewerError, match=r"-m pip install 'glfw<3,>=2.7'.*firefly capture"):
        check_display()


def test_a_window_larger_than_any_screen():
    with pytest.raises(ViewerError, match="choose a smaller size"):
        Window("wide", (LARGEST + 1, 1))


def test_the_corner_of_a_scene_with_many_parameters_has_those_that_differ():
    plugin = find_scene("smoke")
    shown = ShownScene(plugin, {p.name: p.default for p in plugin.parameters} | {"particles": 20})
    frame = Frame({}, 1.0, (64, 48), {}, LightCounts(1, 1, 0), "driver", True, camera=plain_camera())
    rows = [name for name, _ in shown.status_rows(frame, "24 fps", paused=False)]
    assert rows == ["time", "lights", "frame", "picture", "particles"]
    assert shown.drag(0.1, 0.0)
    rows = dict(shown.status_rows(frame, "24 fps", paused=False))
    assert rows["light heading"] == "68 degrees"
