"""What is derived from models and kept: found whole, or made again."""

import json
import os
import time
import zlib
from pathlib import Path

import numpy as np
import pytest

import firefly_sample.disk_cache as module
from firefly_sample.disk_cache import VARIABLE, derived_folder, fingerprint, load_derived, save_derived

ABOUT = {"name": "leaf", "third": 1 / 3, "sizes": [1, 2]}
ARRAYS = {
    "levels": np.arange(24, dtype=np.uint16).reshape(2, 3, 4),
    "none": np.zeros((0, 3)),
    "one": np.array(1 / 3),
    "turned": np.arange(12.0).reshape(3, 4).T,
}


ROWS = [
    *(["a", code, [1]] for code in ("<f4", "<u2", "|O", "no", "", 8, None, ["<f8"], {})),
    *(["a", "<f8", shape] for shape in (1, None, [2], [-1], [0], [1.0], ["1"], [1, -1], [10**18], [[1]])),
    *(None, [], ["a"], ["a", "<f8"], ["a", "<f8", [1], 0], [["a"], "<f8", [1]]),
]
"""Descriptions of an array that are not those of one float64."""


def write_kept(path, header, rest=b""):
    """A file whose checksum is right."""
    checksum = zlib.crc32(header + rest, zlib.crc32(path.stem.encode()))
    path.write_bytes(module._MAGIC + module._FRAME.pack(len(header), checksum) + header + rest)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "kept"))
    return tmp_path / "kept"


def test_what_was_kept_is_found_to_the_last_bit(folder):
    assert load_derived("leaf") is None
    save_derived("leaf", ABOUT, ARRAYS)
    kept = load_derived("leaf")
    assert kept.about == ABOUT
    assert list(kept.arrays) == list(ARRAYS)
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(kept.arrays[name], array)
        assert kept.arrays[name].dtype == array.dtype
        assert kept.arrays[name].shape == array.shape
        assert not kept.arrays[name].flags.writeable
    assert [path.name for path in folder.iterdir()] == ["leaf.derived"]
    assert load_derived("other") is None


def test_no_byte_can_change_unnoticed(folder):
    save_derived("leaf", ABOUT, ARRAYS)
    path = folder / "leaf.derived"
    content = path.read_bytes()
    for place in range(0, len(content), 3):
        damaged = bytearray(content)
        damaged[place] ^= 16
        path.write_bytes(damaged)
        assert load_derived("leaf") is None
    for end in range(0, len(content), 7):
        path.write_bytes(content[:end])
        assert load_derived("leaf") is None
    path.write_bytes(content)
    assert load_derived("leaf") is not None


@pytest.mark.parametrize(
    "header",
    [
        *(b"[]", b"{}", b"1", b"\xff", b'{"arrays": 1}', b'{"arrays": []}', b"", b"[" * 100_000),
        b'{"arrays": [["a", "<f8", [99]]], "about": {}}',
    ],
)
def test_a_whole_file_of_another_kind_counts_as_missing(folder, header):
    folder.mkdir()
    write_kept(folder / "leaf.derived", header)
    assert load_derived("leaf") is None


@pytest.mark.parametrize("row", ROWS)
def test_a_wrong_array_counts_as_missing(folder, row):
    """The checksum is right and the JSON is; one array of 8 bytes is described wrongly."""
    folder.mkdir()
    for described, found in ((["a", "<f8", [1]], True), (row, False)):
        header = json.dumps({"about": {}, "arrays": [described]}).encode()
        start = len(module._MAGIC) + module._FRAME.size + len(header)
        write_kept(folder / "leaf.derived", header, bytes(-start % 64) + bytes(8))
        assert (load_derived("leaf") is not None) == found


def test_a_file_under_another_key_counts_as_missing(folder):
    save_derived("leaf", ABOUT, ARRAYS)
    (folder / "leaf.derived").rename(folder / "bark.derived")
    assert load_derived("bark") is None


def test_a_pipe_is_not_waited_for(folder):
    folder.mkdir()
    os.mkfifo(folder / "leaf.derived")
    assert load_derived("leaf") is None


