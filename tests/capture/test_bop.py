"""BOP's documents, read by a reader written from the description of the format."""

from __future__ import annotations

import json

import numpy as np

from firefly_sample.capture.datasets import DATASETS
from tests.capture.entries import CAPTURE, block, instance, put_files, put_masks, two_frames
from tests.readers import read_bop

BOP = DATASETS["bop"]


def read(folder, frames, **changes):
    put_files(folder, frames)
    put_masks(folder, frames, BOP.layout)
    BOP.write(folder, {**CAPTURE, **changes}, frames)
    return read_bop(folder)


def test_points_in_the_world_follow_from_the_files(tmp_path):
    """Of pixel (7, 1), 4 units away: 3.5 units to the right and 0.8 up. A unit is a metre."""
    first, second = read(tmp_path, two_frames("bop"))
    assert first.path == tmp_path / "rgb/000004.png"
    np.testing.assert_allclose(first.world_points()[1, 7], (1 + 3.5, -2 + 4, 3 + 0.8), rtol=1e-12)
    np.testing.assert_allclose(second.world_points()[1, 7], (5 - 4, 3.5, 3 + 0.8), rtol=1e-12)
    assert np.isnan(first.depth[2, 5])
    np.testing.assert_array_equal(first.k, [[4, 0, 3.5], [0, 5, 2], [0, 0, 1]])


def test_instances_have_their_poses_numbers_and_masks(tmp_path):
    first, second = read(tmp_path, two_frames("bop"))
    assert json.loads((tmp_path / "objects.json").read_text()) == {"1": "box", "2": "cup"}
    assert [thing.number for thing in first.things] == [2, 1]
    assert [thing.number for thing in second.things] == [1, 2]
    for thing in (*first.things, *second.things):
        np.testing.assert_allclose(
            thing.pose, [[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 1.5], [0, 0, 0, 1]], rtol=1e-12
        )
        np.testing.assert_array_equal(thing.whole, block(0, 1, 3, 4))
    np.testing.assert_array_equal(first.things[1].seen, block(6, 3, 2, 3))
    assert not second.things[0].seen.any()


def test_pixels_are_counted(tmp_path):
    """A cup of which 5 of 20 pixels are seen and 12 would be in the picture, and a box out of sight."""
    first, second = read(tmp_path, two_frames("bop"))
    assert first.things[0].info == {
        "bbox_obj": [-2, 1, 5, 4],
        "bbox_visib": [0, 1, 5, 1],
        "px_count_all": 20,
        "px_count_valid": 12,
        "px_count_visib": 5,
        "visib_fract": 0.25,
    }
    assert second.things[0].info == {
        "bbox_obj": [-1, -1, -1, -1],
        "bbox_visib": [-1, -1, -1, -1],
        "px_count_all": 20,
        "px_count_valid": 12,
        "px_count_visib": 0,
        "visib_fract": 0.0,
    }


def test_lengths_are_millimetres(tmp_path):
    BOP.write(tmp_path, CAPTURE, two_frames("bop"))
    camera = json.loads((tmp_path / "scene_camera.json").read_text())["4"]
    # the world's origin is 1 to the left, 3 down and 2 in front of the camera
    assert camera["cam_t_w2c"] == [-1000, 3000, 2000]
    assert camera["cam_R_w2c"] == [1, 0, 0, 0, 0, -1, 0, 1, 0]
    assert camera["depth_scale"] == 2
    assert json.loads((tmp_path / "scene_gt.json").read_text())["4"][0]["cam_t_m2c"] == [100, 200, 1500]


def test_a_size_other_than_the_models_is_told(tmp_path):
    stretch = [[2.0, 0, 0], [0, 1, 0], [0, 0, 1]]
    larger = instance("cup", block(0, 0, 1, 1), [0, 0, 1, 1], scale=1.26, stretch=stretch)
    frames = two_frames("bop")
    frames[0]["instances"].append(larger)
    BOP.write(tmp_path, CAPTURE, frames)
    plain, _, scaled = json.loads((tmp_path / "scene_gt.json").read_text())["4"]
    assert set(plain) == {"cam_R_m2c", "cam_t_m2c", "obj_id"}
    assert (scaled["scale"], scaled["stretch"]) == (1.26, [2, 0, 0, 0, 1, 0, 0, 0, 1])


def test_categories_that_are_numbers_are_the_objects_numbers(tmp_path):
    frames = two_frames("bop")
    for frame in frames:
        for each in frame["instances"]:
            each["category"] = {"cup": "21", "box": "5"}[each["category"]]
    first, _ = read(tmp_path, frames, categories=["21", "30", "5"])
    assert [thing.number for thing in first.things] == [21, 5]


def test_a_frame_without_instances_has_an_empty_list(tmp_path):
    frames = two_frames("bop")
    frames[1]["instances"] = []
    assert [len(picture.things) for picture in read(tmp_path, frames)] == [2, 0]
