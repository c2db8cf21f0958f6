"""BOP's files against rays, and data sets by every way of drawing; for those who change them.

It takes minutes: ``python -m pytest tests/capture/long_datasets.py``.
"""

from __future__ import annotations

import importlib.util
import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from firefly_sample.capture.merge import merge_capture
from firefly_sample.capture.sequence import capture_frames
from firefly_sample.capture.verify import verify_capture
from tests.capture.captures import content
from tests.capture.objects import crowd, rays, sure_hits, sure_owner
from tests.capture.scenes import CROWD_COUNT, CROWD_SIZE
from tests.cli.command import ROOT, environment
from tests.readers import read_bop, read_nerf

CROWDED, PARADE = "tests.capture.scenes:crowded", "tests.capture.scenes:parade"
SMALL = {"size": (48, 36), "fps": 2.0, "time": 0.0, "frames": "0:6", "views": "orbit:4"}
WAYS = ("nerf", "bop", "coco")


@pytest.fixture(scope="module", params=WAYS)
def undisturbed(request, tmp_path_factory):
    """24 frames of a data set, and its name."""
    folder = tmp_path_factory.mktemp(request.param) / "capture"
    capture_frames(PARADE, folder, dataset=request.param, **SMALL)
    return folder, request.param


def test_workers_draw_the_same(undisturbed, tmp_path):
    folder, dataset = undisturbed
    capture_frames(PARADE, tmp_path, dataset=dataset, workers=2, **SMALL)
    assert content(tmp_path) == content(folder)


@pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="dask is not installed")
def test_a_cluster_draws_the_same(undisturbed, tmp_path):
    folder, dataset = undisturbed
    capture_frames(PARADE, tmp_path, dataset=dataset, cluster="local", workers=2, **SMALL)
    assert content(tmp_path) == content(folder)


def test_shards_that_are_merged_are_the_same(undisturbed, tmp_path, monkeypatch):
    folder, dataset = undisturbed
    with monkeypatch.context() as patch:
        patch.setattr("firefly_sample.capture.run.write_records", None)
        capture_frames(PARADE, tmp_path, dataset=dataset, shard="1/2", **SMALL)
        with pytest.raises(TypeError):
            capture_frames(PARADE, tmp_path, dataset=dataset, shard="2/2", **SMALL)
    assert not (tmp_path / "manifest.json").exists()
    merge_capture(tmp_path)
    assert content(tmp_path) == content(folder)


@pytest.mark.parametrize("workers", [1, 2])
def test_a_killed_capture_ends_as_one_that_was_not(undisturbed, workers, tmp_path):
    folder, dataset = undisturbed
    out = tmp_path / "capture"
    words = [*("--size", "48x36", "--fps", "2", "--time", "0", "--frames", "0:6", "--views", "orbit:4")]
    command = [sys.executable, "-m", "firefly_sample", "capture", PARADE, *words]
    command += ["--dataset", dataset, "--workers", str(workers), "-o", str(out)]
    process = subprocess.Popen(
        command, cwd=ROOT, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    end = time.monotonic() + 60
    while len(list(out.rglob("*_00000[0-9].*" if dataset != "bop" else "rgb/*.png"))) < 4:
        assert time.monotonic() < end
        time.sleep(0.005)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert not (out / "manifest.json").exists()
    capture_frames(PARADE, out, dataset=dataset, resume=True, **SMALL)
    assert content(out) == content(folder)
    assert verify_capture(out).ok


def test_files_of_bop_are_what_rays_meet(tmp_path):
    """Masks, counts, shares and boxes of two lenses; rays a hair beside a centre tell which are certain."""
    capture_frames(
        *(CROWDED, tmp_path),
        size=CROWD_SIZE,
        time=0.0,
        dataset="bop",
        sweep={"seed": [0, 1]},
        settings=None,
    )
    width, height = CROWD_SIZE
    inside = np.s_[height : 2 * height, width : 2 * width]
    partly = outside = unseen = 0
    for seed in (0, 1):
        _, meshes, to_pixels = crowd(seed, CROWD_SIZE, CROWD_COUNT)
        (picture,) = read_bop(tmp_path / f"seed={seed}")
        assert len(picture.things) == CROWD_COUNT
        numbers = json.loads((tmp_path / f"seed={seed}" / "objects.json").read_text())
        owner, sure_of_owner = (
            each.reshape(height, width) for each in sure_owner(meshes, *rays(to_pixels, CROWD_SIZE))
        )
        canvas = rays(to_pixels, CROWD_SIZE, tiles=1)
        for number, (mesh, thing) in enumerate(zip(meshes, picture.things, strict=True)):
            assert numbers[str(thing.number)] == ("round" if number % 2 else "square")
            met, sure = (each.reshape(3 * height, 3 * width) for each in sure_hits(mesh, *canvas))
            seen, info = owner == number, thing.info
            np.testing.assert_array_equal(thing.seen[sure_of_owner], seen[sure_of_owner])
            np.testing.assert_array_equal(thing.whole[sure[inside]], met[inside][sure[inside]])
            doubtful = int((~sure).sum())
            certain = int((met & sure).sum())
            assert certain <= info["px_count_all"] <= certain + doubtful
            assert info["px_count_valid"] == thing.whole.sum()
            assert info["px_count_visib"] == thing.seen.sum()
            expected = thing.seen.sum() / info["px_count_all"] if thing.seen.any() else 0.0
            assert info["visib_fract"] == pytest.approx(expected, rel=1e-15)
            boxes = info["bbox_obj"], info["bbox_visib"]
            if not thing.seen.any():
                assert boxes == ([-1] * 4, [-1] * 4)
                unseen += 1
                continue
            for box, mask, corner in zip(boxes, (met, seen), ((width, height), (0, 0)), strict=True):
                rows, columns = np.nonzero(mask)
                left, top = columns.min() - corner[0], rows.min() - corner[1]
                assert np.abs(np.subtract(box, (left, top, np.ptp(columns), np.ptp(rows)))).max() <= 1
            partly += thing.seen.sum() < thing.whole.sum()
            outside += info["px_count_valid"] < info["px_count_all"]
    assert partly > 2
    assert outside > 2


@pytest.mark.parametrize(("dataset", "read"), [("nerf", read_nerf), ("bop", read_bop)])
def test_points_of_the_forest_come_back_from_the_files(tmp_path, dataset, read):
    """Within half a code along the view axis, and float32's rounding of the positions."""
    manifest = capture_frames(
        "forest",
        tmp_path,
        size=(96, 72),
        outputs=("color", "depth", "position_world"),
        dataset=dataset,
        depth_scale=0.01,
        views="orbit:2",
    )
    for picture, entry in zip(read(tmp_path), manifest["frames"], strict=True):
        path = tmp_path / entry["files"]["position_world"]
        position = np.load(path)["position_world"].astype(np.float64)
        points, drawn = picture.world_points(), np.isfinite(position).all(axis=-1)
        assert (np.isfinite(points).all(axis=-1) == drawn).all()
        ray = (position - picture.camera_to_world[:3, 3])[drawn]
        depth = ray @ picture.camera_to_world[:3, 2]
        bound = 0.005 * np.linalg.norm(ray, axis=-1) / depth
        rounding = 2.0**-22 * (np.abs(position[drawn]).max(axis=-1) + depth)
        error = np.linalg.norm(points[drawn] - position[drawn], axis=-1)
        assert (error <= bound + rounding).all()
        assert error.max() > 0.9 * 0.005
