"""The manifest: written frame by frame, read lazily, and read as well after other programs formatted it."""

from __future__ import annotations

import json
import os

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.capture.closing import write_records
from firefly_sample.capture.journal import Journal
from firefly_sample.capture.manifest import FrameLines, read_manifest, write_manifest
from firefly_sample.capture.records import Records
from firefly_sample.errors import FireflyError
from tests.capture.described import description_of, failed_of, frame_of

ASKED = {"frames": (0, 9, 1), "jobs": 1, "shard": ""}
FORMATS = {
    "jq": {"indent": 2},
    "json.dump": {},
    "compact": {"separators": (",", ":")},
    "wide": {"indent": 4},
    "tabs": {"indent": "\t"},
    "sorted": {"indent": 2, "sort_keys": True},
}


def write(folder, *added):
    """Write the manifest of (description, frame) pairs."""
    path = folder / "journal.jsonl"
    with Records([], []) as records, Journal(path, 1, ASKED) as journal:
        descriptions = {}
        for description, frame in added:
            records.add(journal, description, frame)
            descriptions[description["folder"]] = description
        write_records(folder, records, list(descriptions.values()))
    path.unlink()
    return read_manifest(folder)


def plain(folder, count=3):
    return write(folder, *((description_of(), frame_of(index)) for index in range(count)))


def sweep(folder):
    jobs = [
        description_of(folder=f"fireflies={n}", values={"fireflies": n}, parameters={"fireflies": n})
        for n in (1, 2)
    ]
    return write(
        folder,
        *((job, frame_of(index, folder=job["folder"])) for job in jobs for index in range(2)),
        (jobs[1], failed_of(2)),
    )


@pytest.mark.parametrize("make", [plain, sweep])
def test_it_is_the_json_in_the_file(tmp_path, make):
    manifest = make(tmp_path)
    text = (tmp_path / "manifest.json").read_text()
    assert json.loads(text) == manifest.as_dict()
    assert manifest == json.loads(text) == manifest
    assert list(manifest) == list(json.loads(text))
    assert read_manifest(tmp_path / "manifest.json") == manifest
    assert json.loads(json.dumps(manifest.as_dict())) == manifest
    assert text.endswith("\n")
    assert max(map(len, text.splitlines())) < 700


def test_members_of_a_plain_capture(tmp_path):
    first, *_ = manifest = plain(tmp_path)["frames"]
    assert first == {name: value for name, value in frame_of(0).items() if name != "about"}
    assert manifest[-1]["index"] == 2
    assert [frame["index"] for frame in manifest[::-2]] == [2, 0]
    assert len(manifest) == 3
    with pytest.raises(IndexError):
        manifest[3]
    whole = read_manifest(tmp_path)
    (only,) = whole.captures()
    assert only == {"folder": "", "values": {}, **whole}
    assert whole["failed"] == []
    with pytest.raises(KeyError):
        whole["sweep"]


def test_members_of_a_sweep(tmp_path):
    manifest = sweep(tmp_path)
    assert manifest["sweep"] == {"fireflies": [1, 2]}
    for number, capture in enumerate(manifest.captures(), 1):
        assert (capture["folder"], capture["values"]) == (f"fireflies={number}", {"fireflies": number})
        assert capture["parameters"] == {"fireflies": number}
        assert capture["size"] == [8, 6]
        assert [frame["index"] for frame in capture["frames"]] == [0, 1]
        assert capture["failed"] == ([failed_of(2)] if number == 2 else [])
        assert {"captures", "sweep"}.isdisjoint(capture)


