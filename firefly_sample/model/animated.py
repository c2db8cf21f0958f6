"""What moves in a model: its animated nodes, and the Geoms that follow joints and morph targets."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from firefly_sample.errors import SceneError
from firefly_sample.model.animation import Clip
from firefly_sample.model.data import GeomData, ModelData
from firefly_sample.model.deform import DEFORMING, Shape
from firefly_sample.model.root import ModelRoot
from firefly_sample.scene.arrays import Float64, read_only
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.transform_state import TransformState


def geom_arguments(made: GeomData) -> dict[str, Any]:
    """Return the arguments for a `Geom`: the name, and the arrays without those that deform it."""
    return {"name": made.name} | {what: made.arrays[what] for what in made.arrays.keys() - DEFORMING}


def is_posed(data: ModelData, node: int, geom: int) -> bool:
    """Return whether a node's geom follows joints or morph targets, so that `bind` makes a Geom for it."""
    arrays = data.geoms[geom].arrays
    has_targets = any(len(arrays.get(what, ())) for what in ("morph_vertices", "morph_normals"))
    return has_targets or _is_skinned(data, node, geom)


def _is_skinned(data: ModelData, node: int, geom: int) -> bool:
    return data.nodes[node].skin is not None and "joints" in data.geoms[geom].arrays


def bind(
    root: ModelRoot,
    data: ModelData,
    nodes: Sequence[PandaNode],
    materials: Sequence[Material],
    holders: Mapping[int, Sequence[GeomNode]] | None = None,
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
    holders : mapping of int to sequence of GeomNode, optional
        The GeomNodes that get the morphed Geoms of a node: for a node with instances, one below it for each.
        When absent, `nodes[index]` itself, which must then be a GeomNode.

        Skinned Geoms are always put in a new GeomNode with the node's name, directly below `root`, since only
        the joints move them (glTF 2.0, 3.7.3.3).

    Raises
    ------
    SceneError
        If a number or an array is wrong, or a vertex follows a joint that its skin does not have.
    """
    raise NotImplementedError
