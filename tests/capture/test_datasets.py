"""What all data sets have in common: what they refuse, where they write, and how."""

from __future__ import annotations

import json
import tracemalloc

import pytest

from firefly_sample.capture.datasets import DATASETS, find_dataset
from firefly_sample.capture.datasets.dataset import category_ids
from firefly_sample.errors import OutputError
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from tests.capture.entries import CAPTURE, two_frames

PNG = {"color": "png", "color_alpha": "png", "depth": "png16", "id": "png16"}
NAMES = pytest.mark.parametrize("name", DATASETS)


@NAMES
def test_a_data_set_accepts_what_it_draws_by_itself(name):
    dataset = find_dataset(name)
    usual = {"color": "png", "depth": "npz"} | dict(dataset.formats)
    dataset.check(dataset.outputs, {output: usual[output] for output in dataset.outputs})
    dataset.check_lens(PerspectiveLens())


@pytest.mark.parametrize(
    ("name", "outputs", "changes", "error"),
    [
        ("nerf", ("depth",), {}, "'nerf' needs the output 'color_alpha' or 'color'"),
        ("nerf", ("color",), {"color": "webp"}, "cannot have 'color' as webp.*choose png or jpeg"),
        ("nerf", ("color",), {"color": "exr"}, "cannot have 'color' as exr"),
        ("bop", ("depth", "color_alpha"), {}, "'bop' needs the output 'color'"),
        ("bop", ("color",), {}, "'bop' needs the output 'depth'"),
        ("bop", ("color", "depth"), {"depth": "npz"}, "cannot have 'depth' as npz.*choose png16"),
        ("coco", ("id",), {}, "'coco' needs the output 'color' or 'color_alpha'"),
        ("coco", ("color",), {"color": "exr16"}, "choose png or jpeg or webp"),
    ],
)
def test_what_readers_cannot_open_is_refused(name, outputs, changes, error):
    with pytest.raises(OutputError, match=error):
        DATASETS[name].check(outputs, PNG | changes)


def test_a_lens_without_a_matrix_is_refused():
    flat = OrthographicLens()
    for name in ("nerf", "bop"):
        with pytest.raises(OutputError, match=f"'{name}' cannot describe an orthographic lens"):
            DATASETS[name].check_lens(flat)
    DATASETS["coco"].check_lens(flat)


def test_an_unknown_name_has_a_hint():
    with pytest.raises(OutputError, match=r"no data set 'cocoa' \(did you mean 'coco'\?\): choose from nerf"):
        find_dataset("cocoa")


def test_categories_are_counted_or_count_themselves():
    def numbers(*names):
        return category_ids(names)

    assert numbers("tree", "10", "ant") == {"10": 1, "ant": 2, "tree": 3}
    assert list(numbers("10", "9", "0").items()) == [("0", 0), ("9", 9), ("10", 10)]
    assert numbers("1", "01") == {"01": 1, "1": 2}
    assert numbers("3", str(2**31 - 1)) == {"3": 3, "2147483647": 2**31 - 1}
    assert numbers("3", str(2**31)) == {"2147483648": 1, "3": 2}  # readers keep ids in int32 or int64
    assert numbers("3", "9" * 5000) == {"3": 1, "9" * 5000: 2}
    assert numbers() == {}


@NAMES
def test_documents_of_a_sweep_are_in_its_folders(name, tmp_path):
    inner = "seed=1,lights=2"
    (tmp_path / inner).mkdir()
    plain, swept = two_frames(name), two_frames(name)
    for frame in swept:
        frame["files"] = {output: f"{inner}/{path}" for output, path in frame["files"].items()}
    dataset = DATASETS[name]
    alone = dataset.write(tmp_path, CAPTURE, plain)
    assert alone == list(dataset.documents)
    paths = dataset.write(tmp_path, {**CAPTURE, "folder": inner}, swept)
    assert paths == [f"{inner}/{document}" for document in alone]
    for one, other in zip(alone, paths, strict=True):
        assert (tmp_path / one).read_bytes() == (tmp_path / other).read_bytes()


@NAMES
def test_a_capture_without_frames_has_empty_documents(name, tmp_path):
    for path in DATASETS[name].write(tmp_path, CAPTURE, []):
        content = json.loads((tmp_path / path).read_text())
        assert all(not content[key] for key in content if key in ("frames", "images", "annotations"))


@NAMES
def test_a_document_that_cannot_be_finished_changes_nothing(name, tmp_path):
    dataset = DATASETS[name]
    dataset.write(tmp_path, CAPTURE, two_frames(name))
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    damaged = two_frames(name)
    damaged[1]["index"] = float("nan")
    damaged[1]["camera"]["fx"] = float("nan")
    with pytest.raises(ValueError, match="not JSON compliant"):
        dataset.write(tmp_path, CAPTURE, damaged)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


class Many:
    """Frames that are made anew whenever they are gone through."""

    def __init__(self, name: str, count: int) -> None:
        self._frame = json.dumps(two_frames(name)[0])
        self._count = count

    def __iter__(self):
        for index in range(self._count):
            yield {**json.loads(self._frame), "index": index}


@NAMES
def test_frames_are_not_held(name, tmp_path):
    """As much memory for 400 frames as for 20, and the same bytes as from a list."""
    dataset, peaks = DATASETS[name], []
    for count in (20, 400):
        tracemalloc.start()
        paths = dataset.write(tmp_path, CAPTURE, Many(name, count))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < peaks[0] + 50_000
    streamed = [(tmp_path / path).read_bytes() for path in paths]
    dataset.write(tmp_path, CAPTURE, list(Many(name, 400)))
    assert [(tmp_path / path).read_bytes() for path in paths] == streamed
    assert sum(map(len, streamed)) > 50_000
