"""Instances: the objects of a frame as data sets know them, each with its category, pose and pixels.

An instance is everything at and below a node with the tag "category", without what is at and below another
such node under it. A node that is reached by two paths is two instances. If no node of the scene has the tag,
each geometry instance, one value of the output "id", is an instance by itself, and its node's name is its
category. Blended surfaces have no ids: they are no part of an instance's pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.capture.datasets.masks import Mask, box_of, encode_rle
from firefly_sample.capture.datasets.silhouettes import Silhouette
from firefly_sample.frame import Image
from firefly_sample.plan.collect import Snapshot
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.traversal import CATEGORY, InstanceRoot, iter_instances

VIEW_TO_OPENCV = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""From X right, Y forward, Z up to X right, Y down, Z forward, for column vectors."""
UNIFORM = 1e-9
"""Relative difference of stretches up to which they count as one scale: far above float64's rounding."""


@dataclass(frozen=True, eq=False)
class Instance:
    """One object of a frame.

    A point of the instance's space is at ``rotation @ stretch @ point + translation`` in the camera's: the
    rotation and the translation are those of `pose`.

    Attributes
    ----------
    name : str
        The path of its node, as in `Frame.id_names`.
    category : str
        The tag's text, or the node's name if that is empty or there are no tags.
    ids : tuple of int
        Its values of the output "id", the smallest first.
    pose : ndarray of float64, shape (4, 4)
        From the node's space to the camera's, rigid, for column vectors, in scene units. The camera has
        OpenCV's axes: X right, Y down, Z forward.
    scale : float
        The factor between both spaces: of a non-uniform scale the geometric mean. It is below 0 if the
        instance is mirrored: the point reflection comes first, the rotation of the rest is `pose`.
    stretch : ndarray of float64, shape (3, 3)
        The symmetric rest of a non-uniform scale or a shear, its scale included; `scale` times the identity
        if the scale is uniform.
    uniform : bool
        True if `scale` says all of `stretch`.
    """

    name: str
    category: str
    ids: tuple[int, ...]
    pose: Float64
    scale: float
    stretch: Float64
    uniform: bool


def find_instances(plan: FramePlan) -> tuple[Instance, ...]:
    """Return the instances of a frame, by their smallest id, also those that are hidden or out of view.

    The plan is that of the frame, from `Renderer.plan`. Call it before the scene changes: the graph is walked
    once more, so that frames of no data set pay nothing. Instances without geometry that the camera's mask
    lets through have no ids, and are left out.
    """
    snapshot = plan.snapshot
    groups: dict[int, list[int]] = {}
    roots: dict[int, InstanceRoot] = {}
    visited = iter_instances(snapshot.root, snapshot.camera_mask)
    found = [root for node, root in visited if isinstance(node, GeomNode)]
    tagged = any(root.tagged for root in found) or _has_tags(snapshot)
    for number, root in enumerate(found):
        if root.tagged or not tagged:
            # one object for each path, since names with slashes may give two paths the same text
            roots[id(root)] = root
            groups.setdefault(id(root), []).append(number)
    to_camera = VIEW_TO_OPENCV @ plan.view.world_to_view.T
    nets = np.array([roots[key].net for key in groups]).reshape(-1, 4, 4)
    matrices = to_camera @ nets.transpose(0, 2, 1)
    return tuple(
        _instance(roots[key], tuple(groups[key]), matrix[:3, 3], rotation, stretch)
        for key, matrix, rotation, stretch in zip(
            groups, matrices, *split_linear(matrices[:, :3, :3]), strict=True
        )
    )


def _has_tags(snapshot: Snapshot) -> bool:
    """Return whether a node of the scene has the tag, hidden or not."""
    top = snapshot.root.get_top().node()
    return any(CATEGORY in node.tags for node in top.iter_descendants())


