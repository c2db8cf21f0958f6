"""Draws three models side by side, and one that turns: `python -m tests.model.make_pictures [FOLDER]`.

FOLDER is docs/images when absent.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from firefly_sample import Renderer, Settings, model_scene
from firefly_sample.assets import asset_dir
from firefly_sample.scenes.model import scene as model_plugin

SETTINGS = Settings(supersample=2, **model_plugin.settings)
"""What `firefly capture` draws a file with."""
THREE, SIZE = ("lantern", "orrery", "bonsai"), (420, 420)
TURNING, TURNING_SIZE, SECONDS, FPS = "orrery", (400, 300), 4, 12


def draw_three() -> Image.Image:
    """Three models side by side."""
    with Renderer(SIZE, SETTINGS) as renderer:
        pictures = [renderer.render(model_scene(_file(name)), 0.0).color for name in THREE]
    return Image.fromarray(np.hstack(pictures))


def draw_turning() -> list[Image.Image]:
    """One turn of a model, a picture for each frame."""
    scene = model_scene(_file(TURNING), turntable=SECONDS)
    with Renderer(TURNING_SIZE, SETTINGS) as renderer:
        frames = renderer.render_many(scene, [number / FPS for number in range(SECONDS * FPS)])
        return [Image.fromarray(frame.color) for frame in frames]


def main(arguments: list[str]) -> int:
    home = Path(__file__).resolve().parents[2]
    folder = Path(arguments[0]) if arguments else home / "docs" / "images"
    three, turning = folder / "three-models.jpg", folder / "turntable.webp"
    draw_three().save(three, quality=88, optimize=True)
    first, *others = draw_turning()
    duration = round(1000 / FPS)
    first.save(turning, save_all=True, append_images=others, duration=duration, loop=0, quality=75, method=6)
    for path in (three, turning):
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")
    return 0


def _file(name: str) -> Path:
    return asset_dir("models") / f"{name}.glb"


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
