"""``firefly capture -o clip.mp4`` and ``firefly verify clip.mp4``: what they say, and their exit codes."""

from __future__ import annotations

import json

import pytest

from firefly_sample.cli import main

pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")
ROLLING = ("tests.capture.scenes:rolling", "--size", "16x12", "--frames", "0:3")


def firefly(capsys, *words):
    """What the command gives: exit code, lines on stdout, lines on stderr."""
    code = main(list(map(str, words)))
    out, err = capsys.readouterr()
    return code, out.splitlines(), err.splitlines()


def test_a_film_from_its_capture_to_its_comparison(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = firefly(capsys, "capture", *ROLLING, "-o", "clip.mp4")
    assert (code, out) == (0, ["3 frames (color) in clip.mp4"])
    assert err[-1] == "firefly: writing clip.mp4 (3 frames)"
    assert firefly(capsys, "verify", "clip.mp4") == (0, ["clip.mp4 is whole: 3 frames, 1 file"], [])
    code, out, err = firefly(capsys, "capture", *ROLLING, "-o", "clip.mp4", "--resume", "--json")
    assert code == 0
    assert json.loads("\n".join(out)) == json.loads((tmp_path / "clip.mp4.json").read_text())
    assert err == ["firefly: clip.mp4 is whole already"]
    code, out, err = firefly(capsys, "capture", *ROLLING, "-o", "clip.mp4")
    assert (code, out) == (1, [])
    assert err == ["firefly: clip.mp4 is there already: use --overwrite to replace it, or another name"]
    assert firefly(capsys, "capture", *ROLLING, "-o", "clip.apng", "--quiet")[:2] == (0, [])
    code, out, _ = firefly(capsys, "verify", "clip.apng", "clip.mp4", "--max-codes", "60")
    assert (code, out[-1]) == (0, "clip.apng and clip.mp4 are the same (limits: 60 codes): 3 frames")
    (tmp_path / "clip.mp4").write_bytes(b"")
    code, out, _ = firefly(capsys, "verify", "clip.mp4")
    assert code == 1
    assert out[0].startswith("clip.mp4 is damaged: cannot read clip.mp4 as .mp4")
    assert out[-1] == "clip.mp4 is not whole: 1 problem in 3 frames"


def test_a_frame_that_fails(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ("tests.capture.deadly:deadly", "--size", "16x12", "--fps", 1, "--time", 4, "--frames", "0:2")
    code, out, err = firefly(capsys, "capture", *words, "-o", "clip.webp")
    assert (code, out) == (3, ["1 frame (color) in clip.webp.frames"])
    assert err[-1] == (
        "firefly: 1 frame could not be drawn, and clip.webp is not written: --resume tries again"
    )
    code, _, err = firefly(capsys, "verify", "clip.webp")
    assert code == 1
    assert "the capture of clip.webp is not finished, as clip.webp.frames shows" in err[-1]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("-o", "x.mp4", "--crf", "52"), "crf must be a whole number from 0 to 51 for .mp4, got 52"),
        (("-o", "x.mp4", "--crf", "low"), "'low'"),
        (("-o", "x.webp", "--quality", "0"), "quality must be a whole number from 1 to 100"),
        (("-o", "x", "--format", "bmp"), "there is no format 'bmp': choose from png, webp, jpeg"),
        (("-o", "x", "--format", "depth=exr"), "output 'depth' has the format exr, but is not asked for"),
        (("-o", "x", "--depth-scale", "-1"), "depth_scale is a number from 1e-30 to 1e+30, got -1.0"),
        (("-o", "x.mp4", "--outputs", "depth"), "a .mp4 shows 8-bit pictures"),
        (("-o", "x.mp4", "--sweep", "bright=1,2"), "a sweep has many files, and x.mp4 is one: name a folder"),
        (("-o", "x.avi"), "there is no format .avi for x.avi: films are .mp4, .webm"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_values_that_are_wrong(words, said, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = firefly(capsys, "capture", *ROLLING, *words)
    assert code in (1, 2)
    assert (out, len(err)) == ([], 1)
    assert said in err[0]
    assert list(tmp_path.iterdir()) == []
