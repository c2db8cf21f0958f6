"""Tables in which a full-screen pass finds the corners of the triangle behind a pixel.

``shaders/interpolation.frag`` reads them. What float32 cannot hold of a position or a matrix follows as a
second float32, so that the shader has it to 48 bits.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterable
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import GpuError
from firefly_sample.gpu.instance_rows import normal_columns
from firefly_sample.gpu.streams import Streams
from firefly_sample.gpu.uploads import MeshSource
from firefly_sample.plan.frame_plan import Batch, FramePlan
from firefly_sample.plan.view import View

TABLE_WIDTH = 4096
INSTANCE_TEXELS = 12
VERTEX_TEXELS = 3
"""All three are also in ``shaders/interpolation.frag``."""

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]


class _Entry(NamedTuple):
    """A mesh in the tables of meshes."""

    geom: weakref.ref[MeshSource]
    revision: int
    first_triangle: int

    def holds(self, geom: MeshSource) -> bool:
        return self.geom() is geom and self.revision == geom.revision


class CornerTables:
    """The tables of all meshes that were drawn, and of a frame's instances."""

    def __init__(self, ctx: moderngl.Context, streams: Streams) -> None:
        self._ctx = ctx
        self._streams = streams
        self._entries: dict[int, _Entry] = {}
        self._textures: dict[str, moderngl.Texture] = {}

    def prepare(self, plan: FramePlan) -> dict[str, moderngl.Texture]:
        """Return the tables for a frame by the names of their samplers, valid until the next call."""
        geoms = {batch.geom.serial: batch.geom for batch in plan.batches}
        if not all(key in self._entries and self._entries[key].holds(geom) for key, geom in geoms.items()):
            kept = {key: geom for key, entry in self._entries.items() if (geom := entry.geom()) is not None}
            self._make_meshes((kept | geoms).values())
        rows = [
            instance_texels(batch, self._entries[batch.geom.serial].first_triangle, plan.view)
            for batch in plan.batches
        ]
        self._write("u_instances", np.concatenate(rows))
        return self._textures

    def _make_meshes(self, geoms: Iterable[MeshSource]) -> None:
        self._entries, entries = {}, {}  # an error half-way leaves none
        triangles: list[NDArray[np.uint32]] = []
        vertices: list[Float32] = []
        first_triangle = first_vertex = 0
        for geom in geoms:
            entries[geom.serial] = _Entry(weakref.ref(geom), geom.revision, first_triangle)
            triangles.append((geom.triangles + first_vertex).astype(np.uint32))
            rows = np.zeros((len(geom.vertices), VERTEX_TEXELS, 4), dtype=np.float32)
            rows[:, 0, :3], rows[:, 1, :3] = _with_rest(geom.vertices)
            rows[:, 2, :3] = geom.normals
            vertices.append(rows.reshape(-1, 4))
            first_triangle += len(geom.triangles)
            first_vertex += len(geom.vertices)
        self._write("u_triangles", np.concatenate(triangles), exact=True)
        self._write("u_vertices", np.concatenate(vertices), exact=True)
        self._entries = entries

    def _write(self, name: str, rows: NDArray[Any], exact: bool = False) -> None:
        """Write rows as a texture's texels, one after the other."""
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
        self._textures[name] = self._streams.texture(name, texels.reshape(height, width, -1), exact)


def _with_rest(values: Float64) -> tuple[Float32, Float32]:
    """Return numbers as float32 holds them, and the rests."""
    held = values.astype(np.float32)
    return held, (values - held).astype(np.float32)


def instance_texels(batch: Batch, first_triangle: int, view: View) -> Float32:
    """Return the transforms of a batch's instances, shape (`INSTANCE_TEXELS` * n, 4).

    Columns of model space to pixels, for row vectors: across and up, both times the distance ahead, and that
    distance (1 for an orthographic lens), each with its rest. A factor common to all three has no effect, so
    their largest entry is made 1. Then the column of model-to-view that gives y, with its rest, and the three
    that transform normals. Last, the batch's first triangle, and 1 if it is two-sided.
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
