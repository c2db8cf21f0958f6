"""Pose: the present state of a model's animated nodes, its skins, and the Geoms that follow them."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import is_

import numpy as np
from numpy.typing import NDArray

from firefly_sample.model.animation import Clip
from firefly_sample.model.data import ModelData, SkinData
from firefly_sample.model.deform import Shape
from firefly_sample.scene.arrays import Float64, read_only
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.transform_state import TransformState

_WEIGHTS = "morph_weights"
_Components = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
"""Position, quaternion and scale of a node."""


class Pose:
    """The present state of a model's animated nodes, joints and Geoms; `ModelRoot` keeps it.

    It holds the nodes themselves, so their names and parents do not matter. References lead downwards only,
    from the root to nodes below it, so a model that nobody holds is freed at once.

    Parameters
    ----------
    data : ModelData
    nodes : sequence of PandaNode
        The node of each of `data.nodes`, at rest.
    """

    def __init__(self, data: ModelData, nodes: Sequence[PandaNode]) -> None:
        parents = [node.parent for node in data.nodes]
        self._skins = [_Skin.of(skin, parents) for skin in data.skins]
        needed = {index for skin in self._skins for index, _ in skin.chain}
        needed |= {channel.node for made in data.animations for channel in made.channels}
        self._nodes = {index: nodes[index] for index in sorted(needed)}
        self._rest = {index: node.transform for index, node in self._nodes.items()}
        self._weights = [tuple(node.morph_weights) for node in data.nodes]
        self._geoms: list[_PosedGeom] = []
        self._clips: list[Clip] = []
        self._set: dict[int, tuple[_Components, TransformState]] = {}

    @property
    def has_geoms(self) -> bool:
        """True if a Geom follows joints or morph targets."""
        return bool(self._geoms)

    def add_geom(self, geom: Geom, shape: Shape, node: int, skin: int | None) -> None:
        """Make a Geom, which no other model uses, follow a node's weights and a skin, both by index."""
        self._geoms.append(_PosedGeom(geom, shape, node, skin))

    def choose(self, clips: Sequence[Clip]) -> None:
        """Play these animations from the next `update` on; other nodes go back to rest."""
        moved = {node for clip in clips for node, path in clip.targets if path != _WEIGHTS}
        for index in self._set.keys() - moved:
            node, rest = self._nodes[index], self._rest[index]
            if node.transform is not rest:
                node.set_transform(rest)
            del self._set[index]
        self._clips = list(clips)

    def update(self, time: float) -> None:
        """Set nodes and Geoms to their state at `time`; what has it already is not touched."""
        weights: dict[int, tuple[float, ...]] = {}
        parts: dict[int, dict[str, tuple[float, ...]]] = {}
        for clip in self._clips:
            for (index, path), value in zip(clip.targets, clip.evaluate(time), strict=True):
                if path == _WEIGHTS:
                    weights[index] = tuple(value)
                else:
                    parts.setdefault(index, {})[path] = tuple(value)
        for index, given in parts.items():
            self._move(index, given)
        with np.errstate(over="ignore", invalid="ignore"):  # a Geom refuses what is not finite
            for skin in self._skins:
                skin.follow(self._nodes)
            for posed in self._geoms:
                matrices = None if posed.skin is None else self._skins[posed.skin].matrices
                posed.follow(weights.get(posed.node, self._weights[posed.node]), matrices)

    def _move(self, index: int, given: Mapping[str, tuple[float, ...]]) -> None:
        """Set a node's transform from the properties that are animated; it keeps the others from its rest."""
        node, rest = self._nodes[index], self._rest[index]
        components: _Components = (
            given.get("translation", rest.get_pos()),
            given.get("rotation", rest.get_quat()),
            given.get("scale", rest.get_scale()),
        )
        kept = self._set.get(index)
        if kept is not None and kept[0] == components and node.transform is kept[1]:
            return
        (x, y, z), (qw, qx, qy, qz), (sx, sy, sz) = components
        state = TransformState.make_pos_quat_scale_shear(
            (x, y, z), (qw, qx, qy, qz), (sx, sy, sz), rest.get_shear()
        )
        node.set_transform(state)
        self._set[index] = components, state

    def copied(self, copies: Mapping[PandaNode, PandaNode]) -> Pose:
        """Return a pose for copied nodes, with Geoms of its own instead of those that the copies share."""
        pose = copy.copy(self)
        pose._nodes = {index: copies.get(node) or node.make_copy() for index, node in self._nodes.items()}
        pose._skins = [copy.copy(skin) for skin in self._skins]
        pose._geoms = [replace(posed, geom=copy.copy(posed.geom)) for posed in self._geoms]
        pose._set = dict(self._set)
        new = {old.geom: made.geom for old, made in zip(self._geoms, pose._geoms, strict=True)}
        for node in copies.values() if new else ():
            if isinstance(node, GeomNode):
                node.geoms = [(new.get(geom, geom), material) for geom, material in node.geoms]
        return pose


@dataclass
class _Skin:
    """A skin, and the matrices of its joints in their present pose."""

    joints: NDArray[np.int64]  # places in `chain`
    inverse_bind: Float64
    chain: tuple[
        tuple[int, int], ...
    ]  # joints and the nodes above: index, and place of the parent here, or -1
    seen: list[TransformState] = field(default_factory=list)
    matrices: Float64 | None = None  # (j, 4, 4), replaced by a new array when the pose changes

    @classmethod
    def of(cls, skin: SkinData, parents: Sequence[int]) -> _Skin:
        needed: set[int] = set()
        for joint in skin.joints:
            while joint >= 0 and joint not in needed:
                needed.add(joint)
                joint = parents[joint]
        places = {index: place for place, index in enumerate(sorted(needed))}  # parents come first
        chain = tuple((index, places.get(parents[index], -1)) for index in places)
        joints = np.array([places[joint] for joint in skin.joints], dtype=np.int64)
        return cls(joints, read_only(np.array(skin.inverse_bind, dtype=np.float64)), chain)

    def follow(self, nodes: Mapping[int, PandaNode]) -> None:
        """Compute the matrices again if a transform is not the one that was seen last."""
        states = [nodes[index].transform for index, _ in self.chain]
        if self.matrices is not None and all(map(is_, states, self.seen)):
            return
        nets = np.empty((len(states), 4, 4))
        for place, (state, (_, parent)) in enumerate(zip(states, self.chain, strict=True)):
            nets[place] = state.get_mat() if parent < 0 else state.get_mat() @ nets[parent]
        self.seen, self.matrices = states, read_only(self.inverse_bind @ nets[self.joints])


@dataclass
class _PosedGeom:
    """A Geom, what it is at rest, and the pose that it was given last."""

    geom: Geom
    shape: Shape
    node: int  # whose weights count
    skin: int | None
    weights: tuple[float, ...] | None = None
    matrices: Float64 | None = None
    revision: int = -1

    def follow(self, weights: tuple[float, ...], matrices: Float64 | None) -> None:
        """Move the vertices if the weights or the matrices changed, or somebody else has moved them."""
        if weights == self.weights and matrices is self.matrices and self.geom.revision == self.revision:
            return
        posed = self.shape.posed(weights, matrices)
        self.geom.set_vertices(posed.vertices)
        self.geom.set_normals(posed.normals)
        if posed.tangents is not None:
            self.geom.set_tangents(posed.tangents)
        self.weights, self.matrices, self.revision = weights, matrices, self.geom.revision
