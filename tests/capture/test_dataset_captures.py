"""Data sets made by captures: their files against the ids, and what is left after resuming and other changes.

A parade has a cow in frame 0, an ant in frame 1, a bee in frame 2, and nothing in frame 3; a dodo is hidden.
"""

from __future__ import annotations

import json
import shutil
import sys

import numpy as np
import PIL.Image
import pytest
from pycocotools import mask as coco_masks

from firefly_sample.capture.merge import merge_capture
from firefly_sample.capture.sequence import capture_frames
from firefly_sample.capture.verify import compare_captures, verify_capture
from firefly_sample.errors import FireflyError, MissingPackageError, OutputError
from tests.capture.captures import content
from tests.capture.edits import edit
from tests.readers import read_bop, read_mask, read_nerf

PARADE = "tests.capture.scenes:parade"
SMALL = {"size": (24, 18), "fps": 1.0, "time": 0.0}
BOP_FILES = ("objects.json", "scene_camera.json", "scene_gt.json", "scene_gt_info.json")
pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")


def capture(folder, dataset="bop", frames="0:4", scene=PARADE, **options):
    return capture_frames(scene, folder, dataset=dataset, frames=frames, **{**SMALL, **options})


@pytest.fixture(scope="module")
def bop(tmp_path_factory):
    """Four frames; not to be changed."""
    folder = tmp_path_factory.mktemp("bop") / "capture"
    capture(folder, outputs=("color", "depth", "id"))
    return folder


@pytest.fixture
def copy(bop, tmp_path):
    return shutil.copytree(bop, tmp_path / "copy")


def read(folder, name):
    return json.loads((folder / name).read_text())


def ids_of(folder, frame):
    with np.load(folder / frame["files"]["id"]) as arrays:
        (ids,) = arrays.values()
    return ids


def under(names, ids, path):
    """The pixels of all that is at and below a node, by the names of ids."""
    numbers = [number for number, name in enumerate(names) if name == path or name.startswith(f"{path}/")]
    return np.isin(ids, numbers)


def test_masks_of_bop_are_the_ids(bop):
    manifest = read(bop, "manifest.json")
    assert manifest["categories"] == ["ant", "bee", "cow", "dodo"]
    assert read(bop, "objects.json") == {"1": "ant", "2": "bee", "3": "cow", "4": "dodo"}
    seen = []
    for picture, frame in zip(read_bop(bop), manifest["frames"], strict=True):
        ids = ids_of(bop, frame)
        assert [thing.number for thing in picture.things] == [3, 1, 2]
        for thing, instance in zip(picture.things, frame["instances"], strict=True):
            np.testing.assert_array_equal(thing.seen, under(manifest["id_names"], ids, instance["name"]))
            assert thing.info["px_count_visib"] == thing.seen.sum()
            assert (thing.whole | ~thing.seen).all()
        seen.append([thing.number for thing in picture.things if thing.seen.any()])
        # the post stands before the animals, and is none
        hidden = [thing for thing in picture.things if thing.whole.sum() > thing.seen.sum() > 0]
        assert len(hidden) == len(seen[-1])
        assert (ids[~np.logical_or.reduce([thing.seen for thing in picture.things])] <= 0).all()
    assert seen == [[3], [1], [2], []]


def test_masks_of_coco_are_the_ids_also_of_supersampled_pictures(bop, tmp_path):
    manifest = capture(tmp_path / "coco", "coco")
    assert manifest["settings"]["supersample"] == 2
    document = read(tmp_path / "coco", "annotations.json")
    assert [image["id"] for image in document["images"]] == [0, 1, 2, 3]
    assert [one["image_id"] for one in document["annotations"]] == [0, 1, 2]
    names = {one["id"]: one["name"] for one in document["categories"]}
    assert names == {1: "ant", 2: "bee", 3: "cow", 4: "dodo"}
    whole = read(bop, "manifest.json")
    for one in document["annotations"]:
        ids = ids_of(bop, whole["frames"][one["image_id"]])
        body = f"body of {names[one['category_id']]}"
        (path,) = (name for name in whole["id_names"] if name.endswith(body))
        expected = under(whole["id_names"], ids, path)
        np.testing.assert_array_equal(coco_masks.decode(one["segmentation"]), expected)
        assert 0 < one["area"] == expected.sum()


