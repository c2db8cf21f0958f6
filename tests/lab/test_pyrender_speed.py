"""``firefly measure pyrender``, and the table of docs/pyrender.md."""

from __future__ import annotations

import io
import json
import math
import mmap
import sys
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from firefly_sample.cli import main
from firefly_sample.errors import FireflyError
from firefly_sample.lab.fresh import start_process
from firefly_sample.lab.process_tree import own_memory
from firefly_sample.lab.pyrender_process import WAYS
from firefly_sample.lab.pyrender_process import main as process_main
from firefly_sample.lab.pyrender_scenes import SCENES
from firefly_sample.lab.pyrender_speed import (
    SAMPLES,
    measure_pyrender,
    pyrender_as_markdown,
    pyrender_as_text,
)

DOCS = Path(__file__).parents[2] / "docs"
ROW = {"scene", "drawn", "samples", "ms", "pyrender_ms", "ratio", "spread", "converted", "growth"}


def check(result, scenes, ways):
    """The keys of a result, and those of its numbers that any machine has."""
    assert result.keys() == {"size", "frames", "driver", "pyrender", "rows"}
    assert all(isinstance(result[name], str) and result[name] for name in ("driver", "pyrender"))
    expected = [(scene, way, samples) for scene in scenes for way in ways for samples in SAMPLES]
    assert [(row["scene"], row["drawn"], row["samples"]) for row in result["rows"]] == expected
    for row in result["rows"]:
        assert row.keys() == ROW
        assert row["ms"] > 0
        assert row["pyrender_ms"] > 0
        assert row["ratio"] > 0
        assert row["spread"] >= 0
        assert row["converted"] == 0


class KnownTimes:
    """A process whose frames take known times: ours 2 ms, pyrender's 8 ms with four samples, or 3 to 5 ms."""

    def __init__(self):
        self.jobs = []

    def tell(self, job):
        self.jobs.append(job)

    def answer(self):
        *_, job = self.jobs
        kind = self.jobs[0]["renderer"]
        if job is self.jobs[0]:
            return {"driver": f"driver of {kind}"}
        first, end = job["first"], job["end"]
        times = {"ours": 2.0, "4": 8.0, "1": (3.0, 4.0, 5.0)[first % 3]}
        return {
            "milliseconds": [100.0 if frame == 0 else times[kind] for frame in range(first, end)],
            "memory": 1000 * end,
            "converted": 7,
        }


