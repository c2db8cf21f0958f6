"""NeRF: ``transforms.json`` as nerfstudio and instant-ngp read it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from firefly_sample.capture.datasets.dataset import Dataset, Frame, Frames, as_json, write_joined
from firefly_sample.capture.datasets.surroundings import Surroundings
from firefly_sample.whole_files import open_whole

AABB_SCALE = 16
"""Side of instant-ngp's box in unit cubes: it reaches six times as far as the cameras from their target."""
CENTRE = 0.5
"""Image coordinate of the first pixel's centre in these readers, which count from the picture's corner."""


class Nerf(Dataset):
    """Pictures with cameras for radiance fields, and depth if it is there as 16-bit PNG."""

    name = "nerf"
    formats = MappingProxyType({"depth": "png16"})
    pictures = ("color_alpha", "color")
    documents = ("transforms.json",)

    def write(self, folder: Path, capture: Mapping[str, Any], frames: Frames) -> list[str]:
        """Write ``transforms.json``; see `Dataset.write`."""
        summary = _Summary(frames)
        has_depth = capture["formats"].get("depth") == "png16"
        header = {"camera_model": "OPENCV", **summary.intrinsics, "k1": 0.0, "k2": 0.0, "p1": 0.0, "p2": 0.0}
        header |= {"aabb_scale": AABB_SCALE, **summary.surroundings.as_unit_cube()}
        if has_depth:
            header["integer_depth_scale"] = capture["depth_scale"]
        place = self.place(capture)

        def lines() -> Iterator[str]:
            for frame in frames:
                entry = {"file_path": self.picture(capture, frame)}
                if has_depth:
                    depth = frame["files"]["depth"].removeprefix(place)
                    entry |= {"depth_file_path": depth, "depth_path": depth}
                yield as_json(entry | summary.of(frame))

        path = f"{place}{self.documents[0]}"
        with open_whole(folder / path, sync=True) as file:
            members = "".join(f"{as_json(name)}: {as_json(value)},\n" for name, value in header.items())
            write_joined(file, f'{{\n{members}"frames": [', lines(), "]\n}\n")
        return [path]


class _Summary:
    """Facts about all frames: common intrinsics, the range of times, and the point that cameras look at."""

    def __init__(self, frames: Frames) -> None:
        self.surroundings = Surroundings()
        self.intrinsics: dict[str, float] = {}
        self._start, self._end = math.inf, -math.inf
        alike = True
        for frame in frames:
            intrinsics = _intrinsics(frame["camera"])
            alike = alike and self.intrinsics in ({}, intrinsics)
            self.intrinsics = intrinsics
            self._start = min(self._start, frame["time"])
            self._end = max(self._end, frame["time"])
            self.surroundings.add(frame["camera"]["camera_to_world"]["opencv"])
        if not alike:
            self.intrinsics = {}  # nerfstudio would take them for those of all frames

    def of(self, frame: Frame) -> dict[str, Any]:
        """Return the members of a frame's entry: its own intrinsics if they differ, its time and its pose."""
        own: dict[str, Any] = {} if self.intrinsics else dict(_intrinsics(frame["camera"]))
        if self._start < self._end:
            own["time"] = (frame["time"] - self._start) / (self._end - self._start)
        own["transform_matrix"] = frame["camera"]["camera_to_world"]["opengl"]
        return own


def _intrinsics(camera: Mapping[str, Any]) -> dict[str, float]:
    shift = CENTRE - camera["pixel_center"]
    width, height, fx, fy = (camera[name] for name in ("width", "height", "fx", "fy"))
    return {
        "fl_x": fx,
        "fl_y": fy,
        "cx": camera["cx"] + shift,
        "cy": camera["cy"] + shift,
        "w": width,
        "h": height,
        "camera_angle_x": 2.0 * math.atan(0.5 * width / fx),
        "camera_angle_y": 2.0 * math.atan(0.5 * height / fy),
    }
