"""A manifest that is damaged, or was edited by hand: one line with a way out."""

from __future__ import annotations

import json

import pytest

from firefly_sample.capture.work import Work
from firefly_sample.errors import OutputError
from tests.capture.described import failed_of
from tests.capture.folders import finished, names_in, opened, parts_of


@pytest.mark.parametrize("name", ["manifest.json", "manifest.previous.json"])
def test_a_damaged_manifest_is_one_line_with_a_way_out(tmp_path, name):
    (tmp_path / name).write_text('{"frames": [')
    match = rf"^\S+{name} is not a manifest: .*: use --overwrite to replace the capture, or another folder$"
    with pytest.raises(OutputError, match=match), opened(tmp_path):
        pass
    assert names_in(tmp_path) == [name]


FRAMES_BY_HAND = [
    {"files": None},
    {"sha256": None},
    {"file_sha256": ["x"]},
    {"lights": None},
    {"time": None},
    {"index": -5},
    {"index": 10**30},
    {"index": True},
    {"camera": None},
    {"camera": [1]},
    {"instances": 3},
]


@pytest.mark.parametrize("formatted", [False, True])
def test_a_manifest_that_was_edited_by_hand_is_one_line_with_a_way_out(tmp_path, formatted):
    finished(tmp_path)
    path = tmp_path / "manifest.json"
    whole = path.read_text()

    def write(content):
        frames = content.pop("frames")
        lines = ",\n".join(f"    {json.dumps(frame)}" for frame in frames)
        by_line = f'{json.dumps(content, indent=2)[:-2]},\n  "frames": [\n{lines}\n  ]\n}}\n'
        path.write_text(json.dumps(content | {"frames": frames}, indent=2) if formatted else by_line)

    wrong = [("entry 2 of its frames is damaged", ("frames", 1), change) for change in FRAMES_BY_HAND]
    wrong += [
        ("entry 1 of 'failed' is damaged", ("failed", 0), change) for change in ({"error": 3}, {"time": "x"})
    ]
    wrong += [("its 'warnings' are no list", (), {"warnings": 3})]
    wrong += [("its 'dataset' is damaged", (), {"dataset": value}) for value in ([1], {}, 5)]
    wrong += [("its 'views' is damaged", (), {"views": value}) for value in ("x", 5, [], {}, {"views": 2})]
    for text, (*place,), change in wrong:
        content = json.loads(whole)
        content["failed"] = [failed_of(9)]
        entry = content
        for key in place:
            entry = entry[key]
        entry.update(change)
        write(content)
        match = (
            rf"^\S+ is not a manifest: .*{text}: use --overwrite to replace the capture, or another folder$"
        )
        with pytest.raises(OutputError, match=match), opened(tmp_path):
            pass
    content = json.loads(whole)
    del content["frames"][1]["file_sha256"]  # as version 0.1.0 wrote it
    write(content)
    with opened(tmp_path) as place:
        assert dict(Work(place, parts_of(), range(4)).check().wrong) == {"damaged": 1}
