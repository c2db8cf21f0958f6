"""BOP: a scene in the layout of the benchmark for 6D object poses."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from firefly_sample.capture.datasets.dataset import (
    Dataset,
    Frame,
    Frames,
    Matrix,
    as_json,
    category_ids,
    write_joined,
)
from firefly_sample.errors import OutputError
from firefly_sample.whole_files import open_whole

MILLIMETRES = 1000.0
"""BOP's unit in one scene unit, which is a metre."""
NOWHERE = [-1, -1, -1, -1]
"""The box of an instance without a visible pixel."""


class Bop(Dataset):
    """Pictures, depth in millimetres, masks, and the pose of every instance."""

    name = "bop"
    outputs = ("color", "depth")
    formats = MappingProxyType({"depth": "png16"})
    needs = frozenset({"instances", "whole masks"})
    documents = ("scene_camera.json", "scene_gt.json", "scene_gt_info.json", "objects.json")

    def check(self, outputs: Iterable[str], formats: Mapping[str, str]) -> None:
        """Raise an OutputError without color, or without depth as 16-bit PNG."""
        outputs = tuple(outputs)
        super().check(outputs, formats)
        if "depth" not in outputs:
            raise OutputError("data set 'bop' needs the output 'depth': add it to the outputs")
        if formats["depth"] != "png16":
            raise OutputError(
                f"data set 'bop' cannot have 'depth' as {formats['depth']}, which its readers do not open: "
                "choose png16"
            )

    def write(self, folder: Path, capture: Mapping[str, Any], frames: Frames) -> list[str]:
        """Write the three documents of a BOP scene, and the names of its objects; see `Dataset.write`."""
        numbers = category_ids(capture["categories"])
        depth_scale = capture["depth_scale"] * MILLIMETRES
        members: dict[str, Callable[[Frame], Any]] = {
            "scene_camera.json": lambda frame: _camera(frame["camera"], depth_scale),
            "scene_gt.json": lambda frame: [_pose(each, numbers) for each in frame["instances"]],
            "scene_gt_info.json": lambda frame: list(map(_pixels, frame["instances"])),
        }
        place = self.place(capture)
        for name, member in members.items():
            with open_whole(folder / f"{place}{name}", sync=True) as file:
                write_joined(file, "{", _by_image(frames, member), "}\n")
        with open_whole(folder / f"{place}objects.json", sync=True) as file:
            objects = (f'"{number}": {as_json(name)}' for name, number in numbers.items())
            write_joined(file, "{", objects, "}\n")
        return [f"{place}{name}" for name in self.documents]


def _by_image(frames: Frames, member: Callable[[Frame], Any]) -> Iterator[str]:
    return (f'"{frame["index"]}": {as_json(member(frame))}' for frame in frames)


def _camera(camera: Mapping[str, Any], depth_scale: float) -> dict[str, Any]:
    shift = -camera["pixel_center"]
    k = [camera["fx"], 0.0, camera["cx"] + shift, 0.0, camera["fy"], camera["cy"] + shift, 0.0, 0.0, 1.0]
    rotation, translation = _inverse(camera["camera_to_world"]["opencv"])
    return {
        "cam_K": k,
        "cam_R_w2c": rotation,
        "cam_t_w2c": [MILLIMETRES * value for value in translation],
        "depth_scale": depth_scale,
    }


def _inverse(pose: Matrix) -> tuple[list[float], list[float]]:
    """Return rotation, row by row, and translation of a rigid pose's inverse."""
    columns = [[pose[row][column] for row in range(3)] for column in range(3)]
    position = [pose[row][3] for row in range(3)]
    translation = [
        -sum(one * other for one, other in zip(column, position, strict=True)) for column in columns
    ]
    return [value for column in columns for value in column], translation


def _pose(instance: Mapping[str, Any], numbers: Mapping[str, int]) -> dict[str, Any]:
    """Return an entry of ``scene_gt.json``. A size other than the model's is kept in keys of our own."""
    pose = instance["pose"]
    entry: dict[str, Any] = {
        "cam_R_m2c": [value for row in pose[:3] for value in row[:3]],
        "cam_t_m2c": [MILLIMETRES * row[3] for row in pose[:3]],
        "obj_id": numbers[instance["category"]],
    }
    if instance["scale"] != 1.0:
        entry["scale"] = instance["scale"]
    if "stretch" in instance:
        entry["stretch"] = [value for row in instance["stretch"] for value in row]
    return entry


def _pixels(instance: Mapping[str, Any]) -> dict[str, Any]:
    """Return an entry of ``scene_gt_info.json``.

    At each pixel of its whole mask in the picture, the instance or one in front of it is drawn, so that the
    depth of all these pixels is valid.
    """
    visible, whole = instance["visible"], instance["whole"]
    seen = visible["pixels"]
    return {
        "bbox_obj": list(whole["box"]) if seen else NOWHERE,
        "bbox_visib": list(visible["box"]) if seen else NOWHERE,
        "px_count_all": whole["pixels"],
        "px_count_valid": whole["in_picture"],
        "px_count_visib": seen,
        "visib_fract": seen / whole["pixels"] if seen else 0.0,
    }
