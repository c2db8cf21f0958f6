"""Annotations of a frame for a data set: the instances in it, and their masks."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

from firefly_sample.capture.datasets import find_dataset
from firefly_sample.capture.datasets.instances import (
    find_categories,
    find_instances,
    instance_records,
    owner_image,
)
from firefly_sample.capture.datasets.masks import Gray, as_gray
from firefly_sample.capture.datasets.silhouettes import draw_silhouettes
from firefly_sample.frame import Frame

if TYPE_CHECKING:
    from firefly_sample.renderer import Renderer
    from firefly_sample.scene.scene import Scene


class Annotations(NamedTuple):
    """The instances in a frame, the categories of its scene, and masks.

    Attributes
    ----------
    instances : list of dict
        Those of the frame, as its record has them.
    categories : tuple of str
        Those of the scene, see `find_categories`.
    masks : dict of str to ndarray
        By key, for example "mask/3".
    """

    instances: list[dict[str, Any]]
    categories: tuple[str, ...]
    masks: dict[str, Gray]


def is_annotated(dataset: str | None) -> bool:
    """Return whether a data set needs to know the instances of each frame."""
    return dataset is not None and "instances" in find_dataset(dataset).needs


def draw_annotated(
    renderer: Renderer, scene: Scene, time: float, outputs: Iterable[str], dataset: str
) -> tuple[Frame, Annotations]:
    """Draw a frame for a data set, and find the instances in it.

    Ids are samples at the pixels' centres: with supersampling they are drawn once more, without it.
    """
    needs = find_dataset(dataset).needs
    settings = renderer.settings
    names = tuple(dict.fromkeys((*outputs, "id")))
    if settings.supersample == 1:
        plan = renderer.plan(scene, time, names)
        frame = renderer.draw(plan)
        ids = frame["id"]
    else:
        frame = renderer.render(scene, time, outputs)
        renderer.settings = settings.with_changes(supersample=1)
        try:
            plan = renderer.plan(scene, time, ("id",))
            ids = renderer.draw(plan)["id"]
        finally:
            renderer.settings = settings
    instances = find_instances(plan)
    whole = draw_silhouettes(renderer, plan, instances) if "whole masks" in needs else None
    records = instance_records(ids, instances, whole, rle="rle" in needs)
    masks: dict[str, Gray] = {}
    if whole is not None:
        owners = owner_image(ids, instances)
        for number, silhouette in enumerate(whole):
            masks[f"mask/{number}"] = as_gray(silhouette.mask())
            masks[f"mask_visib/{number}"] = as_gray(owners == number)
    return frame, Annotations(records, find_categories(plan), masks)
