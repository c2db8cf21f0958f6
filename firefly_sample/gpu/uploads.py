"""Vertices, instances and textures on the GPU, cached by (serial number, revision).

Casts from float64 to float32 happen here, in `instance_rows`, `light_rows` and `blocks`, nowhere else.
What is uploaded of places is in view space, or in a light's, so that float32 stays exact far from the world's
origin.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from typing import Any, Protocol

import moderngl
import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import GpuError
from firefly_sample.gpu.device import Device
from firefly_sample.gpu.instance_rows import CASTER_DTYPE, INSTANCE_DTYPE, caster_rows, instance_rows
from firefly_sample.gpu.programs import Program
from firefly_sample.mipmaps import kept_texture_levels
from firefly_sample.plan.frame_plan import Batch
from firefly_sample.plan.shadows.maps import CasterBatch

KEEP_FRAMES = 120
"""How long instances and vertex arrays that nothing draws are kept; they are cheap to make again."""


class MeshSource(Protocol):
    """What becomes a mesh: a scene's Geom is one."""

    serial: int
    revision: int
    vertices: NDArray[np.float64]
    normals: NDArray[np.float64]
    texcoords: NDArray[np.float64]
    colors: NDArray[np.float64] | None
    alphas: NDArray[np.float64] | None
    triangles: NDArray[np.int32]


class TextureSource(Protocol):
    """What becomes a texture: a scene's Texture is one."""

    name: str
    serial: int
    revision: int
    size: tuple[int, int]
    digest: str | None

    @property
    def pixels(self) -> NDArray[np.uint8]:
        """As a `Texture` has them."""


@dataclass(eq=False)
class _Mesh:
    revision: int
    dtype: np.dtype[Any]
    vertices: moderngl.Buffer
    indices: moderngl.Buffer

    def release(self) -> None:
        self.vertices.release()
        self.indices.release()


@dataclass(eq=False)
class _Image:
    revision: int
    texture: moderngl.Texture
    used: int = 0

    def release(self) -> None:
        self.texture.release()


@dataclass(eq=False)
class _Drawable:
    """A vertex array over a mesh and instances from `first` on, for one program."""

    parts: tuple[object, ...]
    array: moderngl.VertexArray
    first: int = 0
    used: int = 0

    def release(self) -> None:
        self.array.release()


