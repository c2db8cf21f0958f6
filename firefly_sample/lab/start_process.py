"""The work of the processes that `firefly_sample.lab.start` times, each started with ``python -P -m``.

It imports nothing before it is told what to do: each import is part of what is timed.
"""

from __future__ import annotations

import json
import sys
from typing import Any

DEPENDENCIES = ("numpy", "moderngl", "trimesh", "PIL.Image")


def open_context(device: int | None) -> dict[str, Any]:
    """Import what the package stands on, and open a context: as much as any program of its kind must do."""
    from importlib import import_module

    for name in DEPENDENCIES:
        import_module(name)
    from firefly_sample.gpu.device import Device

    made = Device(device)
    answer = {"driver": made.renderer}
    made.release()
    return answer


def first_picture(scene: str, size: tuple[int, int], time: float, device: int | None) -> dict[str, Any]:
    """Draw one frame of a scene and read it back."""
    import hashlib

    from firefly_sample.renderer import Renderer
    from firefly_sample.scenes import build_scene, find_scene

    built = build_scene(find_scene(scene))
    with Renderer(size, device=device) as renderer:
        frame = renderer.render(built, time)
        return {"driver": frame.driver, "sha256": hashlib.sha256(frame["color"].tobytes()).hexdigest()}


def main() -> int:
    """Do what the only argument says, in JSON, and answer in one line of JSON."""
    from firefly_sample.errors import FireflyError

    given, stdout = json.loads(sys.argv[1]), sys.stdout
    sys.stdout = sys.stderr  # the answer alone is on stdout, whatever a scene prints
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
