"""Vertices, instances and textures on the GPU, cached by (serial number, revision).

Casts from float64 to float32 happen here, in `instance_rows`, `light_records`, `corner_tables` and `blocks`.
Positions are uploaded in view space, or in a light's space, so that float32 stays exact far from the world's
origin.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol

import moderngl
import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import GpuError
from firefly_sample.gpu.device import Device
from firefly_sample.gpu.instance_rows import (
    CASTER_DTYPE,
    INSTANCE_DTYPE,
    SCALED_DTYPE,
    caster_rows,
    instance_rows,
)
from firefly_sample.gpu.programs import Program
from firefly_sample.gpu.raw import CLAMP_TO_EDGE, MIRRORED_REPEAT, REPEAT
from firefly_sample.gpu.streams import Streams
from firefly_sample.mipmaps import Picture, kept_texture_levels
from firefly_sample.plan.frame_plan import Batch
from firefly_sample.plan.shadows.maps import CasterBatch

_FILTERS = {
    "nearest": moderngl.NEAREST,
    "linear": moderngl.LINEAR,
    "nearest_mipmap_nearest": moderngl.NEAREST_MIPMAP_NEAREST,
    "linear_mipmap_nearest": moderngl.LINEAR_MIPMAP_NEAREST,
    "nearest_mipmap_linear": moderngl.NEAREST_MIPMAP_LINEAR,
    "linear_mipmap_linear": moderngl.LINEAR_MIPMAP_LINEAR,
}
_WRAPS = {"repeat": REPEAT, "clamp": CLAMP_TO_EDGE, "mirror": MIRRORED_REPEAT}
KEEP_FRAMES = 120
"""Unused vertex arrays are deleted after this many frames; making them again is cheap."""


Attributes = tuple[bool, bool, int]
"""Of a mesh, as a draw asks for them: colours, their alpha, and tangents along the first (1) or the second
(2) texture coordinates."""


class MeshSource(Protocol):
    """The source of a mesh, such as a scene's Geom."""

    serial: int
    revision: int
    vertices: NDArray[np.float64]
    normals: NDArray[np.float64]
    texcoords: NDArray[np.float64]
    texcoords_1: NDArray[np.float64] | None
    colors: NDArray[np.float64] | None
    alphas: NDArray[np.float64] | None
    indices: NDArray[np.int32]
    triangles: NDArray[np.int32]

    def tangents_or_made(self, texcoord: int) -> NDArray[np.float64]:
        """Return the tangents, or those that belong to one of the two sets of texture coordinates."""


class TextureSource(Picture, Protocol):
    """The source of a texture, such as a scene's Texture."""

    name: str
    serial: int
    revision: int

    @property
    def sampling(self) -> tuple[str, str, str, str]:
        """Wrap modes across and up, filters of small and of large texels."""


@dataclass(eq=False)
class _Kept:
    """GL objects that were made of one revision of their source.

    `used` is the last frame that has drawn them, `first_row` the instance at which a vertex array begins.
    """

    revision: object
    objects: tuple[Any, ...]
    used: int = 0
    first_row: int = 0


class _Table(dict[tuple[Any, ...], _Kept]):
    """Kept objects; the keys begin with the serial number of their source."""

    def free(self, keys: Iterable[tuple[Any, ...]]) -> None:
        for key in tuple(keys):
            for made in self.pop(key).objects:
                made.release()


