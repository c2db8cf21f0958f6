"""Views from files: our own form, a NeRF's, a manifest's; and what is wrong with others."""

from __future__ import annotations

import copy
import json
import math
import pickle

import numpy as np
import pytest

from firefly_sample.camera import CONVENTIONS, FrameCamera, pose_from_matrix
from firefly_sample.capture.viewed_scene import ViewedScene
from firefly_sample.capture.views import parse_views
from firefly_sample.errors import LensError, OutputError
from firefly_sample.scene.intrinsics import Intrinsics
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.transforms import rows_from_hpr

FX = {"fx": 70.0, "fy": 72.5, "cx": 30.25, "cy": 25.5, "width": 64, "height": 48}
PLANES = {"near": 0.25, "far": 40.0}
RIGID = np.eye(4).tolist()


def camera(number, **lens):
    matrix = np.eye(4)
    matrix[:3, :3] = rows_from_hpr((20.0 * number, 3.0 * number, -number))
    matrix[3, :3] = number, 2.0 - number, 0.1
    given = {"projection": "perspective", **FX, **PLANES, **lens}
    return FrameCamera(Intrinsics(**given), matrix)


def written(folder, content, name="poses.json"):
    path = folder / name
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def placed(views, size=(64, 48), lens=None):
    """The matrices and lenses at which a scene's camera is put."""
    scene = Scene()
    scene.camera.node().lens = lens or PerspectiveLens(vfov=30.0, near=2.0, far=50.0)
    before = scene.camera.get_net_mat().tobytes()
    viewed = ViewedScene(scene, views, size)
    found = []
    for viewed.view in range(len(views)):
        viewed.update(0.0)
        found.append((viewed.camera.get_net_mat(), viewed.lens))
    assert scene.camera.get_net_mat().tobytes() == before
    return found


def close(found, expected, atol=1e-12):
    np.testing.assert_allclose(found, expected, rtol=0, atol=atol)


@pytest.mark.parametrize("convention", [*CONVENTIONS, "all"])
def test_our_own_form(tmp_path, convention):
    cameras = [camera(0), camera(1), camera(2, fx=60.0), camera(3)]
    content = [each.as_dict() for each in cameras]
    if convention != "all":
        for each in content:
            each["camera_to_world"] = {convention: each["camera_to_world"][convention]}
    views = parse_views(written(tmp_path, content))
    for (matrix, lens), expected in zip(placed(views), cameras, strict=True):
        close(matrix, expected.view_to_world, atol=0)
        found = lens.intrinsics((64, 48)).as_dict()
        assert found.pop("projection") == "perspective"
        for name, value in found.items():
            assert value == pytest.approx(getattr(expected.intrinsics, name), rel=1e-12), name
    assert views == parse_views({"views": content}) == parse_views(cameras)
    # what a manifest says of them makes them again
    again = parse_views(json.loads(json.dumps(views.as_json())))
    assert (again, hash(again)) == (views, hash(views))
    assert pickle.loads(pickle.dumps(views)) == copy.deepcopy(views) == views
    assert again != parse_views(content[:3])


def test_what_a_file_says_counts_and_not_the_file(tmp_path):
    path = written(tmp_path, [camera(1).as_dict()])
    before = parse_views(str(path))
    written(tmp_path, [camera(2).as_dict()])
    assert before != parse_views(str(path))
    assert before == parse_views([camera(1)])
    assert before.as_json() == json.loads(json.dumps(before.as_json()))


def test_a_lens_that_views_share_stands_at_the_top():
    poses = [{"camera_to_world": each.as_dict()["camera_to_world"]} for each in map(camera, range(3))]
    shared = parse_views({**FX, **PLANES, "views": poses})
    assert shared == parse_views([camera(number) for number in range(3)])
    said = shared.as_json()
    assert {name: said[name] for name in FX} == FX
    assert [list(view) for view in said["views"]] == [["camera_to_world"]] * 3
    one = parse_views({**FX, **PLANES, "views": [poses[0], {**poses[1], "fx": 60.0}]})
    assert one == parse_views([camera(0), camera(1, fx=60.0)])


def test_without_a_lens_it_is_the_scenes_own():
    own = OrthographicLens(film_size=5.0)
    views = parse_views([{"camera_to_world": {"opencv": RIGID}}])
    ((matrix, lens),) = placed(views, lens=own)
    assert lens is own
    # OpenCV's axes are right, down, forward, so that down is the world's Y here
    close(matrix[:3, :3], [[1, 0, 0], [0, 0, 1], [0, -1, 0]], atol=0)
    assert views.as_json() == {"views": [{"camera_to_world": {"panda3d": [*_rows(matrix)]}}]}
    assert parse_views(views.as_json()) == views


def _rows(matrix):
    return pose_from_matrix(matrix, "panda3d").tolist()


