"""Lenses and cameras: projections by values, and there and back to a few roundings."""

from __future__ import annotations

import math
import re

import numpy as np
import pyrender
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from firefly_sample.camera import FrameCamera
from firefly_sample.errors import LensError
from firefly_sample.interop.pyrender.bridge import from_pyrender, to_pyrender
from firefly_sample.losses import ConversionWarning
from firefly_sample.pipeline import build_plan
from firefly_sample.plan.view import camera_matrices
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Camera, Scene
from tests.interop.blocks import ANGLES, SCALE, VECTOR, U, log_floats, there_and_back

SIZE = (64, 48)
TO_Z_UP = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])


@pytest.mark.parametrize(
    "lens",
    [
        PerspectiveLens((50, 40), near=0.5, far=90),
        PerspectiveLens((50, 40), near=0.5, far=math.inf),
        PerspectiveLens((50, 40), near=0.5, far=90, film_offset=(0.3, -0.2)),
        OrthographicLens((8, 6), near=0.5, far=90),
    ],
)
def test_projection_matrices_are_the_same(lens):
    scene = Scene()
    scene.camera_node.lens = lens = lens.with_aspect_ratio(SIZE[0] / SIZE[1])
    camera = to_pyrender(scene, size=SIZE).main_camera_node.camera
    expected = (TO_Z_UP @ lens.get_projection_mat()).T
    np.testing.assert_allclose(camera.get_projection_matrix(*SIZE), expected, rtol=1e-14, atol=1e-15)


def test_pyrender_s_intrinsics_and_opengl_pose_are_those_of_a_frame():
    """pyrender's own matrix of fx, fy, cx and cy, from its picture's corner, and its pose of a camera."""
    lens = PerspectiveLens.from_intrinsics(70, 75, 20, 33, *SIZE, near=0.5, far=90)
    intrinsics = lens.intrinsics(SIZE, pixel_center=0.5)
    path = NodePath("camera")
    path.set_pos_hpr(3, -4, 5, 20, -30, 10)
    camera = FrameCamera(intrinsics, path.get_mat())
    theirs = pyrender.IntrinsicsCamera(
        intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy, intrinsics.near, intrinsics.far
    )
    points = camera.world_points(np.random.default_rng(0).uniform(1, 80, SIZE[::-1]))
    to_clip = theirs.get_projection_matrix(*SIZE) @ np.linalg.inv(camera.pose("opengl"))
    clip = np.concatenate([points, np.ones((*SIZE[::-1], 1))], axis=-1) @ to_clip.T
    ndc = clip[..., :3] / clip[..., 3:]
    rows, columns = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
    np.testing.assert_allclose((ndc[..., 0] + 1) / 2 * SIZE[0], columns, rtol=0, atol=1e-11)
    np.testing.assert_allclose((1 - ndc[..., 1]) / 2 * SIZE[1], rows, rtol=0, atol=1e-11)
    assert (np.abs(ndc[..., 2]) < 1).all()


def test_kinds_of_cameras():
    scene = Scene()
    for lens, kind in (
        (PerspectiveLens(), pyrender.PerspectiveCamera),
        (PerspectiveLens(film_offset=(0.1, 0.0)), pyrender.IntrinsicsCamera),
        (OrthographicLens(), pyrender.OrthographicCamera),
    ):
        scene.camera_node.lens = lens
        assert type(to_pyrender(scene, size=SIZE).main_camera_node.camera) is kind


def test_an_infinite_far_plane_off_centre_is_infinite_in_float32():
    scene = Scene()
    scene.camera_node.lens = lens = PerspectiveLens(
        fov=(50, 40), near=0.7, far=math.inf, film_offset=(0.1, 0.0)
    ).with_aspect_ratio(SIZE[0] / SIZE[1])
    with pytest.warns(ConversionWarning, match="no infinite far plane .*'camera'"):
        camera = to_pyrender(scene, size=SIZE).main_camera_node.camera
    got = camera.get_projection_matrix(*SIZE)[2].astype(np.float32)
    expected = (TO_Z_UP @ lens.get_projection_mat()).T[2].astype(np.float32)
    np.testing.assert_array_equal(got, expected)


