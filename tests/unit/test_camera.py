"""The camera of a frame: against OpenCV's formula and Panda3D's cameras, in dicts, and what is refused."""

from __future__ import annotations

import json
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from panda3d import core as panda

from firefly_sample import FrameCamera, NodePath
from firefly_sample.camera import CONVENTIONS
from firefly_sample.errors import SceneError
from firefly_sample.scene.intrinsics import Intrinsics
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens

PINHOLE = Intrinsics("perspective", 64, 48, 70, 75, 30, 20, 0.5, 50)
FLAT = Intrinsics("orthographic", 64, 48, 7, 8, 30, 20, -5, 50)


def camera_at(intrinsics: Intrinsics, hpr=(20, -30, 10), pos=(3, -4, 5)) -> FrameCamera:
    path = NodePath("camera")
    path.set_hpr(*hpr)
    path.set_pos(*pos)
    return FrameCamera(intrinsics, path.get_mat())


HPR = st.tuples(*[st.floats(-180, 180)] * 3)
POS = st.tuples(*[st.floats(-100, 100)] * 3)
NEAR = st.tuples(*[st.floats(-10, 10)] * 3)


@settings(max_examples=40)
@given(HPR, POS, st.sampled_from([PINHOLE, FLAT]), st.integers(0, 2**32 - 1))
def test_world_points_project_back_to_their_pixels(hpr, pos, intrinsics, seed):
    camera = camera_at(intrinsics, hpr, pos)
    depth = np.random.default_rng(seed).uniform(1, 50, (48, 64))
    u, v, distance = camera.project(camera.world_points(depth))
    rows, columns = np.mgrid[:48, :64]
    # a point at 1 to 50 units, in a world of 200, is known to 1e-13, and a unit is at most 75 pixels
    for found, expected in ((u, columns), (v, rows), (distance, depth)):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


@settings(max_examples=25)
@given(HPR, POS, st.integers(0, 2**32 - 1))
def test_projection_is_that_of_opencv(hpr, pos, seed):
    """cv2.projectPoints without distortion: X_c = R X + t, then K X_c divided by its third number."""
    camera = camera_at(PINHOLE, hpr, pos)
    world_to_camera = np.linalg.inv(camera.pose("opencv"))
    r, t = world_to_camera[:3, :3], world_to_camera[:3, 3]
    seen = np.random.default_rng(seed).uniform((-5, -5, 1), (5, 5, 40), (20, 3))  # in OpenCV's camera
    points = (seen - t) @ r
    image = camera.intrinsics.matrix() @ (r @ points.T + t[:, None])
    u, v, distance = camera.project(points)
    np.testing.assert_allclose([u, v], image[:2] / image[2], rtol=0, atol=1e-10)
    np.testing.assert_allclose(distance, seen[:, 2], rtol=0, atol=1e-12)


LENSES = {
    "centred": (PerspectiveLens, {"fov": 60}),
    "off-centre": (PerspectiveLens, {"film_size": (36, 27), "focal_length": 50, "film_offset": (3, -5)}),
    "orthographic": (OrthographicLens, {"film_size": (20, 15), "film_offset": (2, -1)}),
}


@pytest.mark.parametrize("name", LENSES)
@settings(max_examples=20)
@given(hpr=HPR, pos=NEAR, seed=st.integers(0, 2**32 - 1))
def test_panda3d_s_cameras_see_the_same_points_in_the_same_pixels(name, hpr, pos, seed):
    kind, values = LENSES[name]
    lens, theirs = kind(**values), getattr(panda, kind.__name__)()
    for key, value in values.items():
        getattr(theirs, f"set_{key}")(*(value if isinstance(value, tuple) else (value,)))
    theirs.set_aspect_ratio(4 / 3)
    camera = camera_at(lens.intrinsics((64, 48)), hpr, pos)
    path = panda.NodePath("camera")
    # Panda3D's matrices are for row vectors, too
    path.set_mat(panda.LMatrix4f(*map(float, camera.pose("panda3d").T.ravel())))
    rng = np.random.default_rng(seed)
    points = camera.world_points(rng.uniform(2, 20, (48, 64)))
    root, film = panda.NodePath("root"), panda.Point2()
    for row, column in rng.integers(1, 47, (20, 2)):
        seen = path.get_relative_point(root, panda.Point3(*points[row, column]))
        assert theirs.project(seen, film)
        # float32 of coordinates up to 40 is known to 4e-6, and a unit at distance 2 is at most 50 pixels
        pixel = (film.x + 1) * 32 - 0.5, (1 - film.y) * 24 - 0.5
        assert pixel == pytest.approx((column, row), abs=1e-3)


