"""The processes that `firefly_sample.lab.start` times, each started with ``python -P -m``.

This module imports as little as possible at its top, because every import is part of the timed work.
"""

from __future__ import annotations

import json
import sys
from typing import Any

DEPENDENCIES = ("numpy", "moderngl", "trimesh", "PIL.Image")


def open_context(device: int | None) -> dict[str, Any]:
    """Import the package's dependencies and open a context, as every program of its kind must."""
    from importlib import import_module

    for name in DEPENDENCIES:
        import_module(name)
    from firefly_sample.gpu.device import Device

    made = Device(device)
    answer = {"driver": made.renderer}
    made.release()
    return answer


def first_picture(scene: str, size: tuple[int, int], time: float, device: int | None) -> dict[str, Any]:
    """Draw one frame of a scene with its own settings and read it back."""
    import hashlib

    from firefly_sample.renderer import Renderer
    from firefly_sample.scenes import build_scene, find_scene
    from firefly_sample.scenes.plugin import scene_settings
    from firefly_sample.settings import Settings

    plugin = find_scene(scene)
    built = build_scene(plugin)
    with Renderer(size, Settings(**scene_settings(plugin)), device=device) as renderer:
        frame = renderer.render(built, time)
        return {"driver": frame.driver, "sha256": hashlib.sha256(frame["color"].tobytes()).hexdigest()}


def main() -> int:
    """Do the job in the only argument, which is JSON, and answer in one line of JSON."""
    from firefly_sample.errors import FireflyError

    given, stdout = json.loads(sys.argv[1]), sys.stdout
    sys.stdout = sys.stderr  # only the answer goes to stdout, whatever a scene prints
    try:
        if given["scene"] is None:
            answer = open_context(given["device"])
        else:
            answer = first_picture(given["scene"], tuple(given["size"]), given["time"], given["device"])
    except FireflyError as error:
        answer = {"error": str(error)}
    print(json.dumps(answer), file=stdout, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
