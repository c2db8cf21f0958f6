"""Silhouettes: the pixels of instances as if nothing else were there, also beside the picture.

BOP counts the pixels of a whole instance on a canvas three times as wide and high as the picture, with the
picture in its middle. Here the canvas is nine tiles of the picture's size, and the part of an instance in one
tile is a piece. A draw of the geometry pass, as large as the picture, has all pieces whose boxes do not
overlap; pieces of the outer tiles are moved into the picture. Those of the middle tile have the frame's own
lens and matrices, so that the visible pixels are a part of the silhouette. Blended surfaces have no ids, and
add nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from firefly_sample.capture.datasets.masks import Box, Mask, box_of, join_boxes
from firefly_sample.frame import check_outputs
from firefly_sample.passes.geometry import GeometryVariant
from firefly_sample.plan.frame_plan import Batch, FramePlan, PassPlan
from firefly_sample.plan.targets import Target
from firefly_sample.plan.view import View
from firefly_sample.plan.visible import Visible, make_batches
from firefly_sample.scene.arrays import Float64

if TYPE_CHECKING:
    from firefly_sample.renderer import Renderer

Pixels = NDArray[np.intp]
Tile = tuple[int, int]
"""A part of the canvas: the number of pictures to the right of the picture, and below it."""
MIDDLE: Tile = (0, 0)
TILES: tuple[Tile, ...] = (MIDDLE, (-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1))
MARGIN = 1
"""Pixels by which boxes on the screen are made larger: float32 moves corners by far less."""


class HasIds(Protocol):
    """The part of an instance that is needed here."""

    @property
    def ids(self) -> tuple[int, ...]:
        """Its values of the output "id"."""


@dataclass(frozen=True, eq=False)
class Silhouette:
    """The pixels of one instance as if nothing else were there.

    Attributes
    ----------
    size : (int, int)
        Width and height of the picture.
    pixels : int
        Number of its pixels on a canvas of three times the picture's width and height, with the picture in
        the middle.
    box : Box
        The box around all of them. It may begin left of the picture or above it, at numbers below 0.
    part, corner : ndarray of bool, and (int, int)
        The mask of a rectangle of the picture that contains all of its pixels there, and the rectangle's left
        column and top row.
    """

    size: tuple[int, int]
    pixels: int = 0
    box: Box = (0, 0, 0, 0)
    part: Mask = field(default_factory=lambda: np.zeros((0, 0), dtype=bool))
    corner: tuple[int, int] = (0, 0)

    @property
    def in_picture(self) -> int:
        """The number of its pixels in the picture."""
        return int(self.part.sum())

    def mask(self) -> Mask:
        """Return its pixels in the picture, shape (height, width)."""
        (width, height), (left, top) = self.size, self.corner
        whole = np.zeros((height, width), dtype=bool)
        down, across = self.part.shape
        whole[top : top + down, left : left + across] = self.part
        return whole

    def with_tile(self, tile: Tile, part: Mask, corner: tuple[int, int]) -> Silhouette:
        """Return the silhouette with the pixels of a tile, in which `part` begins at `corner`."""
        left, top, across, down = box_of(part)
        if not across:
            return self
        (x, y), (width, height) = corner, self.size
        box = tile[0] * width + x + left, tile[1] * height + y + top, across, down
        grown = replace(self, pixels=self.pixels + int(part.sum()), box=join_boxes(self.box, box))
        return replace(grown, part=part, corner=corner) if tile == MIDDLE else grown


def draw_silhouettes(
    renderer: Renderer, plan: FramePlan, instances: Sequence[HasIds]
) -> tuple[Silhouette, ...]:
    """Draw the silhouette of each instance of a frame, in their order.

    The plan is the frame's own, made by this renderer. Call it before the scene changes: the meshes of moving
    skins are those of now.

    Raises
    ------
    OutputError
        If the settings ask for supersampling, with which there are no ids.
    """
    check_outputs(("id",), plan.settings.supersample)
    owners = np.full(max(len(plan.id_names), 1), -1)
    for number, instance in enumerate(instances):
        owners[list(instance.ids)] = number
    found = [Silhouette(plan.size) for _ in instances]
    pieces = _pieces(plan.size, _screen_boxes(plan, owners, len(instances)))
    batches = {MIDDLE: plan.batches}
    outer = {piece.tile for piece in pieces} - {MIDDLE}
    aside = _batches_of_canvas(plan) if outer else ()
    for tile in outer:
        batches[tile] = tuple(_moved(plan, tile, batch) for batch in _rows(aside, owners >= 0))
    empty = _plan_of_ids(plan)
    for group in _apart(pieces):
        rows: list[Batch] = []
        for tile in sorted({piece.tile for piece in group}):
            wanted = np.isin(owners, [piece.number for piece in group if piece.tile == tile])
            rows.extend(_rows(batches[tile], wanted))
        if not rows:
            continue
        ids = renderer.draw(replace(empty, batches=tuple(rows)))["id"]
        for number, tile, (left, top, right, bottom) in group:
            cut = ids[top:bottom, left:right]
            part = np.asarray((owners[cut] == number) & (cut >= 0))
            found[number] = found[number].with_tile(tile, part, (left, top))
    return tuple(found)


class _Piece(NamedTuple):
    """The part of an instance in a tile, and its box there: left, top, and the first right and below."""

    number: int
    tile: Tile
    box: tuple[int, int, int, int]


def _pieces(size: tuple[int, int], boxes: Pixels) -> list[_Piece]:
    """Return the pieces of instances from their boxes on the canvas, those of the middle tile first."""
    width, height = size
    pieces = []
    for tile in TILES:
        left, top = tile[0] * width, tile[1] * height
        local = np.clip(boxes - (left, top, left, top), 0, (width, height, width, height))
        seen = np.flatnonzero((local[:, :2] < local[:, 2:]).all(axis=1)).tolist()
        pieces += [_Piece(number, tile, tuple(local[number].tolist())) for number in seen]
    return pieces


def _apart(pieces: Sequence[_Piece]) -> list[list[_Piece]]:
    """Return the pieces in groups in which no two boxes overlap; as few as first fit finds."""
    boxes = np.array([piece.box for piece in pieces], dtype=np.intp).reshape(-1, 4)
    group_of = np.zeros(len(pieces), dtype=np.intp)
    groups: list[list[_Piece]] = []
    for index, piece in enumerate(pieces):
        before, own = boxes[:index], boxes[index]
        meet = ((before[:, :2] < own[2:]) & (own[:2] < before[:, 2:])).all(axis=1)
        taken = set(group_of[:index][meet].tolist())
        group = next(each for each in range(len(groups) + 1) if each not in taken)
        if group == len(groups):
            groups.append([])
        group_of[index] = group
        groups[group].append(piece)
    return groups


def _rows(batches: Iterable[Batch], wanted: Mask) -> Iterator[Batch]:
    """Yield draws of those instances of batches whose ids are wanted; each keeps its batch's key."""
    for batch in batches:
        rows = np.flatnonzero(wanted[batch.ids])
        if len(rows) == len(batch.ids):
            yield batch
        elif len(rows):
            yield replace(
                batch,
                model_to_view=batch.model_to_view[rows],
                ids=batch.ids[rows],
                factors=batch.factors.take(rows),
            )