def test_a_folder_that_cannot_be_used_costs_time_alone(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(VARIABLE, str(tmp_path / "file" / "folder"))
    save_derived("leaf", ABOUT, ARRAYS)
    assert load_derived("leaf") is None
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    (tmp_path / "leaf.derived").mkdir()
    save_derived("leaf", ABOUT, ARRAYS)
    assert load_derived("leaf") is None
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "leaf.derived"]


def test_the_folder_is_the_users_cache_or_the_variables(monkeypatch, tmp_path):
    monkeypatch.delenv(VARIABLE)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert derived_folder() == tmp_path / "firefly_sample" / "models"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert derived_folder() == tmp_path / ".cache" / "firefly_sample" / "models"
    monkeypatch.setenv(VARIABLE, str(tmp_path / "elsewhere"))
    assert derived_folder() == tmp_path / "elsewhere"
    for off in ("off", "OFF"):
        monkeypatch.setenv(VARIABLE, off)
        assert derived_folder() is None
        save_derived("leaf", ABOUT, ARRAYS)
        assert load_derived("leaf") is None
    assert list(tmp_path.iterdir()) == []


def test_without_a_home_nothing_is_kept(monkeypatch):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv(VARIABLE)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", homeless)
    assert derived_folder() is None


def test_what_was_used_least_lately_goes_when_there_is_too_much(folder, monkeypatch):
    def used(key, days):
        stamp = time.time() - 86_400 * days
        os.utime(folder / f"{key}.derived", (stamp, stamp))

    a, b, c, d, e = (f"model-{fingerprint(name)}" for name in "abcde")
    for days, key in enumerate((a, b, c)):
        save_derived(key, {}, ARRAYS)
        used(key, 9 - days)
    assert load_derived(a) is not None  # used again: b is the oldest now
    size = (folder / f"{a}.derived").stat().st_size
    monkeypatch.setattr(module, "LARGEST_CACHE", int(3.5 * size))
    save_derived(d, {}, ARRAYS)
    assert {path.stem for path in folder.iterdir()} == {a, c, d}
    monkeypatch.setattr(module, "LARGEST_CACHE", 1)
    save_derived(e, {}, ARRAYS)
    assert {path.stem for path in folder.iterdir()} == {e}


def test_nothing_is_deleted_but_what_was_written_here(folder, monkeypatch):
    """A folder that the user shares with others: only old files with names of our own go."""
    folder.mkdir()
    digits = fingerprint("other")
    others = [
        *(".x.tmp", ".swp.tmp", "notes.tmp", ".firefly_sample-.tmp", ".firefly_sample-notes.old.tmp"),
        *("mine.derived", f"{digits}.derived", f"model-{digits}.npz", f"old-model-{digits}.derived"),
    ]
    ours = ".firefly_sample-abcdef12.tmp"
    for name in (*others, ours):
        (folder / name).write_text("")
    (folder / ".firefly_sample-aaaaaaaa.tmp").symlink_to(folder / "notes.tmp")
    (folder / ".firefly_sample-bbbbbbbb.tmp").mkdir()
    (folder / f"texture-{digits}.derived").symlink_to(folder / "mine.derived")
    others += [path.name for path in folder.iterdir() if path.is_symlink() or path.is_dir()]
    for path in folder.iterdir():
        os.utime(path, (0, 0), follow_symlinks=False)
    fresh = ".firefly_sample-99999999.tmp"
    (folder / fresh).write_text("")  # somebody is writing it
    monkeypatch.setattr(module, "LARGEST_CACHE", 1)
    save_derived(f"model-{fingerprint('new')}", {}, ARRAYS)
    assert {path.name for path in folder.iterdir()} == {
        *others,
        fresh,
        f"model-{fingerprint('new')}.derived",
    }


def test_a_fingerprint_tells_parts_apart():
    arrays = np.zeros(4, np.uint8), np.zeros((2, 2), np.uint8), np.zeros(4, np.int8), np.zeros(1, np.uint32)
    parts = [(array,) for array in arrays]
    parts += [(b"ab", b"c"), (b"a", b"bc"), ("ab", "c"), (0.5, True), (0.5, None), (np.nextafter(0.5, 1),)]
    assert len({fingerprint(*given) for given in parts}) == len(parts)
    assert fingerprint(np.arange(6.0).reshape(2, 3).T) == fingerprint(
        np.ascontiguousarray(np.arange(6.0).reshape(2, 3).T)
    )
