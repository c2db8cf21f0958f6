"""Journals of shards that are merged by themselves: what was drawn in different ways is no capture."""

from __future__ import annotations

import pytest

from firefly_sample.capture.frames import Shard
from firefly_sample.capture.merge import merge_capture
from firefly_sample.capture.work import Part
from firefly_sample.errors import OutputError
from tests.capture.described import DRIVER, job_of
from tests.capture.folders import draw, opened


def draw_combinations(path, drivers, **changes):
    """Draw one frame of each combination, by a shard of its own that sees no other."""
    for number, (values, driver) in enumerate(zip(({"a": 1}, {"a": 2}), drivers, strict=True), 1):
        given = {"folder": f"a={number}", "values": values} | (changes if number == 2 else {})
        part = Part(job_of(**given), driver, number - 1)
        (path / f"disk{number}").mkdir(parents=True)
        with opened(path / f"disk{number}", Shard(number, 2), frames=1) as place:
            assert draw(place, [part], range(1)) == [0]
        for name in (f"journal-{number}-of-2.jsonl", part.job.folder or "color_000000.png"):
            (path / f"disk{number}" / name).rename(path / name)


def test_combinations_of_one_sweep_are_merged(tmp_path):
    draw_combinations(tmp_path, (DRIVER, DRIVER))
    manifest = merge_capture(tmp_path)
    assert manifest["sweep"] == {"a": [1, 2]}
    assert [len(one["frames"]) for one in manifest.captures()] == [1, 1]


BOTH = (DRIVER, DRIVER)
UPDATED = (DRIVER, DRIVER._replace(version="other"))
DIFFERENT = [
    (UPDATED, {}, r"drawn in different ways \(driver_version: 4.*, now other\)"),
    (BOTH, {"size": (9, 6)}, r"drawn in different ways \(size: \[8, 6\], now \[9, 6\]\)"),
    (BOTH, {"folder": "b=1", "values": {"b": 1}}, "captures over a and over b: put each into a folder of"),
    (BOTH, {"folder": "", "values": {}}, "captures over nothing and over a: put each into a folder of"),
]


@pytest.mark.parametrize(("drivers", "changes", "said"), DIFFERENT)
def test_combinations_that_were_drawn_in_different_ways_are_refused(tmp_path, drivers, changes, said):
    """The manifest says driver, size and outputs once for all combinations."""
    draw_combinations(tmp_path, drivers, **changes)
    with pytest.raises(OutputError, match=said):
        merge_capture(tmp_path)
