"""A COLLADA file as a `ModelData`, read by pycollada.

trimesh reads such files through pycollada too, but drops names, levels of the tree, highlights, and the
textures and skinned meshes that it cannot use, without a word.
"""

from __future__ import annotations

import io
import warnings
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from firefly_sample.errors import ModelError
from firefly_sample.losses import Losses
from firefly_sample.model.builder import GREY, Builder
from firefly_sample.model.conventions import linear_color, linear_colors
from firefly_sample.model.data import MaterialData, ModelData
from firefly_sample.model.folder import Folder
from firefly_sample.model.formats import Up, up_axis
from firefly_sample.model.pixels import one_line
from firefly_sample.model.polygons import cut_faces
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.groups import row_ids

MOST_NODES = 1_000_000
"""The most nodes that are made: nodes that are instances of each other multiply."""

_AXES: dict[str, Up] = {"X_UP": "x", "Y_UP": "y", "Z_UP": "z"}


def read_dae(path: Path, up: str | None, folder: Folder, losses: Losses) -> ModelData:
    """Return the scene of a COLLADA file: its tree, meshes, materials and textures.

    Raises
    ------
    ModelError
        If pycollada cannot read the file, or a texture is too large.
    """
    import collada

    data = path.read_bytes()
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise ModelError(
            f"model {path}: has a document type declaration, which COLLADA does not need: remove it"
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            document = collada.Collada(io.BytesIO(data), ignore=[collada.common.DaeError])
            declared = "y" if document.assetInfo is None else _AXES.get(document.assetInfo.upaxis, "y")
            return _Reader(Builder(path, up_axis(path, up, declared), folder, losses), document).read()
        except (ModelError, MemoryError):
            raise
        except Exception as error:
            raise ModelError(
                f"model {path}: damaged .dae file ({one_line(error)}): export it again"
            ) from error


class _Reader:
    """Converts one document."""

    def __init__(self, builder: Builder, document: Any) -> None:
        self.builder = builder
        self.path = builder.path
        self.losses = builder.losses
        self.document = document
        self.geoms: dict[tuple[Any, ...], tuple[int, ...]] = {}

    def read(self) -> ModelData:
        scene = self.document.scene
        waiting = [(-1, node) for node in (scene.nodes if scene is not None else [])]
        for parent, node in waiting:  # grows as it goes
            if len(waiting) > MOST_NODES:
                raise ModelError(f"model {self.path}: has more than {MOST_NODES} nodes: simplify it")
            waiting.extend(self._node(parent, node))
        if len(self.document.animations):
            self.losses.add("animations of COLLADA files")
        for error in self.document.errors:
            self.losses.add(f"a part that cannot be read ({one_line(error)})")
        return self.builder.model

    def _node(self, parent: int, node: Any) -> list[tuple[int, Any]]:
        """Add a node and what it holds; return the nodes below it, with its index."""
        name = getattr(node, "name", None) or node.id or "node"
        index = self.builder.add_node(name, parent, np.asarray(node.matrix, dtype=np.float64).T)
        made = self.builder.model.nodes[index]
        below = []
        for child in node.children or []:
            kind = type(child).__name__
            if kind == "GeometryNode":
                made.geoms += self._geometry(child.geometry, child.materials)
            elif kind == "ControllerNode":
                self.losses.add("skins and morph targets of COLLADA files: drawn at rest", name)
                made.geoms += self._controller(child)
            elif kind in ("CameraNode", "LightNode"):
                self.losses.add("cameras and lights of COLLADA files", name)
            elif hasattr(child, "children"):
                below.append((index, child))
        return below

    def _controller(self, node: Any) -> tuple[int, ...]:
        source = getattr(node.controller, "geometry", None) or getattr(
            node.controller, "source_geometry", None
        )
        return () if source is None else self._geometry(source, node.materials)

    def _geometry(self, geometry: Any, bindings: Any) -> tuple[int, ...]:
        """Return the indices of a geometry's geoms, which are made once for each set of materials."""
        bound = {binding.symbol: binding.target for binding in bindings or []}
        key = (geometry.id, *sorted((symbol, target.id) for symbol, target in bound.items()))
        if key not in self.geoms:
            made = [self._geom(geometry, primitive, bound) for primitive in geometry.primitives]
            self.geoms[key] = tuple(index for geoms in made for index in geoms)
        return self.geoms[key]

    def _geom(self, geometry: Any, primitive: Any, bound: dict[str, Any]) -> tuple[int, ...]:
        name = geometry.name or geometry.id
        if type(primitive).__name__ == "LineSet":
            self.losses.add("lines", name)
            return ()
        if not len(primitive.index):
            return ()
        # corners that are alike in all indices are one vertex
        index = np.asarray(primitive.index, dtype=np.int64).reshape(-1, primitive.nindices)
        if index.min() < 0:
            raise ModelError(f"model {self.path}: mesh {name!r} is damaged: it has a negative index")
        _, first, vertex = np.unique(row_ids(index), return_index=True, return_inverse=True)
        index = index[first]
        arrays = self._arrays(name, primitive, index)
        counts = np.asarray(getattr(primitive, "vcounts", np.full(len(vertex) // 3, 3)), dtype=np.int64)
        if counts.sum() != len(vertex):
            raise ModelError(
                f"model {self.path}: mesh {name!r} is damaged: its faces are not those it counts"
            )
        faces = np.split(vertex, np.cumsum(counts)[:-1])
        triangles, _ = cut_faces([face.tolist() for face in faces if len(face) > 2], arrays["vertices"])
        material = bound.get(primitive.material)
        if material is None:
            if primitive.material:
                self.losses.add("materials that are bound to nothing", primitive.material)
            index_of = self.builder.plain_material(arrays.get("colors"))
        else:
            index_of = self.builder.material(material.id, partial(self._made, material))
        return self.builder.add_geom(name, index_of, triangles, arrays)

    def _arrays(self, name: str, primitive: Any, index: Any) -> dict[str, Float64]:
        """Return the rows that the inputs of a primitive have for each vertex."""
        names = {"VERTEX": "vertices", "NORMAL": "normals", "TEXCOORD": "texcoords", "COLOR": "colors"}
        arrays = {}
        for semantic, what in names.items():
            inputs = primitive.sources.get(semantic) or []
            if inputs:
                offset, source = inputs[0][0], inputs[0][4]
                arrays[what] = np.asarray(source.data, dtype=np.float64)[index[:, offset]]
            if len(inputs) > 1 and semantic in ("TEXCOORD", "COLOR"):
                self.losses.add(f"{what} after the first set, of meshes", name)
        if "texcoords" in arrays:
            arrays["texcoords"] = arrays["texcoords"][:, :2]
        if "colors" in arrays:
            arrays["colors"] = linear_colors(arrays["colors"])
        return arrays

    def _made(self, material: Any) -> MaterialData:
        name = material.name or material.id
        effect = material.effect
        color, texture = self._color(effect.diffuse, GREY[:3])
        emission, emission_texture = self._color(effect.emission, (0.0, 0.0, 0.0))
        specular, specular_texture = self._color(effect.specular, (0.0, 0.0, 0.0))
        opacity = self._opacity(name, effect)
        exponent = effect.shininess if isinstance(effect.shininess, (int, float)) else 0.0
        shines = effect.shadingtype in ("phong", "blinn") and exponent >= 1.0 and specular_texture is None
        for what, value in (
            ("specular textures", specular_texture),
            ("bump and normal maps", effect.bumpmap),
            ("reflections", effect.reflectivity or None),
        ):
            if value is not None:
                self.losses.add(f"{what} of materials", name)
        return MaterialData(
            name,
            base_color=(*color, opacity),
            texture=texture,
            alpha_mode="blend" if opacity < 1.0 else "opaque",
            double_sided=True,
            emission=emission,
            emission_texture=emission_texture,
            specular=specular if shines else (0.0, 0.0, 0.0),
            shininess=min(float(exponent), 1e6) if shines else 0.0,
        )

    def _color(
        self, value: Any, absent: tuple[float, float, float]
    ) -> tuple[tuple[float, float, float], int | None]:
        """Return a linear colour and a texture: white and a texture, or a colour and None."""
        if value is None or isinstance(value, (int, float)):
            return absent, None
        if hasattr(value, "sampler"):
            texture = self._texture(value.sampler)
            return ((1.0, 1.0, 1.0) if texture is not None else absent), texture
        return linear_color(value[:3]), None

    def _texture(self, sampler: Any) -> int | None:
        name = unquote(sampler.surface.image.path or "").removeprefix("file://")
        return self.builder.texture(self.builder.folder.image(name))

    def _opacity(self, name: str, effect: Any) -> float:
        """Return how opaque a material is (COLLADA 1.4.1, "Determining Transparency")."""
        transparent, share = effect.transparent, effect.transparency
        if hasattr(transparent, "sampler") or hasattr(share, "sampler"):
            self.losses.add("opacity textures of materials", name)
            return 1.0
        if not isinstance(share, (int, float)) or transparent is None:
            return 1.0
        if effect.opaque_mode == "RGB_ZERO":
            red, green, blue = transparent[:3]
            opacity = 1.0 - share * (0.212671 * red + 0.715160 * green + 0.072169 * blue)
        else:
            opacity = float(transparent[3]) * share
        return min(max(float(opacity), 0.0), 1.0)
