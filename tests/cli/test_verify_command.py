"""``firefly verify``, as a CI job uses it: captures by the command, verified by the command."""

from __future__ import annotations

import json
import os
import shutil

import pytest

from firefly_sample.capture.checking.comparing import Limits
from firefly_sample.capture.checking.report import Report
from firefly_sample.cli import main
from firefly_sample.commands.verify import report_as_text
from tests.capture.edits import brighten, redraw
from tests.cli.command import GLADE, firefly


@pytest.fixture(scope="module")
def golden(tmp_path_factory):
    """The forest, small: two frames of a picture and of its depth."""
    folder = tmp_path_factory.mktemp("golden") / "golden"
    options = ("--size", "40x30", "--frames", "0:2", "--outputs", "color,depth")
    assert main(["capture", "forest", *options, "--quiet", "-o", str(folder)]) == 0
    return folder


@pytest.fixture
def here(golden, tmp_path, monkeypatch):
    """A working folder with "golden" and an equal capture, "out"."""
    for name in ("golden", "out"):
        shutil.copytree(golden, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def verify(capsys, *arguments):
    """The exit code, and the lines on stdout and stderr."""
    capsys.readouterr()
    code = main(["verify", *map(str, arguments)])
    out, err = capsys.readouterr()
    return code, out.splitlines(), err.splitlines()


def test_the_forest_drawn_again_is_the_same(golden, tmp_path, capsys, monkeypatch):
    """In another process, as on the next day."""
    options = ("--size", "40x30", "--frames", "0:2", "--outputs", "color,depth", "-o", "out")
    done = firefly("capture", "forest", *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    monkeypatch.chdir(tmp_path)
    assert verify(capsys, "out") == (0, ["out is whole: 2 frames, 4 files"], [])
    assert verify(capsys, golden, "out") == (0, [f"{golden} and out are the same: 2 frames"], [])
    assert verify(capsys, golden, "out", "--quiet") == (0, [], [])


def test_a_frame_that_differs_is_a_row_with_its_picture(here, capsys):
    redraw(here / "out", 1, brighten)
    assert verify(capsys, "golden", "out", "--differences", "diff") == (
        1,
        [
            "FRAME  OUTPUT  PIXELS       LARGEST  MEAN      PICTURE",
            "1      color   1 (0.083 %)  2        0.000556  difference_color_000001.png",
            "1 picture of differences in diff",
            "golden and out differ: 1 problem in 2 frames",
        ],
        [],
    )
    assert os.listdir("diff") == ["difference_color_000001.png"]
    assert verify(capsys, "golden", "out", "--max-codes", 2) == (
        0,
        [
            "note: 1 image differs, but within the limits",
            "golden and out are the same (limits: 2 codes): 2 frames",
        ],
        [],
    )
    assert verify(capsys, "golden", "out", "-q", "--max-share", 0.001, "--max-error", 0.01) == (0, [], [])


def test_floats_are_shown_as_their_limit_counts_them(here, capsys):
    def nearer(image):
        image[25:, :] *= 0.5

    redraw(here / "out", 0, nearer, "depth")
    code, (head, row, _), _ = verify(capsys, "golden", "out")
    assert (code, head.split()) == (1, ["FRAME", "OUTPUT", "PIXELS", "LARGEST", "MEAN"])
    assert row.split()[:5] == ["0", "depth", "200", "(17", "%)"]
    largest = float(row.split()[5])
    for error, code in ((largest * 0.9, 1), (largest * 1.1, 0)):
        assert verify(capsys, "golden", "out", "--max-error", error)[0] == code


def test_faults_of_one_capture(here, capsys):
    os.remove("out/color_000000.png")
    os.truncate("out/depth_000001.npz", 20)
    (here / "out/color_000007.png").touch()
    assert verify(capsys, "out") == (
        1,
        [
            "note: out/color_000007.png is not in the manifest of out",
            "out/color_000000.png is missing",
            "out/depth_000001.npz is damaged: it cannot be decoded",
            "out is not whole: 2 problems in 2 frames",
        ],
        [],
    )
    code, out, err = verify(capsys, "out", "--json")
    told = json.loads("\n".join(out))
    assert (code, err, told["ok"], told["other"], told["limits"]) == (1, [], False, None, None)
    assert told.keys() == {"ok", "folder", "other", "limits", "frames", "files", "problems", "notes"}
    assert [problem["kind"] for problem in told["problems"]] == ["missing", "damaged"]
    assert told["problems"][0].keys() == {
        *("kind", "text", "file", "capture", "frame", "output", "figures", "picture"),
    }
    assert told["notes"] == [
        {
            "kind": "stale",
            "text": "out/color_000007.png is not in the manifest of out",
            "files": ["out/color_000007.png"],
        }
    ]


def test_a_frame_that_failed_is_a_problem(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    options = ("--size", "8x6", "--fps", "1", "--time", "0", "--frames", "2:4", "-o", "out")
    assert main(["capture", "tests.cli.glade:failing", *options]) == 3
    assert verify(capsys, "out") == (
        1,
        ["out: frame 3 could not be drawn: no fourth frame", "out is not whole: 1 problem in 1 frame"],
        [],
    )


def test_shards_are_merged(tmp_path, monkeypatch, capsys):
    """Each was drawn on a disk of its own, so that none of them saw that all are done."""
    monkeypatch.chdir(tmp_path)
    for shard in ("1/2", "2/2"):
        options = ("--size", "8x6", "--frames", "0:4", "--shard", shard, "-o", f"disk{shard[0]}")
        assert main(["capture", GLADE, *options, "--quiet"]) == 0
        shutil.copytree(f"disk{shard[0]}", "all", dirs_exist_ok=True)
    code, out, (line,) = verify(capsys, "all")
    assert (code, out) == (1, [])
    assert line.endswith("; if all its shards are done, firefly verify --merge does")
    code, out, (line,) = verify(capsys, "disk1", "--merge")
    assert (code, out) == (1, [])
    assert "frames have yet to be drawn in disk1" in line
    assert verify(capsys, "all", "--merge") == (0, ["all is whole: 4 frames, 4 files"], [])
    assert verify(capsys, "all") == (0, ["all is whole: 4 frames, 4 files"], [])


def test_folders_without_a_capture_are_one_line(here, capsys):
    (here / "empty").mkdir()
    (here / "begun").mkdir()
    (here / "begun" / "journal.jsonl").touch()
    for folder, said in (
        ("empty", "empty holds no capture: there is no manifest.json"),
        ("none", "there is no folder none"),
        ("begun", "the capture in begun is not finished, as journal.jsonl shows: firefly capture with "),
    ):
        for arguments in ((folder,), ("golden", folder), (folder, "golden")):
            code, out, (line,) = verify(capsys, *arguments)
            assert (code, out) == (1, [])
            assert line.startswith(f"firefly: {said}")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "FOLDER requires an argument"),
        (("",), "it must name a folder, got ''"),
        (("golden", "--max-codes", "1"), "--max-codes compares two captures: give two folders"),
        (("golden", "--differences", "d"), "--differences compares two captures: give two folders"),
        (
            ("golden", "out", "--max-codes", "nan"),
            "--max-codes: it must be a number from 0 to 255, got 'nan'",
        ),
        (("golden", "out", "--max-error", "-1"), "--max-error: it must be a number, 0 or more, got '-1'"),
        (("golden", "out", "--max-share", "5%"), "--max-share: it must be a share from 0 to 1, got '5%'"),
        (("golden", "out", "--merge"), "--merge takes one folder: leave the other one out"),
        (("golden", "out", "third"), "third"),
    ],
)
def test_wrong_command_lines(here, capsys, arguments, said):
    code, out, (line,) = verify(capsys, *arguments)
    assert (code, out) == (2, [])
    assert said in line


@pytest.mark.parametrize(("count", "lines"), [(1, 2), (3, 4), (20, 21), (21, 22), (200, 22)])
def test_many_problems_are_counted(count, lines):
    report = Report("golden", "out", Limits(max_codes=1, max_share=0.001), frames=300)
    for index in range(count):
        report.add("missing", f"golden/color_{index:06d}.png is missing")
    text = report_as_text(report).splitlines()
    assert len(text) == lines
    assert all(len(line) <= 80 for line in text[:-1])
    assert text[-1] == (
        f"golden and out differ (limits: 1 code, 0.1 % of pixels): {count} "
        f"problem{'' if count == 1 else 's'} in 300 frames"
    )
    if count > 20:
        assert text[-2] == f"and {count - 20} more, which --json lists"