@pytest.mark.parametrize("intrinsics", [PINHOLE, FLAT])
@pytest.mark.parametrize("convention", [None, *CONVENTIONS])
def test_a_dict_and_json_lose_nothing_and_one_pose_is_enough(intrinsics, convention):
    camera = camera_at(intrinsics)
    written = json.loads(json.dumps(camera.as_dict()))
    assert list(written)[-1] == "camera_to_world"
    if convention:
        written["camera_to_world"] = {convention: written["camera_to_world"][convention]}
    back = FrameCamera.from_dict(written)
    assert back.intrinsics == intrinsics
    np.testing.assert_array_equal(back.view_to_world, camera.view_to_world)
    assert back.as_dict() == camera.as_dict()
    drawn = back.lens().intrinsics((64, 48))
    assert (drawn.projection, drawn.fx) == (intrinsics.projection, pytest.approx(intrinsics.fx))


def test_copies_keep_the_matrix_read_only():
    given_matrix = np.eye(4)
    camera = FrameCamera(PINHOLE, given_matrix)
    given_matrix[3, 0] = 7
    copied = pickle.loads(pickle.dumps(camera))
    np.testing.assert_array_equal(copied.view_to_world, np.eye(4))
    for each in (camera, copied):
        with pytest.raises(ValueError, match="read-only"):
            each.view_to_world[3, 0] = 1


GOOD = camera_at(PINHOLE).as_dict()
POSES = GOOD["camera_to_world"]
ELSEWHERE = camera_at(PINHOLE, pos=(3, -4, 5.001)).as_dict()["camera_to_world"]
TURNED = camera_at(PINHOLE, hpr=(20.01, -30, 10)).as_dict()["camera_to_world"]


@pytest.mark.parametrize(
    ("values", "says"),
    [
        (None, "a camera must be a dict, got None"),
        (
            {k: v for k, v in GOOD.items() if k != "camera_to_world"},
            "a camera needs 'camera_to_world', a dict",
        ),
        ({**GOOD, "camera_to_world": {}}, "a camera needs 'camera_to_world'"),
        ({**GOOD, "camera_to_world": POSES["opencv"]}, "a camera needs 'camera_to_world'"),
        (
            {**GOOD, "camera_to_world": {"openCV": POSES["opencv"]}},
            r"'openCV' of poses \(did you mean 'opencv'",
        ),
        (
            {**GOOD, "camera_to_world": {"opengl": np.diag([2, 2, 2, 1]).tolist()}},
            "opengl pose scales or shears",
        ),
        (
            {**GOOD, "camera_to_world": POSES | {"opengl": ELSEWHERE["opengl"]}},
            "the opengl pose contradicts the",
        ),
        (
            {**GOOD, "camera_to_world": POSES | {"opencv": TURNED["opencv"]}},
            "the opencv pose contradicts the pa",
        ),
        (
            {**GOOD, "camera_to_world": POSES | {"opencv": POSES["opengl"]}},
            "the opencv pose contradicts the pa",
        ),
        ({**GOOD, "fx": -1}, "fx must be above 0"),
        ({**GOOD, "skew": 0}, "intrinsics have no key 'skew'"),
    ],
)
def test_a_wrong_dict_is_refused(values, says):
    with pytest.raises(SceneError, match=says):
        FrameCamera.from_dict(values)


def test_a_wrong_camera_is_refused():
    for arguments, says in (
        ((np.eye(3), np.eye(4)), "a FrameCamera takes Intrinsics"),
        ((PINHOLE, np.eye(3)), r"view_to_world, transposed, must have shape \(4, 4\)"),
        ((PINHOLE, np.diag([1, 1, 1, 2])), "view_to_world, transposed, .* last row must be 0, 0, 0, 1"),
    ):
        with pytest.raises(SceneError, match=says):
            FrameCamera(*arguments)
    with pytest.raises(SceneError, match=r"no convention 'opncv' of poses \(did you mean 'opencv'\?\)"):
        camera_at(PINHOLE).pose("opncv")
    with pytest.raises(SceneError, match=r"points must have shape \(\.\.\., 3\), got \(4,\)"):
        camera_at(PINHOLE).project([1, 2, 3, 4])
