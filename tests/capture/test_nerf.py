"""NeRF's documents, read as nerfstudio and instant-ngp read them."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from firefly_sample.capture.datasets import DATASETS
from tests.capture.entries import (
    CAPTURE,
    LOOKS_ALONG_MINUS_X,
    LOOKS_ALONG_Y,
    camera,
    entry,
    put_files,
    two_frames,
)
from tests.readers import read_nerf

NERF = DATASETS["nerf"]


def written(folder, frames, **capture):
    assert NERF.write(folder, {**CAPTURE, **capture}, frames) == ["transforms.json"]
    return json.loads((folder / "transforms.json").read_text())


def test_points_in_the_world_follow_from_the_files(tmp_path):
    """Of pixel (7, 1), 4 units away: 3.5 units to the right and 0.8 up."""
    frames = two_frames("nerf")
    put_files(tmp_path, frames)
    written(tmp_path, frames)
    first, second = read_nerf(tmp_path)
    assert [first.path.name, second.path.name] == ["color_000004.png", "color_000007.png"]
    assert (first.pixels == 4).all()
    np.testing.assert_array_equal(first.camera_to_world, LOOKS_ALONG_Y)
    np.testing.assert_array_equal(second.camera_to_world, LOOKS_ALONG_MINUS_X)
    np.testing.assert_allclose(first.world_points()[1, 7], (1 + 3.5, -2 + 4, 3 + 0.8), rtol=1e-12)
    np.testing.assert_allclose(second.world_points()[1, 7], (5 - 4, 3.5, 3 + 0.8), rtol=1e-12)
    assert np.isnan(first.depth).sum() == 1
    assert np.isnan(first.depth[2, 5])


def test_intrinsics_count_from_the_corner(tmp_path):
    content = written(tmp_path, two_frames("nerf"))
    assert [content[name] for name in ("fl_x", "fl_y", "cx", "cy", "w", "h")] == [4, 5, 4, 2.5, 8, 6]
    assert content["camera_angle_x"] == pytest.approx(math.pi / 2)
    assert math.tan(content["camera_angle_y"] / 2) * 5 == pytest.approx(3)
    assert content["integer_depth_scale"] == 0.002
    assert content["aabb_scale"] in {1, 2, 4, 8, 16, 32, 64, 128}
    assert set(content["frames"][0]) == {"file_path", "depth_file_path", "depth_path", "transform_matrix"}


def test_intrinsics_that_differ_are_each_frames_own(tmp_path):
    """None may be left at the top: nerfstudio would take it for that of all frames."""
    frames = two_frames("nerf")
    frames[1]["camera"] = camera(fx=7.0, cx=1.0)
    content = written(tmp_path, frames)
    names = {"fl_x", "fl_y", "cx", "cy", "w", "h", "camera_angle_x", "camera_angle_y"}
    assert not names & set(content)
    assert [[frame[name] for name in ("fl_x", "cx", "w")] for frame in content["frames"]] == [
        [4, 4, 8],
        [7, 1.5, 8],
    ]
    put_files(tmp_path, frames)
    assert [picture.k[0, 0] for picture in read_nerf(tmp_path)] == [4, 7]


def test_times_run_from_0_to_1_if_there_are_several(tmp_path):
    """Three moments, each seen by two cameras."""
    layout, outputs = NERF.layout, {"color": ".png"}
    frames = [
        entry(index, layout, outputs, time=10.0 + index // 2 * 0.25, view=index % 2) for index in range(6)
    ]
    put_files(tmp_path, frames)
    written(tmp_path, frames, formats={"color": "png"}, depth_scale=None)
    assert [picture.time for picture in read_nerf(tmp_path)] == [0, 0, 0.5, 0.5, 1, 1]
    assert all("time" not in frame for frame in written(tmp_path, frames[:2], formats={})["frames"])


def test_only_files_that_readers_open_are_named(tmp_path):
    """The picture with alpha before the one without, and depth only as PNG."""
    frame = entry(0, NERF.layout, {"color": ".png", "color_alpha": ".png", "depth": ".npz"})
    content = written(tmp_path, [frame], formats={"color": "png", "color_alpha": "png", "depth": "npz"})
    assert content["frames"][0]["file_path"] == "color_alpha_000000.png"
    assert not {"depth_path", "depth_file_path"} & set(content["frames"][0])
    assert "integer_depth_scale" not in content


def looking(position, forward):
    """A camera with the axes right, down, forward; its right is level."""
    forward = np.array(forward) / np.linalg.norm(forward)
    right = np.cross(forward, (0, 0, 1))
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(forward, right), forward, position], axis=1)
    return pose.tolist()


def cube(folder, poses):
    frames = [entry(i, NERF.layout, {"color": ".png"}, camera=camera(pose)) for i, pose in enumerate(poses)]
    content = written(folder, frames, formats={"color": "png"})
    return content["scale"], content["offset"]


def test_what_cameras_look_at_is_in_the_middle_of_the_unit_cube(tmp_path):
    """Cameras 4 units around a point: the distance of the first NeRF scenes, whose scale is 0.33."""
    angles = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    away = np.stack([np.cos(angles) * 0.8, np.sin(angles) * 0.8, np.full(12, 0.6)], axis=1)
    centre = np.array([1000.0, -20.0, 30.0])
    scale, offset = cube(tmp_path, [looking(centre + 4 * one, -one) for one in away])
    assert scale == 0.33
    np.testing.assert_allclose(centre * scale + offset, 0.5, atol=1e-3)


def test_cameras_side_by_side_are_around_the_middle_themselves(tmp_path):
    """Two at a distance of 2 that look the same way: each is 1 unit from their mean."""
    scale, offset = cube(tmp_path, [looking((0, 0, 1), (0, 1, 0)), looking((2, 0, 1), (0, 1, 0))])
    assert scale == 1.32
    np.testing.assert_allclose(offset, (0.5 - 1.32, 0.5, 0.5 - 1.32), rtol=1e-5)


def test_a_camera_that_turns_in_one_place_keeps_the_usual_scale(tmp_path):
    turns = [(1, 0, 0), (0, 1, 0), (1, 1, 0.5)]
    scale, offset = cube(tmp_path, [looking((3, 0, 0), turn) for turn in turns])
    assert scale == 0.33
    np.testing.assert_allclose(offset, (0.5 - 0.99, 0.5, 0.5), rtol=1e-5)
