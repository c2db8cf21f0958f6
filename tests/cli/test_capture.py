"""``firefly capture`` with a real driver: what is on disk, and that it is the same every time."""

from __future__ import annotations

import hashlib
import json
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import firefly_sample
from firefly_sample import SoftwareDriverWarning
from firefly_sample.capture import drawing
from firefly_sample.capture.frames import parse_frames
from firefly_sample.capture.sequence import capture_frames, capture_settings
from firefly_sample.cli import main
from firefly_sample.errors import FireflyError, OutputError
from firefly_sample.frame import OUTPUTS
from tests.cli.command import GLADE, environment, manifest_of

pytestmark = pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning")
SMALL = ("--size", "40x30")


def hashes(manifest):
    return [frame["sha256"]["color"] for frame in manifest["frames"]]


def names_in(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_frames_are_the_same_twice_and_differ_by_time_and_seed(tmp_path, capsys):
    first = manifest_of(capsys, GLADE, *SMALL, "--frames", "0:3", "-o", tmp_path / "a")
    again = manifest_of(capsys, GLADE, *SMALL, "--frames", "0:3", "-o", tmp_path / "b")
    other = manifest_of(capsys, GLADE, *SMALL, "--frames", "0:3", "-o", tmp_path / "c", "--seed", 8)
    assert hashes(first) == hashes(again)
    assert len({*hashes(first), *hashes(other)}) == 6
    assert main(["verify", str(tmp_path / "a"), str(tmp_path / "b")]) == 0
    assert main(["verify", str(tmp_path / "a"), str(tmp_path / "c")]) == 1
    assert "note: seed: 7, now 8\n" in capsys.readouterr().out


def test_the_forest_by_default(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    manifest = manifest_of(capsys, *SMALL)
    assert (manifest["scene"], manifest["seed"]) == ("forest", 7)
    assert manifest["frames"][0]["lights"]["in_scene"] == 500
    assert manifest["frames"][0]["lights"]["dropped"] == 0
    assert names_in(tmp_path / "captures" / "forest") == {"color_000000.png", "manifest.json"}
    with Image.open(tmp_path / "captures/forest/color_000000.png") as image:
        assert image.size == (40, 30)
        assert np.asarray(image).max() > 20


def test_a_picture_without_its_background_is_a_png_with_alpha(tmp_path, capsys):
    """Averaged over four samples if nothing but pictures is asked for; what an alpha of 0 hides is black."""
    for outputs, supersample in (("color_alpha", 2), ("color,color_alpha", 2), ("color_alpha,id", 1)):
        folder = tmp_path / outputs
        manifest = manifest_of(capsys, GLADE, *SMALL, "--outputs", outputs, "--glass", "-o", folder)
        assert manifest["settings"]["supersample"] == supersample
        (frame,) = manifest["frames"]
        assert frame["files"]["color_alpha"] == "color_alpha_000000.png"
        with Image.open(folder / "color_alpha_000000.png") as image:
            assert image.mode == "RGBA"
            pixels = np.asarray(image)
        assert hashlib.sha256(pixels.tobytes()).hexdigest() == frame["sha256"]["color_alpha"]
        alpha = pixels[..., 3]
        assert alpha.min() == 0
        assert alpha.max() == 255
        assert (np.unique(alpha).size > 4) == (supersample == 2)  # edges of the balls
        assert (pixels[alpha == 0] == 0).all()
    assert main(["capture", GLADE, "--outputs", "color_alpha", "--look", "classic"]) == 1
    assert "look 'classic' has no output 'color_alpha'" in capsys.readouterr().err


def test_hashes_are_of_the_pixels_that_the_files_hold(tmp_path, capsys):
    manifest = manifest_of(capsys, GLADE, *SMALL, "--outputs", ",".join(OUTPUTS), "-o", tmp_path)
    frame = manifest["frames"][0]
    assert frame["files"].keys() == frame["sha256"].keys() == OUTPUTS.keys()
    for output, info in OUTPUTS.items():
        file = tmp_path / frame["files"][output]
        if info.dtype == "uint8":
            with Image.open(file) as image:
                pixels = np.asarray(image)
        else:
            with np.load(file) as arrays:
                assert arrays.files == [output]
                pixels = arrays[output]
        assert pixels.dtype == info.dtype
        size = (0, 0) if output.endswith("atlas") else (30, 40)  # nothing casts shadows there
        assert pixels.shape == ((*size, info.channels) if info.channels > 1 else size)
        assert hashlib.sha256(pixels.tobytes()).hexdigest() == frame["sha256"][output]
    assert names_in(tmp_path) == {"manifest.json", *frame["files"].values()}


def test_ids_index_the_names_in_the_manifest(tmp_path, capsys):
    manifest = manifest_of(capsys, GLADE, *SMALL, "--outputs", "id", "-o", tmp_path)
    with np.load(tmp_path / manifest["frames"][0]["files"]["id"]) as arrays:
        drawn = {manifest["id_names"][index] for index in np.unique(arrays["id"]) if index >= 0}
    assert any(name.endswith("ball") for name in drawn)
    assert any(name.endswith("floor") for name in drawn)


def test_names_that_change_between_frames_stand_with_their_frame(tmp_path):
    manifest = capture_frames(
        "tests.cli.glade:growing", tmp_path, frames="0:2", fps=1, time=0.5, size=(8, 6), outputs=["id"]
    )
    before, after = manifest["frames"]
    assert "id_names" not in before
    assert set(after["id_names"]) - set(manifest["id_names"]) == {"root/extra"}


def test_time_of_each_frame(tmp_path, capsys):
    options = ("--frames", "10:31:10", "--fps", 20, "--time", -2)
    manifest = manifest_of(capsys, GLADE, "--size", "4x3", *options, "-o", tmp_path)
    assert [(frame["index"], frame["time"]) for frame in manifest["frames"]] == [
        (10, -1.5),
        (20, -1.0),
        (30, -0.5),
    ]
    assert "color_000020.png" in names_in(tmp_path)


def test_manifest_is_stdout_and_says_how_to_repeat_it(tmp_path, capsys):
    options = ("--fireflies", 3, "--no-dusk", "--exposure", 2.5, "--size", "8x8")
    manifest = manifest_of(capsys, GLADE, *options, "-o", tmp_path)
    assert json.loads((tmp_path / "manifest.json").read_text()) == manifest
    assert manifest["parameters"] == {"fireflies": 3, "seed": 7, "reach": 2.5, "glass": False, "dusk": False}
    assert manifest["settings"] == capture_settings(["color"], exposure=2.5).as_dict()
    assert manifest["version"] == firefly_sample.__version__
    assert manifest["frames"][0]["lights"]["in_scene"] == 3


@pytest.mark.parametrize(("outputs", "samples"), [("color", 2), ("color,depth", 1), ("radiance", 1)])
def test_colour_alone_is_supersampled(tmp_path, capsys, outputs, samples):
    options = ("--size", "8x6", "--outputs", outputs, "-o", tmp_path)
    assert manifest_of(capsys, GLADE, *options)["settings"]["supersample"] == samples


def test_supersampling_can_be_chosen(tmp_path, capsys):
    options = ("--size", "8x6", "--supersample", 1, "-o", tmp_path)
    assert manifest_of(capsys, GLADE, *options)["settings"]["supersample"] == 1


def test_one_pixel_without_any_light(tmp_path, capsys):
    manifest = manifest_of(capsys, GLADE, "--size", "1x1", "--fireflies", 0, "-o", tmp_path)
    assert manifest["frames"][0]["lights"] == {"in_scene": 0, "in_view": 0, "dropped": 0}


def test_summary_goes_to_stdout_and_each_warning_once_to_stderr(tmp_path, capsys):
    options = "--size", "8x6", "--frames", "0:3", "--glass", "--look", "classic", "-o", str(tmp_path)
    assert main(["capture", GLADE, *options]) == 0
    out, err = capsys.readouterr()
    assert out == f"3 frames (color) in {tmp_path}\n"
    warned = err.splitlines()
    assert len([line for line in warned if "glass" in line]) == 1
    assert all(line.startswith("firefly: warning: ") for line in warned)
    assert len(warned) == len(set(warned))


def test_quiet_prints_nothing_but_warnings(tmp_path, capsys):
    assert main(["capture", GLADE, "--size", "8x6", "-q", "-o", str(tmp_path)]) == 0
    assert capsys.readouterr().out == ""


def test_a_second_capture_is_refused_or_replaces_the_first(tmp_path, capsys):
    first = manifest_of(capsys, GLADE, "--size", "8x6", "--frames", "0:2", "-o", tmp_path, "--seed", 1)
    second = GLADE, "--size", "8x6", "-o", str(tmp_path), "--seed", "2"
    assert main(["capture", *second]) == 1
    error = capsys.readouterr().err
    assert error.startswith(f"firefly: there is a capture in {tmp_path} already: ")
    assert error.count("\n") == 1
    assert "--resume" in error
    assert "--overwrite" in error
    assert json.loads((tmp_path / "manifest.json").read_text()) == first
    replaced = manifest_of(capsys, *second, "--overwrite")
    assert json.loads((tmp_path / "manifest.json").read_text()) == replaced
    with Image.open(tmp_path / "color_000000.png") as image:
        assert hashlib.sha256(np.asarray(image).tobytes()).hexdigest() == hashes(replaced)[0]
    assert hashes(replaced)[0] != hashes(first)[0]
    assert names_in(tmp_path) == {"manifest.json", "color_000000.png"}


def test_progress_counts_every_frame(tmp_path):
    seen = []
    capture_frames(
        GLADE, tmp_path, frames=range(5, 8), size=(4, 3), progress=lambda *counts: seen.append(counts)
    )
    assert seen == [(0, 3), (1, 3), (2, 3), (3, 3)]


def test_a_failure_between_frames_leaves_whole_frames_and_no_manifest(tmp_path):
    capture_frames(GLADE, tmp_path, size=(4, 3), parameters={"seed": 1})

    def stop(done, total):
        if done == 2:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        capture_frames(GLADE, tmp_path, frames="0:30", size=(4, 3), progress=stop, overwrite=True)
    left = len(names_in(tmp_path)) - 1
    assert 2 <= left < 30  # what was drawn before it was known
    assert names_in(tmp_path) == {f"color_{index:06d}.png" for index in range(left)} | {"journal.jsonl"}


def test_frames_before_one_that_cannot_be_drawn_are_whole(tmp_path):
    options = {"frames": "0:9", "fps": 1, "time": 0, "size": (4, 3), "fail_fast": True}
    with pytest.raises(FireflyError, match=r"^frame 3: no fourth frame$"):
        capture_frames("tests.cli.glade:failing", tmp_path, **options)
    assert names_in(tmp_path) == {f"color_{index:06d}.png" for index in range(3)} | {"journal.jsonl"}


def test_a_file_that_cannot_be_written_is_one_line(tmp_path, capsys):
    (tmp_path / "color_000001.png").mkdir()
    options = ("--size", "8x6", "--frames", "0:9", "-q", "-o", str(tmp_path), "--overwrite")
    assert main(["capture", GLADE, *options]) == 1
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.startswith(f"firefly: cannot write {tmp_path / 'color_000001.png'}: ")
    assert "color_000000.png" in names_in(tmp_path)
    assert {name for name in names_in(tmp_path) if not name.endswith(".png")} == {"journal.jsonl"}


def test_images_are_encoded_while_the_next_frames_are_drawn(tmp_path, monkeypatch):
    """By other threads, so that the one that draws goes on."""
    from firefly_sample.capture import engine

    threads = set()

    def encode(*arguments):
        threads.add(threading.get_ident())
        return drawing.encode(*arguments)

    monkeypatch.setattr(engine, "encode", encode)
    capture_frames(GLADE, tmp_path, frames="0:4", size=(8, 6))
    assert threads
    assert threading.get_ident() not in threads


def test_a_failure_before_the_first_frame_leaves_nothing(tmp_path):
    with pytest.raises(FireflyError):
        capture_frames(GLADE, tmp_path / "new" / "folder", size=(10**6, 1))
    assert names_in(tmp_path) == set()


def test_a_failure_before_the_first_frame_keeps_an_earlier_capture(tmp_path):
    manifest = capture_frames(GLADE, tmp_path, size=(4, 3))
    with pytest.raises(FireflyError):
        capture_frames(GLADE, tmp_path, size=(10**6, 1))
    assert json.loads((tmp_path / "manifest.json").read_text()) == manifest


def test_ctrl_c_leaves_whole_frames_with_a_journal_and_no_manifest(tmp_path):
    command = [sys.executable, "-m", "firefly_sample.cli", "capture", GLADE]
    options = ["--size", "16x12", "--frames", "0:100000", "-o", "out"]
    process = subprocess.Popen(
        [*command, *options],
        cwd=tmp_path,
        env=environment(),
        stderr=subprocess.PIPE,
        text=True,
        # whoever runs the tests in the background may have had SIGINT ignored, which children inherit
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    out = tmp_path / "out"
    try:
        deadline = time.monotonic() + 600
        while not (out / "color_000003.png").exists():
            assert process.poll() is None, process.communicate()[1]
            assert time.monotonic() < deadline
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=600)
    finally:
        process.kill()
    assert process.returncode == 130
    said, last = err.splitlines()[-2:]
    assert last == "firefly: interrupted"
    count = re.fullmatch(r"firefly: (\d+) of 100000 frames are whole in out; to go on, use --resume", said)
    assert count is not None, err
    assert "Traceback" not in err
    assert names_in(out) >= {"journal.jsonl", *(f"color_{index:06d}.png" for index in range(4))}
    pictures = names_in(out) - {"journal.jsonl"}
    assert 4 <= int(count[1]) == len(pictures)
    for name in pictures:
        with Image.open(out / name) as image:
            assert np.asarray(image).shape == (12, 16, 3)


def test_capture_warns_about_a_software_driver_only_where_there_is_one(tmp_path, recwarn):
    import warnings

    warnings.simplefilter("always", SoftwareDriverWarning)
    manifest = capture_frames(GLADE, tmp_path, frames="0:2", size=(4, 3))
    warned = [warning for warning in recwarn if warning.category is SoftwareDriverWarning]
    assert len(warned) == manifest["software"]


@pytest.mark.parametrize(
    ("frames", "numbers"),
    [("0:3", [0, 1, 2]), ("2:9:3", [2, 5, 8]), ("7", [7]), (7, [7]), (range(4, 0, -2), [4, 2]), ("0:1", [0])],
)
def test_frame_numbers(frames, numbers):
    assert list(parse_frames(frames)) == numbers


@pytest.mark.parametrize(
    "frames",
    ["", "a", "1:", ":3", "0:3:0", "3:3", "5:2", "-1:2", -1, "0:1:2:3", "0:1000001", 10**6, "1.5", "²"],
)
def test_wrong_frame_numbers(frames):
    with pytest.raises(OutputError, match=r"^frames .*"):
        parse_frames(frames)
