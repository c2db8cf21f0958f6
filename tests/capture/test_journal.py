"""The journal and the records read from it: whatever was appended, cut off or damaged, the latest counts."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firefly_sample.capture.journal import Journal
from firefly_sample.capture.records import Records
from firefly_sample.errors import FireflyError
from tests.capture.described import description_of, failed_of, frame_of

ASKED = {"frames": (0, 9, 1), "jobs": 1, "shard": ""}
NAMES = ["root/ball", "root/floor"]


def read(records):
    """All that records say, by folder and index."""
    return {
        (folder, index): records.frame(folder, index)
        for folder in records.folders()
        for index in records.indices(folder)
    }


def plain(records):
    """As `read`, with only what was given to the journal."""
    return {
        place: {name: value for name, value in frame.items() if name != "about"}
        for place, frame in read(records).items()
    }


@pytest.fixture(scope="module", autouse=True)
def unsynced():
    """Nothing here waits for the disk, because no test cuts the power."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)
        yield


@pytest.fixture(scope="module")
def scratch(tmp_path_factory):
    return tmp_path_factory.mktemp("journals")


@st.composite
def events(draw):
    """Runs in one of three journals: frames whole or failed, of two jobs, that share long values or not."""
    index, folder = draw(st.integers(0, 600)), draw(st.sampled_from(["", "a=1"]))
    if draw(st.booleans()):
        return folder, failed_of(index)
    more = {}
    if draw(st.booleans()):
        more["warnings"] = draw(st.sampled_from([["one"], ["one", "two"], ["ü\n"]]))
    if draw(st.booleans()):
        more["id_names"] = draw(st.sampled_from([NAMES, [*NAMES, "root/extra"]]))
    return folder, frame_of(index, folder=folder, **more)


runs = st.lists(st.tuples(st.integers(1, 3), st.booleans(), st.lists(events(), max_size=8)), max_size=6)


@settings(max_examples=50)
@given(runs)
def test_the_latest_line_of_each_frame_counts(scratch, several):
    paths = [scratch / f"journal-{number}-of-3.jsonl" for number in (1, 2, 3)]
    for path in paths:
        path.unlink(missing_ok=True)
    latest = {}
    for run, (number, bright, added) in enumerate(several, 1):
        with Records([], paths) as records, Journal(paths[number - 1], run, ASKED) as journal:
            assert plain(records) == latest
            assert records.run == run - 1
            for folder, frame in added:
                description = description_of(folder=folder, exposure=2.0 if bright else 1.0)
                records.add(journal, description, frame)
                latest[folder, frame["index"]] = frame
            assert plain(records) == latest
    with Records([], paths) as records:
        assert plain(records) == latest
        for (folder, index), frame in latest.items():
            assert records.has(folder, index)
            about = records.descriptions[records.frame(folder, index)["about"]]
            assert (about["folder"], frame["index"]) == (folder, index)


SHORT = description_of() | {"settings": {}}


def small_journal(path):
    with Records([], []) as records, Journal(path, 1, ASKED) as journal:
        records.add(journal, SHORT, frame_of(0, warnings=["one"], id_names=NAMES))
        records.add(journal, SHORT, failed_of(1))
        records.add(journal, SHORT, frame_of(2, warnings=["two"], id_names=NAMES))


def test_a_journal_cut_off_at_any_byte_loses_its_last_line_at_most_and_can_be_appended_to(tmp_path):
    whole = tmp_path / "whole.jsonl"
    small_journal(whole)
    with Records([], [whole]) as records:
        frames = read(records)
    assert len(frames) == 3
    content = whole.read_bytes()
    ends = [place for place, byte in enumerate(content, 1) if byte == ord("\n")]
    lines = [json.loads(line) for line in content.splitlines()]
    cut = tmp_path / "cut.jsonl"
    for length in range(len(content) + 1):
        cut.write_bytes(content[:length])
        kept = sum(end - 1 <= length for end in ends)  # a line may lack its end
        expected = {("", line["index"]) for line in lines[:kept] if "index" in line}
        with Records([], [cut]) as records:
            assert read(records) == {place: frames[place] for place in expected}
            if length % 9 and not any(abs(end - length) < 3 for end in ends):
                continue  # appending takes long, and differs only at the end of a line
            with Journal(cut, 2, ASKED) as journal:
                records.add(journal, SHORT, frame_of(7, warnings=["one"]))
            after = read(records)
        assert after.keys() == expected | {("", 7)}
        with Records([], [cut]) as records:
            assert read(records) == after
            assert (records.run, records.asked[-1]["run"]) == (2, 2)


GARBAGE = [
    b"\0" * 600,
    b"\xff\xfe{}",
    b"[" * 20_000,
    b'{"run": "many"}',
    b'{"run": null, "asked": 3}',
    b'{"about": "x", "is": 3}',
    b'{"about": "x", "is": {"folder": ""}}',
    b'{"about": [1], "is": {"folder": "", "values": {}}}',
    b'{"about": "x", "is": {"folder": NaN}}',
    b'{"index": 1}',
    b'{"index": 1, "about": ["x"]}',
    b"[1, 2]",
    b"17",
    b"",
    b"{",
]


