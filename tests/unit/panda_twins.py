"""The same scene twice, in Panda3D and in ours, and how far float32 lets the two differ.

Panda3D from PyPI computes in float32, ours in float64 from the same float32 inputs, so what lies between
them is Panda3D's rounding. Two bounds of it, both of first order in eps = 2**-23:

`matrix_bound`, a priori. Rounding a local matrix A (angles to radians, sine, cosine, three turns, scale,
shear) and multiplying it into a chain moves the product by at most C eps times the product of the norms;
a transform relative to another node goes up by an inverse as well, and with R = U^-1 D

    |dR| <= |U^-1| (|dU| |R| + |dD|).

`first_order_bound`, from the function itself: the sum over all inputs of |d result / d input| times that
input's rounding, the derivatives taken by differences in float64. It serves where the way to a result is
not a product of matrices.

C = 16 counts roundings a level: three angles (up to 180 degrees, so pi/2 roundings each when in radians),
their products, scale, shear, and four terms a product of matrices. In 4,000 examples a test, matrices used
at most 0.05 of their bound, components, setters and look_at at most 0.4 of theirs.

On top of that, Panda3D takes transforms whose matrices differ by less than 1e-6 for one, and keeps the
older: in results 1e-6 is added, and on the way, where it is 8.4 eps, numbers count as 1 at least.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from hypothesis import strategies as st
from panda3d import core as panda

from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.transform_state import TransformState

EPS32 = 2.0**-23
ROUNDINGS = 16
INTERNED = 1e-6

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Local:
    """Components of one node, numbers that float32 holds exactly."""

    pos: Vector
    hpr: Vector
    scale: Vector
    shear: Vector

    def ours(self) -> TransformState:
        return TransformState.make_pos_hpr_scale_shear(self.pos, self.hpr, self.scale, self.shear)

    def theirs(self) -> panda.TransformState:
        return panda.TransformState.make_pos_hpr_scale_shear(self.pos, self.hpr, self.scale, self.shear)

    def roundings(self) -> list[tuple[str, int, float]]:
        """(component, index, how far float32 arithmetic with it may move it)."""
        reach = max(1.0, *map(abs, self.pos))
        sizes = {"pos": 4 * reach, "hpr": 360.0, "scale": max(1.0, *map(abs, self.scale)), "shear": 1.0}
        return [(name, index, EPS32 * size) for name, size in sizes.items() for index in range(3)]

    def moved(self, name: str, index: int, step: float) -> Local:
        values = list(getattr(self, name))
        values[index] += step
        return replace(self, **{name: tuple(values)})


def float32s(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, width=32)


def vectors(low: float, high: float) -> st.SearchStrategy[Vector]:
    return st.tuples(*[float32s(low, high)] * 3)


size = float32s(0.25, 4)
positive_scales = st.tuples(size, size, size) | size.map(lambda s: (s, s, s)) | st.just((1.0, 1.0, 1.0))
scales = positive_scales | st.tuples(positive_scales, st.tuples(*[st.sampled_from((-1.0, 1.0))] * 3)).map(
    lambda pair: tuple(a * b for a, b in zip(*pair, strict=True))
)
shears = st.just((0.0, 0.0, 0.0)) | vectors(-1, 1)


def locals_(scale: st.SearchStrategy[Vector] = scales) -> st.SearchStrategy[Local]:
    return st.builds(Local, vectors(-10, 10), vectors(-180, 180), scale, shears)


def columns(matrix: panda.LMatrix4f | np.ndarray) -> np.ndarray:
    """The first three columns; the last is 0, 0, 0, 1, in Panda3D only nearly so."""
    if isinstance(matrix, np.ndarray):
        return matrix[:, :3]
    return np.array([[matrix.get_cell(row, column) for column in range(3)] for row in range(4)])


class Twins:
    """Paths to the same places in both scenes, `ours[i]` beside `theirs[i]`; number 0 is the root."""

    def __init__(self) -> None:
        self.ours = [NodePath("root")]
        self.theirs = [panda.NodePath("root")]

    @classmethod
    def grown(cls, nodes: list[tuple[int, Local]]) -> Twins:
        """A tree: each node hangs below the node of its number, counted round."""
        twins = cls()
        for parent, local in nodes:
            twins.attach(parent % len(twins), local)
        return twins

    @classmethod
    def branches(cls, *chains: list[Local]) -> tuple[Twins, *tuple[int, ...]]:
        """Chains below one root, and the numbers of their ends."""
        twins, ends = cls(), []
        for chain in chains:
            end = 0
            for local in chain:
                end = twins.attach(end, local)
            ends.append(end)
        return twins, *ends

    def pick(self, *numbers: int) -> tuple[list[NodePath], list[panda.NodePath]]:
        """Ours and theirs of these numbers, counted round."""
        chosen = [number % len(self) for number in numbers]
        return [self.ours[number] for number in chosen], [self.theirs[number] for number in chosen]

    def __len__(self) -> int:
        return len(self.ours)

    def attach(self, parent: int, local: Local | None = None, sort: int = 0) -> int:
        """A new node below number `parent`; its number."""
        name = f"n{len(self)}"
        self.add(
            self.ours[parent].attach_new_node(name, sort), self.theirs[parent].attach_new_node(name, sort)
        )
        if local is not None:
            self.ours[-1].set_transform(local.ours())
            self.theirs[-1].set_transform(local.theirs())
        return len(self) - 1

    def add(self, ours: NodePath, theirs: panda.NodePath) -> None:
        """Two paths to what is the same place."""
        self.ours.append(ours)
        self.theirs.append(theirs)


def trees(max_size: int = 6) -> st.SearchStrategy[list[tuple[int, Local]]]:
    return st.lists(st.tuples(st.integers(0, 20), locals_()), min_size=1, max_size=max_size)


def _growth(path: NodePath, top: NodePath) -> tuple[float, float, int]:
    """Of the chain of matrices below `top`: the product of norms, the same for translations, the length."""
    linear, translation, levels = 1.0, 0.0, 0
    for place in reversed(path.get_ancestors()):
        if top.is_empty() or not place.is_ancestor_of(top):
            matrix = place.get_mat()
            translation += linear * max(1.0, float(np.linalg.norm(matrix[3, :3])))
            linear *= float(np.linalg.norm(matrix[:3, :3], 2))
            levels += 1
    return linear, translation, levels


def matrix_bound(path: NodePath, other: NodePath) -> np.ndarray:
    """How far each number of Panda3D's ``path.get_mat(other)`` may be from the true one; shape (4, 3)."""
    top = path.get_common_ancestor(other)
    relative = path.get_mat(other)
    down, down_translation, down_levels = _growth(path, top)
    up, up_translation, up_levels = _growth(other, top)
    inverse = float(np.linalg.norm(top.get_mat(other)[:3, :3], 2)) if not top.is_empty() else 1.0
    unit = ROUNDINGS * EPS32 * (down_levels + up_levels + 1) * inverse
    bound = np.zeros((4, 3))
    bound[:3] = unit * (up * np.linalg.norm(relative[:3, :3], 2) + down)
    bound[3] = unit * (up * np.linalg.norm(relative[3, :3]) + up_translation + down_translation)
    return bound + INTERNED


def first_order_bound(function: Callable[[list[Local]], np.ndarray], given: list[Local]) -> np.ndarray:
    """How far `ROUNDINGS` float32 roundings of each input may move a float64 function of them."""
    centre = function(given)
    total = np.full(np.shape(centre), EPS32) * np.maximum(1.0, np.abs(centre))
    for number, local in enumerate(given):
        for name, index, rounding in local.roundings():
            changed = list(given)
            changed[number] = local.moved(name, index, rounding)
            total += np.abs(function(changed) - centre)
    return ROUNDINGS * total + INTERNED
