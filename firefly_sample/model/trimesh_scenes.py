"""Files that trimesh reads, as a `ModelData`."""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np

from firefly_sample.errors import ModelError
from firefly_sample.losses import Losses
from firefly_sample.model.contents import note_content
from firefly_sample.model.data import GeomData, MaterialData, ModelData, NodeData, TextureData
from firefly_sample.model.folder import Folder
from firefly_sample.model.formats import Up
from firefly_sample.model.pixels import one_line, open_image, own_pixel_limit
from firefly_sample.model.plain_meshes import (
    PLAIN,
    PLAIN_COLORED,
    linear_color,
    linear_colors,
    make_geom,
    split_face_colors,
    turn_matrix,
)
from firefly_sample.scene.arrays import Float64

_ROUNDED = 255.0


def read_scene(path: Path, suffix: str, up: Up, folder: Folder, losses: Losses) -> ModelData:
    """Return what trimesh reads of a file: nodes with their names and transforms, meshes and materials.

    Raises
    ------
    ModelError
        If trimesh, or a package that it uses, cannot read the file, or a texture is too large.
    """
    import trimesh

    resolver = _Resolver(folder)
    with own_pixel_limit(), _warnings_as_losses(losses), path.open("rb") as file:
        # what NumPy would leave out of a damaged list of numbers
        warnings.filterwarnings("error", message="string or file could not be read")
        try:
            scene = trimesh.load_scene(file, file_type=suffix, resolver=cast("Any", resolver), process=False)
            note_content(path, suffix, losses)
        except MemoryError:
            raise
        except Exception as error:
            # a converter that fails leaves no file
            fault = "nothing in it could be read" if isinstance(error, FileNotFoundError) else one_line(error)
            described = f"damaged .{suffix} file ({fault}): export it again"
            raise ModelError(f"model {path}: {described}") from error
    if resolver.refused is not None:
        raise resolver.refused
    return _Reader(path, suffix, up, scene, folder, losses).read()


@contextmanager
def _warnings_as_losses(losses: Losses) -> Iterator[None]:
    """Note what trimesh logs as a warning during a block: parts that it leaves out."""
    handler = _LossHandler(losses)
    log = logging.getLogger("trimesh")
    log.addHandler(handler)
    try:
        yield
    finally:
        log.removeHandler(handler)


class _LossHandler(logging.Handler):
    """Notes warnings as losses."""

    def __init__(self, losses: Losses) -> None:
        super().__init__(logging.WARNING)
        self.losses = losses

    def emit(self, record: logging.LogRecord) -> None:
        self.losses.add(f"a part that trimesh cannot read ({' '.join(record.getMessage().split())[:200]})")


class _Resolver:
    """Gives trimesh the files beside the model, and keeps the error that trimesh would swallow."""

    file_name = None

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        self.refused: ModelError | None = None

    def get(self, name: str) -> bytes:
        try:
            self.folder.image(name)
        except ModelError as error:
            self.refused = error
        path = self.folder.find(name)
        if path is None:
            raise FileNotFoundError(name)
        return path.read_bytes()


