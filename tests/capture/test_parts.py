"""The small parts of a capture: shards, keys, differences, sources, names of files."""

from __future__ import annotations

import hashlib
import pickle
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firefly_sample.capture.files import hash_file, remove_unfinished
from firefly_sample.capture.frames import Shard, parse_shard
from firefly_sample.capture.job import differences, key_of
from firefly_sample.capture.sources import hash_sources
from firefly_sample.errors import FireflyError, OutputError
from firefly_sample.frame import OUTPUTS
from firefly_sample.settings import Settings
from firefly_sample.whole_files import open_whole
from tests.capture.described import DRIVER, description_of, job_of
from tests.capture.usual_files import file_name, named_frame
from tests.cli.permissions import obeyed_permissions


@given(st.integers(1, 50), st.integers(0, 300))
def test_shards_share_the_frames_out(count, frames):
    shards = [parse_shard((number, count)) for number in range(1, count + 1)]
    shares = [[place for place in range(frames) if shard.has(place)] for shard in shards]
    assert sorted(place for share in shares for place in share) == list(range(frames))
    assert max(map(len, shares)) - min(map(len, shares)) <= 1
    assert len({shard.label for shard in shards}) == count


@pytest.mark.parametrize(
    ("text", "shard"), [("2/8", (2, 8)), (" 1/1 ", (1, 1)), ((3, 100_000), (3, 100_000))]
)
def test_texts_of_shards(text, shard):
    parsed = parse_shard(text)
    assert parsed == Shard(*shard)
    assert parse_shard(str(parsed)) == parsed


@pytest.mark.parametrize(
    "text",
    [
        *("", "2", "0/8", "9/8", "-1/8", "1/0", "1/8/2", "a/b", "1.0/8", "²/8", "1/100001", "1/9999999999"),
        *((0, 8), (9, 8), (1.5, 8), (1,), (1, 2, 3), ("1", "x"), (True, 8)),
    ],
)
def test_wrong_shards(text):
    with pytest.raises(OutputError, match=r"^a shard is I/N, .*, got ") as caught:
        parse_shard(text)
    assert str(caught.value).endswith(repr(text))


CHANGES = {
    "scene": ("spheres", "scene: tests.cli.glade:glade, now spheres"),
    "parameters": ({"fireflies": 4, "seed": 7}, "fireflies: 3, now 4"),
    "settings": (Settings(supersample=2), "supersample: 1, now 2"),
    "size": ((8, 7), "size: [8, 6], now [8, 7]"),
    "outputs": (("color", "depth"), "outputs: ['color'], now ['color', 'depth']"),
    "fps": (25.0, "fps: 24.0, now 25.0"),
    "start": (1.0, "time: 0.0, now 1.0"),
    "sources": ({"a.glb": "00"}, "a.glb has changed"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_whatever_changes_pixels_changes_the_key_and_is_named(name):
    value, said = CHANGES[name]
    before, now = description_of(), description_of(**{name: value})
    assert key_of(before) != key_of(now)
    assert differences(before, now) == [said]
    assert differences(now, now) == []


def test_a_driver_changes_the_key_and_is_named():
    other = DRIVER._replace(name="NVIDIA H200", software=False)
    before, now = description_of(), job_of().description(other)
    assert key_of(before) != key_of(now)
    assert differences(before, now) == [f"driver: {DRIVER.name}, now NVIDIA H200"]


def test_long_lists_of_poses_are_counted():
    poses = [{"views": [{"camera_to_world": {"opencv": [[float(shift)] * 4] * 4}}] * 3} for shift in range(2)]
    stages = [description_of() | {"views": views} for views in (None, {"orbit": 24}, *poses)]
    found = [differences(*pair) for pair in pairwise(stages)]
    assert found == [
        ["views: none, now orbit:24"],
        ["views: orbit:24, now 3 poses"],
        ["views: 3 poses, now other 3 poses"],
    ]
    assert differences(description_of(), stages[1]) == ["views: none, now orbit:24"]


def test_what_changes_no_pixel_does_not_change_the_key():
    before = description_of(exposure=None)
    assert key_of(before) == key_of(description_of(exposure=2.5))
    assert key_of(before) == key_of(description_of(exposure=None, device=3, require_gpu=True))
    assert key_of(before) == key_of(dict(reversed(before.items())))


def test_jobs_can_be_pickled():
    job = job_of(values={"fireflies": 3}, sources={"a": "b"})
    assert pickle.loads(pickle.dumps(job)) == job
    assert job.time(12) == 0.5
    assert job_of(exposure=None, settings=Settings(exposure="auto")).exposed.exposure == "auto"
    assert job_of(exposure=2.5, settings=Settings(exposure="auto")).exposed.exposure == 2.5


def test_sources_are_the_files_that_parameters_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a.glb", "b.glb"):
        (tmp_path / name).write_text(name)
    (tmp_path / "read.glb").write_text("not read again")
    known = {"read.glb": "known"}
    names = {
        "file": "a.glb,b.glb",
        "other": "none.glb",
        "seed": 3,
        "empty": "",
        "dot": ".",
        "last": "read.glb",
    }
    found = hash_sources(names, known)
    assert found == known
    assert found.pop("read.glb") == "known"
    assert found == {name: hashlib.sha256(name.encode()).hexdigest() for name in ("a.glb", "b.glb")}


@pytest.mark.parametrize("output", OUTPUTS)
def test_names_of_files_and_back(output):
    assert named_frame(file_name(output, 12)) == (output, 12)


@pytest.mark.parametrize(
    "name",
    [
        *("color_12.png", "color_000012.tif", "colour_000012.png", "color_0000012.png"),
        *("color_000012.png.part", "my_color_000012.png", "manifest.json", "color_000012.PNG"),
    ],
)
def test_other_names_are_no_frames(name):
    assert named_frame(name) is None


def test_what_a_killed_writer_left_is_removed_and_nothing_else(tmp_path):
    (tmp_path / "mine.part").touch()
    (tmp_path / ".color.part").touch()
    with open_whole(tmp_path / "color_000000.png"):
        (name,) = (path.name for path in tmp_path.iterdir() if path.name.startswith(".color_"))
    (tmp_path / "color_000000.png").unlink()
    (tmp_path / name).touch()  # as if the process had been killed within the block
    assert len(list(tmp_path.iterdir())) == 3
    remove_unfinished(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"mine.part", ".color.part"}


def test_folders_and_files_that_cannot_be_read_are_passed_over(tmp_path):
    (tmp_path / "closed").mkdir(mode=0)
    (tmp_path / "file").touch(mode=0)
    with obeyed_permissions():
        remove_unfinished(tmp_path / "closed")
        assert hash_file(tmp_path / "file") is None
    assert hash_file(tmp_path / "none") is None
    assert hash_file(tmp_path) is None


def test_a_file_has_its_name_only_when_it_is_whole(tmp_path):
    path = tmp_path / "a.png"
    path.write_bytes(b"before")
    with open_whole(path, sync=True) as file:
        file.write(b"after")
        file.flush()
        assert path.read_bytes() == b"before"
    assert path.read_bytes() == b"after"
    with pytest.raises(FireflyError, match=r"^cannot write \S+a\.png: no room$"), open_whole(path):
        raise OSError(28, "no room")
    assert [(each.name, each.read_bytes()) for each in tmp_path.iterdir()] == [("a.png", b"after")]