def _moved(plan: FramePlan, tile: Tile, batch: Batch) -> Batch:
    """Return a draw that shows in the picture what the batch shows in a tile, under a key of its own.

    Moving the picture of a perspective lens is a shear along the view axis in view space.
    """
    lens = plan.view.lens
    move = np.eye(4)
    move[1 if lens.perspective else 3, [0, 2]] = -2.0 * tile[0] / lens.a, 2.0 * tile[1] / lens.c
    return replace(batch, key=(batch.key, tile), model_to_view=batch.model_to_view @ move)


def _plan_of_ids(plan: FramePlan) -> FramePlan:
    """Return a plan that draws only ids, and that has no batches yet."""
    lens = plan.view.lens
    variant = GeometryVariant(
        albedo=False, normal=False, distance=False, id=True, orthographic=not lens.perspective
    )
    because = "silhouettes of instances"
    # as the frame has it, so that the texture stays
    depth = plan.target("depth") or Target(
        "depth",
        "depth32f" if plan.view.reverse else "depth24",
        because,
        (0.0 if plan.view.reverse else 1.0, 0.0, 0.0, 0.0),
    )
    return replace(
        plan,
        outputs=("id",),
        batches=(),
        clusters=(),
        blended=None,
        particle_shadow=None,
        targets=(depth, Target("id", "r32ui", because)),
        passes=(PassPlan("geometry", (), ("depth", "id"), (), because, variant),),
        sources={"id": ("id",)},
    )


