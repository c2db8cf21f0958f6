"""What is derived from models and kept: found whole, or made again."""

import os
import time
import zlib
from pathlib import Path

import numpy as np
import pytest

import firefly_sample.derived as module
from firefly_sample.derived import VARIABLE, derived_folder, fingerprint, load_derived, save_derived

ABOUT = {"name": "leaf", "third": 1 / 3, "sizes": [1, 2]}
ARRAYS = {
    "levels": np.arange(24, dtype=np.uint16).reshape(2, 3, 4),
    "none": np.zeros((0, 3)),
    "one": np.array(1 / 3),
    "turned": np.arange(12.0).reshape(3, 4).T,
}


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
    [b"[]", b"{}", b"1", b'{"arrays": [["a", "<f8", [99]]], "about": {}}', b"\xff", b'{"arrays": 1}'],
)
def test_a_whole_file_of_another_kind_counts_as_missing(folder, header):
    folder.mkdir()
    frame = module._FRAME.pack(len(header), zlib.crc32(header))
    (folder / "leaf.derived").write_bytes(module._MAGIC + frame + header)
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

    for days, key in enumerate("abc"):
        save_derived(key, {}, ARRAYS)
        used(key, 9 - days)
    assert load_derived("a") is not None  # used again: b is the oldest now
    size = (folder / "a.derived").stat().st_size
    monkeypatch.setattr(module, "LARGEST_CACHE", int(3.5 * size))
    (folder / ".dead.tmp").write_text("")
    os.utime(folder / ".dead.tmp", (0, 0))
    (folder / ".alive.tmp").write_text("")
    save_derived("d", {}, ARRAYS)
    assert sorted(path.name for path in folder.iterdir()) == [
        *(".alive.tmp", "a.derived", "c.derived", "d.derived"),
    ]
    monkeypatch.setattr(module, "LARGEST_CACHE", 1)
    save_derived("e", {}, ARRAYS)
    assert [path.name for path in folder.glob("*.derived")] == ["e.derived"]


def test_a_fingerprint_tells_parts_apart():
    arrays = np.zeros(4, np.uint8), np.zeros((2, 2), np.uint8), np.zeros(4, np.int8), np.zeros(1, np.uint32)
    parts = [(array,) for array in arrays]
    parts += [(b"ab", b"c"), (b"a", b"bc"), ("ab", "c"), (0.5, True), (0.5, None), (np.nextafter(0.5, 1),)]
    assert len({fingerprint(*given) for given in parts}) == len(parts)
    assert fingerprint(np.arange(6.0).reshape(2, 3).T) == fingerprint(
        np.ascontiguousarray(np.arange(6.0).reshape(2, 3).T)
    )
