"""Data sets: the documents that make the files of a capture readable to other programs."""

from __future__ import annotations

from firefly_sample.capture.datasets.bop import Bop
from firefly_sample.capture.datasets.coco import Coco
from firefly_sample.capture.datasets.dataset import Dataset
from firefly_sample.capture.datasets.nerf import Nerf

DATASETS: dict[str, Dataset] = {dataset.name: dataset for dataset in (Nerf(), Bop(), Coco())}
"""Every data set by its name, as in ``--dataset``."""
