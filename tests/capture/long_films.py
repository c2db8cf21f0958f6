"""Films that take long: many frames, several processes, a full disk, and the forest.

``python -m pytest tests/capture/long_films.py`` runs it, and ``-s`` prints the figures.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time

import numpy as np
import pytest

from firefly_sample.capture.verify import compare_captures, verify_capture
from firefly_sample.encoding.films import film_facts
from tests.capture.kinds_of_harm import PAGE, small_disk
from tests.capture.launch import Launcher
from tests.capture.rolled import film_pictures, luma_psnr, names_in, pictures, roll
from tests.cli.command import ROOT, environment

pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")

LARGE = ("tests.cli.glade:glade", "--size", "256x192", "--frames", "0:8")
"""A film that is larger than any other file of its capture."""


@pytest.mark.parametrize("words", [(), ("--cluster", "local")], ids=["workers", "cluster"])
def test_several_processes_make_the_same_films(words, tmp_path):
    for name in ("clip.mp4", "clip.webm", "clip.webp"):
        roll(tmp_path / name)
        command = (
            f"{sys.executable} -m firefly_sample capture tests.capture.scenes:rolling --size 32x24".split()
        )
        command += ["--frames", "0:4", *words, "--workers", "2", "-o", str(tmp_path / "more" / name)]
        subprocess.run(command, cwd=ROOT, env=environment(), check=True, capture_output=True)
        assert names_in(tmp_path / "more") == [name, f"{name}.json"]
        for one in (name, f"{name}.json"):
            assert (tmp_path / "more" / one).read_bytes() == (tmp_path / one).read_bytes()
            (tmp_path / "more" / one).unlink()


@pytest.mark.parametrize("name", ["clip.mp4", "clip.apng"])
def test_a_full_disk_while_the_film_is_bound(name, tmp_path):
    """The frames stay whole, nothing else is left, and with more room it goes on."""
    words = [*LARGE, *(("--crf", "0") if name == "clip.mp4" else ())]
    with Launcher(tmp_path) as launcher:
        (tmp_path / "whole").mkdir()
        launcher.start(*words, tmp_path / "whole" / name).end()
        run = launcher.start(
            *words, tmp_path / "killed" / name, at=(rf"open \.{name}\.", 1), watched=tmp_path / "killed"
        )
        run.die(9)
        frames = tmp_path / "killed" / f"{name}.frames"
        pages = 3 + sum(-(-path.stat().st_size // PAGE) for path in frames.iterdir())
        film = (tmp_path / "whole" / name).stat().st_size
        assert film > PAGE
        with small_disk(tmp_path / "disk", 4 * pages) as is_small:
            if not is_small:
                pytest.skip("mounting is not allowed")
            clip, ballast = tmp_path / "disk" / name, tmp_path / "disk" / "ballast"
            ballast.write_bytes(b"x" * (4 * pages - pages - 1) * PAGE)
            lines = launcher.start(*words, clip).end(1, "cannot write .*: No space left on device")
            assert any("8 of 8 frames are whole" in line for line in lines), lines
            assert names_in(tmp_path / "disk") == ["ballast", f"{name}.frames"]
            ballast.unlink()
            launcher.start(*words, "--resume", clip).end()
            assert names_in(tmp_path / "disk") == [name, f"{name}.json"]
            assert clip.read_bytes() == (tmp_path / "whole" / name).read_bytes()


@pytest.mark.parametrize("name", ["clip.mp4", "clip.apng"])
def test_no_file_may_grow_to_the_size_of_a_film(name, tmp_path):
    words = [*LARGE, *(("--crf", "0") if name == "clip.mp4" else ())]
    with Launcher(tmp_path) as launcher:
        (tmp_path / "a").mkdir()
        launcher.start(*words, tmp_path / "a" / name).end()
        size = (tmp_path / "a" / name).stat().st_size
        run = launcher.start(*words, tmp_path / "b" / name, largest=size - 100)
        lines = run.end(1, f"cannot write .*{name}: File too large")
        assert names_in(tmp_path / "b") == [f"{name}.frames"], lines
        launcher.start(*words, "--resume", tmp_path / "b" / name).end()
        assert (tmp_path / "b" / name).read_bytes() == (tmp_path / "a" / name).read_bytes()


_MEASURED = """
import json, resource, sys, time, warnings
warnings.simplefilter("ignore")
from tests.capture.rolled import roll
calls = []
def progress(done, total):
    calls.append((time.monotonic(), done))
count, path = int(sys.argv[1]), sys.argv[2]
from pathlib import Path
roll(Path(path), frames=f"0:{count}", size=(320, 240), progress=progress)
bound = [moment for moment, done in calls[count + 1:]]
print(json.dumps({
    "rss": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    "calls": [done for _, done in calls],
    "seconds": bound[-1] - bound[0],
    "pause": max(b - a for a, b in zip(bound, bound[1:])),
}))
"""


@pytest.mark.parametrize("name", ["clip.mp4", "clip.webm", "clip.webp", "clip.apng", "clip.gif"])
def test_a_thousand_frames_take_the_memory_of_a_hundred(name, tmp_path):
    figures = []
    for count in (100, 1000):
        words = [sys.executable, "-c", _MEASURED, str(count), str(tmp_path / str(count) / name)]
        done = subprocess.run(words, cwd=ROOT, env=environment(), check=True, capture_output=True, text=True)
        figures.append(json.loads(done.stdout))
        assert figures[-1]["calls"] == [*range(count + 1), *range(1, count + 1)]
    few, many = figures
    size = (tmp_path / "1000" / name).stat().st_size / 2**20
    print(
        f"{name}: 1,000 frames of 320x240 bound in {many['seconds']:.1f} s, {size:.2f} MiB, longest pause "
        f"{many['pause']:.2f} s, {few['rss']:.0f} and {many['rss']:.0f} MiB of memory"
    )
    assert many["rss"] < few["rss"] + 24
    begin = time.monotonic()
    assert verify_capture(tmp_path / "1000" / name).ok
    print(f"  verified in {time.monotonic() - begin:.2f} s")
    assert film_facts(tmp_path / "1000" / name).frames == 1000


def test_the_forest_as_a_film(tmp_path):
    """Without loss it is bit for bit, and the usual quality is 35 dB or more.

    A quantiser of 18, and six more for frames between others, has a step of 10 codes: 10²/12 = 8.3 codes², or
    38.9 dB. Encoders round at 5/6 of a step in place of a half, which costs up to 3.7 dB.
    """
    options = {"scene": "forest", "size": (320, 240), "frames": "0:12"}
    roll(tmp_path / "frames", **options)
    expected = pictures(tmp_path / "frames")
    for name, more in {
        "a.mp4": {},
        "b.webm": {},
        "c.mp4": {"crf": 0},
        "d.webm": {"crf": 0},
        "e.webp": {},
        "f.apng": {},
        "g.gif": {},
    }.items():
        roll(tmp_path / name, **options, **more)
        found = film_pictures(tmp_path / name)
        report = compare_captures(tmp_path / "frames", tmp_path / name)
        decibels = luma_psnr(expected, found)
        print(f"{name} {more}: {decibels:.1f} dB, {(tmp_path / name).stat().st_size / 1024:.0f} KiB")
        if name[0] in "cdef":
            np.testing.assert_array_equal(np.stack(found), np.stack(expected))
            assert report.ok
        elif name[0] in "ab":
            assert decibels > 35
    assert film_facts(tmp_path / "f.apng").frames == 12
