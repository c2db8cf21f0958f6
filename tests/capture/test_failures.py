"""Frames that cannot be drawn: the others are whole, the manifest names them, and resuming tries again."""

from __future__ import annotations

import json

import pytest

from firefly_sample.capture.manifest import read_manifest
from firefly_sample.cli import main
from firefly_sample.errors import FireflyError, GpuError
from firefly_sample.renderer import Renderer
from tests.capture.captures import capture, content

pytestmark = [
    pytest.mark.filterwarnings("ignore::firefly_sample.SoftwareDriverWarning"),
    pytest.mark.filterwarnings("ignore:frame .* cannot be drawn:UserWarning"),
]
PLUGIN = """
import json, sys
from pathlib import Path
from firefly_sample import Scene

def fail(how):
    if how == "exit":
        sys.exit("enough")
    if how == "generator":
        raise GeneratorExit
    raise ValueError(f"no\\nframe")

class Trouble(Scene):
    def update(self, time):
        how = json.loads(Path("trouble.json").read_text()).get(str(int(time)))
        if how:
            fail(how)
        self.background = (time / 9, 0.5, 0.5)

class Plugin:
    name, summary, parameters = "trouble", "Fails where a file says so.", ()

    def build(self):
        if Path("no build").exists():
            raise ValueError("no scene")
        return Trouble()

plugin = Plugin()
"""


