"""Made-up frames of a capture, with files, whose data sets are known."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
from pycocotools import mask as coco_masks

from firefly_sample.capture.layout import Layout, layout_of

WIDTH, HEIGHT = 8, 6
DEPTH_SCALE = 0.002
CODE = 2000
"""Of a wall four units before the camera."""
LOOKS_ALONG_Y = [[1.0, 0, 0, 1], [0, 0, 1, -2], [0, -1, 0, 3], [0, 0, 0, 1]]
"""The columns are the camera's right, down, forward and position in a world with Z up."""
LOOKS_ALONG_MINUS_X = [[0.0, 0, -1, 5], [1, 0, 0, 0], [0, -1, 0, 3], [0, 0, 0, 1]]
CAPTURE: dict[str, Any] = {
    "folder": "",
    "version": "1.2",
    "formats": {"color": "png", "depth": "png16"},
    "depth_scale": DEPTH_SCALE,
    "categories": ["box", "cup"],
}


def camera(opencv: list[list[float]] = LOOKS_ALONG_Y, **changes: Any) -> dict[str, Any]:
    """A camera of 8 x 6 pixels: its principal point is half a pixel above the middle of the picture."""
    opengl = [[row[0], -row[1], -row[2], row[3]] for row in opencv]
    panda3d = [[row[0], row[2], -row[1], row[3]] for row in opencv]
    return {
        "projection": "perspective",
        "width": WIDTH,
        "height": HEIGHT,
        "fx": 4.0,
        "fy": 5.0,
        "cx": 3.5,
        "cy": 2.0,
        "pixel_center": 0.0,
        "near": 0.1,
        "far": None,
        "camera_to_world": {"panda3d": panda3d, "opengl": opengl, "opencv": opencv},
        **changes,
    }


def block(left: int, top: int, width: int, height: int) -> np.ndarray:
    mask = np.zeros((HEIGHT, WIDTH), dtype=bool)
    mask[top : top + height, left : left + width] = True
    return mask


def instance(category: str, seen: np.ndarray, box: list[int], **changes: Any) -> dict[str, Any]:
    """An instance 1.5 units before the camera, turned by a quarter about its axis, and half out of sight."""
    rle = coco_masks.encode(np.asfortranarray(seen))
    return {
        "name": f"scene/{category}",
        "category": category,
        "ids": [3, 4],
        "pose": [[0.0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 1.5], [0, 0, 0, 1]],
        "scale": 1.0,
        "visible": {"pixels": int(seen.sum()), "box": box},
        "whole": {"pixels": 20, "in_picture": 12, "box": [-2, 1, 5, 4]},
        "rle": {"size": list(rle["size"]), "counts": rle["counts"].decode()},
        **changes,
    }


def entry(index: int, layout: Layout, outputs: dict[str, str], **changes: Any) -> dict[str, Any]:
    """A frame whose files are named by a layout; the endings of their names are given by output."""
    files = {output: layout.path(output, index, suffix) for output, suffix in outputs.items()}
    return {"index": index, "time": 0.0, "lights": {}, "files": files, "camera": camera(), **changes}


def two_frames(dataset: str) -> list[dict[str, Any]]:
    """Frames 4 and 7, by two cameras, with a cup in both and a box that is in sight in one of them."""
    layout, outputs = layout_of(dataset), {"color": ".png", "depth": ".png"}
    cup, away = instance("cup", block(0, 1, 5, 1), [0, 1, 5, 1]), block(0, 0, 0, 0)
    box = instance("box", block(6, 3, 2, 3), [6, 3, 2, 3])
    hidden = instance("box", away, [0, 0, 0, 0])
    other = camera(LOOKS_ALONG_MINUS_X)
    return [
        entry(4, layout, outputs, instances=[cup, box]),
        entry(7, layout, outputs, instances=[hidden, dict(cup)], camera=other),
    ]


def put_files(folder: Path, frames: list[dict[str, Any]], depth_hole: tuple[int, int] = (2, 5)) -> None:
    """Write grey pictures, and depths that are the same everywhere but at one pixel, where nothing is."""
    codes = np.full((HEIGHT, WIDTH), CODE, dtype=np.uint16)
    codes[depth_hole] = 0
    for frame in frames:
        for output, path in frame["files"].items():
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            pixels = codes if output == "depth" else np.full((HEIGHT, WIDTH, 3), frame["index"], np.uint8)
            PIL.Image.fromarray(pixels).save(folder / path)


def put_masks(folder: Path, frames: list[dict[str, Any]], layout: Layout) -> None:
    """Write the masks of instances: what is seen of them, and the left half of the picture as their whole."""
    for frame in frames:
        for number, each in enumerate(frame["instances"]):
            with warnings.catch_warnings():  # pycocotools has not caught up with NumPy 2
                warnings.simplefilter("ignore", DeprecationWarning)
                seen = coco_masks.decode(each["rle"]) * np.uint8(255)
            whole = block(0, 1, 3, 4) * np.uint8(255)
            for kind, mask in (("mask_visib", seen), ("mask", whole)):
                path = folder / layout.path(f"{kind}/{number}", frame["index"], ".png")
                path.parent.mkdir(exist_ok=True)
                PIL.Image.fromarray(mask).save(path)
