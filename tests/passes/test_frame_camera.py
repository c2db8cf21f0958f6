"""Points of the world from nothing but a frame's camera, as JSON, and its depth, against `position_world`.

Depth is rounded to float32, which moves a point along its ray by at most 2^-24 of its distance from the eye;
`position_world` is rounded to float32 itself. Both together are the bound, for a float64 formula written out.
"""

from __future__ import annotations

import json
import math
import pickle

import numpy as np
import pytest

from firefly_sample import FrameCamera, OrthographicLens, PerspectiveLens, Settings
from firefly_sample.scenes import build_scene, find_scene
from tests.conftest import borrow_renderer
from tests.scenes import ball_scene

U32 = 2.0**-24
SIZE = (64, 48)


def points_of(camera: dict, depth: np.ndarray, convention: str) -> np.ndarray:
    """World points from a camera's JSON: the formulas of the page on lenses, by hand."""
    rows, columns = np.mgrid[: camera["height"], : camera["width"]] + camera["pixel_center"]
    right = (columns - camera["cx"]) / camera["fx"]
    down = (rows - camera["cy"]) / camera["fy"]
    if camera["projection"] == "perspective":
        right, down = right * depth, down * depth
    axes = {
        "opencv": (right, down, depth),
        "opengl": (right, -down, -depth),
        "panda3d": (right, depth, -down),
    }[convention]
    points = np.stack([*axes, np.ones_like(depth)], axis=-1)
    return (points @ np.array(camera["camera_to_world"][convention]).T)[..., :3]


def forest():
    return build_scene(find_scene("forest"), fireflies=3)


def off_centre():
    scene = ball_scene(lights=3)
    scene.camera.node().lens = PerspectiveLens.from_intrinsics(70, 75, 20, 33, *SIZE, 0.5, math.inf)
    return scene


def orthographic():
    scene = ball_scene(lights=3)
    scene.camera.node().lens = OrthographicLens((12, 9.5), film_offset=(1, -0.5), near=-5, far=60)
    return scene


def scaled_parents():
    """A camera below a stretched and turned node: scale and shear do not reach the picture."""
    scene = ball_scene(lights=3)
    rig = scene.root.attach_new_node("rig")
    rig.set_scale(0.5, 2, 3)
    rig.set_hpr(10, 5, -20)
    scene.camera.wrt_reparent_to(rig)
    scene.camera.set_hpr(4, -10, 30)
    return scene


CASES = {
    "forest": (forest, Settings()),
    "off-centre, infinite far": (off_centre, Settings()),
    "off-centre, reversed depth": (off_centre, Settings(position_method="depth32f")),
    "off-centre, standard depth": (off_centre, Settings(position_method="depth24")),
    "orthographic": (orthographic, Settings()),
    "scaled parents": (scaled_parents, Settings()),
}


@pytest.mark.parametrize("case", CASES)
def test_points_from_camera_and_depth_are_position_world(case):
    build, settings = CASES[case]
    scene = build()
    with borrow_renderer(SIZE, settings) as renderer:
        frame = renderer.render(scene, 0.0, ("depth", "position_world"))
    camera, expected = frame.camera, frame.position_world
    assert camera.intrinsics == scene.lens.intrinsics(SIZE)
    drawn = np.isfinite(frame.depth)
    assert drawn.sum() > 300
    eye = np.array(camera.pose("opencv"))[:3, 3]
    assert eye == pytest.approx(scene.camera.get_net_transform().get_pos(), rel=1e-14)
    distance = np.linalg.norm(expected - eye, axis=-1, keepdims=True)
    bound = (1.01 * U32 * (distance + np.abs(expected)))[drawn]
    stored = json.loads(json.dumps(camera.as_dict()))
    depth = np.where(drawn, frame.depth, np.nan).astype(np.float64)
    for found in (
        *(points_of(stored, depth, name) for name in ("panda3d", "opengl", "opencv")),
        FrameCamera.from_dict(stored).world_points(frame.depth),
        camera.world_points(frame.depth),
    ):
        assert (np.abs(found - expected)[drawn] <= bound).all()
        assert np.isnan(found[~drawn]).all()
    # and the pixel of each point is its own; a point moves by less than a thousandth of one
    u, v, forward = camera.project(expected[drawn])
    rows, columns = np.nonzero(drawn)
    np.testing.assert_allclose(u, columns, rtol=0, atol=1e-3)
    np.testing.assert_allclose(v, rows, rtol=0, atol=1e-3)
    np.testing.assert_allclose(forward, frame.depth[drawn], rtol=0, atol=bound.max())


def test_a_supersampled_picture_has_the_same_camera():
    scene = off_centre()
    with borrow_renderer(SIZE, Settings(supersample=2)) as renderer:
        twice = renderer.render(scene)
    with borrow_renderer(SIZE) as renderer:
        once = renderer.render(scene)
    assert twice.color.shape == once.color.shape
    assert twice.camera.as_dict() == once.camera.as_dict()


def test_a_pickled_frame_has_its_images_and_its_camera():
    with borrow_renderer(SIZE) as renderer:
        frame = renderer.render(off_centre(), 0.0, ("color", "depth"))
    copied = pickle.loads(pickle.dumps(frame))
    assert copied.camera.as_dict() == frame.camera.as_dict()
    np.testing.assert_array_equal(copied.color, frame.color)
    np.testing.assert_array_equal(
        copied.camera.world_points(copied.depth), frame.camera.world_points(frame.depth)
    )
