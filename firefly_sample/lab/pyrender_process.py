"""The processes that `firefly_sample.lab.pyrender_speed` times: each draws one scene with one renderer.

Each line of its input is a job, and each line of its output an answer, in JSON.
"""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Callable
from time import perf_counter
from typing import Any

import firefly_sample.interop.pyrender as pyrender
from firefly_sample.lab.process_tree import own_memory
from firefly_sample.lab.pyrender_scenes import SCENES, PosedScene

Draw = Callable[[PosedScene], None]


def _ways(renderer: Any, flags: Any) -> dict[str, Draw]:
    """Return what draws a frame of a scene, by the names under which it is measured."""

    def color(posed: PosedScene) -> None:
        renderer.render(posed.scene)

    def depth(posed: PosedScene) -> None:
        renderer.render(posed.scene, flags.DEPTH_ONLY)

    def segments(posed: PosedScene) -> None:
        renderer.render(posed.scene, flags.SEG, posed.segments)

    def both(posed: PosedScene) -> None:
        color(posed)
        segments(posed)

    return {"color+depth": color, "depth": depth, "segments": segments, "color+segments": both}


WAYS = tuple(_ways(None, None))
"""The flags that a frame is drawn with: none, DEPTH_ONLY, SEG, and none and SEG in turn."""


def _make_renderer(kind: str, size: tuple[int, int]) -> Any:
    """Return a renderer: "ours", or pyrender's with so many samples a pixel, "4" or "1"."""
    if kind == "ours":
        return pyrender.OffscreenRenderer(*size)
    from firefly_sample.interop.pyrender.package import import_pyrender

    original = import_pyrender()
    if kind == "1":
        module = original.renderer
        storage = module.glRenderbufferStorageMultisample
        module.glRenderbufferStorageMultisample = lambda target, _, *rest: storage(target, 0, *rest)
    return original.OffscreenRenderer(*size)


def _timed(draw: Draw, posed: PosedScene, frames: range) -> list[float]:
    """Return the milliseconds of each frame, without those of setting its poses."""
    milliseconds = []
    for frame in frames:
        posed.pose(frame)
        start = perf_counter()
        draw(posed)
        milliseconds.append(1e3 * (perf_counter() - start))
    return milliseconds


def _driver() -> str:
    from firefly_sample.gpu.device import Device

    device = Device()
    try:
        return device.renderer
    finally:
        device.release()


def main() -> int:
    """Do the jobs on stdin until it ends; the first one names the renderer, the size and the scene."""
    from firefly_sample.errors import FireflyError, SoftwareDriverWarning

    warnings.simplefilter("ignore", SoftwareDriverWarning)
    stdout, sys.stdout = sys.stdout, sys.stderr  # only answers go to stdout, whatever a library prints

    def answer(told: dict[str, Any]) -> None:
        print(json.dumps(told), file=stdout, flush=True)

    first = json.loads(sys.stdin.readline())
    try:
        ours = first["renderer"] == "ours"
        driver = _driver() if ours else ""
        renderer, posed = _make_renderer(first["renderer"], tuple(first["size"])), SCENES[first["scene"]]()
    except FireflyError as error:
        answer({"error": str(error)})
        return 0
    ways = _ways(renderer, pyrender.RenderFlags)
    answer({"driver": driver})
    for line in sys.stdin:
        job = json.loads(line)
        milliseconds = _timed(ways[job["way"]], posed, range(job["first"], job["end"]))
        meshes = renderer.converted_meshes if ours else 0
        answer({"milliseconds": milliseconds, "memory": own_memory(), "converted": meshes})
    renderer.delete()
    return 0


if __name__ == "__main__":
    sys.exit(main())