class Uploads:
    """Everything of the scene that lives on the GPU."""

    def __init__(self, device: Device) -> None:
        self._raw = device.raw
        self._ctx = device.ctx
        self._frame = 0
        self._owners: dict[int, weakref.ref[Any]] = {}
        self._meshes: dict[tuple[int, bool, bool], _Mesh] = {}
        self._images: dict[tuple[int, float | None, bool], _Image] = {}
        self._instances: moderngl.Buffer | None = None
        self._batches: tuple[Batch, ...] = ()
        self._first: dict[int, int] = {}
        self._drawables: dict[tuple[int, object, int], _Drawable] = {}
        self._casters: moderngl.Buffer | None = None
        self._caster_arrays: dict[tuple[int, int], _Drawable] = {}

    def _own(self, thing: MeshSource | TextureSource) -> int:
        """Remember whose copy is kept, without keeping it alive."""
        owner = thing.serial
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
        for table in self._tables():
            for key in [key for key in table if key[0] in dead]:
                table.pop(key).release()
        for owner in dead:
            del self._owners[owner]

    def _evict(self) -> None:
        """Free what belongs to a colour or a cut-off that is no longer drawn."""
        oldest = self._frame - KEEP_FRAMES
        tables: tuple[dict[Any, Any], ...] = (self._drawables, self._caster_arrays)
        for table in tables:
            for key in [key for key, entry in table.items() if entry.used < oldest]:
                table.pop(key).release()
        # a texture takes long to decode: it goes only if the same image is in use in another form
        current = {key[0] for key, image in self._images.items() if image.used >= oldest}
        for key in [key for key, image in self._images.items() if image.used < oldest and key[0] in current]:
            self._images.pop(key).release()

    def _tables(self) -> tuple[dict[Any, Any], ...]:
        """Every table; its keys begin with their owner's serial number."""
        return (self._drawables, self._caster_arrays, self._meshes, self._images)

    def prepare(self, batches: tuple[Batch, ...]) -> None:
        """Bring the instances of a frame's batches up to date: one after the other in one buffer."""
        if batches is self._batches and self._instances is not None:
            return
        rows = instance_rows(batches)
        if self._instances is None or self._instances.size < rows.nbytes:
            if self._instances is not None:
                self._instances.release()
            self._instances = self._ctx.buffer(reserve=2 * max(rows.nbytes, 64), dynamic=True)
        self._instances.write(rows)
        counts = [len(batch.ids) for batch in batches]
        starts = np.cumsum([0, *counts]).tolist()
        self._first = {id(batch): start for batch, start in zip(batches, starts, strict=False)}
        self._batches = batches

    def drawable(self, batch: Batch, program: Program) -> moderngl.VertexArray:
        """The vertex array that draws one of the batches that were prepared with `program`."""
        assert self._instances is not None
        mesh = self._mesh(batch.geom, batch.surface.vertex_color, batch.surface.vertex_alpha)
        key = (self._own(batch.geom), batch.key, id(program))
        kept = self._array(self._drawables, key, mesh, self._instances, INSTANCE_DTYPE, program)
        first = self._first[id(batch)]
        if kept.first != first:
            # OpenGL 3.3 has no draw that begins with another instance than 0: the attributes do
            self._raw.point_attributes(
                kept.array.glo,
                self._instances.glo,
                program.pointers(INSTANCE_DTYPE),
                INSTANCE_DTYPE.itemsize,
                first,
            )
            kept.first = first
        kept.array.instances = len(batch.ids)
        return kept.array

    def caster_array(self, batch: CasterBatch, program: Program) -> moderngl.VertexArray:
        """The vertex array that draws `batch` into a shadow map; it holds until the next call."""
        rows = caster_rows(batch)
        if self._casters is None or self._casters.size < rows.nbytes:
            if self._casters is not None:
                self._casters.release()
            self._casters = self._ctx.buffer(reserve=2 * rows.nbytes, dynamic=True)
        self._casters.write(rows)
        mesh = self._mesh(batch.geom, batch.geom.colors is not None, batch.vertex_alpha)
        key = (batch.geom.serial, id(program))
        array = self._array(self._caster_arrays, key, mesh, self._casters, CASTER_DTYPE, program).array
        array.instances = len(rows)
        return array

    def _array(
        self,
        table: dict[Any, _Drawable],
        key: tuple[Any, ...],
        mesh: _Mesh,
        instances: moderngl.Buffer,
        dtype: np.dtype[Any],
        program: Program,
    ) -> _Drawable:
        """A mesh and its instances for a program, made anew where one of them was."""
        kept = table.get(key)
        if kept is None or kept.parts != (mesh, instances):
            if kept is not None:
                kept.release()
            content = [
                program.attributes_of(mesh.vertices, mesh.dtype),
                program.attributes_of(instances, dtype, per_instance=True),
            ]
            array = self._ctx.vertex_array(
                program.mgl, [part for part in content if part], mesh.indices, index_element_size=4
            )
            kept = table[key] = _Drawable((mesh, instances), array)
        kept.used = self._frame
        return kept

    def _mesh(self, geom: MeshSource, colors: bool, alphas: bool) -> _Mesh:
        """A Geom's vertices, with or without its colours and their alpha, and its triangles."""
        key = (self._own(geom), colors, alphas)
        mesh = self._meshes.get(key)
        if mesh is not None and mesh.revision == geom.revision:
            return mesh
        if mesh is not None:
            mesh.release()
        rows = np.zeros(len(geom.vertices), dtype=_mesh_dtype(colors, alphas))
        rows["in_position"] = geom.vertices
        rows["in_normal"] = geom.normals
        rows["in_texcoord"] = geom.texcoords
        if colors:
            rows["in_color"] = geom.colors
        if alphas:
            rows["in_vertex_alpha"] = geom.alphas
        triangles = np.ascontiguousarray(geom.triangles, dtype=np.uint32)
        mesh = _Mesh(geom.revision, rows.dtype, self._ctx.buffer(rows), self._ctx.buffer(triangles))
        self._meshes[key] = mesh
        return mesh

    def texture(self, image: TextureSource, cutoff: float | None, stored: bool = False) -> moderngl.Texture:
        """A base colour texture with its mipmaps.

        Decoded once, at load, to linear RGBA16, which costs no more to sample than sRGB8 and errs less;
        as it is stored where `stored` (the classic look) says so.

        Parameters
        ----------
        cutoff : float or None
            The alpha at which it is cut out, None where it is not: smaller levels keep the share that stays.
        """
        key = (self._own(image), cutoff, stored)
        kept = self._images.get(key)
        if kept is not None and kept.revision == image.revision:
            kept.used = self._frame
            return kept.texture
        if kept is not None:
            kept.release()
        width, height = image.size
        limit = self._ctx.info["GL_MAX_TEXTURE_SIZE"]
        if max(width, height) > limit:
            raise GpuError(
                f"texture {image.name!r} is {width}x{height}, above the driver's limit of "
                f"{limit} a side: scale it down"
            )
        levels = kept_texture_levels(image, cutoff, stored)
        texture = self._ctx.texture((width, height), 4, dtype="nu2")
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        self._raw.upload_levels(texture.glo, levels)
        self._images[key] = _Image(image.revision, texture, self._frame)
        return texture

    def release(self) -> None:
        """Free everything."""
        for table in self._tables():
            for entry in table.values():
                entry.release()
            table.clear()
        if self._casters is not None:
            self._casters.release()
            self._casters = None
        if self._instances is not None:
            self._instances.release()
            self._instances = None
        self._batches = ()
        self._owners.clear()


def _mesh_dtype(colors: bool, alphas: bool) -> np.dtype[Any]:
    fields: list[Any] = [
        ("in_position", np.float32, 3),
        ("in_normal", np.float32, 3),
        ("in_texcoord", np.float32, 2),
    ]
    if colors:
        fields.append(("in_color", np.float32, 3))
    if alphas:
        fields.append(("in_vertex_alpha", np.float32))
    return np.dtype(fields)