def find_categories(plan: FramePlan) -> tuple[str, ...]:
    """Return the categories of a frame's scene, sorted, also those of instances that no camera sees.

    They do not depend on the camera, so that all frames of a scene number them alike. As `find_instances`,
    call it before the scene changes.
    """
    tagged, untagged = set[str](), set[str]()
    for node in plan.snapshot.root.get_top().node().iter_descendants():
        if CATEGORY in node.tags:
            tagged.add(node.tags[CATEGORY] or node.name)
        elif isinstance(node, GeomNode):
            untagged.add(node.name)
    return tuple(sorted(tagged or untagged))


def _instance(
    root: InstanceRoot, ids: tuple[int, ...], translation: Float64, rotation: Float64, stretch: Float64
) -> Instance:
    """Return the instance at a root; of a uniform scale, the stretch becomes exactly that."""
    scale = float(np.cbrt(np.linalg.det(stretch)))
    even = scale * np.eye(3)
    uniform = bool(np.abs(stretch - even).max() <= UNIFORM * abs(scale))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, translation
    return Instance(root.path, root.category, ids, pose, scale, even if uniform else stretch, uniform)


def split_linear(linear: Float64) -> tuple[Float64, Float64]:
    """Return rotations and symmetric matrices whose products are `linear`, all of shape (..., 3, 3).

    This is the polar decomposition: a rotation is the nearest one to `linear`. If `linear` is mirrored, it is
    the nearest one to ``-linear``, and the symmetric matrix is negative.
    """
    sign = np.where(np.linalg.det(linear) < 0, -1.0, 1.0)[..., None, None]
    left, _, right = np.linalg.svd(sign * linear)
    # only a flat matrix has a mirrored product, and a free last axis
    left[..., 2] *= np.where(np.linalg.det(left @ right) < 0, -1.0, 1.0)[..., None]
    rotation = left @ right
    stretch = rotation.swapaxes(-1, -2) @ linear
    return rotation, 0.5 * (stretch + stretch.swapaxes(-1, -2))


def owner_image(ids: Image, instances: Sequence[Instance]) -> NDArray[np.intp]:
    """Return the index of the instance at each pixel, -1 for none, of an output "id"."""
    largest = max([int(ids.max(initial=-1)), *(instance.ids[-1] for instance in instances)])
    owners = np.full(largest + 2, -1, dtype=np.intp)  # the first stands for -1, nothing drawn
    for number, instance in enumerate(instances):
        owners[np.array(instance.ids) + 1] = number
    return np.asarray(owners[ids + 1])


def instance_record(
    instance: Instance, visible: Mask, whole: Silhouette | None = None, rle: bool = False
) -> dict[str, Any]:
    """Return what a frame's record in a manifest says of an instance, as JSON has it.

    Parameters
    ----------
    visible : ndarray of bool, shape (height, width)
        Its visible pixels.
    whole : Silhouette, optional
        Its pixels as if nothing else were there: the key "whole", whose "in_picture" counts those that are
        in the picture.
    rle : bool
        With the visible pixels in COCO's encoding.
    """
    record: dict[str, Any] = {
        "name": instance.name,
        "category": instance.category,
        "ids": list(instance.ids),
        "pose": instance.pose.tolist(),
        "scale": instance.scale,
    }
    if not instance.uniform:
        record["stretch"] = instance.stretch.tolist()
    record["visible"] = {"pixels": int(visible.sum()), "box": list(box_of(visible))}
    if whole is not None:
        record["whole"] = {
            "pixels": whole.pixels,
            "in_picture": whole.in_picture,
            "box": list(whole.box),
        }
    if rle:
        record["rle"] = encode_rle(visible)
    return record


def instance_records(
    ids: Image,
    instances: Sequence[Instance],
    whole: Sequence[Silhouette] | None = None,
    rle: bool = False,
) -> list[dict[str, Any]]:
    """Return the records of a frame's instances from its output "id", in the instances' order.

    Without `whole`, only those with a visible pixel are listed. With it all are, as in BOP's ``scene_gt``,
    which also names objects that are hidden or out of view.
    """
    owners = owner_image(ids, instances)
    listed = (
        [int(number) for number in np.unique(owners) if number >= 0]
        if whole is None
        else range(len(instances))
    )
    return [
        instance_record(instances[number], owners == number, None if whole is None else whole[number], rle)
        for number in listed
    ]
