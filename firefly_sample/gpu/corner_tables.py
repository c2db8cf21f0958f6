"""Tables in which a full-screen pass finds the corners of the triangle behind a pixel.

``shaders/interpolation.frag`` reads them. What float32 cannot hold of a place or a matrix follows as
a second float32, so that the shader has it to 48 bits.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import GpuError
from firefly_sample.gpu.instance_rows import normal_columns
from firefly_sample.gpu.uploads import MeshSource
from firefly_sample.plan.frame_plan import Batch, FramePlan
from firefly_sample.plan.view import View

TABLE_WIDTH = 4096
INSTANCE_TEXELS = 12
VERTEX_TEXELS = 3
"""All three are also in ``shaders/interpolation.frag``."""

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]


@dataclass(frozen=True)
class _Place:
    """Where a mesh is in the tables of meshes."""

    geom: weakref.ref[MeshSource]
    revision: int
    first_triangle: int

    def holds(self, geom: MeshSource) -> bool:
        return self.geom() is geom and self.revision == geom.revision


class CornerTables:
    """The tables of all meshes that were drawn, and of a frame's instances."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._places: dict[int, _Place] = {}
        self._textures: dict[str, moderngl.Texture] = {}

    def of(self, plan: FramePlan) -> dict[str, moderngl.Texture]:
        """The tables for a frame, by the names of their samplers; they hold until the next call."""
        geoms = {batch.geom.serial: batch.geom for batch in plan.batches}
        if not all(key in self._places and self._places[key].holds(geom) for key, geom in geoms.items()):
            kept = {key: geom for key, place in self._places.items() if (geom := place.geom()) is not None}
            self._make_meshes((kept | geoms).values())
        first = [self._places[batch.geom.serial].first_triangle for batch in plan.batches]
        rows = [instance_texels(*pair, plan.view) for pair in zip(plan.batches, first, strict=True)]
        self._write("u_instances", np.concatenate(rows))
        return self._textures

    def _make_meshes(self, geoms: Iterable[MeshSource]) -> None:
        self._places, places = {}, {}  # an error half-way leaves none
        triangles: list[NDArray[np.uint32]] = []
        vertices: list[Float32] = []
        first_triangle = first_vertex = 0
        for geom in geoms:
            places[geom.serial] = _Place(weakref.ref(geom), geom.revision, first_triangle)
            triangles.append((geom.triangles + first_vertex).astype(np.uint32))
            rows = np.zeros((len(geom.vertices), VERTEX_TEXELS, 4), dtype=np.float32)
            rows[:, 0, :3], rows[:, 1, :3] = _with_rest(geom.vertices)
            rows[:, 2, :3] = geom.normals
            vertices.append(rows.reshape(-1, 4))
            first_triangle += len(geom.triangles)
            first_vertex += len(geom.vertices)
        self._write("u_triangles", np.concatenate(triangles))
        self._write("u_vertices", np.concatenate(vertices))
        self._places = places

    def _write(self, name: str, rows: NDArray[Any]) -> None:
        """Rows as a texture's texels, row after row."""
        width = min(max(len(rows), 1), TABLE_WIDTH)
        height = max(-(-len(rows) // width), 1)
        limit = self._ctx.info["GL_MAX_TEXTURE_SIZE"]
        if height > limit:
            raise GpuError(
                f"interpolation=float64: the meshes take {len(rows)} texels, where this driver's textures "
                f"have {limit * TABLE_WIDTH}; use interpolation=rasterizer, which needs none"
            )
        texels = np.zeros((height * width, rows.shape[1]), dtype=rows.dtype)
        texels[: len(rows)] = rows
        kept = self._textures.get(name)
        if kept is not None and kept.size == (width, height):
            kept.write(texels)
            return
        if kept is not None:
            kept.release()
        texture = self._ctx.texture((width, height), rows.shape[1], texels, dtype=f"{rows.dtype.kind}4")
        texture.filter = moderngl.NEAREST, moderngl.NEAREST
        self._textures[name] = texture

    def release(self) -> None:
        """Free all tables."""
        for texture in self._textures.values():
            texture.release()
        self._textures.clear()
        self._places.clear()


def _with_rest(values: Float64) -> tuple[Float32, Float32]:
    """Numbers as float32 holds them, and what it leaves."""
    held = values.astype(np.float32)
    return held, (values - held).astype(np.float32)


def instance_texels(batch: Batch, first_triangle: int, view: View) -> Float32:
    """Where a batch's instances are, shape (`INSTANCE_TEXELS` * n, 4).

    Columns of model space to pixels, for row vectors: across and up, both times the distance ahead, and that
    distance (1 for an orthographic lens), each with its rest; a factor common to all three has no effect, so
    that their largest entry is made 1. Then the column of model-to-view that gives y, with its rest, and the
    three that turn normals. Last, where the batch's triangles begin, and 1 if it is two-sided.
    """
    clip = view.lens.matrix()
    half = np.array(view.size) / 2.0
    to_pixels = np.column_stack((half * (clip[:, :2] + clip[:, 3:]), clip[:, 3]))
    columns = batch.model_to_view @ to_pixels
    largest = np.abs(columns).max(axis=(1, 2), keepdims=True)
    columns = (columns / np.where(largest > 0.0, largest, 1.0)).transpose(0, 2, 1)
    texels = np.zeros((len(columns), INSTANCE_TEXELS, 4), dtype=np.float32)
    texels[:, 0:6:2], texels[:, 1:6:2] = _with_rest(columns)
    texels[:, 6], texels[:, 7] = _with_rest(batch.model_to_view[:, :, 1])
    texels[:, 8:11, :3] = normal_columns(batch.model_to_view).transpose(0, 2, 1)
    texels[:, 11, :3] = *divmod(first_triangle, TABLE_WIDTH), batch.surface.double_sided
    return texels.reshape(-1, 4)
