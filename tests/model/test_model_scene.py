"""The scene plugin "model": up axis, cameras, animations, turntable, lights and ground."""

from __future__ import annotations

import math

import numpy as np
import pytest

from firefly_sample import model_scene
from firefly_sample.errors import ModelError, ParameterError, SceneError
from firefly_sample.model.studio import BACKDROP
from firefly_sample.scenes import build_scene, find_scene
from tests.model.gltf_files import GltfFile
from tests.model.scene_files import add_camera, add_slide, add_sun, box_file
from tests.model.test_framing import in_view
from tests.model.test_gltf_images import encoded, shown, uri


@pytest.fixture
def box(tmp_path):
    return box_file().write(tmp_path / "box.glb")


def bounds_of(scene):
    return np.array(scene.root.find("**/box").get_tight_bounds(scene.root))


def corners_of(scene):
    low, high = bounds_of(scene)
    ends = np.stack([low, high])
    return np.array([(ends[i, 0], ends[j, 1], ends[k, 2]) for i in (0, 1) for j in (0, 1) for k in (0, 1)])


def is_shown(path):
    return not path.is_hidden()


def test_a_file_in_one_line(box, render):
    frame = render(model_scene(box), size=(80, 60), outputs=("color", "id"))
    names = [frame.id_names[index] for index in np.unique(frame.id) if index >= 0]
    assert any(name.endswith("box/box") for name in names)
    assert any(name.endswith("ground") for name in names)
    assert (frame.color[0, 0].astype(int) > 150).all()


@pytest.mark.parametrize(
    ("up", "size"), [("auto", (2, 2, 4)), ("y", (2, 2, 4)), ("z", (2, 4, 2)), ("x", (4, 2, 2))]
)
def test_the_up_axis(box, up, size):
    """In the file the box is 2 wide (x), 4 high (y) and 2 deep (z); with x up, its y is across."""
    low, high = bounds_of(model_scene(box, up=up))
    assert (high - low).tolist() == list(size)


class TestFileScene:
    @pytest.fixture
    def file(self, tmp_path):
        file = box_file()
        file.node(name="other box", mesh=0)
        file.json["scenes"] = [{"nodes": [0], "name": "day"}, {"nodes": [1], "name": "night"}]
        return file.write(tmp_path / "two.glb")

    @pytest.mark.parametrize(
        ("chosen", "name"), [("", "box"), ("day", "box"), ("night", "other box"), ("1", "other box")]
    )
    def test_by_name_or_number(self, file, chosen, name):
        (model,) = model_scene(file, file_scene=chosen).root.find("turntable").get_children()
        assert [path.get_name() for path in model.get_children()] == [name]

    def test_one_that_is_not_there(self, file):
        with pytest.raises(ModelError, match="there is no scene 'dusk': it has 0 'day', 1 'night'"):
            model_scene(file, file_scene="dusk")

    def test_other_formats_have_none(self, tmp_path):
        path = tmp_path / "a.off"
        path.write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 0 1\n3 0 1 2\n")
        model_scene(path)
        with pytest.raises(ModelError, match=r"a\.off: there is no scene 'day': only glTF files have scenes"):
            model_scene(path, file_scene="day")


def test_the_limit_of_textures(tmp_path):
    """The texture has 6 x 4 pixels."""
    path = shown(GltfFile(), {}, uri=uri(encoded())).write(tmp_path / "m.glb")
    model_scene(path, max_texture_megapixels=24e-6)
    with pytest.raises(ModelError, match="6x4 pixels, more than max_texture_megapixels=2e-05 allows"):
        model_scene(path, max_texture_megapixels=20e-6)


@pytest.mark.parametrize("shape", [0.5, 1.0, 4 / 3, 3.0])
def test_without_a_camera_the_model_is_framed(box, shape):
    scene = model_scene(box)
    ndc, _ = in_view(scene, corners_of(scene), shape)
    assert 0.85 < np.abs(ndc).max() <= 0.91


class TestCameras:
    @pytest.fixture
    def file(self, tmp_path):
        file = box_file()
        add_camera(file, "Front", translation=[0.0, 2.0, 10.0])
        half = math.sqrt(0.5)
        add_camera(
            file, "Top", translation=[0.0, 20.0, 0.0], rotation=[-half, 0.0, 0.0, half], scale=[3, 3, 3]
        )
        return file.write(tmp_path / "cameras.glb")

    def test_the_first_one_by_default(self, file):
        scene = model_scene(file)
        np.testing.assert_allclose(scene.camera.get_pos(), (0.0, -10.0, 2.0), atol=1e-6)
        np.testing.assert_allclose(scene.camera.get_hpr(), (0.0, 0.0, 0.0), atol=1e-6)
        assert math.isclose(scene.lens.for_picture(100, 100).get_vfov(), 60.0, rel_tol=1e-6)
        assert scene.lens.get_near() == 0.5
        np.testing.assert_allclose(scene.focus, (0.0, 0.0, 2.0))

    def test_one_by_its_name_and_without_its_scale(self, file):
        scene = model_scene(file, camera="Top")
        np.testing.assert_allclose(scene.camera.get_pos(), (0.0, 0.0, 20.0), atol=1e-6)
        np.testing.assert_allclose(scene.camera.get_net_mat()[1, :3], (0.0, 0.0, -1.0), atol=1e-6)

    def test_a_framing_one_all_the_same(self, file):
        assert model_scene(file, camera="frame").camera.get_pos()[0] > 1.0

    def test_one_that_is_not_there(self, file):
        with pytest.raises(
            SceneError, match=r"no camera 'Tip' \(did you mean 'Top'\?\): give Front, Top, auto"
        ):
            model_scene(file, camera="Tip")

    def test_it_stays_while_the_model_turns(self, file):
        scene = model_scene(file, turntable=4.0)
        before = scene.camera.get_net_mat()
        scene.update(1.0)
        np.testing.assert_allclose(scene.camera.get_net_mat(), before, atol=1e-9)
        np.testing.assert_allclose(scene.root.find("turntable").get_h(), 90.0)