def test_ratios_are_of_blocks_and_the_first_frame_counts_for_nothing(capsys, tmp_path, monkeypatch):
    made = []

    def start_process(module, **variables):
        assert module == "firefly_sample.lab.pyrender_process"
        assert variables == {"PYOPENGL_PLATFORM": "egl"}
        made.append(KnownTimes())
        return nullcontext(made[-1])

    monkeypatch.setattr("firefly_sample.lab.pyrender_speed.start_process", start_process)
    arguments = ("--scenes", "tabletop", "--ways", "depth,segments", "--frames", "60", "--size", "48x36")
    assert main(["measure", "pyrender", *arguments, "-o", str(tmp_path), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    check(result, ["tabletop"], ["depth", "segments"])
    assert (result["size"], result["frames"], result["driver"]) == ([48, 36], 60, "driver of ours")
    for process, kind in zip(made, ("ours", "4", "1"), strict=True):
        assert process.jobs[0] == {"renderer": kind, "scene": "tabletop", "size": (48, 36)}
        for way in ("depth", "segments"):
            drawn = [range(job["first"], job["end"]) for job in process.jobs[1:] if job["way"] == way]
            assert [frame for frames in drawn for frame in frames] == [*range(61)]
    for row in result["rows"]:
        # blocks begin with the frames 1, 21, 31 and 51, where one sample takes 4, 3, 4 and 3 ms
        many = row["samples"] == 4
        assert (row["ms"], row["pyrender_ms"]) == (2.0, 8.0 if many else 4.0)
        assert math.isclose(row["ratio"], 0.25 if many else 0.5 * (2 / 3 + 2 / 4))
        assert math.isclose(row["spread"], 0.0 if many else (2 / 3 - 2 / 4) / (0.5 * (2 / 3 + 2 / 4)))
        assert row["growth"] == 1000 * (60 - 30)
    assert json.loads((tmp_path / "pyrender.json").read_text()) == result
    assert pyrender_as_markdown(result).startswith("60 poses, 48x36, driver of ours, pyrender ")
    assert (tmp_path / "pyrender.md").read_text() == pyrender_as_markdown(result)
    assert pyrender_as_markdown(result).splitlines()[4:6] == [
        "| tabletop | depth | 4 | 2.0 | 8.0 | 0.25 | 0.00 | 0 | 0.0 |",
        "| tabletop | depth | 1 | 2.0 | 4.0 | 0.58 | 0.29 | 0 | 0.0 |",
    ]
    line = pyrender_as_text(result).splitlines()[2]
    assert line.split() == ["tabletop", "depth", "4", "2.0", "8.0", "0.25", "0.00", "0", "0.0"]


def jobs(kind):
    """The first job of a process, and two frames drawn in each way."""
    first = {"renderer": kind, "size": [48, 36], "scene": "one mesh"}
    return [first, *({"way": way, "first": 0, "end": 2} for way in WAYS)]


def test_our_process_draws_in_every_way(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stdin", io.StringIO("".join(json.dumps(job) + "\n" for job in jobs("ours"))))
    assert process_main() == 0
    first, *answers = map(json.loads, capsys.readouterr().out.splitlines())
    assert first["driver"]
    for answer in answers:
        assert len(answer["milliseconds"]) == 2
        assert answer["converted"] == 1
        assert answer["memory"] > 2**20
    assert len(answers) == len(WAYS)


def test_pyrenders_process_draws_in_every_way():
    with start_process("firefly_sample.lab.pyrender_process", PYOPENGL_PLATFORM="egl") as process:
        for job in jobs("1"):
            process.tell(job)
            answer = process.answer()
    assert len(answer["milliseconds"]) == 2


def test_what_cannot_be_measured_is_said_in_one_line(capsys, monkeypatch):
    for arguments, said in {
        ("--scenes", "tabeltop"): "there is no scene 'tabeltop' (did you mean 'tabletop'?)",
        ("--ways", "colour"): "there is no way 'colour'",
        ("--frames", "1"): "give two or more",
    }.items():
        assert main(["measure", "pyrender", *arguments]) == 1
        assert said in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "pyrender", None)
    with pytest.raises(FireflyError, match=r"pyrender cannot be imported .* pip install .*pyrender"):
        measure_pyrender()


def test_a_process_that_cannot_draw_says_why(monkeypatch, capsys):
    job = {"renderer": "ours", "size": [0, 1], "scene": "one mesh"}
    monkeypatch.setattr(sys, "stdin", io.StringIO(json.dumps(job) + "\n"))
    assert process_main() == 0
    assert "size must be two whole numbers" in json.loads(capsys.readouterr().out)["error"]


def test_memory_of_ones_own_grows_by_what_is_written():
    before = own_memory()
    pages = mmap.mmap(-1, 2**26, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)  # new, unlike a heap's
    pages[:] = b"1" * 2**26
    grown = own_memory() - before
    pages.close()
    assert abs(grown - 2**26) < 2**22  # the text is freed, in part
    assert abs(own_memory() - before) < 2**22


@pytest.mark.parametrize("name", SCENES)
def test_every_frame_of_a_scene_has_poses_of_its_own(name):
    posed = SCENES[name]()
    poses = set()
    for frame in range(3):
        posed.pose(frame)
        for node in (posed.camera, *posed.moving):
            pose = posed.scene.get_pose(node)
            poses.add(pose.tobytes())
            assert np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3))
        eye, back = posed.scene.get_pose(posed.camera)[:3, 3], posed.scene.get_pose(posed.camera)[:3, 2]
        assert np.allclose(np.linalg.norm(eye) * back, eye)  # it looks at the origin
    assert len(poses) == 3 * (1 + len(posed.moving))


def test_the_page_has_the_measured_table():
    result = json.loads((DOCS / "measured/pyrender/pyrender.json").read_text())
    check(result, SCENES, WAYS)
    assert result["frames"] >= 200
    assert pyrender_as_markdown(result) in (DOCS / "pyrender.md").read_text()
