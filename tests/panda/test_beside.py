"""``firefly measure fireflies``, on a program whose graph is built like that of Panda3D's sample."""

import io
import json
import random
import shutil
import sys
import warnings

import numpy as np
import PIL.Image
import pytest

from firefly_sample import Renderer
from firefly_sample.cli import main
from firefly_sample.errors import FireflyError, MissingPackageError
from firefly_sample.interop.panda3d.program import run_main
from firefly_sample.lab import fireflies
from firefly_sample.scene.lights import PointLight
from firefly_sample.settings import Settings
from tests.panda.stand_in.art import write_art

SIZE = (160, 120)
CLASSIC = Settings(look="classic", supersample=1)


@pytest.fixture(scope="module")
def art(tmp_path_factory):
    return write_art(tmp_path_factory.mktemp("panda") / "stand in")


@pytest.fixture(scope="module")
def beside(art, tmp_path_factory):
    """The command's result and its picture for the stand-in after a second, and what it has drawn."""
    shown, lines, stdout = [], [], io.StringIO()
    run_sample = fireflies.run_sample

    def record(*arguments):
        shown.append(run_sample(*arguments))
        return shown[-1]

    file = tmp_path_factory.mktemp("pictures") / "both.png"
    options = ["-o", str(file), "--seconds", "1", "--size", "x".join(map(str, SIZE)), "--json"]
    with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings():
        patch.setattr(fireflies, "run_sample", record)
        patch.setattr("sys.stdout", stdout)
        patch.setattr("firefly_sample.cli.complain", lines.append)
        assert main(["measure", "fireflies", str(art), *options]) == 0
    return json.loads(stdout.getvalue()), np.asarray(PIL.Image.open(file)), shown[0], lines


def test_the_halves_are_panda3ds_picture_and_ours(beside):
    result, sheet, (theirs, scene, _), _ = beside
    (width, height), top = SIZE, 40
    assert sheet.shape == (height + top + 8, 2 * width + 24, 3)
    left, right = (sheet[top : top + height, x : x + width] for x in (8, width + 16))
    with Renderer(SIZE, CLASSIC) as renderer:
        ours = renderer.render(scene).color
    np.testing.assert_array_equal(left, theirs)
    np.testing.assert_array_equal(right, ours)
    apart = np.abs(theirs.astype(int) - ours)
    assert result["mean_codes"] == apart.mean()
    assert result["largest_codes"] == apart.max()
    assert result["within_two"] == (apart.max(axis=-1) <= 2).mean()


def test_all_that_is_lit_but_a_few_pixels_is_within_a_code(beside):
    """At edges some are not. Around dots, which we draw by a formula and hide behind models, none count."""
    _, _, (theirs, scene, _), _ = beside
    (dots,) = (path for path in scene.root.get_children() if path.get_name() == "dots")
    forest = scene.root.find("forest")
    with Renderer(SIZE, CLASSIC) as renderer:
        dots.hide()
        ours = renderer.render(scene).color.astype(int)
        dots.show()
        forest.hide()
        dotted = renderer.render(scene).color.any(axis=-1)
        forest.show()
    around = np.lib.stride_tricks.sliding_window_view(np.pad(dotted, 2), (5, 5)).any(axis=(2, 3))
    lit = theirs.any(axis=-1) & ~around
    assert lit.mean() > 0.4
    assert (np.abs(ours - theirs).max(axis=-1)[lit] <= 1).mean() >= 0.999


def test_every_fly_is_a_light(beside):
    """Twelve, and one more after a second, which all have flown 2.5 of 20 units along x."""
    result, _, (_, scene, _), _ = beside
    assert [result[name] for name in ("models", "lights", "dots")] == [10, 13, 13]
    lights = [path for path in scene.root.get_children() if isinstance(path.node(), PointLight)]
    numbers, rng = np.arange(13), random.Random(1)
    flown = np.where(numbers < 12, 2.5, 0.0)
    x, y, z = -60 + 30 * (numbers % 4) + flown, -30 + 45 * (numbers // 4), 14 + 9 * (numbers % 3)
    colors = [(1, rng.uniform(0.5, 1), 0.5) for _ in numbers]
    nodes = [path.node() for path in lights]
    assert [node.name for node in nodes] == ["fly"] * 13
    np.testing.assert_allclose([path.get_pos() for path in lights], np.column_stack([x, y, z]), atol=1e-3)
    np.testing.assert_allclose([n.get_max_distance() for n in nodes], 60 - 6 * (numbers % 3), rtol=1e-5)
    np.testing.assert_allclose([n.get_color() for n in nodes], colors, atol=1e-6)


def test_what_is_not_drawn_is_named_on_the_terminal(beside):
    result, _, _, lines = beside
    for line in (
        "shaders of cameras are not run: the look takes their place: 'surfaces.sha', 'shine.sha'",
        "shader inputs are not used: 'base', 'depth', 'lens', 'stored'",
        "dots are round and soft without their textures, and hidden by what is before them: 'spark'",
    ):
        assert line in result["differences"]
    named = [line.removeprefix("warning: ") for line in lines]
    assert set(result["differences"]) <= set(named)
    assert len(named) == len(set(named))


@pytest.fixture
def no_display(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(shutil, "which", lambda name: None)


def run(folder, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return fireflies.measure_fireflies(folder, seconds=0.0, size=(32, 24), **options)


def test_without_a_display_shaders_in_cg_are_named_and_ours_is_drawn(no_display, art):
    result = run(art)
    assert result["lights"] == 12
    assert result["differences"][0] == (
        "Panda3D does not run shaders in Cg without an X display: 'surfaces.sha', 'shine.sha'"
    )


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ("import math\n\nmath.sqrt(-1)\n", r"main.py failed in line 3: ValueError: math domain error"),
        ("import sys\nsys.exit(4)\n", r"main.py ended by sys.exit\(4\) before"),
        ("x = 1\n", r"main.py ended without a call of run\(\)"),
    ],
    ids=["fails", "exits", "ends"],
)
def test_programs_that_end_by_themselves_are_refused(monkeypatch, tmp_path, program, message):
    (tmp_path / "main.py").write_text(program)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(FireflyError, match=message):
        run_main()


def test_graphs_of_other_kinds_are_refused(no_display, monkeypatch, tmp_path):
    monkeypatch.setenv("DISPLAY", ":9876")  # there is none, so that Panda3D takes the next way
    program = "from direct.showbase.ShowBase import ShowBase\nprint('hello')\nShowBase().run()\n"
    (tmp_path / "main.py").write_text(program)
    with pytest.raises(
        FireflyError, match="not lit by shaders of its own: no camera with a shader draws models"
    ):
        run(tmp_path)


def test_a_program_that_takes_too_long_is_ended(no_display, monkeypatch, art):
    monkeypatch.setattr(fireflies, "LONGEST", 0.05)
    with pytest.raises(FireflyError, match=r"took longer than 0\.05 s"):
        run(art)


def test_a_folder_without_main_py_is_refused(tmp_path, capsys):
    assert main(["measure", "fireflies", str(tmp_path)]) == 1
    assert "has no main.py: give the folder of Panda3D's sample fireflies" in capsys.readouterr().err


def test_other_files_than_png_are_refused(tmp_path, capsys):
    assert main(["measure", "fireflies", str(tmp_path), "-o", "both.jpg"]) == 2
    assert "it must name a PNG file" in capsys.readouterr().err


def test_panda3d_is_an_extra(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "panda3d.core", None)
    with pytest.raises(MissingPackageError, match="install"):
        fireflies.measure_fireflies(tmp_path)
