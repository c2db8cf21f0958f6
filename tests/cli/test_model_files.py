"""Files of models as scenes on the command line: ``firefly capture model.glb`` and the other commands."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

from firefly_sample.capture.sequence import capture_frames
from firefly_sample.cli import main
from tests.cli.command import firefly, manifest_of
from tests.model.scene_files import add_camera, add_slide, box_file

SMALL = ("--size", "40x30")


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A working folder with two models."""
    monkeypatch.chdir(tmp_path)
    box_file().write(tmp_path / "box.glb")
    file = box_file()
    add_camera(file, "Front", translation=[0.0, 2.0, 10.0])
    add_slide(file, "walk", 6.0)
    file.write(tmp_path / "walker.gltf")
    return tmp_path


def hashes(manifest):
    return [frame["sha256"]["color"] for frame in manifest["frames"]]


def test_a_picture_by_one_command(here):
    """In a process of its own, as a user runs it."""
    done = firefly("capture", "box.glb", *SMALL, cwd=here)
    assert (done.returncode, done.stdout) == (0, "1 frame (color) in captures/box\n")
    with Image.open(here / "captures/box/color_000000.png") as image:
        pixels = np.asarray(image).astype(int)
    assert pixels.shape == (30, 40, 3)
    assert pixels[0, 0].min() > 150  # the backdrop
    assert np.abs(pixels - pixels[0, 0]).max() > 40  # the box, and its shadow


def test_the_manifest_has_files_parameters_warnings_and_time_0(here, capsys):
    manifest = manifest_of(capsys, "box.glb", *SMALL, "--turntable", 4)
    assert manifest["scene"] == "box.glb"
    assert manifest["parameters"] == {
        "file": "box.glb",
        "file_scene": "",
        "up": "auto",
        "camera": "auto",
        "animation": "first",
        "max_texture_megapixels": 100.0,
        "turntable": 4.0,
        "lights": "auto",
        "ground": True,
    }
    assert manifest["frames"][0]["time"] == 0.0
    assert manifest["warnings"] == []
    assert json.loads((here / "captures/box/manifest.json").read_text()) == manifest


def test_warnings_of_all_frames_once_in_order(here, capsys):
    glade = ("tests.cli.glade:glade", *SMALL, "--glass", "--outputs", "id")
    manifest = manifest_of(capsys, *glade, "--frames", "0:3")
    lines = capsys.readouterr().err.splitlines()
    assert len(manifest["warnings"]) == len(set(manifest["warnings"])) == 1
    assert "glass" in manifest["warnings"][0]
    assert lines == []


def test_what_a_file_has_that_is_not_drawn_is_named_on_stderr_and_in_the_manifest(here, capsys):
    file = box_file()
    coat = {"KHR_materials_clearcoat": {"clearcoatFactor": 1.0}}
    lacquer = file.add("materials", name="lacquer", extensions=coat)
    file.json["meshes"][0]["primitives"][0]["material"] = lacquer
    file.write(here / "coated.glb")
    assert main(["capture", "coated.glb", *SMALL, "--frames", "0:2"]) == 0
    lines = [line for line in capsys.readouterr().err.splitlines() if "lacquer" in line]
    manifest = json.loads((here / "captures/coated/manifest.json").read_text())
    assert lines == [f"firefly: warning: {warning}" for warning in manifest["warnings"]]
    assert any("KHR_materials_clearcoat is not drawn" in line for line in lines)


def test_several_files_are_one_scene(here, capsys):
    manifest = manifest_of(capsys, "box.glb", "walker.gltf", *SMALL, "--outputs", "id")
    assert manifest["scene"] == manifest["parameters"]["file"] == "box.glb,walker.gltf"
    assert {"model/turntable/box/box", "model/turntable/walker/box"} <= set(manifest["id_names"])
    assert (here / "captures/box+walker/manifest.json").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ("--size", "8x6", "box.glb", "--turntable", "3"),
        ("--turntable", "3", "box.glb", "--size", "8x6"),
        ("--scene", "box.glb", "--size", "8x6", "--turntable", "3"),
        ("box.glb", "--size", "8x6", "walker.gltf", "--turntable", "3"),
        ("model", "--file", "box.glb", "--size", "8x6", "--turntable", "3"),
    ],
    ids=" ".join,
)
def test_files_and_their_options_in_any_order(here, capsys, arguments):
    if arguments[0] == "model":
        arguments = ("firefly_sample.scenes.model:scene", *arguments[1:])
    manifest = manifest_of(capsys, *arguments)
    assert manifest["parameters"]["file"].startswith("box.glb")
    assert manifest["parameters"]["turntable"] == 3.0


def test_a_turntable_is_the_same_in_any_order(here, capsys):
    options = ("--turntable", 2, "--fps", 37, "--size", "16x12", "box.glb")
    whole = hashes(manifest_of(capsys, *options, "--frames", "0:8", "-o", here / "a"))
    assert hashes(manifest_of(capsys, *options, "--frames", "5", "-o", here / "b")) == whole[5:6]
    assert len(set(whole)) == 8


def test_an_animation_moves_and_a_time_can_be_given(here, capsys):
    options = ("walker.gltf", *SMALL, "-o", here / "out", "--overwrite")
    first, at_0, at_1 = (
        hashes(manifest_of(capsys, *options, *time)) for time in ((), ("--time", 0), ("--time", 1))
    )
    assert first == at_0 != at_1
    still = [hashes(manifest_of(capsys, *options, "--time", time, "--animation", "none")) for time in (0, 1)]
    assert still[0] == still[1]


