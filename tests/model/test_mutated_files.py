"""Damaged files, drawn in a process with limits: a picture or one clear line.

`python -m tests.model.mutate_files` draws as many as one likes.
"""

from __future__ import annotations

import os
import random
import sys
from pathlib import Path

import numpy as np
import pytest

from firefly_sample import Scene, load_model, model_scene
from firefly_sample.errors import FireflyError, ModelError, NodeError
from firefly_sample.model import framing, isolated
from firefly_sample.model.framing import visible_bounds
from tests.model import damage
from tests.model.format_files import write, zipped
from tests.model.mutate_files import draw_all, run
from tests.model.originals import GLTF, OTHERS, rich_file
from tests.model.scene_files import TRIANGLES, add_camera, add_slide, box_file


def test_fifteen_files() -> None:
    failed, table = run("quick", range(15))
    assert failed == []
    kinds = {kind for _, kind in table}
    assert kinds == {"picture", "line"}


@pytest.mark.parametrize("name", [*GLTF, *(name for name in OTHERS if name not in damage.ISOLATED)])
def test_the_originals_are_whole(name: str, tmp_path: Path) -> None:
    if name in ("draco.glb", "meshopt.glb"):
        pytest.importorskip({"draco.glb": "DracoPy", "meshopt.glb": "meshoptimizer"}[name])
    assert load_model((GLTF | OTHERS)[name](tmp_path)).find_all_matches("**/+GeomNode")


def test_a_file_that_takes_too_much_memory_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The limits of the worker are real: 3 GiB in place of the reader are no picture and no line."""

    (tmp_path / "sitecustomize.py").write_text(
        "import firefly_sample.model.gltf.reader as reader\n"
        "def read_gltf(*_): bytearray(3 << 30)\n"
        "reader.read_gltf = read_gltf\n"
    )
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *filter(None, sys.path)]))
    path = box_file().write(tmp_path / "box.glb")
    (found,) = draw_all(iter([path]))
    assert found.kind == "traceback"
    assert "MemoryError" in found.text


# errors are one line


def test_errors_have_no_characters_that_cannot_be_printed() -> None:
    assert str(NodeError("a\nb\x1b[31m\udcff ü☃")) == "a\\nb\\x1b[31m\\udcff ü☃"
    assert FireflyError("a", 1).args == ("a", 1)


def test_names_of_files_in_archives(tmp_path: Path) -> None:
    path = tmp_path / "a\nb.zip"
    path.write_bytes(zipped({"c\nd.off": b"OFX"}))
    with pytest.raises(ModelError) as caught:
        load_model(path)
    shown = str(path).replace("\n", "\\n")
    assert str(caught.value).startswith(
        f"model {shown}: c\\nd.off: damaged .off file (its first word is not OFF"
    )


# what is no file


@pytest.mark.parametrize("suffix", ["glb", "obj", "step", "zip"])
def test_pipes_and_empty_files(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"pipe.{suffix}"
    os.mkfifo(path)
    with pytest.raises(ModelError, match="not a file"):
        load_model(path)
    path = tmp_path / f"empty.{suffix}"
    path.touch()
    with pytest.raises(ModelError, match="the file is empty"):
        load_model(path)


# large models


def test_what_does_not_move_counts_once(tmp_path: Path) -> None:
    file = box_file()
    still = file.node(mesh=0, translation=[0, 20, 0])
    add_slide(file, "slide", 10.0)
    scene = Scene()
    load_model(file.write(tmp_path / "a.glb")).reparent_to(scene.root)
    assert still
    bounds = visible_bounds(scene, times=(0.0, 0.5, 1.0))
    assert len(bounds.points) == (3 + 1) * TRIANGLES.size
    assert (bounds.points + bounds.center)[:, 0].max() == 1.0 + 5.0


def test_boxes_stand_for_very_many_points(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A twisted prism has the bounds of its points or, with more than allowed, those of its turned box."""
    file = box_file()
    inner = file.mesh(POSITION=np.float32([[-1, 0, -1], [1, 0, 1], [0, 4, 0.5]]))
    half = float(np.sqrt(0.5))
    file.json["nodes"][0] |= {"mesh": inner, "rotation": [0, np.sin(np.pi / 8), 0, np.cos(np.pi / 8)]}
    scene = Scene()
    load_model(file.write(tmp_path / "a.glb")).reparent_to(scene.root)
    exact = visible_bounds(scene)
    assert len(exact.points) == 3
    monkeypatch.setattr(framing, "MOST_POINTS", 2)
    boxed = visible_bounds(scene)
    assert len(boxed.points) == 8
    np.testing.assert_allclose(boxed.points[:, :2].max(axis=0), 2.0 * half)
    assert boxed.low == exact.low == 0.0


def test_models_that_are_too_large_are_named(tmp_path: Path) -> None:
    file = box_file()
    file.json["nodes"][0]["scale"] = [1e30, 1e30, 1e30]
    path = file.write(tmp_path / "large.glb")
    with pytest.raises(ModelError, match=r"large\.glb: too large for a ground, with a radius of 2\.\d+e\+30"):
        model_scene(path)


@pytest.mark.parametrize("far", [1e155, 1.7e308])
def test_far_planes_beyond_squares_of_float64(far: float, tmp_path: Path, render) -> None:
    """The picture is that without a far plane, and nothing overflows."""
    pictures = []
    for zfar in ({"zfar": far}, {}):
        file = rich_file()
        lens = file.json["cameras"][0]["perspective"]
        del lens["zfar"]
        lens.update(zfar)
        pictures.append(render(model_scene(file.write(tmp_path / "a.glb"))).color)
    np.testing.assert_array_equal(*pictures)


@pytest.mark.parametrize("place", [[0, 0, 1e155], [1.7e308, 0, 0], [0, -2e30, 0]])
def test_cameras_that_are_too_far_away_are_named(place: list[float], tmp_path: Path, render) -> None:
    file = box_file()
    add_camera(file, "eye", translation=place)
    scene = model_scene(file.write(tmp_path / "a.glb"))
    with pytest.raises(NodeError, match=r"camera model/camera: its position in the world must be at most"):
        render(scene)


# other formats

PLY = "ply\nformat ascii 1.0\nelement vertex 3\n{}property float y\nproperty float z\n{}end_header\n"
ROWS = "0 0 0\n1 0 0\n0 1 0\n"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (PLY.format("property float w\n", "") + ROWS, "'x' is missing"),
        (
            PLY.format(
                "property float x\n", "element tristrips 1\nproperty list uchar int other\n"
            ) + ROWS + "3 0 1 2\n",
            "holds no triangles.* tables of PLY files other than vertices and faces: 'tristrips'",
        ),
    ],
)  # fmt: skip
def test_ply_without_what_it_needs(text: str, line: str, tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    path.write_text(text)
    with pytest.raises(ModelError, match=line):
        load_model(path)


def test_the_time_of_other_readers_is_bounded_by_the_size_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(isolated, "SECONDS", 0)
    monkeypatch.setattr(isolated, "SECONDS_PER_MEGABYTE", 2)
    path = write(tmp_path, "xaml")
    with path.open("ab") as file:
        file.write(b" " * 1_000_000)
    (tmp_path / "lxml.py").write_text("while True: pass\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(ModelError, match="more than 2 seconds"):
        load_model(path)


def test_every_kind_of_damage_is_repeatable(tmp_path: Path) -> None:
    for number in range(20):
        made = []
        for attempt in ("a", "b"):
            folder = tmp_path / f"{attempt}{number}"
            folder.mkdir()
            path, what = damage.make(folder, random.Random(number))
            made.append((what, path.name))
        assert made[0] == made[1]