@pytest.mark.parametrize("make", [plain, sweep])
@pytest.mark.parametrize("style", FORMATS)
def test_one_that_another_program_has_formatted_is_read_and_gone_on_with(tmp_path, make, style):
    manifest = make(tmp_path).as_dict()
    path = tmp_path / "manifest.json"
    with Records([path], []) as records:
        before = {
            (folder, index): records.frame(folder, index)
            for folder in records.folders()
            for index in records.indices(folder)
        }
    path.write_text(json.dumps(manifest, **FORMATS[style]))
    again = read_manifest(tmp_path)
    assert again == manifest
    with Records([path], []) as records:
        assert records.folders() == list(dict.fromkeys(folder for folder, _ in before))
        for (folder, index), frame in before.items():
            assert records.frame(folder, index) == frame


@pytest.mark.parametrize("make", [plain, sweep])
def test_line_ends_of_another_system_change_nothing(tmp_path, make):
    manifest = make(tmp_path).as_dict()
    path = tmp_path / "manifest.json"
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert read_manifest(tmp_path) == manifest
    assert isinstance(read_manifest(tmp_path).captures()[0]["frames"], FrameLines)


def test_records_keep_the_failed_frames_of_a_manifest(tmp_path):
    write(tmp_path, (description_of(), frame_of(0)), (description_of(), failed_of(1)))
    with Records([tmp_path / "manifest.json"], []) as records:
        assert list(records.indices("")) == [0, 1]
        key = records.frame("", 0)["about"]
        assert records.frame("", 1) == failed_of(1) | {"about": key}
        with Journal(tmp_path / "journal.jsonl", 1, ASKED) as journal:
            records.add(journal, description_of(), frame_of(1))
        assert "error" not in records.frame("", 1)


def test_a_parameter_called_frames_can_be_swept(tmp_path):
    jobs = [description_of(folder=f"frames={n}", values={"frames": n}) for n in (1, 2)]
    manifest = write(tmp_path, *((job, frame_of(0, folder=job["folder"])) for job in jobs))
    assert manifest["sweep"] == {"frames": [1, 2]}
    assert [len(capture["frames"]) for capture in manifest["captures"]] == [1, 1]


def test_captures_without_a_whole_frame(tmp_path):
    jobs = [description_of(folder=f"a={n}", values={"a": n}) for n in (1, 2)]
    manifest = write(tmp_path, (jobs[0], failed_of(0)), (jobs[1], frame_of(0, folder="a=2")))
    assert [len(capture["frames"]) for capture in manifest["captures"]] == [0, 1]
    manifest = write(tmp_path, *((job, failed_of(0)) for job in jobs))
    assert [list(capture["frames"]) for capture in manifest["captures"]] == [[], []]


def test_frames_are_read_when_they_are_asked_for(tmp_path):
    manifest = plain(tmp_path, 50)
    assert isinstance(manifest["frames"], FrameLines)
    assert manifest["frames"].offsets.itemsize == 8
    assert [frame["index"] for frame in manifest["frames"]] == list(range(50))
    plain(tmp_path, 49)  # another one takes its place
    for read in (lambda: manifest["frames"][3], lambda: list(manifest["frames"]), manifest.as_dict):
        with pytest.raises(FireflyError, match=r"^\S+manifest\.json has changed since it was read"):
            read()
    (tmp_path / "manifest.json").unlink()
    with pytest.raises(FireflyError, match=r"^cannot read \S+manifest\.json: No such file"):
        manifest["frames"][0]