def test_a_camera_of_the_file(here, capsys):
    of_file, framed = (
        hashes(manifest_of(capsys, "walker.gltf", *SMALL, "-o", here / name, "--camera", name))
        for name in ("Front", "frame")
    )
    assert of_file != framed


def test_scenes_without_a_start_time_begin_at_5_s(here, capsys):
    assert manifest_of(capsys, "tests.cli.glade:empty", "--size", "4x3")["frames"][0]["time"] == 5.0
    assert capture_frames("box.glb", here / "out", size=(4, 3))["frames"][0]["time"] == 0.0
    assert capture_frames("box.glb", here / "two", size=(4, 3), time=2)["frames"][0]["time"] == 2.0


@pytest.mark.parametrize(
    ("words", "time"),
    [
        (("capture", "box.glb"), "0.0"),
        (("capture", "forest"), "5.0"),
        (("plan", "box.glb"), "0.0"),
        (("measure", "trade", "box.glb"), "0.0"),
        (("measure", "speed", "forest"), "5.0"),
        (("run", "forest"), "0.0"),
    ],
    ids=" ".join,
)
def test_help_says_the_scenes_own_time_and_parameters(here, capsys, words, time):
    assert main([*words, "--help"]) == 0
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    described = text[text.index("--time SECONDS") :]
    assert described[described.index("[default: ") :].startswith(f"[default: {time}]")
    if "box.glb" in words:
        assert "Scene box.glb" in text
        for option in ("--file", "--up", "--camera", "--animation", "--turntable", "--lights", "--ground"):
            assert option in text
        assert "[choices: auto, x, y, z]" in text


def test_a_plan_needs_no_driver_and_says_what_is_drawn(here, capsys):
    assert main(["plan", "box.glb", "--json"]) == 0
    plan = json.loads(capsys.readouterr().out)
    assert plan["lights"]["in_scene"] == 2
    assert main(["plan", "box.glb", "--json", "--lights", "file"]) == 0
    assert json.loads(capsys.readouterr().out)["lights"]["in_scene"] == 0


def test_a_performance_test_without_a_window(here, capsys):
    options = ("--headless", "--performance-test", "0.1", "--size", "16x12", "--json", "--turntable", "3")
    assert main(["run", "box.glb", *options]) == 0
    assert json.loads(capsys.readouterr().out)["scene"] == "box.glb"


def test_measure_speed_has_one_row_for_each_method(here, capsys):
    options = ("--size", "16x12", "--rounds", "1", "--methods", "volumes,loop", "--json")
    assert main(["measure", "speed", "box.glb", *options]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [(row["method"], row["lights"]) for row in rows] == [("volumes", 2), ("loop", 2)]
    assert main(["measure", "speed", "box.glb", "--counts", "3"]) == 1
    assert "scene 'box.glb' has no parameter for its number of lights" in capsys.readouterr().err


def test_a_configuration_may_name_the_file(here, capsys, monkeypatch):
    (here / "firefly.toml").write_text(
        '[firefly.capture]\nscene = "box.glb"\nsize = "8x6"\nturntable = 2.0\n'
    )
    assert manifest_of(capsys)["parameters"]["turntable"] == 2.0
    assert manifest_of(capsys, "walker.gltf")["scene"] == "walker.gltf"
    (here / "firefly.toml").unlink()
    monkeypatch.setenv("FIREFLY_CAPTURE_SCENE", "walker.gltf")
    assert manifest_of(capsys, "--size", "8x6", "-o", "again")["scene"] == "walker.gltf"


ERRORS = [
    (["capture", "bax.glb"], "model bax.glb: no such file (did you mean 'box.glb'?)", 1),
    (["capture", "walker.glb"], "model walker.glb: no such file (did you mean 'walker.gltf'?)", 1),
    (["plan", "box.glb", "gone.obj"], "model gone.obj: no such file", 1),
    (["run", "sub/a.ply"], "model sub/a.ply: no such file: there is no folder sub", 1),
    (["measure", "start", "gone.stl"], "model gone.stl: no such file", 1),
    (["capture", "."], "it is a folder, it holds box.glb, damaged.glb, walker.gltf", 1),
    (["capture", "notes.txt"], "model notes.txt: the suffix .txt is unknown", 1),
    (["capture", "damaged.glb"], "model damaged.glb: ", 1),
    (["capture", "box.glb", "forest"], "nothing else: got 'box.glb', 'forest'", 2),
    (["capture", "box.glb", "--up", "w"], 'Choose from: "auto", "x", "y", "z"', 2),
    (["capture", "box.glb", "--turntable", "-1"], "turntable must be between 0 and 1000000", 1),
    (["capture", "box.glb", "--camera", "Front"], "scene 'box.glb': there is no camera 'Front'", 1),
    (["capture", "walker.gltf", "--animation", "run"], "there is no animation 'run'", 1),
    (["capture", "firefly_sample.scenes.model:scene"], "scene 'model': no file is given", 1),
    (["capture", "florist"], "there is no scene 'florist'", 1),
]


@pytest.mark.parametrize(("arguments", "message", "code"), ERRORS)
def test_errors_are_one_line_and_leave_nothing(here, capsys, arguments, message, code):
    (here / "notes.txt").write_text("a model of patience")
    (here / "damaged.glb").write_bytes((here / "box.glb").read_bytes()[:100])
    before = set(here.iterdir())
    assert main(arguments) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("firefly: ")
    assert err.count("\n") == 1
    assert message in err
    assert set(here.iterdir()) == before