class TestTurntable:
    def test_a_turn_is_a_function_of_time_about_the_middle(self, box, tmp_path):
        file = box_file()
        file.json["nodes"][0]["translation"] = [100.0, 0.0, 0.0]
        moved = file.write(tmp_path / "moved.glb")
        scene = model_scene(moved, turntable=8.0)
        still = corners_of(scene)
        scene.update(2.0)  # a quarter: the box has the same corners
        np.testing.assert_allclose(bounds_of(scene), [still.min(axis=0), still.max(axis=0)], atol=1e-9)
        quarter = scene.root.find("**/box").get_net_mat()
        scene.update(1e4)
        scene.update(2.0)
        assert np.array_equal(scene.root.find("**/box").get_net_mat(), quarter)
        scene.update(8.0)
        np.testing.assert_allclose(scene.root.find("turntable").get_mat(), np.eye(4), atol=1e-9)

    def test_it_stands_still_by_default_to_the_bit(self, box):
        scene = model_scene(box)
        scene.update(3.0)
        assert np.array_equal(scene.root.find("turntable").get_mat(), np.eye(4))

    @pytest.mark.parametrize("time", [0.0, 0.7, 1.9, 3.3])
    def test_it_stays_in_view(self, box, time):
        scene = model_scene(box, turntable=4.0)
        scene.update(time)
        points = corners_of(model_scene(box))
        net = scene.root.find("turntable").get_net_mat()
        ndc, _ = in_view(scene, points @ net[:3, :3] + net[3, :3], 4 / 3)
        assert np.abs(ndc).max() <= 0.91

    def test_it_is_live(self, box):
        scene = model_scene(box)
        scene.set("turntable", 4.0)
        scene.update(1.0)
        assert math.isclose(scene.root.find("turntable").get_h(), 90.0)


class TestAnimations:
    @pytest.fixture
    def file(self, tmp_path):
        file = box_file()
        add_slide(file, "walk", 6.0)
        add_slide(file, "run", 60.0)
        return file.write(tmp_path / "walker.glb")

    def x_at(self, scene, time):
        scene.update(time)
        return bounds_of(scene).mean(axis=0)[0]

    @pytest.mark.parametrize(
        ("animation", "x"), [("first", 3.0), ("walk", 3.0), ("run", 30.0), ("all", 30.0), ("none", 0.0)]
    )
    def test_which_plays(self, file, animation, x):
        scene = model_scene(file, animation=animation)
        assert math.isclose(self.x_at(scene, 1.0), x, abs_tol=1e-6)

    def test_all_of_its_way_is_framed(self, file):
        scene = model_scene(file)
        for time in (0.0, 0.9, 1.8):
            scene.update(time)
            ndc, _ = in_view(scene, corners_of(scene), 1.0)
            assert np.abs(ndc).max() < 1.0

    def test_the_ground_is_below_all_of_it(self, tmp_path):
        file = box_file()
        add_slide(file, "sink", 0.0)
        low = np.array([(0.0, 0.0, 0.0), (0.0, -2.0, 0.0)], dtype=np.float32)
        file.json["animations"][0]["samplers"][0]["output"] = file.accessor(low)
        scene = model_scene(file.write(tmp_path / "sinking.glb"))
        assert -2.0 < scene.root.find("ground").get_z() < -1.8  # the last of its poses is before the end
        assert bounds_of(scene)[0, 2] == 0.0

    def test_one_that_is_not_there(self, file):
        message = r"no animation 'wal' \(did you mean 'walk'\?\): give walk, run, first, all, none"
        with pytest.raises(SceneError, match=message):
            model_scene(file, animation="wal")

    def test_several_files_of_which_one_has_it(self, file, box):
        scene = model_scene(box, file, animation="run")
        scene.update(1.0)
        moved = [path.get_net_mat()[3, 0] for path in scene.root.find_all_matches("turntable/*/box")]
        assert sorted(moved) == pytest.approx([0.0, 30.0])


