"""Vertices, instances and textures on the GPU, cached by (object, revision).

Casts from float64 to float32 happen here, in `blocks` and in `rows`, nowhere else. What is
uploaded of places is in view space, so that float32 stays exact far from the world's origin.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import GpuError
from firefly_sample.gpu.mipmaps import mip_chain
from firefly_sample.gpu.programs import Program
from firefly_sample.plan.frame_plan import Batch
from firefly_sample.srgb import srgb_to_linear

__all__ = ["INSTANCE_DTYPE", "Uploads", "instance_rows"]

Float64 = NDArray[np.float64]

INSTANCE_DTYPE = np.dtype(
    [
        ("in_view_x", np.float32, 4),
        ("in_view_y", np.float32, 4),
        ("in_view_z", np.float32, 4),
        ("in_normal_x", np.float32, 3),
        ("in_normal_y", np.float32, 3),
        ("in_normal_z", np.float32, 3),
        ("in_id", np.uint32),
    ]
)
"""One instance: the columns of model-to-view for positions and for normals, and id + 1."""


def instance_rows(batch: Batch) -> NDArray[Any]:
    """The instance buffer of a batch; normals go through the cofactor matrix, which needs no inverse."""
    m = batch.model_to_view
    rows = np.zeros(len(m), dtype=INSTANCE_DTYPE)
    linear = m[:, :3, :3]
    cofactors = np.cross(linear[:, [1, 2, 0]], linear[:, [2, 0, 1]])
    # a flat matrix has no sides: it keeps the sign of one that is not mirrored
    cofactors *= np.where(np.linalg.det(linear) < 0, -1.0, 1.0)[:, None, None]
    # shaders normalise anyway; this keeps tiny and huge scales inside float32
    largest = np.abs(cofactors).max(axis=(1, 2), keepdims=True)
    cofactors /= np.where(largest > 0, largest, 1.0)
    for column, axis in enumerate("xyz"):
        rows[f"in_view_{axis}"] = m[:, :, column]
        rows[f"in_normal_{axis}"] = cofactors[:, :, column]
    rows["in_id"] = batch.ids.astype(np.uint32) + 1
    return rows


KEEP_FRAMES = 120
"""How long instances and vertex arrays that nothing draws are kept; they are cheap to make again."""


@dataclass(eq=False)
class _Mesh:
    revision: int
    vertices: moderngl.Buffer
    indices: moderngl.Buffer
    count: int

    def release(self) -> None:
        self.vertices.release()
        self.indices.release()


@dataclass(eq=False)
class _Instances:
    buffer: moderngl.Buffer
    rows: NDArray[Any]
    used: int = 0

    def release(self) -> None:
        self.buffer.release()


@dataclass(eq=False)
class _Image:
    revision: int
    texture: moderngl.Texture
    used: int = 0

    def release(self) -> None:
        self.texture.release()


@dataclass(eq=False)
class _Drawable:
    """A vertex array over a mesh and its instances, for one program."""

    parts: tuple[object, ...]
    array: moderngl.VertexArray
    used: int = 0

    def release(self) -> None:
        self.array.release()


class Uploads:
    """Everything of the scene that lives on the GPU."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._frame = 0
        self._owners: dict[int, weakref.ref[Any]] = {}
        self._meshes: dict[tuple[int, bool], _Mesh] = {}
        self._images: dict[tuple[int, float | None, bool], _Image] = {}
        self._instances: dict[tuple[int, int, object], _Instances] = {}
        self._drawables: dict[tuple[int, int, object, int], _Drawable] = {}

    def _own(self, thing: object) -> int:
        """Remember whose copy is kept, without keeping it alive."""
        owner = id(thing)
        if owner not in self._owners:
            self._owners[owner] = weakref.ref(thing)
        return owner

    def sweep(self) -> None:
        """Free what is gone or long unused; call it once a frame, with the context current."""
        self._frame += 1
        self._evict()
        dead = {key for key, reference in self._owners.items() if reference() is None}
        if not dead:
            return
        for table, owners in self._tables():
            for key in [key for key in table if dead.intersection(key[:owners])]:
                table.pop(key).release()
        for owner in dead:
            del self._owners[owner]

    def _evict(self) -> None:
        """Free what belongs to a colour or a cut-off that is no longer drawn."""
        oldest = self._frame - KEEP_FRAMES
        tables: tuple[dict[Any, Any], ...] = (self._drawables, self._instances)
        for table in tables:
            for key in [key for key, entry in table.items() if entry.used < oldest]:
                table.pop(key).release()
        # a texture takes long to decode: it goes only if the same image is in use in another form
        current = {key[0] for key, image in self._images.items() if image.used >= oldest}
        for key in [key for key, image in self._images.items() if image.used < oldest and key[0] in current]:
            self._images.pop(key).release()

    def _tables(self) -> tuple[tuple[dict[Any, Any], int], ...]:
        """Every table, and how many of its keys' first parts are owners."""
        return ((self._drawables, 2), (self._instances, 2), (self._meshes, 1), (self._images, 1))

    def drawable(self, batch: Batch, program: Program) -> moderngl.VertexArray:
        """The vertex array that draws `batch` with `program`, its instances up to date."""
        mesh = self._mesh(batch)
        instances = self._instance_buffer(batch)
        key = (id(batch.geom), id(batch.material), (batch.color, batch.mirrored), id(program))
        drawable = self._drawables.get(key)
        if drawable is None or drawable.parts != (mesh, instances.buffer):
            if drawable is not None:
                drawable.release()
            content = [
                self._attributes(mesh.vertices, _mesh_dtype(_has_colors(batch)), program, ""),
                self._attributes(instances.buffer, INSTANCE_DTYPE, program, "/i"),
            ]
            array = self._ctx.vertex_array(
                program.mgl, [c for c in content if c], mesh.indices, index_element_size=4
            )
            drawable = self._drawables[key] = _Drawable((mesh, instances.buffer), array)
        drawable.used = self._frame
        drawable.array.instances = len(batch.ids)
        return drawable.array

    def _attributes(
        self, buffer: moderngl.Buffer, dtype: np.dtype[Any], program: Program, rate: str
    ) -> tuple[Any, ...] | None:
        """A buffer as moderngl wants it described, with padding for what the program does not use."""
        formats, names = [], []
        assert dtype.names is not None
        for name in dtype.names:
            field = dtype[name]
            count = int(np.prod(field.shape, initial=1))
            if name in program.attributes:
                formats.append(f"{count}{'u' if field.base.kind == 'u' else 'f'}")
                names.append(name)
            else:
                formats.append(f"{count * 4}x")
        return (buffer, " ".join(formats) + rate, *names) if names else None

    def _mesh(self, batch: Batch) -> _Mesh:
        geom, colors = batch.geom, _has_colors(batch)
        key = (self._own(geom), colors)
        mesh = self._meshes.get(key)
        if mesh is not None and mesh.revision == geom.revision:
            return mesh
        if mesh is not None:
            mesh.release()
        rows = np.zeros(len(geom.vertices), dtype=_mesh_dtype(colors))
        rows["in_position"] = geom.vertices
        rows["in_normal"] = geom.normals
        rows["in_texcoord"] = geom.texcoords
        if colors:
            rows["in_color"] = geom.colors
        triangles = np.ascontiguousarray(geom.triangles, dtype=np.uint32)
        mesh = _Mesh(geom.revision, self._ctx.buffer(rows), self._ctx.buffer(triangles), triangles.size)
        self._meshes[key] = mesh
        return mesh

    def _instance_buffer(self, batch: Batch) -> _Instances:
        key = (self._own(batch.geom), self._own(batch.material), (batch.color, batch.mirrored))
        rows = instance_rows(batch)
        kept = self._instances.get(key)
        if kept is None or kept.buffer.size < rows.nbytes:
            if kept is not None:
                kept.release()
            kept = self._instances[key] = _Instances(self._ctx.buffer(rows, dynamic=True), rows)
        elif len(kept.rows) != len(rows) or not np.array_equal(kept.rows, rows):
            kept.buffer.write(rows)
            kept.rows = rows
        kept.used = self._frame
        return kept

    def texture(self, batch: Batch, stored: bool) -> moderngl.Texture:
        """The base colour texture of a batch with its mipmaps.

        Decoded once, at load, to linear RGBA16, which costs no more to sample than sRGB8 and errs less;
        as it is stored where `stored` (the classic look) says so.
        """
        image = batch.material.texture
        assert image is not None
        cutoff = batch.alpha_cutoff if batch.cutout else None
        key = (self._own(image), cutoff, stored)
        kept = self._images.get(key)
        if kept is not None and kept.revision == image.revision:
            kept.used = self._frame
            return kept.texture
        if kept is not None:
            kept.release()
        pixels = image.pixels[::-1].astype(np.float32) / np.float32(255.0)
        if not stored:
            decoded = srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)
            pixels[..., :3] = decoded[image.pixels[::-1, :, :3]]
        limit = self._ctx.info["GL_MAX_TEXTURE_SIZE"]
        if max(pixels.shape[:2]) > limit:
            raise GpuError(
                f"texture {image.name!r} is {pixels.shape[1]}x{pixels.shape[0]}, above the driver's limit of "
                f"{limit} a side: scale it down"
            )
        levels = mip_chain(pixels, cutoff)
        texture = self._ctx.texture(levels[0].shape[1::-1], 4, dtype="nu2")
        texture.build_mipmaps(0, len(levels) - 1)
        for level, values in enumerate(levels):
            texture.write(np.round(values * np.float32(65535.0)).astype(np.uint16), level=level)
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        self._images[key] = _Image(image.revision, texture, self._frame)
        return texture

    def release(self) -> None:
        """Free everything."""
        for table, _ in self._tables():
            for entry in table.values():
                entry.release()
            table.clear()
        self._owners.clear()


def _has_colors(batch: Batch) -> bool:
    return batch.geom.colors is not None and batch.color is None


def _mesh_dtype(colors: bool) -> np.dtype[Any]:
    fields: list[Any] = [
        ("in_position", np.float32, 3),
        ("in_normal", np.float32, 3),
        ("in_texcoord", np.float32, 2),
    ]
    return np.dtype(fields + ([("in_color", np.float32, 3)] if colors else []))