def test_a_lens_takes_the_shape_of_the_picture_and_keeps_its_own_without_one():
    scene = Scene()
    scene.camera_node.lens = PerspectiveLens(fov=60)
    assert to_pyrender(scene).main_camera_node.camera.aspectRatio == pytest.approx(1.0)
    wide = to_pyrender(scene, size=(200, 50)).main_camera_node.camera
    assert wide.aspectRatio == pytest.approx(4.0)
    assert math.tan(wide.yfov / 2) == pytest.approx(math.tan(math.radians(30)) / 4.0)


@pytest.mark.parametrize("lens", [PerspectiveLens((60, 30)), OrthographicLens((3, 2))])
def test_two_numbers_take_the_shape_of_the_picture_as_when_the_renderer_draws(lens):
    scene = Scene()
    scene.root.attach_new_node(Camera("other")).node().lens = lens.make_copy()
    scene.camera_node.lens = lens
    with pytest.warns(ConversionWarning) as said:
        written = to_pyrender(scene, size=(200, 50))
    assert re.search(
        r"picture's aspect ratio: its (field|film) .* fixes .* at (2|1\.)\S*, but .* of 200x50 has 4: draw "
        r".*: 'camera', 'other'",
        " ".join(str(warning.message) for warning in said),
    )
    drawn = build_plan(scene, size=(200, 50)).view.lens
    for node in written.camera_nodes:
        got = node.camera.get_projection_matrix(200, 50)
        assert (got[0, 0], got[1, 1]) == pytest.approx((drawn.a, drawn.c), rel=1e-14)


def test_only_the_main_camera_s_intrinsics_must_fit_the_picture():
    scene = Scene()
    lens = PerspectiveLens.from_intrinsics(500, 480, 300, 200, 600, 400, pixel_center=0.5)
    scene.root.attach_new_node(Camera("kinect")).node().lens = lens
    with pytest.warns(ConversionWarning, match=r"stretched .* for pictures of 600x400 .*: 'kinect'$"):
        written = to_pyrender(scene, size=(640, 640))
    (kinect,) = (node for node in written.camera_nodes if node.name == "kinect")
    np.testing.assert_allclose(
        kinect.camera.get_projection_matrix(640, 640)[:2],
        (TO_Z_UP @ lens.get_projection_mat()).T[:2],
        rtol=1e-14,
        atol=1e-15,
    )
    scene.camera_node.lens = lens
    with pytest.raises(LensError, match="camera 'camera': its calibration for pictures of 600x400 fixes"):
        to_pyrender(scene, size=(640, 640))


def test_cameras_that_are_as_high_in_every_picture():
    """pyrender takes the viewport's shape for them, and keeps how high they see."""
    eye, board = pyrender.Scene(), pyrender.Scene()
    eye.add(pyrender.PerspectiveCamera(math.radians(40.0)))
    board.add(pyrender.OrthographicCamera(3.0, 2.0))
    for source in (eye, board):
        for size in ((640, 480), (100, 300)):
            camera = source.main_camera_node.camera
            lens = from_pyrender(source).lens.for_picture(*size)
            expected = camera.get_projection_matrix(*size)
            np.testing.assert_allclose((TO_Z_UP @ lens.get_projection_mat()).T[:2], expected[:2], rtol=1e-14)


def test_fixed_shapes_and_pixels_that_are_not_square_come_back():
    fixed, pixels = pyrender.Scene(), pyrender.Scene()
    fixed.add(pyrender.PerspectiveCamera(1.0, aspectRatio=1.5), name="eye")
    pixels.add(pyrender.IntrinsicsCamera(500.0, 480.0, 300.0, 250.0, znear=0.1, zfar=10.0), name="kinect")
    with pytest.raises(LensError, match="draw 640x427"):
        from_pyrender(fixed).lens.for_picture(640, 480)
    lens = from_pyrender(pixels, size=(640, 480)).lens.for_picture(640, 480)
    expected = pixels.main_camera_node.camera.get_projection_matrix(640, 480)
    np.testing.assert_allclose((TO_Z_UP @ lens.get_projection_mat()).T[:2], expected[:2], rtol=1e-14)