def test_without_planes_they_are_those_of_the_scene_at_the_moment():
    scene = Scene()
    viewed = ViewedScene(scene, parse_views({**FX, "views": [camera(0).as_dict() | FX]}), (64, 48))
    assert viewed.lens is scene.lens  # until it is updated
    views = parse_views([{**FX, "camera_to_world": {"opengl": RIGID}}])
    viewed = ViewedScene(scene, views, (64, 48))
    viewed.update(0.0)
    first = viewed.lens
    assert (first.get_near(), first.get_far()) == (1.0, 100_000.0)
    viewed.update(1.0)
    assert viewed.lens is first  # so that what is kept for this lens is kept
    scene.lens.set_near_far(3.0, math.inf)
    viewed.update(2.0)
    assert (viewed.lens.get_near(), viewed.lens.get_far()) == (3.0, math.inf)
    scene.camera.node().lens = OrthographicLens(film_size=2.0, near=-1.0, far=1.0)
    with pytest.raises(LensError, match="view 0: near of a perspective lens must be above 0"):
        viewed.update(3.0)


def test_an_infinite_far_plane_is_null():
    views = parse_views([camera(0, far=math.inf)])
    assert views.as_json()["far"] is None
    assert placed(views)[0][1].get_far() == math.inf
    assert parse_views(json.loads(json.dumps(views.as_json()))) == views


def test_orthographic_cameras():
    film = {"projection": "orthographic", "fx": 8.0, "fy": 8.0, "cx": 31.5, "cy": 20.0, "near": -3.0}
    given = camera(1, **film)
    ((matrix, lens),) = placed(parse_views([given]))
    close(matrix, given.view_to_world, atol=0)
    close(lens.get_film_size(), (8.0, 6.0))
    close(lens.get_film_offset(), (0.0, (20.5 - 24.0) / 8.0))
    assert (lens.get_near(), lens.get_far()) == (-3.0, 40.0)


# a camera at (4, 0, 1) that looks along -X: to its right is +Y, upwards +Z, backwards +X
AT_FOUR = [[0.0, 0.0, 1.0, 4.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]]


@pytest.mark.parametrize("where", ["top", "frame"])
def test_a_nerfs_transforms(tmp_path, where):
    lens = {"fl_x": 80.0, "fl_y": 82.0, "cx": 30.0, "cy": 26.0, "w": 64, "h": 48}
    frame = {"file_path": "images/0001.png", "sharpness": 31.5, "transform_matrix": AT_FOUR}
    content = {"camera_model": "OPENCV", "k1": 0.0, "p2": 0, "aabb_scale": 16, "frames": [frame]}
    (content if where == "top" else frame).update(lens)
    views = parse_views(written(tmp_path, content, "transforms.json"))
    for size, scale in (((64, 48), 1.0), ((160, 120), 2.5)):
        ((matrix, found),) = placed(views, size)
        close(matrix[0, :3], (0, 1, 0), atol=0)  # right
        close(matrix[1, :3], (-1, 0, 0), atol=0)  # forward
        close(matrix[2, :3], (0, 0, 1), atol=0)  # up
        close(matrix[3, :3], (4, 0, 1), atol=0)
        k = found.intrinsics(size, pixel_center=0.5)
        close((k.fx, k.fy, k.cx, k.cy), np.array([80.0, 82.0, 30.0, 26.0]) * scale)
        assert (found.get_near(), found.get_far()) == (2.0, 50.0)


@pytest.mark.parametrize("angle", [0.6911112070083618, math.pi / 2, 2.5])
def test_a_nerfs_angle(angle):
    content = {"camera_angle_x": angle, "frames": [{"transform_matrix": AT_FOUR}]}
    for size in ((64, 48), (48, 64)):
        ((_, lens),) = placed(parse_views(content), size)
        k = lens.for_picture(*size).intrinsics(size, pixel_center=0.5)
        focal = 0.5 * size[0] / math.tan(0.5 * angle)
        close((k.fx, k.fy, k.cx, k.cy), (focal, focal, 0.5 * size[0], 0.5 * size[1]), atol=1e-10)
    views = parse_views(content)
    assert views.as_json() == {"camera_angle_x": angle, **views.as_json()}
    assert parse_views(json.loads(json.dumps(views.as_json()))) == views
    ((_, lens),) = placed(parse_views({**content, "w": 80.0, "h": 60.0, "camera_angle_y": 1.0}))
    k = lens.intrinsics((80, 60), pixel_center=0.5)
    focals = 40.0 / math.tan(0.5 * angle), 30.0 / math.tan(0.5)
    close((k.fx, k.fy, k.cx, k.cy), (*focals, 40.0, 30.0), atol=1e-10)


