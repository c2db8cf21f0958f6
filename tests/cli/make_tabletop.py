"""Draws twelve frames of the recipe of docs/tabletop.md: `python -m tests.cli.make_tabletop [FILE]`.

FILE is docs/images/tabletop.jpg when absent.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

from firefly_sample import Renderer, Settings
from firefly_sample.scenes import build_scene, find_scene
from tests.tabletop import installed

SIZE, COLUMNS, FRAMES = (320, 240), 4, 12


def draw_frames() -> Image.Image:
    """The first frames in rows."""
    with tempfile.TemporaryDirectory() as folder, installed(Path(folder)):
        scene = build_scene(find_scene("tabletop"))
    with Renderer(SIZE, Settings(supersample=2)) as renderer:
        frames = renderer.render_many(scene, [float(number) for number in range(FRAMES)])
        pictures = [frame.color for frame in frames]
    rows = [np.hstack(pictures[start : start + COLUMNS]) for start in range(0, FRAMES, COLUMNS)]
    return Image.fromarray(np.vstack(rows))


def main(arguments: list[str]) -> int:
    home = Path(__file__).resolve().parents[2]
    path = Path(arguments[0]) if arguments else home / "docs" / "images" / "tabletop.jpg"
    draw_frames().save(path, quality=88, optimize=True)
    print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