def test_an_intrinsics_camera_keeps_pixels():
    source = pyrender.Scene()
    source.add(pyrender.IntrinsicsCamera(500.0, 500.0, 300.0, 250.0, znear=0.1, zfar=10.0), name="kinect")
    lens = from_pyrender(source, size=(640, 480)).lens
    assert lens.get_film_size() == (640.0, 480.0)
    assert lens.get_focal_length() == 500.0
    assert lens.get_film_offset() == (20.0, 10.0)
    assert (lens.get_near(), lens.get_far()) == (0.1, 10.0)


def test_the_main_camera_is_the_scenes_and_others_stay():
    scene = Scene()
    other = scene.root.attach_new_node(Camera("other"))
    main = scene.root.attach_new_node("arm").attach_new_node(Camera("main"))
    scene.camera = main
    converted = to_pyrender(scene)
    assert converted.main_camera_node.name == "main"
    assert {node.name for node in converted.camera_nodes} == {"camera", "other", "main"}
    back = from_pyrender(converted)
    assert str(back.camera) == "root/arm/main"
    assert isinstance(back.root.find(f"**/{other.get_name()}").node(), Camera)


def test_a_camera_from_elsewhere_comes_along():
    rig = NodePath("rig")
    rig.set_pos(1, 2, 3)
    scene = Scene(camera=rig.attach_new_node(Camera("eye")))
    converted = to_pyrender(scene)
    pose = converted.get_pose(converted.main_camera_node)
    np.testing.assert_array_equal(pose[:3, 3], [1, 3, -2])


def test_a_scene_without_camera_gets_one():
    assert from_pyrender(pyrender.Scene()).camera.get_name() == "camera"


@pytest.mark.parametrize(
    ("camera", "message"),
    [
        (pyrender.PerspectiveCamera(4.0), "camera 'eye': .*focal length must be above 0"),
        (pyrender.PerspectiveCamera(1.0, znear=0.0), "camera 'eye': near of a perspective lens"),
        (pyrender.IntrinsicsCamera(0.0, 1.0, 2.0, 3.0), "camera 'eye': fx and fy must be above 0"),
    ],
)
def test_cameras_that_no_lens_can_be(camera, message):
    source = pyrender.Scene()
    source.add(camera, name="eye")
    with pytest.raises(LensError, match=message):
        from_pyrender(source, size=SIZE)


def test_cameras_in_pixels_want_a_size():
    scene = Scene()
    scene.camera_node.lens = PerspectiveLens(film_offset=(0.1, 0.0))
    with pytest.raises(LensError, match=r"camera 'camera': its film is off centre.* give .*size=\(width"):
        to_pyrender(scene)
    with pytest.raises(LensError, match=r"camera 'camera': it measures in pixels: give .*size=\(width"):
        from_pyrender(to_pyrender(scene, size=SIZE))


ANGLE = st.one_of(log_floats(1e-3, 90), log_floats(1e-3, 90).map(lambda angle: 180.0 - angle))
OFFSET = st.tuples(st.floats(-3, 3), st.floats(-3, 3))
SIDE = st.integers(1, 8192)


def assert_same_lens(given, got, scale_error: float = 8 * U) -> None:
    """A and C to `scale_error`; offsets to a few roundings of the picture's width; B and D exactly."""
    assert type(got) is type(given)
    a, b = given.constants(), got.constants()
    assert (b.b, b.d) == (a.b, a.d)
    np.testing.assert_allclose((b.a, b.c), (a.a, a.c), rtol=scale_error)
    for mine, its in ((a.x_offset, b.x_offset), (a.z_offset, b.z_offset)):
        assert abs(its - mine) <= 8 * U * (1.0 + abs(mine))