def test_a_nerf_may_say_nothing_of_its_lens():
    own = PerspectiveLens(vfov=33.0)
    assert placed(parse_views({"frames": [{"transform_matrix": AT_FOUR}]}), lens=own)[0][1] is own


def test_the_views_of_a_manifest_are_its_distinct_cameras(tmp_path):
    cameras = [camera(2), camera(0), camera(2), camera(1), camera(0)]
    frames = [{"index": 3 * i, "time": 5.0, "camera": each.as_dict()} for i, each in enumerate(cameras)]
    content = {"scene": "forest", "size": [64, 48], "views": {"orbit": 3}, "frames": frames}
    expected = parse_views([camera(2), camera(0), camera(1)])
    assert parse_views(written(tmp_path, content, "manifest.json")) == expected
    sweep = {"scene": "forest", "captures": [{"frames": frames[:2]}, {"frames": frames[1:]}]}
    assert parse_views(written(tmp_path, sweep, "manifest.json")) == expected


def test_pictures_of_another_shape():
    views = parse_views([camera(0), camera(1, width=48, height=48), camera(2)])
    with pytest.raises(
        OutputError,
        match="view 1: 'width' and 'height' are 48x48, and pictures of 64x48 have another shape: capture at "
        "--size 48x48 or a multiple",
    ):
        views.check_size((64, 48))
    with pytest.raises(OutputError, match="view 1: 'width' and 'height'"):
        ViewedScene(Scene(), views, (64, 48))
    same = parse_views([camera(0)])
    for size in ((64, 48), (640, 480), (100, 75), (33, 25), (1, 1)):  # to whole pixels
        same.check_size(size)
    with pytest.raises(OutputError, match="pictures of 640x482"):
        same.check_size((640, 482))


def posed(pose, **more):
    return [{"camera_to_world": {"opencv": pose}}, {"camera_to_world": {"opencv": pose}, **more}]


def turned(**entries):
    """A pose with some numbers changed, by row and column as "r2c0"."""
    pose = np.eye(4).tolist()
    for place, value in entries.items():
        pose[int(place[1])][int(place[3])] = value
    return pose


