"""Files that trimesh reads, as a `ModelData`."""

from __future__ import annotations

import io
import logging
import warnings
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import ModelError
from firefly_sample.losses import Losses
from firefly_sample.model.builder import Builder
from firefly_sample.model.contents import MIXED_PLY, PLY_COLORS, check_content, note_content
from firefly_sample.model.conventions import linear_color, linear_colors
from firefly_sample.model.data import ImageData, MaterialData, ModelData
from firefly_sample.model.folder import Folder
from firefly_sample.model.formats import Up
from firefly_sample.model.pixels import one_line, open_image, own_pixel_limit
from firefly_sample.scene.arrays import Float64


def read_scene(path: Path, suffix: str, up: Up, folder: Folder, losses: Losses) -> ModelData:
    """Return what trimesh reads of a file: nodes with their names and transforms, meshes and materials.

    Raises
    ------
    ModelError
        If trimesh, or a package that it uses, cannot read the file, or a texture is too large.
    """
    import trimesh

    resolver = _Resolver(folder)
    with own_pixel_limit(), _LossHandler(losses), path.open("rb") as file:
        # what NumPy would leave out of a damaged list of numbers
        warnings.filterwarnings("error", message="string or file could not be read")
        try:
            options = check_content(path, suffix, losses)
            scene = trimesh.load_scene(
                file, file_type=suffix, resolver=cast("Any", resolver), process=False, **options
            )
            note_content(path, suffix, scene, losses)
        except MemoryError:
            raise
        except Exception as error:
            if "PLY is unexpected length" in str(error):
                raise ModelError(f"model {path}: damaged .{suffix} file ({MIXED_PLY})") from error
            # a converter that fails leaves no file
            fault = "nothing in it could be read" if isinstance(error, FileNotFoundError) else one_line(error)
            raise ModelError(f"model {path}: damaged .{suffix} file ({fault}): export it again") from error
    if resolver.refused is not None:
        raise resolver.refused
    return _Reader(Builder(path, up, folder, losses), suffix, scene, resolver.images).read()


class _LossHandler(logging.Handler):
    """Notes what trimesh logs as a warning during a block: parts that it leaves out."""

    def __init__(self, losses: Losses) -> None:
        super().__init__(logging.WARNING)
        self.losses = losses

    def __enter__(self) -> None:
        logging.getLogger("trimesh").addHandler(self)

    def __exit__(self, *_: object) -> None:
        logging.getLogger("trimesh").removeHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        if record.exc_info is None or not isinstance(record.exc_info[1], _NamedError):
            self.losses.add(
                f"a part that trimesh cannot read ({' '.join(record.getMessage().split())[:200]})"
            )


class _NamedError(Exception):
    """A texture cannot be read, which is a loss, or an error, that is noted already."""


class _Resolver:
    """Gives trimesh the textures beside the model, and keeps the error that trimesh would swallow."""

    file_name = None

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        self.refused: ModelError | None = None
        self.images: dict[bytes, ImageData] = {}

    def get(self, name: str) -> bytes:
        try:
            image = self.folder.image(name)
        except ModelError as error:
            self.refused = error
            raise _NamedError from error
        path = self.folder.find(name)
        if image is None or path is None:
            raise _NamedError
        data = path.read_bytes()
        self.images[data] = image
        return data