@pytest.fixture
def fail(tmp_path, monkeypatch):
    """``fail({3: "value"})`` chooses the frames that fail, and how."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "trouble_plugin.py").write_text(PLUGIN)

    def choose(how):
        (tmp_path / "trouble.json").write_text(json.dumps(how))

    choose({})
    return choose


def draw(folder, **options):
    return capture(folder, "trouble_plugin:plugin", **({"parameters": {}} | options))


def numbers(frames):
    return [frame["index"] for frame in frames]


@pytest.mark.parametrize(
    ("failing", "how"),
    [
        *(([0], "value"), ([5], "value"), ([0, 1, 4, 5], "value"), ([1, 2, 3, 4], "value"), ([3], "value")),
        *(([3], "exit"), ([0, 1, 4, 5], "exit"), ([2, 3], "generator"), ([5], "generator")),
    ],
    ids=str,
)
def test_the_others_are_as_without_it_and_it_is_tried_again(tmp_path, fail, failing, how):
    fail(dict.fromkeys(failing, how))
    manifest = draw(tmp_path / "out")
    assert numbers(manifest["failed"]) == failing
    assert numbers(manifest["frames"]) == [index for index in range(6) if index not in failing]
    for failed in manifest["failed"]:
        assert failed["time"] == failed["index"]
        assert failed["error"].startswith("scene 'trouble")
        assert "trouble_plugin.py:" in failed["error"]
        assert "\n" not in failed["error"]
    fail({})
    draw(tmp_path / "whole")
    before = content(tmp_path / "out")
    assert before.keys() < content(tmp_path / "whole").keys()
    draw(tmp_path / "out", resume=True)
    assert content(tmp_path / "out") == content(tmp_path / "whole")


def test_frames_that_failed_stay_named_when_others_are_asked_for(tmp_path, fail):
    fail({3: "value"})
    draw(tmp_path / "out", frames="0:5")
    manifest = draw(tmp_path / "out", frames="5:6", resume=True)
    assert numbers(manifest["failed"]) == [3]
    assert numbers(manifest["frames"]) == [0, 1, 2, 4, 5]


def test_a_frame_that_was_whole_and_now_fails_leaves_no_file(tmp_path, fail):
    draw(tmp_path / "out")
    (tmp_path / "out" / "color_000003.png").write_bytes(b"damaged")
    fail({3: "value"})
    assert numbers(draw(tmp_path / "out", resume=True)["failed"]) == [3]
    assert "color_000003.png" not in content(tmp_path / "out")


def test_if_none_can_be_drawn_it_is_an_error_and_nothing_is_left(tmp_path, fail):
    fail(dict.fromkeys(range(6), "value"))
    with pytest.raises(FireflyError, match=r"^scene 'trouble.*: ValueError: no frame"):
        draw(tmp_path / "out")
    assert not (tmp_path / "out").exists()
    fail({})
    (tmp_path / "no build").touch()
    with pytest.raises(FireflyError, match=r"^scene 'trouble.*: ValueError: no scene"):
        draw(tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_frame_that_cannot_be_read_is_not_taken_for_the_next_one(tmp_path, fail, monkeypatch):
    """The next one has been begun by then."""
    read, count = Renderer._read_behind, iter(range(100))

    def read_behind(renderer, pending):
        if next(count) == 2:
            pending.give_back(renderer._gpu)
            raise GpuError("lost")
        return read(renderer, pending)

    draw(tmp_path / "whole")
    with monkeypatch.context() as patch:
        patch.setattr(Renderer, "_read_behind", read_behind)
        assert draw(tmp_path / "out")["failed"] == [{"index": 2, "time": 2.0, "error": "lost"}]
    draw(tmp_path / "out", resume=True)
    assert content(tmp_path / "out") == content(tmp_path / "whole")


def test_failing_fast_stops_at_the_first_and_keeps_those_before(tmp_path, fail):
    fail({3: "value", 4: "value"})
    with pytest.raises(FireflyError, match=r"^frame 3: scene 'trouble.*: ValueError: no frame"):
        draw(tmp_path / "out", fail_fast=True)
    assert content(tmp_path / "out").keys() == {*(f"color_00000{n}.png" for n in range(3)), "journal.jsonl"}
    fail({})
    draw(tmp_path / "whole")
    draw(tmp_path / "out", fail_fast=True, resume=True)
    assert content(tmp_path / "out") == content(tmp_path / "whole")


def test_the_first_few_are_warned_of(tmp_path, fail):
    fail(dict.fromkeys(range(1, 20), "value"))
    with pytest.warns(UserWarning, match="^frame 1 cannot be drawn") as caught:
        manifest = draw(tmp_path / "out", frames="0:20")
    said = [str(one.message) for one in caught if "cannot be drawn" in str(one.message)]
    assert [text.partition(" cannot")[0] for text in said] == [f"frame {number}" for number in range(1, 6)]
    assert len(manifest["failed"]) == 19


def test_a_combination_that_cannot_be_built_does_not_lose_the_others(tmp_path):
    """A failure of the scene itself; the combination has no folder."""
    sweep = {"model": [str(tmp_path / "none.glb"), str(tmp_path / "flat.obj")]}
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    options = {"sweep": sweep, "frames": "0:2", "parameters": {}}
    manifest = capture(tmp_path / "out", "tests.cli.glade:statue", **options)
    failed, whole = sorted(manifest["captures"], key=lambda each: len(each["frames"]))
    assert (numbers(failed["failed"]), numbers(failed["frames"])) == ([0, 1], [])
    assert (numbers(whole["failed"]), numbers(whole["frames"])) == ([], [0, 1])
    assert {name.partition("/")[0] for name in content(tmp_path / "out")} == {
        "manifest.json",
        whole["folder"],
    }


def test_exit_codes_and_lines_of_the_command(tmp_path, fail, capsys):
    words = [
        "capture",
        "trouble_plugin:plugin",
        "--size",
        "8x6",
        "--frames",
        "0:4",
        "--fps",
        "1",
        "--time",
        "0",
    ]
    words += ["-o", str(tmp_path / "out"), "-q"]
    fail({3: "value"})
    assert main(words) == 3
    err = capsys.readouterr().err.splitlines()
    assert err[-1] == "firefly: 1 frame could not be drawn: --resume tries again"
    assert sum("frame 3 cannot be drawn: scene 'trouble" in line for line in err) == 1
    assert all(line.startswith("firefly: ") for line in err)
    assert main([*words, "--resume"]) == 3
    assert main([*words, "--resume", "--fail-fast"]) == 1
    assert capsys.readouterr().err.splitlines()[-1].startswith("firefly: frame 3: scene 'trouble")
    fail({})
    assert main([*words, "--resume"]) == 0
    assert numbers(read_manifest(tmp_path / "out")["frames"]) == [0, 1, 2, 3]
