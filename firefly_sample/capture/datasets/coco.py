"""COCO: ``annotations.json`` with a box and a mask for each instance that is seen."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from firefly_sample.capture.datasets.dataset import Dataset, Frames, as_json, category_ids, write_joined
from firefly_sample.whole_files import open_whole


class Coco(Dataset):
    """Pictures with boxes and masks for detectors; it has no cameras."""

    name = "coco"
    needs = frozenset({"instances", "rle"})
    pictures = ("color", "color_alpha")
    picture_formats = ("png", "jpeg", "webp")
    pinhole = False
    documents = ("annotations.json",)

    def write(self, folder: Path, capture: Mapping[str, Any], frames: Frames) -> list[str]:
        """Write ``annotations.json``; see `Dataset.write`. Its images have the numbers of their frames."""
        numbers = category_ids(capture["categories"])
        categories = (
            as_json({"id": number, "name": name, "supercategory": ""}) for name, number in numbers.items()
        )
        info = {"description": f"captured by firefly_sample {capture.get('version', '')}".rstrip()}
        path = f"{self.place(capture)}{self.documents[0]}"
        with open_whole(folder / path, sync=True) as file:
            start = f'{{\n"info": {as_json(info)},\n"licenses": [],\n"images": ['
            write_joined(file, start, self._images(capture, frames), "],\n")
            write_joined(file, '"categories": [', categories, "],\n")
            write_joined(file, '"annotations": [', _annotations(frames, numbers), "]\n}\n")
        return [path]

    def _images(self, capture: Mapping[str, Any], frames: Frames) -> Iterator[str]:
        for frame in frames:
            size = {name: frame["camera"][name] for name in ("width", "height")}
            yield as_json({"id": frame["index"], "file_name": self.picture(capture, frame), **size})


def _annotations(frames: Frames, numbers: Mapping[str, int]) -> Iterator[str]:
    number = 0
    for frame in frames:
        for instance in frame["instances"]:
            visible = instance["visible"]
            if not visible["pixels"]:
                continue
            number += 1  # from 1: pycocotools takes 0 for "no match" when it evaluates
            yield as_json(
                {
                    "id": number,
                    "image_id": frame["index"],
                    "category_id": numbers[instance["category"]],
                    "segmentation": instance["rle"],
                    "area": visible["pixels"],
                    "bbox": visible["box"],
                    "iscrowd": 0,
                }
            )
