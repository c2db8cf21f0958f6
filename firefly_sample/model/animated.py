"""Tie the animations, skins and morph targets of a model to its nodes and Geoms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from firefly_sample.errors import SceneError
from firefly_sample.model.animation import Clip
from firefly_sample.model.data import AnimationData, GeomData, ModelData, SkinData
from firefly_sample.model.deform import DEFORMING, Shape
from firefly_sample.model.pose import Pose
from firefly_sample.model.root import ModelRoot
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode


def geom_arguments(made: GeomData) -> dict[str, Any]:
    """Return the arguments for a `Geom`: its name and mode, and the arrays that do not deform it."""
    return {"name": made.name, "mode": made.mode} | {
        what: made.arrays[what] for what in made.arrays.keys() - DEFORMING
    }


def is_posed(data: ModelData, node: int, geom: int) -> bool:
    """Return whether a node's geom follows joints or morph targets, so that `bind` makes a Geom for it."""
    arrays = data.geoms[geom].arrays
    kinds = "morph_vertices", "morph_normals", "morph_tangents"
    has_targets = any(len(arrays.get(what, ())) for what in kinds)
    return has_targets or _is_skinned(data, node, geom)


def _is_skinned(data: ModelData, node: int, geom: int) -> bool:
    return data.nodes[node].skin is not None and "joints" in data.geoms[geom].arrays


def bind(
    root: ModelRoot,
    data: ModelData,
    nodes: Sequence[PandaNode],
    materials: Sequence[Material],
    holders: Mapping[int, Sequence[GeomNode]],
) -> None:
    """Tie a model's animations, skins and morph targets to the nodes that were made for it.

    The first animation plays, and the model takes its pose at time 0. A model without any of these is not
    changed.

    Parameters
    ----------
    root : ModelRoot
        The root of `nodes`.
    data : ModelData
    nodes : sequence of PandaNode
        The node made for each of `data.nodes`, linked, with its transform. They have the Geoms that are not
        `is_posed`; this function makes the others, for each node its own, and adds them.
    materials : sequence of Material
        The material made for each of `data.materials`.
    holders : mapping of int to sequence of GeomNode
        The GeomNodes that get the morphed Geoms of a node: the node itself, or one below it for each
        instance.

        Skinned Geoms are always put in a new GeomNode with the node's name, directly below `root`, since only
        the joints move them (glTF 2.0, 3.7.3.3).

    Raises
    ------
    SceneError
        If a number or an array is wrong, or a vertex follows a joint that its skin does not have.
    """
    clips = named_clips(data.animations)
    pose = Pose(data, nodes)
    for index, node in enumerate(data.nodes):
        posed = [number for number in node.geoms if is_posed(data, index, number)]
        skinned = [number for number in posed if _is_skinned(data, index, number)]
        if skinned:
            below = GeomNode(node.name)
            root.add_child(below)
            is_mirrored = _is_mirrored(data, nodes, index)
            for number in skinned:
                geom = _skinned_geom(pose, data, index, number, is_mirrored)
                below.add_geom(geom, materials[data.geoms[number].material])
        for number in posed:
            if number in skinned:
                continue
            geom = _morphed_geom(pose, data, index, number)
            for holder in holders[index]:
                holder.add_geom(geom, materials[data.geoms[number].material])
    root.bind_pose(pose if clips or pose.has_geoms else None, clips)


def _morphed_geom(pose: Pose, data: ModelData, index: int, number: int) -> Geom:
    """Return a new Geom that follows the weights of a node."""
    made = data.geoms[number]
    geom = Geom(**geom_arguments(made))
    pose.add_geom(geom, Shape(made, geom.normals), index, None)
    return geom


def _skinned_geom(pose: Pose, data: ModelData, index: int, number: int, is_mirrored: bool) -> Geom:
    """Return a new Geom that follows the skin of a node; turned over if the node mirrors."""
    made, skin = data.geoms[number], data.nodes[index].skin
    assert skin is not None
    _check_joints(made, data.skins[skin])
    arguments = geom_arguments(made)
    if is_mirrored:
        arguments["triangles"] = np.asarray(arguments["triangles"])[:, ::-1]
    geom = Geom(**arguments)
    pose.add_geom(geom, Shape(made, geom.normals, True, is_mirrored), index, skin)
    return geom


def named_clips(animations: Sequence[AnimationData]) -> dict[str, Clip]:
    """Return the animations by name; one without is "animation 3", a second of the same name ends in "#2"."""
    taken = {made.name for made in animations}
    clips: dict[str, Clip] = {}
    for number, made in enumerate(animations):
        name = made.name or f"animation {number}"
        count = 1
        while name in clips:
            count += 1
            if (numbered := f"{made.name or f'animation {number}'}#{count}") not in taken:
                name = numbered
        clips[name] = Clip(made, name)
    return clips


def _check_joints(made: GeomData, skin: SkinData) -> None:
    joints = made.arrays["joints"]
    if joints.size and not 0 <= joints.min() <= joints.max() < len(skin.joints):
        wrong = int(joints.max() if joints.max() >= len(skin.joints) else joints.min())
        raise SceneError(
            f"geom {made.name!r}: a vertex follows joint {wrong}, but the skin {skin.name!r} has "
            f"{len(skin.joints)} joints"
        )


def _is_mirrored(data: ModelData, nodes: Sequence[PandaNode], index: int) -> bool:
    """Return whether a node's net transform at rest mirrors, which turns its triangles over (3.7.4)."""
    determinant = 1.0
    while index >= 0:
        determinant *= float(np.sign(np.linalg.det(nodes[index].transform.get_mat()[:3, :3])))
        index = data.nodes[index].parent
    return determinant < 0.0
