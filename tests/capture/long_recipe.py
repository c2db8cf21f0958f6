"""A thousand frames of the recipe of docs/tabletop.md: ``python -m pytest -s tests/capture/long_recipe.py``.

It takes twelve minutes on two cores; ``RECIPE_FRAMES=20`` in the environment tries it with fewer frames. The
figures that it prints are those of the page.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections import Counter

import numpy as np
import pytest

from firefly_sample.capture.manifest import read_manifest
from firefly_sample.scenes import build_scene, find_scene
from tests.capture.launch import wait_for
from tests.cli.command import environment
from tests.tabletop import installed, objects_of, overlapping, vertices_of

FRAMES = int(os.environ.get("RECIPE_FRAMES", "1000"))
SIZE = "320x240"
SECONDS = 4.0 * FRAMES + 300.0
"""The patience with one capture."""


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    with installed(tmp_path_factory.mktemp("tabletop")) as folder:
        yield folder


@pytest.mark.parametrize("dataset", ["bop", "coco"])
def test_a_killed_capture_ends_with_the_same_bytes(dataset, packages, tmp_path):
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    started = time.monotonic()
    assert start(dataset, whole, packages).wait(SECONDS) == 0
    seconds = time.monotonic() - started

    process = start(dataset, killed, packages)
    wait_for(lambda: lines_in(killed / "journal.jsonl") >= FRAMES // 2, "half of the frames", SECONDS)
    process.send_signal(signal.SIGKILL)
    assert process.wait(SECONDS) == -signal.SIGKILL
    assert FRAMES // 2 <= lines_in(killed / "journal.jsonl") < FRAMES
    assert not (killed / "manifest.json").exists()
    assert start(dataset, killed, packages, "--resume").wait(SECONDS) == 0

    names = files_in(whole)
    assert files_in(killed) == names
    assert [name for name in names if (killed / name).read_bytes() != (whole / name).read_bytes()] == []
    check_frames(dataset, read_manifest(killed)["frames"])

    size = sum((whole / name).stat().st_size for name in names)
    print(
        f"\n{dataset}: {FRAMES} frames of {SIZE} by two workers: {FRAMES / seconds:.2f} frames/s, "
        f"{len(names)} files, {size / 1e6:.1f} MB, {size / 1e3 / FRAMES:.0f} kB per frame"
    )


def check_frames(dataset, frames):
    """Compare the instances of all frames with the scene, in which no two intersect."""
    scene = build_scene(find_scene("tabletop"))
    counts = Counter()
    for number, frame in enumerate(frames):
        assert frame["index"] == number
        scene.update(float(number))
        objects = {path.get_name(): path for path in objects_of(scene)}
        vertices = {name: vertices_of(path) for name, path in objects.items()}
        assert overlapping(vertices) == set(), f"frame {number}"
        for name, points in vertices.items():
            assert abs(points[:, 2].min()) < 1e-6, f"frame {number}: {name}"
        to_world = np.array(frame["camera"]["camera_to_world"]["opencv"])
        instances = {instance["name"].split("/")[2]: instance for instance in frame["instances"]}
        # COCO has only those that are seen
        assert dataset == "coco" or instances.keys() == objects.keys(), f"frame {number}"
        for name, instance in instances.items():
            (model,) = objects[name].get_children()
            assert instance["category"] == model.get_name()
            scaled = np.diag([*[instance["scale"]] * 3, 1.0])
            placed = to_world @ np.array(instance["pose"]) @ scaled
            np.testing.assert_allclose(placed, model.get_net_mat().T, rtol=0, atol=1e-9)
        counts[len(objects)] += 1
    assert sum(counts.values()) == FRAMES
    print(f"\nobjects on the table: {dict(sorted(counts.items()))}")


def start(dataset, folder, packages, *more):
    """``firefly capture tabletop`` in a process of its own."""
    words = ["capture", "tabletop", "--frames", f"0:{FRAMES}", "--fps", "1", "--size", SIZE]
    words += ["--dataset", dataset, "--workers", "2", "--quiet", "-o", str(folder), *more]
    path = os.pathsep.join((str(packages), environment()["PYTHONPATH"]))
    return subprocess.Popen(
        [sys.executable, "-m", "firefly_sample", *words], env=environment(PYTHONPATH=path)
    )


def lines_in(path):
    """The number of whole lines of a file, 0 if there is none."""
    return path.read_bytes().count(b"\n") if path.exists() else 0


def files_in(folder):
    """The names of all files of a capture but its lock, which a killed process leaves."""
    paths = (path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    return sorted(path.as_posix() for path in paths if path.name != ".firefly.lock")