def test_numbers_of_categories_do_not_depend_on_which_frames_are_drawn(tmp_path):
    """Only the bee is drawn, in a sweep of which one scene has more categories than the other."""
    manifest = capture(tmp_path, frames="2:3", sweep={"more": [0, 2]})
    names = ["a0", "a1", "ant", "bee", "cow", "dodo"]
    assert manifest["categories"] == names
    for folder in ("more=0", "more=2"):
        assert read(tmp_path / folder, "objects.json") == {str(i): name for i, name in enumerate(names, 1)}
        things = read_bop(tmp_path / folder)[0].things
        assert [thing.number for thing in things if thing.seen.any()] == [4]
    assert set(manifest.captures()[0]["documents"]) == {f"more=0/{name}" for name in BOP_FILES}
    assert verify_capture(tmp_path).ok
    before = content(tmp_path)
    (tmp_path / "more=2" / "scene_gt.json").unlink()
    capture(tmp_path, frames="2:3", sweep={"more": [0, 2]}, resume=True)
    assert content(tmp_path) == before


def test_a_capture_that_goes_on_ends_as_one_that_did_not_stop(bop, tmp_path):
    outputs = ("color", "depth", "id")
    folder = tmp_path / "capture"
    capture(folder, frames="0:1", outputs=outputs)
    assert list(read(folder, "scene_gt.json")) == ["0"]
    capture(folder, frames="0:4", outputs=outputs, resume=True)
    assert content(folder) == content(bop)


def test_shards_make_the_same_data_set(bop, tmp_path):
    folder = tmp_path / "capture"
    options = {"outputs": ("color", "depth", "id")}
    for shard in ("2/2", "1/2"):
        assert not (folder / "scene_gt.json").exists()
        capture(folder, shard=shard, **options)
    assert content(folder) == content(bop)
    (folder / "manifest.json").unlink()
    for name in BOP_FILES:
        (folder / name).unlink()
    capture(tmp_path / "other", shard="1/2", **options)
    with pytest.raises(OutputError, match="frames have yet to be drawn"):
        merge_capture(tmp_path / "other")
    assert not (tmp_path / "other" / "scene_gt.json").exists()


def test_verify_finds_masks_and_documents_that_are_not_as_they_were(copy, bop):
    assert verify_capture(copy).ok
    (copy / "mask/000001_000001.png").unlink()
    PIL.Image.fromarray(np.zeros((18, 24), np.uint8)).save(copy / "mask_visib/000000_000000.png")
    with (copy / "scene_gt.json").open("a") as file:
        file.write(" ")
    (copy / "objects.json").unlink()
    shutil.copy(copy / "mask/000000_000000.png", copy / "mask/000000_000077.png")
    report = verify_capture(copy)
    assert sorted((fault.kind, fault.file.removeprefix(f"{copy}/")) for fault in report.problems) == [
        ("changed", "mask_visib/000000_000000.png"),
        ("changed", "scene_gt.json"),
        ("missing", "mask/000001_000001.png"),
        ("missing", "objects.json"),
    ]
    assert [note.kind for note in report.notes] == ["stale"]
    both = {(fault.kind, fault.output) for fault in compare_captures(bop, copy).problems}
    assert both >= {("changed", None), ("missing", None), ("missing", "mask/1"), ("changed", "mask_visib/0")}


@pytest.mark.parametrize("name", ["../scene_gt.json", "/etc/hostname", ""])
def test_verify_reads_no_document_outside_the_folder(name, copy):
    edit(copy, lambda manifest: manifest["documents"].update({name: "0" * 64}))
    (problem,) = verify_capture(copy).problems
    assert problem.kind == "damaged"
    assert problem.text.startswith(f"one of its 'documents' is damaged: {name!r} is not ")


@pytest.mark.parametrize("damaged", [{}, {"fx": "a"}])
def test_a_recorded_camera_that_is_damaged_is_one_line(damaged, copy):
    edit(copy, lambda manifest: manifest["frames"][0].update(camera=damaged))
    with pytest.raises(
        FireflyError, match=r"as data set 'bop', because .* is damaged .*: use --overwrite"
    ) as caught:
        capture(copy, outputs=("color", "depth", "id"), resume=True)
    assert "\n" not in str(caught.value)


def test_a_damaged_mask_is_drawn_again(copy, bop):
    (copy / "mask/000001_000001.png").write_bytes(b"")
    capture(copy, outputs=("color", "depth", "id"), resume=True)
    assert content(copy) == content(bop)