def _batches_of_canvas(plan: FramePlan) -> tuple[Batch, ...]:
    """Return the draws of all that is seen on the canvas, not only in the picture."""
    lens = plan.view.lens
    canvas = replace(
        lens,
        a=lens.a / 3.0,
        c=lens.c / 3.0,
        x_offset=lens.x_offset / 3.0,
        z_offset=lens.z_offset / 3.0,
    )
    planes = [*canvas.side_planes(), (0.0, 1.0, 0.0, -plan.view.near)]
    if np.isfinite(plan.view.far):
        planes.append((0.0, -1.0, 0.0, plan.view.far))
    seen = Visible(plan.snapshot.instances, plan.view.world_to_view, np.array(planes))
    blended = seen.blended if plan.settings.look != "classic" else (False,) * len(seen.parts)
    return make_batches(seen, plan.view.near, blended)


def _screen_boxes(plan: FramePlan, owners: Pixels, count: int) -> Pixels:
    """Return boxes that contain instances on the canvas: left, top, right, bottom; empty if left >= right.

    They are counted in pixels of the picture; right and bottom are the first that are not in the box.
    """
    view, (width, height) = plan.view, plan.size
    canvas = np.array([-width, -height, 2 * width, 2 * height])
    found = np.array([canvas[2:], canvas[:2]]).reshape(1, 4).repeat(count, axis=0)  # empty
    for group in plan.snapshot.groups:
        rows = np.flatnonzero(owners[group.ids] >= 0)
        if not len(rows):
            continue
        low, high = group.geom.bounds
        corners = np.array(list(product(*zip(low, high, strict=True))))
        matrices = group.model_to_world[rows] @ view.world_to_view
        points = corners @ matrices[:, :3, :3] + matrices[:, None, 3, :3]
        boxes = _project(view, points, plan.size)
        boxes = np.clip(boxes, np.tile(canvas[:2], 2), np.tile(canvas[2:], 2)).astype(np.intp)
        numbers = owners[group.ids[rows]]
        np.minimum.at(found[:, :2], numbers, boxes[:, :2])
        np.maximum.at(found[:, 2:], numbers, boxes[:, 2:])
    return found


def _project(view: View, points: Float64, size: tuple[int, int]) -> Float64:
    """Return boxes around the projections of points in view space, shape (n, k, 3), with a margin.

    A set of points that is partly behind the near plane may be anywhere; one wholly behind it is nowhere.
    """
    width, height = size
    distance = points[..., 1]
    behind = distance < view.near if view.lens.perspective else np.zeros(distance.shape, dtype=bool)
    safe = np.where(behind[..., None], (0.0, 1.0, 0.0), points)
    ndc = view.lens.ndc_from_view(safe)
    u, v = 0.5 * (1.0 + ndc[..., 0]) * width, 0.5 * (1.0 - ndc[..., 1]) * height
    low = np.floor(np.stack([u.min(axis=1), v.min(axis=1)], axis=1)) - MARGIN
    high = np.ceil(np.stack([u.max(axis=1), v.max(axis=1)], axis=1)) + MARGIN
    boxes = np.concatenate([low, high], axis=1)
    boxes[behind.any(axis=1)] = (-np.inf, -np.inf, np.inf, np.inf)
    boxes[behind.all(axis=1)] = (np.inf, np.inf, -np.inf, -np.inf)
    return boxes
