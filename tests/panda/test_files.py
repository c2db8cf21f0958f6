"""Panda3D's own files by the command line and by `load_model`, beside Panda3D's own pictures."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import panda3d
import pytest
from panda3d import core
from PIL import Image

from firefly_sample import load_model
from firefly_sample import model_scene as our_scene
from firefly_sample.cli import main
from firefly_sample.errors import ModelError
from firefly_sample.model.panda3d.graph import GraphTree
from tests.panda.agreement import agreement
from tests.panda.scenes import card, framed, model_scene

MODELS = Path(panda3d.__file__).parent / "models"
OPTIONS = "--size", "160x120", "--supersample", 1, "--outputs", "color_alpha"
TRIANGLE = """<CoordinateSystem> {{ Z-up }} {0} <VertexPool> v {{
  <Vertex> 0 {{ 0 0 0 <UV> {{ 0 0 }} }}
  <Vertex> 1 {{ 1 0 0 <UV> {{ 1 0 }} }}
  <Vertex> 2 {{ 0 0 1 <UV> {{ 0 1 }} }}
}}
<Group> triangle {{ <Polygon> {{ {1} <VertexRef> {{ 0 1 2 <Ref> {{ v }} }} }} }}"""


def capture(capsys, *arguments) -> str:
    """What ``firefly capture`` says on stderr; it must succeed."""
    code = main(["capture", *map(str, arguments)])
    err = capsys.readouterr().err
    assert code == 0, err
    return err


def picture(file: Path) -> SimpleNamespace:
    """A PNG with alpha as a frame."""
    codes = np.array(Image.open(file))
    return SimpleNamespace(color=codes[..., :3], depth=np.where(codes[..., 3] > 0, 1.0, np.inf))


def test_a_bam_file_is_drawn_with_its_own_camera_and_lights(by_panda, tmp_path, capsys):
    name = "models/panda.egg.pz"
    root, _ = model_scene(name)
    assert root.write_bam_file(core.Filename.from_os_specific(str(tmp_path / "scene.bam")))
    out = tmp_path / "scene.png"
    err = capture(capsys, tmp_path / "scene.bam", *OPTIONS, "-o", out)
    assert [line for line in err.splitlines() if "warning" in line and "llvmpipe" not in line] == []
    found = agreement(by_panda(model_scene, name), picture(out))
    assert found.strays == 0
    assert found.covered > 0.15
    assert found.mean <= 0.1


@pytest.mark.parametrize(("name", "frame"), [("teapot", None), ("panda-model", 17)])
def test_an_egg_file_is_drawn_as_panda3d_draws_it_without_lights(by_panda, tmp_path, capsys, name, frame):
    name, out = f"models/{name}.egg.pz", tmp_path / "frames"
    files, when = MODELS.parent / name, 0
    if frame is not None:  # a second file moves the first; 30 frames a second
        files, when = f"{files},{MODELS / 'panda-walk4.egg.pz'}", frame
    capture(capsys, files, *OPTIONS, "--fps", 30, "--frames", f"{when}:{when + 1}", "-o", out)
    found = agreement(by_panda(framed, name, frame), picture(out / f"color_alpha_{when:06}.png"))
    assert found.strays == 0
    assert found.covered > 0.2
    assert found.mean <= 0.1


def geoms(scene):
    """What the files hold, without the ground."""
    found = scene.root.find_all_matches("turntable/**/+GeomNode")
    return [pair for path in found for pair in path.node().geoms]


def vertices(scene):
    return np.concatenate([geom.vertices for geom, _ in geoms(scene)])


def test_an_actor_is_where_time_puts_it_and_loops():
    scene = our_scene(MODELS / "panda-model.egg.pz", MODELS / "panda-walk4.egg.pz")
    (model,) = scene._models()
    (clip,) = model.animations.values()
    poses = {}
    for time in (0.0, 0.5, clip.duration + 0.5, 0.5 - clip.duration):
        scene.update(time)
        poses[time] = vertices(scene)
    first, half, *others = poses.values()
    assert np.abs(first - half).max() > 1.0
    assert all(np.array_equal(half, other) for other in others)
    model.play(None)
    scene.update(0.5)
    rest = our_scene(MODELS / "panda-model.egg.pz")
    assert np.allclose(vertices(scene), vertices(rest), rtol=0.0, atol=1e-4)  # of about 1,000; float32


def test_billboards_face_the_camera_while_the_model_turns(tmp_path, monkeypatch):
    root = core.NodePath("root")
    for name in ("turned", "fixed"):
        card(name).reparent_to(root)
    root.find("turned").set_billboard_point_eye()
    root.write_bam_file(core.Filename.from_os_specific(str(tmp_path / "cards.bam")))
    scene = our_scene(tmp_path / "cards.bam", turntable=8.0)
    for time in (0.0, 1.0, 3.0):
        scene.update(time)
        turned, camera = (path.get_net_mat() for path in (scene.root.find("**/turned"), scene.camera))
        assert np.allclose(turned[:3, :3], camera[:3, :3], rtol=0.0, atol=1e-6)
    walks = []
    update = GraphTree.update
    monkeypatch.setattr(GraphTree, "update", lambda *given: walks.append(given) or update(*given))
    scene.update(3.0)
    assert len(walks) == 1


def test_default_lights_light_what_has_none():
    scene = our_scene(MODELS / "teapot.egg.pz", lights="default")
    assert [material.unlit for _, material in geoms(scene)] == [False] * 4
    scene.set("lights", "auto")
    assert [material.unlit for _, material in geoms(scene)] == [True] * 4


def test_the_up_axis_can_be_another(tmp_path):
    file = tmp_path / "triangle.egg"
    file.write_text(TRIANGLE.format("", ""))
    node = load_model(file, up="y").find("**/+GeomNode")
    (geom, _), *_ = node.node().geoms
    turned = np.c_[geom.vertices, np.ones(3)] @ node.get_net_mat()
    assert sorted(map(tuple, turned[:, :3].tolist())) == [(0, -1, 0), (0, 0, 0), (1, 0, 0)]


def test_images_that_are_missing_are_named_once(tmp_path):
    file = tmp_path / "triangle.egg"
    file.write_text(TRIANGLE.format("<Texture> wood { gone.png }", "<TRef> { wood }"))
    assert load_model(file).node().warnings == ("images that are missing or damaged: 'gone.png'",)


def test_images_that_are_too_large_are_refused(tmp_path):
    Image.new("RGB", (64, 64)).save(tmp_path / "wood.png")
    file = tmp_path / "triangle.egg"
    file.write_text(TRIANGLE.format("<Texture> wood { wood.png }", "<TRef> { wood }"))
    load_model(file, max_texture_megapixels=0.0041)
    with pytest.raises(
        ModelError, match=r"image 'wood' has 0\.0041 megapixels, more than max_texture_megapixels"
    ):
        load_model(file, max_texture_megapixels=0.004)


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        (
            "a.egg",
            b"<Group> x { <Vertex",
            "Error in a.egg at line 1, column 19: <Group> x { <Vertex; syntax error",
        ),
        ("a.bam", b"pbj\0\n\rxxxxxx", "Unable to read Bam header."),
        ("a.bam", b"", "a.bam is not a valid BAM file."),
        ("a.egg.pz", b"not compressed", ""),
    ],
)
def test_a_damaged_file_is_refused_in_one_line(tmp_path, capfd, name, data, said):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(ModelError) as caught:
        our_scene(tmp_path / name)
    line = str(caught.value)
    assert line.startswith(f"model {tmp_path / name}: ")
    assert said in line
    assert "\n" not in line
    assert capfd.readouterr().err == ""


def test_a_file_of_an_animation_alone_has_nothing_to_draw():
    with pytest.raises(ModelError, match="nothing to draw"):
        our_scene(MODELS / "panda-walk.egg.pz")