def test_another_data_set_leaves_nothing_of_the_one_before(copy, tmp_path, caplog):
    """Also where only some frames are asked for again, and where the capture is overwritten."""
    manifest = capture(copy, "nerf", frames="0:2", outputs=("color", "depth"), resume=True)
    assert "dataset: bop, now nerf" in caplog.text
    assert len(manifest["frames"]) == 4
    capture(tmp_path / "fresh", "nerf", outputs=("color", "depth"))
    assert content(copy) == content(tmp_path / "fresh")
    assert [path.name for path in copy.iterdir() if path.is_dir()] == []
    assert len(read_nerf(copy)) == 4
    capture(copy, None, overwrite=True)
    capture(tmp_path / "plain", None)
    assert content(copy) == content(tmp_path / "plain")


def test_masks_of_instances_that_are_gone_are_removed(tmp_path):
    """Three more animals in the first capture, which nobody sees."""
    more, fewer = tmp_path / "more", tmp_path / "fewer"
    capture(more, frames="0:2", parameters={"more": 3})
    assert len(list((more / "mask").iterdir())) == 12
    capture(more, frames="0:1", parameters={"more": 0}, resume=True)
    capture(fewer, frames="0:2")
    assert content(more) == content(fewer)


def test_documents_are_gone_while_others_are_made(copy, monkeypatch):
    """They would describe other pictures."""
    monkeypatch.setattr("firefly_sample.capture.run.write_records", None)
    with pytest.raises(TypeError):
        capture(copy, outputs=("color", "depth", "id"), time=0.25, resume=True)
    assert not [name for name in BOP_FILES if (copy / name).exists()]


def test_a_frame_that_fails_is_left_out_of_documents(tmp_path):
    with pytest.warns(UserWarning, match="the parade has stopped"):
        manifest = capture(tmp_path, "nerf", frames="0:3", parameters={"fails": 1.0})
    assert [failed["index"] for failed in manifest["failed"]] == [1]
    paths = [frame["file_path"] for frame in read(tmp_path, "transforms.json")["frames"]]
    assert paths == ["color_000000.png", "color_000002.png"]


@pytest.mark.parametrize("dataset", ["nerf", "bop"])
def test_an_orthographic_lens_is_refused_before_anything_is_drawn(dataset, tmp_path):
    with pytest.raises(OutputError, match=f"^data set '{dataset}' cannot describe an orthographic lens"):
        capture(tmp_path / "capture", dataset, parameters={"flat": True})
    assert not (tmp_path / "capture").exists()


def test_the_lenses_of_views_count(tmp_path):
    pose = {"panda3d": np.eye(4).tolist()}
    flat = {"width": 24, "height": 18, "fx": 4, "fy": 4, "cx": 12, "cy": 9, "near": 1, "far": 9}
    views = tmp_path / "views.json"
    views.write_text(
        json.dumps([{"camera_to_world": pose, "projection": kind, **flat} for kind in ("perspective",) * 2])
    )
    manifest = capture(tmp_path / "well", "nerf", frames=0, views=str(views), parameters={"flat": True})
    assert len(manifest["frames"]) == 2
    kinds = ("perspective", "orthographic")
    views.write_text(json.dumps([{"camera_to_world": pose, "projection": kind, **flat} for kind in kinds]))
    with pytest.raises(OutputError, match=r"^data set 'nerf' cannot describe an orthographic lens"):
        capture(tmp_path / "ill", "nerf", frames=0, views=str(views))
    assert not (tmp_path / "ill").exists()
    assert len(read(tmp_path / "well", "transforms.json")["frames"]) == 2


def test_a_missing_package_is_an_error_before_anything_is_drawn(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pycocotools.mask", None)
    with pytest.raises(MissingPackageError, match=r"pycocotools .*pip install"):
        capture(tmp_path / "capture", "coco")
    assert not (tmp_path / "capture").exists()


@pytest.mark.parametrize(("dataset", "name"), [("nerf", "transforms.json"), ("bop", "rgb/000003.png")])
def test_files_of_others_are_not_replaced(dataset, name, tmp_path):
    """For example the transforms.json that the views are from."""
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_text("of others")
    with pytest.raises(OutputError, match=rf"named like frames, for example {name}: use another folder"):
        capture(tmp_path, dataset)
    assert content(tmp_path) == {name: b"of others"}


def test_masks_of_every_instance_are_files(tmp_path):
    """Those that are hidden or out of sight have empty ones, because readers open one for each."""
    capture(tmp_path, frames="3")
    masks = sorted(path.name for path in (tmp_path / "mask").iterdir())
    assert masks == [f"000003_{number:06d}.png" for number in range(3)]
    assert not any(
        read_mask(tmp_path / kind / name).any() for kind in ("mask", "mask_visib") for name in masks
    )
    info = read(tmp_path, "scene_gt_info.json")["3"]
    assert [one["px_count_visib"] for one in info] == [0, 0, 0]
