"""Two pictures of one Panda3D scene, Panda3D's own and ours, and how they agree."""

from __future__ import annotations

import warnings

from firefly_sample import Renderer, Settings
from firefly_sample.interop.panda3d import from_panda3d
from tests.panda.agreement import agreement as agreement
from tests.panda.oracle import SIZE
from tests.panda.scenes import Build


def draw_ours(build: Build, *arguments, size=SIZE, **changes):
    """Our Frame of what `build` builds, with its colour, depth and the lines of its warnings."""
    root, camera = build(*arguments)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        scene = from_panda3d(root, camera)
        with Renderer(size, Settings(**({"look": "panda3d"} | changes))) as renderer:
            frame = renderer.render(scene, outputs=("color", "color_alpha", "depth"))
    return frame, [str(warning.message) for warning in caught]