class TestLights:
    @pytest.fixture
    def file(self, tmp_path):
        file = box_file()
        child = file.mesh(POSITION=np.eye(3, dtype=np.float32) + 1)
        lamp = add_sun(file)
        file.node(name="shade", parent=lamp, mesh=child)
        return file.write(tmp_path / "lit.glb")

    @pytest.mark.parametrize(
        ("lights", "file_on", "default_on"),
        [("auto", True, False), ("file", True, False), ("default", False, True), ("both", True, True)],
    )
    def test_a_file_with_a_light(self, file, lights, file_on, default_on, render):
        scene = model_scene(file, lights=lights)
        assert is_shown(scene.root.find("**/sun")) == file_on
        assert is_shown(scene.root.find("default lights")) == default_on
        assert scene.background == (BACKDROP if default_on else (0.0, 0.0, 0.0))
        assert is_shown(scene.root.find("ground")) == default_on
        assert render(scene).lights.in_scene == file_on + 2 * default_on

    def test_what_is_below_a_hidden_light_is_drawn(self, file, render):
        frame = render(model_scene(file, lights="default"), outputs=("id",))
        assert any(name.endswith("sun/shade") for name in frame.id_names)

    @pytest.mark.parametrize(("lights", "on"), [("auto", 2), ("file", 0), ("default", 2), ("both", 2)])
    def test_a_file_without(self, box, lights, on, render):
        assert render(model_scene(box, lights=lights)).lights.in_scene == on

    def test_lights_and_ground_are_live(self, file):
        scene = model_scene(file)
        scene.set("lights", "both")
        assert is_shown(scene.root.find("ground"))
        scene.set("ground", False)
        assert not is_shown(scene.root.find("ground"))
        with pytest.raises(
            ParameterError, match="lights must be one of auto, file, default, both, got 'botch'"
        ):
            scene.set("lights", "botch")
        with pytest.raises(ParameterError, match="has no live parameter 'camera'"):
            scene.set("camera", "frame")

    def test_the_ground_is_just_below_the_model(self, box):
        scene = model_scene(box)
        low, high = bounds_of(scene)
        height = scene.root.find("ground").get_z()
        assert 0.0 < low[2] - height < 0.01 * (high - low).max()

    def test_the_backdrop(self, box, render):
        radiance = render(model_scene(box, ground=False), outputs=("radiance",)).radiance
        np.testing.assert_allclose(radiance[0, 0], BACKDROP.horizon, rtol=1e-3)


class TestFiles:
    def test_find_scene(self, box, monkeypatch):
        monkeypatch.chdir(box.parent)
        plugin = find_scene("box.glb")
        assert (plugin.name, plugin.folder, plugin.start_time) == ("box.glb", "box", 0.0)
        scene = build_scene(plugin)
        assert scene.values["file"] == "box.glb"
        assert build_scene(plugin, up="z").values["up"] == "z"

    def test_several_files_share_one_space(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        for name in ("a.glb", "b, c.gltf"):
            box_file().write(tmp_path / name)
        plugin = find_scene("a.glb,b, c.gltf")
        scene = build_scene(plugin)
        assert [path.get_name() for path in scene.root.find("turntable").get_children()] == ["a", "b, c"]
        assert plugin.folder == "a+b, c"
        assert len(model_scene("a.glb", "b, c.gltf").root.find_all_matches("**/box")) == 2

    def test_a_scene_wins_against_a_file_of_its_name(self, box, monkeypatch):
        monkeypatch.chdir(box.parent)
        box.rename("forest")
        assert find_scene("forest").name == "forest"
        assert find_scene("./forest").name == "./forest"

    @pytest.mark.parametrize(
        ("name", "message"),
        [
            ("bax.glb", r"model bax\.glb: no such file \(did you mean 'box\.glb'\?\)"),
            ("box", r"model box: no such file \(did you mean 'box\.glb'\?\)"),
            ("sub/box.obj", r"model sub/box\.obj: no such file: there is no folder sub"),
            (".", r"model \.: it is a folder, it holds box\.glb: give one of them"),
            ("box.glb,who.stl", r"model who\.stl: no such file"),
        ],
    )
    def test_a_file_that_is_missing(self, box, monkeypatch, name, message):
        monkeypatch.chdir(box.parent)
        if name == "box":
            name = "./box"
            message = message.replace("model box", r"model \./box")
        with pytest.raises(ModelError, match=message):
            find_scene(name)

    def test_no_file(self):
        for made in (model_scene, lambda: build_scene(find_scene("firefly_sample.scenes.model:scene"))):
            with pytest.raises(SceneError, match="scene 'model': no file is given"):
                made()

    def test_nothing_to_draw_names_what_the_file_has(self, tmp_path):
        file = GltfFile()
        points = file.mesh(file.primitive(NORMAL=np.eye(3, dtype=np.float32), mode=0))
        file.node(mesh=points)
        path = file.write(tmp_path / "points.glb")
        with pytest.raises(
            ModelError, match=r"points\.glb: .*nothing to draw.*points without positions are not drawn"
        ):
            model_scene(path)

    def test_a_parameter_that_does_not_exist(self, box):
        with pytest.raises(
            ParameterError, match=r"box\.glb' has no parameter 'upp': it has file, file_scene, up"
        ):
            model_scene(box, upp="z")