class _Reader:
    """Converts one trimesh scene."""

    def __init__(self, builder: Builder, suffix: str, scene: Any, images: dict[bytes, ImageData]) -> None:
        self.builder = builder
        self.suffix = suffix
        self.scene = scene
        self.images = images
        self.geoms: dict[str, tuple[int, ...]] = {}

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
                self.builder.losses.add("meshes that no node shows", name)
        return self.builder.model

    def _node(self, parent: int, name: str, edge: dict[str, Any]) -> int:
        source = edge.get("geometry")
        only = len(self.scene.geometry) == 1 and parent < 0 and name == source
        matrix = np.asarray(edge.get("matrix", np.eye(4)), dtype=np.float64).T
        index = self.builder.add_node(self.builder.path.stem if only else name, parent, matrix)
        if source is not None:
            if source not in self.geoms:
                self.geoms[source] = self._geom(source)
            self.builder.model.nodes[index].geoms = self.geoms[source]
        return index

    def _geom(self, name: str) -> tuple[int, ...]:
        """Return the index of a new geom; () of what is no triangles."""
        mesh = self.scene.geometry[name]
        if not hasattr(mesh, "faces"):
            points = type(mesh).__name__ == "PointCloud"
            self.builder.losses.add("points" if points else "curves", name)
            return ()
        triangles = np.asarray(mesh.faces, dtype=np.int64)
        arrays: dict[str, Float64] = {"vertices": np.asarray(mesh.vertices, dtype=np.float64)}
        # trimesh turns the vertices of .xaml, but not its normals
        if self.suffix != "xaml" and "vertex_normals" in mesh._cache.cache:
            arrays["normals"] = np.asarray(mesh.vertex_normals, dtype=np.float64)
        visual = mesh.visual
        colors = _vertex_colors(mesh)
        if colors is not None:
            arrays["colors"] = linear_colors(colors)
        elif visual.kind == "face" and len(visual.face_colors) == len(triangles):
            inside = triangles.min(initial=0) >= 0 and triangles.max(initial=-1) < len(mesh.vertices)
            if inside:  # of others, there is an error below
                arrays = {what: array[triangles.ravel()] for what, array in arrays.items()}
                arrays["colors"] = np.repeat(linear_colors(np.asarray(visual.face_colors)), 3, axis=0)
                triangles = np.arange(triangles.size).reshape(-1, 3)
        if visual.kind == "texture" and np.shape(visual.uv) == (len(mesh.vertices), 2):
            arrays["texcoords"] = np.asarray(visual.uv, dtype=np.float64)
        material = self._material(visual, arrays.get("colors"))
        return self.builder.add_geom(name, material, triangles, arrays)

    def _material(self, visual: Any, colors: Float64 | None) -> int:
        """Return the index of a mesh's material; its colours are display colours, but for those of STEP."""
        source = visual.material if visual.kind == "texture" else None
        if hasattr(source, "baseColorFactor"):
            return self.builder.material(id(source), lambda: self._made(source))
        # where a file has no texture, trimesh makes one
        texture = self._texture(source.image) if source is not None and self.images else None
        if texture is None:
            return self.builder.plain_material(colors)
        made = MaterialData("textured", texture=texture, double_sided=True)
        return self.builder.material(id(source), lambda: made)

    def _made(self, source: Any) -> MaterialData:
        name = getattr(source, "_name", None) or f"material {len(self.builder.model.materials)}"
        given = source.baseColorFactor
        color = np.ones(4) if given is None else np.asarray(given, dtype=np.float64) / 255.0
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
        if isinstance(getattr(image, "fp", None), io.BytesIO):
            data = image.fp.getvalue()
        else:
            kept = io.BytesIO()
            image.save(kept, "PNG")
            data = kept.getvalue()
        if data not in self.images:
            what = f"model {self.builder.path}: a texture"
            self.images[data] = open_image(data, "texture", what, self.builder.folder.max_texture_megapixels)
        return self.builder.texture(self.images[data])


def _vertex_colors(mesh: Any) -> NDArray[np.uint8] | None:
    """Return the display colours of a mesh's vertices (n, 4), None if it has none.

    trimesh leaves out those of PLY files with texture coordinates, and Blender writes both.
    """
    from trimesh.visual.color import to_rgba

    if mesh.visual.kind == "vertex":
        return np.asarray(mesh.visual.vertex_colors)
    table = mesh.metadata.get("_ply_raw", {}).get("vertex")
    if mesh.visual.kind != "texture" or table is None or table["length"] != len(mesh.vertices):
        return None
    columns = [table["data"][name] for name in PLY_COLORS if name in table["properties"]]
    return np.asarray(to_rgba(np.column_stack(columns))) if len(columns) >= 3 else None