def test_manifests_are_equal_by_what_they_say(tmp_path):
    folders = [tmp_path / name for name in "abc"]
    for folder in folders:
        folder.mkdir()
    one, same, other = plain(folders[0]), plain(folders[1]), plain(folders[2], 2)
    assert one == same
    assert one["frames"] == same["frames"]
    assert one != other
    assert one != other.as_dict()
    assert one["frames"] != other["frames"]
    with pytest.raises(TypeError):
        hash(one)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"[]",
        b"3",
        b"{}",
        b'{"frames": ',
        b"\xff\xfe",
        b"\0" * 100,
        b'{"captures": 3}',
        b'{"captures": [1]}',
        b'{"captures": [{}]}',
        b'{"captures": ["frames"]}',
        b"[" * 50_000,
        b'{\n  "frames": [\n{"index": 1}\n',
    ],
)
def test_what_is_no_manifest_is_one_line(tmp_path, content):
    (tmp_path / "manifest.json").write_bytes(content)
    for read in (lambda: read_manifest(tmp_path), lambda: Records([tmp_path / "manifest.json"], [])):
        with pytest.raises(FireflyError, match=r"^\S+manifest\.json is not a manifest: .+$") as caught:
            read()
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "change",
    [
        {"frames": 3},
        {"frames": [3]},
        {"frames": [{"index": "1", "files": {}}]},
        {"frames": [{}]},
        {"failed": [{}]},
        {"failed": 3},
    ],
)
def test_records_of_a_manifest_with_wrong_frames_are_one_line(tmp_path, change):
    content = plain(tmp_path).as_dict() | change
    (tmp_path / "manifest.json").write_text(json.dumps(content))
    with pytest.raises(FireflyError, match=r"^\S+manifest\.json is not a manifest: .+$"):
        Records([tmp_path / "manifest.json"], [])


@pytest.mark.parametrize("folder", ["..", "/tmp", "a/../../b"])
def test_a_manifest_that_names_another_folder_is_no_record(tmp_path, folder):
    content = sweep(tmp_path).as_dict()
    content["captures"][0]["folder"] = folder
    (tmp_path / "manifest.json").write_text(json.dumps(content))
    with pytest.raises(FireflyError, match="names a folder that is not in its own"):
        Records([tmp_path / "manifest.json"], [])


def test_a_folder_without_a_manifest_is_one_line(tmp_path):
    with pytest.raises(FireflyError, match=r"^cannot read \S+manifest\.json: No such file or directory$"):
        read_manifest(tmp_path)
    with pytest.raises(FireflyError, match=r"^cannot read \S+none: No such file or directory$"):
        read_manifest(tmp_path / "none")


def test_what_json_lacks_is_no_manifest_and_keeps_the_one_before(tmp_path):
    before = plain(tmp_path).as_dict()
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_manifest(tmp_path / "manifest.json", {}, [({"exposure": float("nan")}, [])])
    assert read_manifest(tmp_path) == before
    assert os.listdir(tmp_path) == ["manifest.json"]


texts = st.text(max_size=20)
frames = st.lists(st.integers(0, 999_999), max_size=8, unique=True).map(sorted)


@settings(max_examples=25)
@given(st.dictionaries(texts, texts), frames)
def test_any_texts_and_frames_come_back(tmp_path_factory, parameters, indices):
    folder = tmp_path_factory.getbasetemp() / "any"
    folder.mkdir(exist_ok=True)
    entries = [frame_of(index) | {"id_names": list(parameters)} for index in indices]
    write_manifest(folder / "manifest.json", {}, [({"parameters": parameters}, entries)])
    manifest = read_manifest(folder)
    assert manifest == {"parameters": parameters, "frames": entries}


def test_warnings_come_in_the_order_of_their_first_frames(tmp_path):
    added = [
        (description_of(), frame_of(index, warnings=said))
        for index, said in ((9, ["last", "both"]), (2, ["first"]), (5, ["both", "second"]))
    ]
    assert write(tmp_path, *added)["warnings"] == ["first", "both", "second", "last"]


def test_names_of_ids_stand_once_and_where_they_differ(tmp_path):
    names = [["root/ball"], ["root/ball", "root/extra"], ["root/ball"]]
    added = [
        (description_of(outputs=("id",)), frame_of(index, ("id",), id_names=each))
        for index, each in enumerate(names)
    ]
    manifest = write(tmp_path, (description_of(outputs=("id",)), failed_of(7)), *added)
    assert manifest["id_names"] == names[0]
    assert [frame.get("id_names") for frame in manifest["frames"]] == [None, names[1], None]
    with Records([tmp_path / "manifest.json"], []) as records:
        assert [records.frame("", index)["id_names"] for index in range(3)] == names
    assert manifest["failed"] == [failed_of(7)]
