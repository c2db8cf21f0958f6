"""Readers of data sets, written from the descriptions of their formats and not from this package.

Each gives the pictures of a folder with their cameras in one convention, whatever that of the format is.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import PIL.Image

FLIP = np.diag([1.0, -1.0, -1.0, 1.0])
"""From OpenGL's axes of a camera to OpenCV's, and back."""


@dataclass
class Thing:
    """One instance in a picture: its object's number, and what the format says of it."""

    number: int
    pose: np.ndarray
    """From the model to the camera (right, down, forward), with lengths in metres."""
    seen: np.ndarray
    """The pixels that are seen."""
    whole: np.ndarray
    """The pixels as if nothing else were there."""
    info: dict


@dataclass
class Picture:
    """One picture, and what is known of it."""

    path: Path
    k: np.ndarray
    """K, shape (3, 3)."""
    pixel_center: float
    """What K gives for the middle of the first pixel."""
    camera_to_world: np.ndarray
    """Shape (4, 4); the camera's axes are right, down and forward. Lengths in scene units, or metres."""
    depth: np.ndarray | None = None
    """Along the forward axis, in the same unit; NaN where there is nothing."""
    time: float | None = None
    things: list[Thing] = field(default_factory=list)

    @property
    def pixels(self) -> np.ndarray:
        return np.asarray(PIL.Image.open(self.path))

    def world_points(self) -> np.ndarray:
        """The point in the world at each pixel, shape (height, width, 3)."""
        rows, columns = np.indices(self.depth.shape)
        ones = np.ones(self.depth.shape)
        at = np.stack([columns + self.pixel_center, rows + self.pixel_center, ones], axis=-1)
        rays = at @ np.linalg.inv(self.k).T
        points = rays * self.depth[..., None]
        return points @ self.camera_to_world[:3, :3].T + self.camera_to_world[:3, 3]


def read_codes(path: Path) -> np.ndarray:
    """The codes of a PNG of 16 bits, which must be grey."""
    with PIL.Image.open(path) as image:
        assert image.mode.startswith("I;16"), image.mode
        return np.asarray(image).astype(np.float64)


def read_mask(path: Path) -> np.ndarray:
    with PIL.Image.open(path) as image:
        assert image.mode == "L", image.mode
        mask = np.asarray(image)
    assert set(np.unique(mask)) <= {0, 255}
    return mask > 0


def or_nothing(codes: np.ndarray, scale: float) -> np.ndarray:
    return np.where(codes == 0, np.nan, codes * scale)


def read_nerf(folder: Path) -> list[Picture]:
    """The pictures of a ``transforms.json``, sorted by path as its readers do.

    A value for all frames wins over one of a frame, as in nerfstudio. The columns of a matrix are right, up,
    backward and the position of the camera. K counts from the corner of the picture.
    """
    content = json.loads((folder / "transforms.json").read_text())
    assert content["camera_model"] == "OPENCV"
    assert not any(content.get(name, 0) for name in ("k1", "k2", "k3", "p1", "p2"))
    pictures = []
    for frame in sorted(content["frames"], key=lambda frame: frame["file_path"]):
        known = {**frame, **content}
        k = np.array(
            [[known["fl_x"], 0, known["cx"]], [0, known["fl_y"], known["cy"]], [0, 0, 1]], dtype=np.float64
        )
        matrix = np.array(frame["transform_matrix"])
        assert matrix.shape == (4, 4)
        picture = Picture(folder / frame["file_path"], k, 0.5, matrix @ FLIP, time=frame.get("time"))
        with PIL.Image.open(picture.path) as image:
            assert image.size == (known["w"], known["h"])
        if "depth_file_path" in frame:
            assert frame["depth_path"] == frame["depth_file_path"]
            codes = read_codes(folder / frame["depth_file_path"])
            picture.depth = or_nothing(codes, content["integer_depth_scale"])
        pictures.append(picture)
    return pictures


def read_bop(folder: Path) -> list[Picture]:
    """The pictures of a scene of BOP, by their numbers. Lengths are millimetres there, and metres here.

    K counts from the middle of the first pixel, as the toolkit's conversion of depths to points does.
    """
    cameras, poses, infos = (
        json.loads((folder / f"{name}.json").read_text())
        for name in ("scene_camera", "scene_gt", "scene_gt_info")
    )
    assert list(cameras) == list(poses) == list(infos)
    pictures = []
    for image in sorted(map(int, cameras)):
        camera = cameras[str(image)]
        world_to_camera = matrix(camera["cam_R_w2c"], camera["cam_t_w2c"])
        (path,) = folder.glob(f"rgb/{image:06d}.*")
        codes = read_codes(folder / f"depth/{image:06d}.png")
        picture = Picture(
            path,
            np.array(camera["cam_K"]).reshape(3, 3),
            0.0,
            np.linalg.inv(world_to_camera),
            or_nothing(codes, camera["depth_scale"] / 1000.0),
        )
        pairs = zip(poses[str(image)], infos[str(image)], strict=True)
        for number, (pose, info) in enumerate(pairs):
            seen, whole = (
                read_mask(folder / f"{kind}/{image:06d}_{number:06d}.png") for kind in ("mask_visib", "mask")
            )
            model_to_camera = matrix(pose["cam_R_m2c"], pose["cam_t_m2c"])
            picture.things.append(Thing(pose["obj_id"], model_to_camera, seen, whole, info))
        pictures.append(picture)
    return pictures


def matrix(rotation: list[float], millimetres: list[float]) -> np.ndarray:
    made = np.eye(4)
    made[:3, :3] = np.array(rotation).reshape(3, 3)
    made[:3, 3] = np.array(millimetres) / 1000.0
    return made