def lens_back(lens, size=None):
    scene = Scene()
    scene.camera_node.lens = lens
    return there_and_back(scene, size).lens


@given(ANGLE, ANGLE, log_floats(1e-6, 1e6), st.one_of(st.just(math.inf), log_floats(1.01, 1e12)))
def test_centred_lenses_come_back(horizontal, vertical, near, ratio):
    """pyrender keeps an angle; in its half's cotangent the angle's rounding is half/(sin cos) as large."""
    lens = PerspectiveLens((horizontal, vertical), near=near, far=near * ratio)
    half = math.radians(vertical) / 2
    assert_same_lens(lens, lens_back(lens), U * (16 + 8 * half / (math.sin(half) * math.cos(half))))


@given(ANGLE, log_floats(1e-6, 1e6), log_floats(1.01, 1e12), OFFSET, SIDE, SIDE)
@example(60.0, 1.0, 100.0, (0.25, 0.0), 640, 480)
def test_lenses_off_centre_come_back(vertical, near, ratio, offset, width, height):
    lens = PerspectiveLens(vfov=vertical, near=near, far=near * ratio, film_offset=offset)
    half = math.radians(vertical) / 2
    bound = 16 * U if any(offset) else U * (16 + 8 * half / (math.sin(half) * math.cos(half)))
    assert_same_lens(lens.for_picture(width, height), lens_back(lens, (width, height)), bound)


@given(log_floats(1e-3, 1e6), log_floats(1e-3, 1e6), log_floats(1e-6, 1e6), log_floats(1.01, 1e9))
def test_orthographic_lenses_come_back(width, height, near, ratio):
    lens = OrthographicLens((width, height), near=near, far=near * ratio)
    assert_same_lens(lens, lens_back(lens))


@given(OFFSET, st.floats(-100, 100), log_floats(1e-3, 1e3), VECTOR, ANGLES, arrays(np.float64, (4, 3)))
def test_orthographic_views_that_are_moved_see_the_same(offset, near, span, pos, hpr, points):
    """Off centre, or from behind the camera: another place, another lens, the same NDC and depth."""
    points = np.clip(np.nan_to_num(points), -1e3, 1e3)
    scene = Scene()
    scene.camera.set_pos_hpr(pos, hpr)
    scene.camera_node.lens = OrthographicLens((8, 6), near=near, far=near + span, film_offset=offset)
    back = there_and_back(scene)

    def seen(of: Scene) -> Float64:
        world_to_view = np.linalg.inv(of.camera.get_net_mat())
        k = of.lens.constants()
        view = points @ world_to_view[:3, :3] + world_to_view[3, :3]
        return np.stack([k.a * view[:, 0] + k.x_offset, k.c * view[:, 2] + k.z_offset, view[:, 1]], axis=1)

    moved = back.lens.get_near() - near
    np.testing.assert_allclose(seen(back) - [0, 0, moved], seen(scene), atol=1e-11)
    assert back.lens.get_far() - back.lens.get_near() == pytest.approx(span, rel=1e-12)


@given(SCALE.map(abs), SCALE.map(abs), VECTOR, ANGLES, ANGLES)
def test_a_scaled_camera_looks_as_the_renderer_has_it(x, z, pos, hpr, above):
    """Without its scale and shear: forward stays, right and up are made perpendicular to it."""
    scene = Scene()
    arm = scene.root.attach_new_node("arm")
    arm.set_hpr(above)
    arm.set_scale(x, 1.0, z)
    scene.camera.reparent_to(arm)
    scene.camera.set_pos_hpr(pos, hpr)
    converted = to_pyrender(scene)
    expected = camera_matrices(scene).view_to_world
    got = camera_matrices(from_pyrender(converted)).view_to_world
    np.testing.assert_allclose(got, expected, rtol=1e-11, atol=1e-11)
    pose = converted.get_pose(converted.main_camera_node)[:3, :3]
    np.testing.assert_allclose(pose.T @ pose, np.eye(3), atol=1e-11)
