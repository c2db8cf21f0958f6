"""COCO's annotations, read and evaluated by pycocotools."""

from __future__ import annotations

import numpy as np
import pytest
from pycocotools import mask as coco_masks
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

from firefly_sample.capture.datasets import DATASETS
from tests.capture.entries import CAPTURE, block, two_frames

pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")
"""pycocotools has not caught up with NumPy 2."""


@pytest.fixture
def read(tmp_path):
    frames = two_frames("coco")
    for frame in frames:
        for each in frame["instances"]:
            each.pop("whole")
    assert DATASETS["coco"].write(tmp_path, CAPTURE, frames) == ["annotations.json"]
    return COCO(str(tmp_path / "annotations.json"))


def test_images_are_the_frames(read):
    assert read.loadImgs(read.getImgIds()) == [
        {"id": 4, "file_name": "color_000004.png", "width": 8, "height": 6},
        {"id": 7, "file_name": "color_000007.png", "width": 8, "height": 6},
    ]


def test_categories_are_counted_from_1_by_name(read):
    assert read.loadCats(read.getCatIds()) == [
        {"id": 1, "name": "box", "supercategory": ""},
        {"id": 2, "name": "cup", "supercategory": ""},
    ]
    assert read.getImgIds(catIds=read.getCatIds(["box"])) == [4]


def test_masks_are_the_pixels_that_are_seen(read):
    """An instance that is out of sight in frame 7 has no annotation there."""
    cup, box = read.loadAnns(read.getAnnIds(imgIds=[4]))
    (only,) = read.loadAnns(read.getAnnIds(imgIds=[7]))
    assert [cup["id"], box["id"], only["id"]] == [1, 2, 3]
    assert only["category_id"] == cup["category_id"]
    for annotation, mask in ((cup, block(0, 1, 5, 1)), (box, block(6, 3, 2, 3)), (only, block(0, 1, 5, 1))):
        np.testing.assert_array_equal(read.annToMask(annotation), mask)
        assert annotation["area"] == coco_masks.area(annotation["segmentation"]) == mask.sum()
        assert annotation["bbox"] == coco_masks.toBbox(annotation["segmentation"]).tolist()
        assert annotation["iscrowd"] == 0


@pytest.mark.parametrize("kind", ["segm", "bbox"])
def test_the_truth_has_a_perfect_score(read, kind):
    results = [{**annotation, "score": 0.9} for annotation in read.loadAnns(read.getAnnIds())]
    evaluation = COCOeval(read, read.loadRes(results), kind)
    evaluation.evaluate()
    evaluation.accumulate()
    evaluation.summarize()
    assert evaluation.stats[0] == 1.0


def test_there_is_no_date(read):
    assert read.dataset["info"] == {"description": "captured by firefly_sample 1.2"}
    assert read.dataset["licenses"] == []
