"""Data sets: the documents that make the files of a capture readable to other programs."""

from __future__ import annotations

from firefly_sample.capture.datasets.bop import Bop
from firefly_sample.capture.datasets.coco import Coco
from firefly_sample.capture.datasets.dataset import Dataset
from firefly_sample.capture.datasets.nerf import Nerf
from firefly_sample.errors import OutputError, did_you_mean

DATASETS: dict[str, Dataset] = {dataset.name: dataset for dataset in (Nerf(), Bop(), Coco())}
"""Every data set by its name, as in ``--dataset``."""


def find_dataset(name: str) -> Dataset:
    """Return the data set of a name; raise an OutputError if there is none."""
    if name not in DATASETS:
        raise OutputError(
            f"there is no data set {name!r}{did_you_mean(name, DATASETS)}: choose from {', '.join(DATASETS)}"
        )
    return DATASETS[name]