GOOD = {"camera_to_world": {"opencv": RIGID}}
NERF = {"fl_x": 80.0, "w": 64, "h": 48, "frames": [{"transform_matrix": AT_FOUR}] * 2}
WRONG = {
    "empty": ([], "there must be 1 to 100,000 views, got 0"),
    "text": ('"poses"', "there are no views: it must be a list"),
    "number": (3, "there are no views"),
    "other": ({"poses": []}, "there are no views"),
    "views": ({"views": 3}, "'views' must be a list, got 3"),
    "camera": ([GOOD, 3], "view 1: a camera must be an object, got 3"),
    "no pose": ([GOOD, {**FX}], "view 1: 'camera_to_world' is missing"),
    "list": ([{"camera_to_world": RIGID}], "view 0: 'camera_to_world' must be an object, got "),
    "none": ([{"camera_to_world": {}}], "view 0: 'camera_to_world' has no pose: give one of panda3d"),
    "convention": (
        [{"camera_to_world": {"opencl": RIGID}}],
        "view 0: there is no key 'opencl' in 'camera_to_world' (did you mean 'opengl'?)",
    ),
    "shape": (posed(np.eye(3).tolist()), "view 0: 'camera_to_world': the opencv pose must have shape (4, 4)"),
    "ragged": (posed([[1, 2], [3]]), "view 0: 'camera_to_world': the opencv pose must be a 4x4 matrix"),
    "words": (posed([["a"] * 4] * 4), "view 0: 'camera_to_world': the opencv pose must be a 4x4 matrix"),
    "nan": (posed(turned(r1c3=math.nan)), "view 0: 'camera_to_world': the opencv pose must be of finite"),
    "huge": (posed(turned(r1c3=10**400)), "view 0: 'camera_to_world': the opencv pose must be a 4x4"),
    "far": (posed(turned(r1c3=1e31)), "view 0: 'camera_to_world': its position must be at most 1e+30"),
    "mirrored": (posed(turned(r0c0=-1)), "view 0: 'camera_to_world': the opencv pose mirrors"),
    "scaled": (posed(turned(r0c0=1.001)), "view 0: 'camera_to_world': the opencv pose scales or shears"),
    "rows": (posed(turned(r3c0=4.0)), "view 0: 'camera_to_world': the opencv pose is for column vectors"),
    "contradiction": (
        [{"camera_to_world": {"opencv": RIGID, "opengl": RIGID}}],
        "view 0: 'camera_to_world': the opengl pose contradicts the opencv pose",
    ),
    "key": (posed(RIGID, focal=3), "view 1: there is no key 'focal' in a camera"),
    "top": ({"fz": 1, "views": [GOOD]}, "there is no key 'fz' beside 'views'"),
    "lens": (posed(RIGID, fx=3), "view 1: its lens: intrinsics lack "),
    "negative": (posed(RIGID, **{**FX, "fy": -1}), "view 1: its lens: fy must be above 0, got -1"),
    "width": (posed(RIGID, **{**FX, "width": 1.5}), "view 1: its lens: width must be a whole number"),
    "extreme": (posed(RIGID, **{**FX, "fx": 1e-320}), "view 1: its lens: this lens is too extreme"),
    "near": (posed(RIGID, **FX, near=1), "view 1: its lens: 'near' without 'far': give both"),
    "planes": (posed(RIGID, **FX, near=2, far=1), "view 1: its lens: far must be beyond near"),
    "projection": (posed(RIGID, **FX, projection="x"), "view 1: its lens: projection must be"),
    "angle": (posed(RIGID, camera_angle_x=4), "view 1: its lens: 'camera_angle_x' must be an angle between"),
    "both": (posed(RIGID, **FX, camera_angle_x=1), "view 1: its lens: 'camera_angle_x' and 'width'"),
    "frames": (
        {"frames": [{"index": 3}]},
        "its 'frames' have neither 'transform_matrix' (NeRF) nor 'camera'",
    ),
    "no frames": ({"frames": []}, "there must be 1 to 100,000 views, got 0"),
    "manifest": ({"frames": [{"index": 3, "camera": {}}]}, "frame 3: 'camera_to_world' is missing"),
    "half": (
        {"frames": [{"index": 3, "camera": GOOD}, {"index": 7}]},
        "frame 7: 'camera' is missing",
    ),
    "sweep": ({"captures": [{"frames": 3}]}, "'frames' must be a list, got 3"),
    "nerf": (
        {"frames": [{"transform_matrix": AT_FOUR}, {"file_path": "x"}]},
        "view 1: 'transform_matrix' is missing",
    ),
    "nerf pose": (
        {"frames": [{"transform_matrix": AT_FOUR[:3]}]},
        "view 0: 'transform_matrix': the opengl pose must have shape (4, 4)",
    ),
    "nerf size": ({**NERF, "w": 64.5}, "view 0: 'w' must be a whole number of pixels, got 64.5"),
    "nerf huge": ({**NERF, "w": 10**400}, "view 0: 'w' must be a finite number above 0, got 1000"),
    "too many": ([GOOD] * 100_000 + [3], "there must be 1 to 100,000 views, got 100,001"),
    "nerf too many": (
        {"frames": [{"transform_matrix": 3}] * 100_001},
        "there must be 1 to 100,000 views, got 100,001",
    ),
    "nerf no size": ({"fl_x": 8.0, "frames": NERF["frames"]}, "view 0: 'w' is missing"),
    "nerf focal": ({**NERF, "fl_y": 0}, "view 0: 'fl_y' must be a finite number above 0, got 0"),
    "nerf centre": ({**NERF, "cx": "32"}, "view 0: 'cx' must be a number, got '32'"),
    "nerf nan": ({**NERF, "cy": math.nan}, "view 0: 'cy' must be a finite number, got nan"),
    "nerf angle": (
        {"camera_angle_x": 0.0, "w": 64, "h": 48, "frames": NERF["frames"]},
        "view 0: 'camera_angle_x' must be an angle between 0 and pi radians, got 0.0",
    ),
    "distortion": ({**NERF, "k2": -0.01}, "view 0: 'k2' is -0.01, and no lens with distortion is drawn"),
    "fisheye": ({**NERF, "camera_model": "OPENCV_FISHEYE"}, "view 0: 'camera_model' is 'OPENCV_FISHEYE'"),
    "is fisheye": ({**NERF, "is_fisheye": True}, "view 0: 'is_fisheye' is True, and only pinhole cameras"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_files(tmp_path, name):
    content, message = WRONG[name]
    path = written(tmp_path, content)
    with pytest.raises(OutputError) as caught:
        parse_views(str(path))
    assert str(caught.value).startswith(f"{path}: {message}")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", ["", "{", "[1, 2", "views: 3", "[" * 100_000])
def test_files_that_are_no_json(tmp_path, content):
    path = tmp_path / "poses.json"
    path.write_text(content)
    with pytest.raises(OutputError, match="views must be JSON, and this is not") as caught:
        parse_views(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(OutputError, match=r"cannot read the views of .*poses.json: No such file"):
        parse_views(tmp_path / "poses.json")
    with pytest.raises(OutputError, match=r"cannot read the views of .*: Is a directory"):
        parse_views(str(tmp_path))
    (tmp_path / "poses.json").write_bytes(b"\xff\xfe\xff")
    with pytest.raises(OutputError, match="must be JSON"):
        parse_views(tmp_path / "poses.json")
