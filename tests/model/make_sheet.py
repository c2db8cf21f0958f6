"""Draws every file of `sheet_files` for docs/: `python -m tests.model.make_sheet [FILE]`.

FILE is docs/images/models.jpg when absent.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from firefly_sample import Renderer, model_scene
from tests.model.make_pictures import SETTINGS
from tests.model.sheet_files import FILES, TIMES

SIZE = 160, 120
COLUMNS, GAP, LABEL = 6, 8, 20
PAPER, TEXT = (250, 249, 246), (40, 40, 44)


def write_files(folder: Path) -> dict[str, Path]:
    """Write all files into a folder; returns their paths by label."""
    paths = {}
    for number, (label, make) in enumerate(FILES.items()):
        paths[label] = folder / f"{number:02}.glb"
        paths[label].write_bytes(make().glb())
    return paths


def draw(renderer: Renderer, path: Path, time: float = 0.0) -> np.ndarray:
    """The picture of a file at a time in seconds."""
    return renderer.render(model_scene(path), time).color


def assemble(pictures: dict[str, np.ndarray]) -> Image.Image:
    """Pictures in rows, each with its label below."""
    rows = -(-len(pictures) // COLUMNS)
    width, height = SIZE[0] + GAP, SIZE[1] + LABEL + GAP
    sheet = Image.new("RGB", (COLUMNS * width + GAP, rows * height + GAP), PAPER)
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(12)
    for number, (label, pixels) in enumerate(pictures.items()):
        x, y = GAP + number % COLUMNS * width, GAP + number // COLUMNS * height
        sheet.paste(Image.fromarray(pixels), (x, y))
        pen.text((x + SIZE[0] / 2, y + SIZE[1] + 4), label, TEXT, font, anchor="ma")
    return sheet


def main(arguments: list[str]) -> int:
    home = Path(__file__).resolve().parents[2]
    target = Path(arguments[0]) if arguments else home / "docs" / "images" / "models.jpg"
    with (
        tempfile.TemporaryDirectory() as folder,
        Renderer(SIZE, SETTINGS) as renderer,
    ):
        paths = write_files(Path(folder))
        pictures = {label: draw(renderer, path, TIMES.get(label, 0.0)) for label, path in paths.items()}
    assemble(pictures).save(target, quality=88, optimize=True)
    print(f"{target}: {target.stat().st_size / 1e3:.0f} kB")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