class _Reader:
    """Converts one trimesh scene."""

    def __init__(self, path: Path, suffix: str, up: Up, scene: Any, folder: Folder, losses: Losses) -> None:
        self.path = path
        self.suffix = suffix
        self.up = up
        self.scene = scene
        self.folder = folder
        self.losses = losses
        self.model = ModelData(path.stem)
        self.geoms: dict[str, int | None] = {}
        self.materials: dict[Any, int] = {}
        self.textures: dict[bytes, int] = {}

    def read(self) -> ModelData:
        names = set(self.scene.geometry)
        edges: dict[str, list[tuple[str, dict[str, Any]]]] = {}
        for (parent, child), edge in self.scene.graph.transforms.edge_data.items():
            edges.setdefault(parent, []).append((child, edge))
        waiting = [(-1, child) for child in edges.pop(self.scene.graph.base_frame, [])]
        for parent, (name, edge) in waiting:  # grows as it goes
            index = self._node(parent, name, edge)
            waiting.extend((index, child) for child in edges.pop(name, []))
            names.discard(edge.get("geometry", ""))
        for name in names:  # in no node
            if hasattr(self.scene.geometry[name], "faces"):
                self.losses.add("meshes that no node shows", name)
        return self.model

    def _node(self, parent: int, name: str, edge: dict[str, Any]) -> int:
        matrix = np.asarray(edge.get("matrix", np.eye(4)), dtype=np.float64).T
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
            raise ModelError(f"model {self.path}: node {name!r} has a transform that is not finite")
        moved = not np.array_equal(matrix, np.eye(4))
        source = edge.get("geometry")
        geom = None if source is None else self._geom(source)
        only = len(self.scene.geometry) == 1 and parent < 0
        self.model.nodes.append(
            NodeData(
                self.path.stem if only and name == source else name,
                parent,
                turn_matrix(self.up, matrix) if moved else None,
                geoms=() if geom is None else (geom,),
            )
        )
        return len(self.model.nodes) - 1

    def _geom(self, name: str) -> int | None:
        """Return the index of a geom, which is made once; None of what is no triangles."""
        if name not in self.geoms:
            source = self.scene.geometry[name]
            made = self._made_geom(name, source) if hasattr(source, "faces") else None
            if not hasattr(source, "faces"):
                what = "points" if type(source).__name__ == "PointCloud" else "curves"
                self.losses.add(what, name)
            self.geoms[name] = None if made is None else len(self.model.geoms)
            if made is not None:
                self.model.geoms.append(made)
        return self.geoms[name]

    def _made_geom(self, name: str, mesh: Any) -> GeomData | None:
        triangles = np.asarray(mesh.faces, dtype=np.int64)
        arrays: dict[str, Float64] = {"vertices": np.asarray(mesh.vertices, dtype=np.float64)}
        # trimesh turns the vertices of .xaml, but not its normals
        if self.suffix != "xaml" and "vertex_normals" in mesh._cache.cache:
            arrays["normals"] = np.asarray(mesh.vertex_normals, dtype=np.float64)
        triangles, arrays = self._add_visual(name, mesh, triangles, arrays)
        alphas = arrays["colors"][:, 3] if "colors" in arrays else None
        clear = alphas is not None and bool((alphas < 1.0).any())
        material = self._material(mesh.visual, "colors" in arrays, clear)
        where = f"model {self.path}"
        return make_geom(where, name, material, triangles, arrays, self.up)

    def _add_visual(
        self, name: str, mesh: Any, triangles: Any, arrays: dict[str, Float64]
    ) -> tuple[Any, dict[str, Float64]]:
        """Return triangles and arrays with the texture coordinates or colours of a mesh."""
        visual = mesh.visual
        if visual.kind == "texture":
            uv = visual.uv
            if uv is not None and np.shape(uv) == (len(mesh.vertices), 2):
                arrays["texcoords"] = np.asarray(uv, dtype=np.float64)
        elif visual.kind == "vertex":
            colors = np.asarray(visual.vertex_colors)
            if len(colors) == len(mesh.vertices):
                arrays["colors"] = linear_colors(colors)
        elif visual.kind == "face":
            colors = np.asarray(visual.face_colors)
            if len(colors) == len(triangles) and triangles.max(initial=-1) < len(mesh.vertices):
                return split_face_colors(triangles, arrays, linear_colors(colors))
        return triangles, arrays

    def _material(self, visual: Any, colored: bool, clear: bool) -> int:
        source = visual.material if visual.kind == "texture" else None
        key = id(source) if source is not None else (colored, clear)
        if key not in self.materials:
            made = self._made_material(source) if source is not None else PLAIN_COLORED if colored else PLAIN
            if clear:
                made = MaterialData(made.name, alpha_mode="blend", double_sided=True)
            self.materials[key] = len(self.model.materials)
            self.model.materials.append(made)
        return self.materials[key]

    def _made_material(self, source: Any) -> MaterialData:
        """Return a material of trimesh's; its colours are display colours, but for those of STEP."""
        name = getattr(source, "_name", None) or f"material {len(self.model.materials)}"
        if not hasattr(source, "baseColorFactor"):  # one texture, as of PLY
            texture = self._texture(source.image)
            return replace(PLAIN if texture is None else PLAIN_COLORED, name=name, texture=texture)
        given = source.baseColorFactor
        color = np.ones(4) if given is None else np.asarray(given, dtype=np.float64) / _ROUNDED
        linear = self.suffix in ("step", "stp")
        red, green, blue = color[:3].tolist() if linear else linear_color(color[:3])
        alpha = float(color[3])
        emissive = np.zeros(3) if source.emissiveFactor is None else np.asarray(source.emissiveFactor)
        return MaterialData(
            name,
            base_color=(red, green, blue, alpha),
            texture=self._texture(source.baseColorTexture),
            alpha_mode="blend" if alpha < 1.0 else "opaque",
            double_sided=True,
            emission=linear_color(emissive),
        )

    def _texture(self, image: Any) -> int | None:
        """Return the index of the texture of a Pillow image, which is decoded later from its bytes."""
        if image is None:
            return None
        data = image.fp.getvalue() if isinstance(image.fp, io.BytesIO) else None
        if data is None:
            kept = io.BytesIO()
            image.save(kept, "PNG")
            data = kept.getvalue()
        if data not in self.textures:
            limit = self.folder.max_texture_megapixels
            self.model.images.append(open_image(data, "texture", f"model {self.path}: a texture", limit))
            self.model.textures.append(TextureData(len(self.model.images) - 1))
            self.textures[data] = len(self.model.textures) - 1
        return self.textures[data]