def test_garbage_between_the_lines_is_passed_over(tmp_path):
    path = tmp_path / "journal.jsonl"
    small_journal(path)
    with Records([], [path]) as records:
        frames = read(records)
    # as places of values are those in the file, garbage comes after the lines, and then once more lines
    key = frames["", 0]["about"]
    garbage = [
        *GARBAGE,
        *(
            json.dumps(frame_of(0) | {"about": key} | change).encode()
            for change in (
                {"index": "0"},
                {"index": -1},
                {"index": 10**6},
                {"index": 0.0},
                {"index": True},
                {"files": None},
                {"file_sha256": ["a"]},
                {"warnings": 1},
                {"warnings": ["x"]},
                {"id_names": 10**9},
                {"about": "unknown"},
            )
        ),
    ]
    with path.open("ab") as file:
        file.write(b"\n".join(garbage) + b"\n")
    with Records([], [path]) as records, Journal(path, 2, ASKED) as journal:
        assert read(records) == frames
        records.add(journal, description_of(), frame_of(8))
    with Records([], [path]) as records:
        assert read(records).keys() == {*frames, ("", 8)}


def test_a_frame_whose_long_value_is_lost_is_no_frame(tmp_path):
    """After a loss of power, a block in the middle of the file may hold zeros."""
    path = tmp_path / "journal.jsonl"
    small_journal(path)
    lines = path.read_bytes().splitlines(keepends=True)
    place = next(number for number, line in enumerate(lines) if line == b'{"value": ["two"]}\n')
    lines[place] = b"\0" * len(lines[place])
    path.write_bytes(b"".join(lines))
    with Records([], [path]) as records:
        assert [index for _, index in read(records)] == [0, 1]


@pytest.mark.parametrize("folder", ["..", ".", "/etc", "a/b", "..\\x", "a/../..", 3, None, ["a"]])
def test_a_journal_that_names_another_folder_is_refused(tmp_path, folder):
    path = tmp_path / "journal.jsonl"
    with Journal(path, 1, ASKED) as journal:
        journal.add(description_of(folder=folder), frame_of(0))
    with pytest.raises(FireflyError, match=r"^\S*journal\.jsonl names a folder that is not in its own: .+$"):
        Records([], [path])


def test_an_exposure_that_was_measured_stays_known(tmp_path):
    path = tmp_path / "journal.jsonl"
    unmeasured, measured = description_of(exposure=None), description_of(exposure=2.5)
    with Records([], []) as records, Journal(path, 1, ASKED) as journal:
        records.add(journal, measured, frame_of(0))
        records.add(journal, unmeasured, failed_of(1))
        assert [one["exposure"] for one in records.descriptions.values()] == [2.5]
    with Records([], [path]) as records:
        assert [one["exposure"] for one in records.descriptions.values()] == [2.5]


def test_long_values_that_stay_the_same_are_written_once(tmp_path):
    path = tmp_path / "journal.jsonl"
    names = [f"root/tree{number}" for number in range(2_000)]
    with Records([], []) as records, Journal(path, 1, ASKED) as journal:
        for index in range(50):
            records.add(journal, description_of(), frame_of(index, id_names=names, warnings=["one"]))
    assert path.stat().st_size < 80_000
    with Records([], [path]) as records:
        assert records.frame("", 49)["id_names"] == names


def test_a_hundred_thousand_records_take_little_memory(tmp_path):
    path = tmp_path / "journal.jsonl"
    with Journal(path, 1, ASKED) as journal:
        start = journal.add(description_of(), frame_of(0))
    line = path.read_bytes()[start:]
    assert line.startswith(b'{"index": 0, ')
    with path.open("ab") as file:
        for index in range(1, 100_000):
            file.write(line.replace(b'{"index": 0, ', b'{"index": %d, ' % index, 1))
    before = resident()
    with Records([], [path]) as records:
        assert sum(1 for _ in records.indices("")) == 100_000
        assert records.frame("", 99_999)["index"] == 99_999
        grown = resident() - before
    assert grown < 8 * 2**20  # kept as they are parsed, they would take 150 MiB


def resident():
    """The memory of this process in bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def test_a_file_that_cannot_be_read_is_one_line(tmp_path):
    (tmp_path / "journal.jsonl").mkdir()
    with pytest.raises(FireflyError, match=r"^cannot read \S*journal\.jsonl: Is a directory$"):
        Records([], [tmp_path / "journal.jsonl"])
    with pytest.raises(FireflyError, match=r"^cannot write \S*journal\.jsonl: Is a directory$"):
        Journal(tmp_path / "journal.jsonl", 1, ASKED)
    with Records([tmp_path / "none"], [tmp_path / "none"]) as records:
        assert (records.folders(), records.run) == ([], 0)
