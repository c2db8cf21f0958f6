"""Draws what captures make for docs/: `python -m tests.capture.make_pictures [FOLDER]`.

A bonsai from twelve sides, a frame of BOP with its masks, and films of several qualities, enlarged. FOLDER
is docs/images when absent.
"""

from __future__ import annotations

import json
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from firefly_sample import SoftwareDriverWarning, capture_frames
from firefly_sample.assets import model_path
from firefly_sample.encoding.films import read_film
from tests.tabletop import installed

PAPER, TEXT, GAP, LABEL = (250, 249, 246), (40, 40, 44), 8, 20
COLORS = np.array(
    [(230, 80, 60), (60, 160, 230), (90, 190, 90), (240, 180, 50), (160, 110, 220), (80, 200, 190)]
)
BOP_FRAME = 8
FILMS = {
    "as drawn": (".apng", {}),
    "MP4": (".mp4", {}),
    "MP4, crf 28": (".mp4", {"crf": 28}),
    "GIF": (".gif", {}),
}
CROP, TIMES = (400, 150, 496, 222), 2


def assemble(pictures: dict[str, Image.Image]) -> Image.Image:
    """Pictures of one size in a row, each with its label below."""
    width, height = next(iter(pictures.values())).size
    sheet = Image.new("RGB", (len(pictures) * (width + GAP) + GAP, height + LABEL + GAP), PAPER)
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(12)
    for number, (label, picture) in enumerate(pictures.items()):
        left = GAP + number * (width + GAP)
        sheet.paste(picture, (left, GAP))
        pen.text((left + width / 2, GAP + height + 4), label, TEXT, font, anchor="ma")
    return sheet


def draw_orbit(folder: Path) -> Image.Image:
    """Twelve views of a model, in two rows."""
    manifest = capture_frames(
        str(model_path("bonsai.glb")), folder / "orbit", views="orbit:12", size=(120, 120)
    )
    pictures = [
        np.asarray(Image.open(folder / "orbit" / frame["files"]["color"])) for frame in manifest["frames"]
    ]
    return Image.fromarray(np.vstack([np.hstack(pictures[:6]), np.hstack(pictures[6:])]))


def draw_bop(folder: Path) -> Image.Image:
    """A frame of the recipe of docs/tabletop.md as a scene of BOP."""
    with installed(folder):
        scene = folder / "bop"
        capture_frames("tabletop", scene, frames=BOP_FRAME, fps=1, size=(240, 180), dataset="bop")
    name = f"{BOP_FRAME:06d}"
    picture = np.asarray(Image.open(scene / "rgb" / f"{name}.png"))
    known = json.loads((scene / "scene_gt_info.json").read_text())[str(BOP_FRAME)]
    visible = 0.35 * picture
    for number in range(len(known)):
        mask = np.asarray(Image.open(scene / "mask_visib" / f"{name}_{number:06d}.png")) > 0
        visible[mask] = 0.35 * picture[mask] + 0.65 * COLORS[number % len(COLORS)]
    boxed = Image.fromarray(visible.astype(np.uint8))
    pen = ImageDraw.Draw(boxed)
    for number, one in enumerate(known):
        x, y, width, height = one["bbox_visib"]
        if width > 0:
            pen.rectangle((x, y, x + width - 1, y + height - 1), outline=tuple(COLORS[number % len(COLORS)]))
    shares = [one["px_count_visib"] / max(one["px_count_valid"], 1) for one in known]
    hidden = int(np.argmin(shares))
    whole = np.asarray(Image.open(scene / "mask" / f"{name}_{hidden:06d}.png")) > 0
    seen = np.asarray(Image.open(scene / "mask_visib" / f"{name}_{hidden:06d}.png")) > 0
    both = np.where(whole[..., None], (110, 110, 116), (20, 20, 24))
    both[seen] = COLORS[hidden % len(COLORS)]
    depth = np.asarray(Image.open(scene / "depth" / f"{name}.png")).astype(float)
    near, far = depth[depth > 0].min(), depth.max()
    grey = np.where(depth > 0, 255 - 215 * (depth - near) / (far - near), 0)
    return assemble(
        {
            "rgb": Image.fromarray(picture),
            "depth": Image.fromarray(np.repeat(grey.astype(np.uint8)[..., None], 3, axis=2)),
            "mask_visib and bbox_visib": boxed,
            f"mask of an object, {shares[hidden]:.0%} visible": Image.fromarray(both.astype(np.uint8)),
        }
    )


def draw_films(folder: Path) -> Image.Image:
    """A detail of the last of twelve frames, read back from several films."""
    pictures = {}
    for number, (label, (suffix, choices)) in enumerate(FILMS.items()):
        film = folder / f"{number}{suffix}"
        capture_frames("forest", film, frames="0:12", size=(640, 360), **choices)
        *_, last = read_film(film)
        detail = Image.fromarray(last).crop(CROP)
        pictures[label] = detail.resize(
            (TIMES * detail.width, TIMES * detail.height), Image.Resampling.NEAREST
        )
    return assemble(pictures)


def main(arguments: list[str]) -> int:
    home = Path(__file__).resolve().parents[2]
    target = Path(arguments[0]) if arguments else home / "docs" / "images"
    warnings.simplefilter("ignore", SoftwareDriverWarning)
    for name, draw in (("orbit", draw_orbit), ("bop", draw_bop), ("film-quality", draw_films)):
        with tempfile.TemporaryDirectory() as folder:
            picture = draw(Path(folder))
        path = target / f"{name}.png"
        picture.save(path, optimize=True)
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