class Uploads:
    """The scene's objects on the GPU."""

    def __init__(self, device: Device, streams: Streams) -> None:
        self._raw = device.raw
        self._ctx = device.ctx
        self._streams = streams
        self._frame = 0
        self._sources: dict[int, weakref.ref[Any]] = {}
        self._tables = self._arrays, self._meshes, self._images = _Table(), _Table(), _Table()
        self._instance_buffer: moderngl.Buffer | None = None
        self._batches: tuple[Batch, ...] = ()
        self._first_rows: dict[int, int] = {}

    def sweep(self) -> None:
        """Free objects whose source is gone or that are long unused; call it once per frame."""
        self._frame += 1
        oldest = self._frame - KEEP_FRAMES
        self._arrays.free(key for key, kept in self._arrays.items() if kept.used < oldest)
        # decoding a texture is slow: it is freed only if the same image is in use in a different form
        current = {key[0] for key, kept in self._images.items() if kept.used >= oldest}
        images = self._images.items()
        self._images.free(key for key, kept in images if kept.used < oldest and key[0] in current)
        gone = {serial for serial, source in self._sources.items() if source() is None}
        if gone:
            for table in self._tables:
                table.free(key for key in table if key[0] in gone)
        for serial in gone:
            del self._sources[serial]

    def _serial(self, source: MeshSource | TextureSource) -> int:
        """Return a source's serial number, and remember the source without keeping it alive."""
        if source.serial not in self._sources:
            self._sources[source.serial] = weakref.ref(source)
        return source.serial

    def _keep(
        self, table: _Table, key: tuple[Any, ...], revision: object, make: Callable[[], tuple[Any, ...]]
    ) -> _Kept:
        """Return the objects of a key, made again if their revision has changed."""
        kept = table.get(key)
        if kept is None or kept.revision != revision:
            if kept is not None:
                table.free([key])
            kept = table[key] = _Kept(revision, make())
        kept.used = self._frame
        return kept

    def prepare(self, batches: tuple[Batch, ...]) -> None:
        """Upload the instances of a frame's batches, one batch after the other, into one buffer."""
        if batches is self._batches and self._instance_buffer is not None:
            return
        self._instance_buffer = self._streams.buffer("instances", instance_rows(batches))
        starts = np.cumsum([0, *(len(batch.ids) for batch in batches)]).tolist()
        self._first_rows = {id(batch): start for batch, start in zip(batches, starts, strict=False)}
        self._batches = batches

    def drawable(self, batch: Batch, program: Program) -> moderngl.VertexArray:
        """Return the vertex array that draws one of the prepared batches with `program`."""
        assert self._instance_buffer is not None
        key = (self._serial(batch.geom), batch.key, id(program))
        surface = batch.surface
        attributes = surface.vertex_color, surface.vertex_alpha, surface.normal_map
        instances, rows = self._instance_buffer, SCALED_DTYPE if surface.scaled else INSTANCE_DTYPE
        kept = self._array(key, batch.geom, attributes, instances, rows, program)
        array: moderngl.VertexArray = kept.objects[0]
        first = self._first_rows[id(batch)]
        if kept.first_row != first:
            # OpenGL 3.3 has no draw call that begins with an instance other than 0: the attributes do
            pointers = program.pointers(rows)
            self._raw.point_attributes(array.glo, instances.glo, pointers, rows.itemsize, first)
            kept.first_row = first
        array.instances = len(batch.ids)
        return array

    def sorted_array(self, batch: Batch, corners: moderngl.Buffer, program: Program) -> moderngl.VertexArray:
        """Return the vertex array that draws triangles of a batch's instances in any order.

        `corners` holds the indices of their vertices; those of instance i begin at i times the number of the
        mesh's vertices.
        """
        surface, geom = batch.surface, batch.geom
        attributes = surface.vertex_color, surface.vertex_alpha, surface.normal_map
        copies = 1 << max(len(batch.ids) - 1, 0).bit_length()
        second = geom.texcoords_1 is not None

        def copy() -> tuple[Any, ...]:
            rows = self._mesh_rows(geom, attributes)
            copied = np.zeros(copies * len(rows), dtype=[*rows.dtype.descr, ("in_instance", np.uint32)])
            for name in rows.dtype.names or ():
                copied[name] = np.tile(rows[name], (copies, *(1,) * (rows[name].ndim - 1)))
            copied["in_instance"] = np.repeat(np.arange(copies), len(rows))
            return (self._ctx.buffer(copied),)

        mesh = self._keep(self._meshes, (self._serial(geom), *attributes, copies), geom.revision, copy)

        def make() -> tuple[Any, ...]:
            dtype = np.dtype([*_mesh_dtype(*attributes, second).descr, ("in_instance", np.uint32)])
            content = program.attributes_of(mesh.objects[0], dtype)
            return (self._ctx.vertex_array(program.mgl, [content], corners, index_element_size=4),)

        key = (self._serial(geom), batch.key, id(program), "sorted")
        array: moderngl.VertexArray = self._keep(self._arrays, key, (mesh, corners), make).objects[0]
        return array

    def caster_array(self, batch: CasterBatch, program: Program) -> moderngl.VertexArray:
        """Return the vertex array that draws `batch` into a shadow map; it is valid until the next call."""
        rows = caster_rows(batch)
        casters = self._streams.buffer("casters", rows)
        key = (self._serial(batch.geom), id(program))
        attributes = batch.geom.colors is not None, batch.vertex_alpha, 0
        kept = self._array(key, batch.geom, attributes, casters, CASTER_DTYPE, program)
        array: moderngl.VertexArray = kept.objects[0]
        array.instances = len(rows)
        return array

    def _array(
        self,
        key: tuple[Any, ...],
        geom: MeshSource,
        attributes: Attributes,
        instances: moderngl.Buffer,
        dtype: np.dtype[Any],
        program: Program,
    ) -> _Kept:
        """Keep the vertex array of a mesh and its instances for a program."""
        mesh, second = self._mesh(geom, attributes), geom.texcoords_1 is not None

        def make() -> tuple[Any, ...]:
            vertices, indices = mesh.objects
            corners = program.attributes_of(vertices, _mesh_dtype(*attributes, second))
            rows = program.attributes_of(instances, dtype, per_instance=True)
            parts = [part for part in (corners, rows) if part is not None]
            return (self._ctx.vertex_array(program.mgl, parts, indices, index_element_size=4),)

        return self._keep(self._arrays, key, (mesh, instances), make)

    def _mesh(self, geom: MeshSource, attributes: Attributes) -> _Kept:
        """Keep the buffers of a Geom's vertices and indices, with the attributes that are asked for."""

        def make() -> tuple[Any, ...]:
            rows = self._mesh_rows(geom, attributes)
            return self._ctx.buffer(rows), self._ctx.buffer(
                np.ascontiguousarray(geom.indices, dtype=np.uint32)
            )

        return self._keep(self._meshes, (self._serial(geom), *attributes), geom.revision, make)

    @staticmethod
    def _mesh_rows(geom: MeshSource, attributes: Attributes) -> NDArray[Any]:
        colors, alphas, tangents = attributes
        second = geom.texcoords_1 is not None
        rows = np.zeros(len(geom.vertices), dtype=_mesh_dtype(*attributes, second))
        rows["in_position"] = geom.vertices
        rows["in_normal"] = geom.normals
        rows["in_texcoord"][:, :2] = geom.texcoords
        if colors:
            rows["in_color"][:, :3] = geom.colors
        if alphas:
            rows["in_color"][:, 3] = geom.alphas
        if tangents:
            rows["in_tangent"] = geom.tangents_or_made(tangents - 1)
        if second:
            rows["in_texcoord"][:, 2:] = geom.texcoords_1
        return rows

    def texture(self, image: TextureSource, cutoff: float | None, stored: bool = False) -> moderngl.Texture:
        """Return a texture with its mipmaps, if its filter needs them.

        It is decoded once to linear RGBA16, which is sampled as fast as sRGB8 and is more exact; not if
        `stored`, for looks that filter codes. Mipmaps keep the share of texels whose alpha is above
        `cutoff`, if there is one.
        """

        def make() -> moderngl.Texture:
            levels = kept_texture_levels(image, cutoff, stored)
            texture = self._ctx.texture(image.size, 4, dtype="nu2")
            self._raw.upload_levels(texture.glo, levels if "mipmap" in image.sampling[2] else levels[:1])
            return texture

        return self._texture((self._serial(image), cutoff, stored), image, make)

    def byte_texture(self, image: TextureSource) -> moderngl.Texture:
        """Return a texture of an image's bytes as they are, with mipmaps that the driver makes.

        That is what pyrender samples. What a driver makes of an odd number of texels is its own affair.
        """

        def make() -> moderngl.Texture:
            texture = self._ctx.texture(image.size, 4, np.ascontiguousarray(image.pixels[::-1]))
            if "mipmap" in image.sampling[2]:
                texture.build_mipmaps()
            return texture

        return self._texture((self._serial(image), "bytes"), image, make)

    def _texture(
        self, key: tuple[Any, ...], image: TextureSource, make: Callable[[], moderngl.Texture]
    ) -> moderngl.Texture:
        """Keep the texture of an image that `make` returns, and set how it is sampled."""

        def made() -> tuple[Any, ...]:
            limit = self._ctx.info["GL_MAX_TEXTURE_SIZE"]
            if max(image.size) > limit:
                width, height = image.size
                raise GpuError(
                    f"texture {image.name!r} is {width}x{height}, above the driver's limit of "
                    f"{limit} a side: scale it down"
                )
            texture = make()
            across, up, minfilter, magfilter = image.sampling
            texture.filter = _FILTERS[minfilter], _FILTERS[magfilter]
            self._raw.set_wrap(texture.glo, _WRAPS[across], _WRAPS[up])
            return (texture,)

        texture: moderngl.Texture = self._keep(self._images, key, image.revision, made).objects[0]
        return texture

    def release(self) -> None:
        """Free everything."""
        for table in self._tables:
            table.free(table)


@cache
def _mesh_dtype(colors: bool, alphas: bool, tangents: int, second_texcoords: bool) -> np.dtype[Any]:
    fields = {"in_position": 3, "in_normal": 3, "in_texcoord": 4 if second_texcoords else 2}
    if colors:
        fields["in_color"] = 4 if alphas else 3
    if tangents:
        fields["in_tangent"] = 4
    return np.dtype([(name, np.float32, count) for name, count in fields.items()])
