"""Models from binary glTF files (.glb), read by trimesh and turned from Y-up to Z-up."""

from __future__ import annotations

import io
import json
import signal
import struct
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from firefly_sample.errors import ModelError, SceneError
from firefly_sample.model.kept import (
    GeomData,
    MaterialData,
    ModelData,
    NodeData,
    load_kept,
    model_key,
    save_kept,
)
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.material import AlphaMode, Texture
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.transforms import matrix_from_gltf, vectors_from_gltf

_ALPHA_MODES: dict[str, AlphaMode] = {"OPAQUE": "opaque", "MASK": "mask", "BLEND": "blend"}


def load_model(path: str | Path) -> NodePath:
    """Load a new tree of nodes from a .glb file.

    The file's axes are turned (glTF is Y-up, this package Z-up); units are kept. Nodes keep their names
    and transforms, primitives of one mesh become Geoms of one node, and nodes with the same mesh share Geoms.
    Base colour, its texture, cut-out alpha, sidedness and vertex colours are read; other properties of glTF
    materials are ignored.

    Files are cached and not parsed twice: see `firefly_sample.disk_cache`. The root is named after the file.

    Raises
    ------
    ModelError
        If the file is missing, is not binary glTF 2, is damaged, or holds no triangles.
    """
    path = Path(path)
    data, header = _read_container(path)
    key = model_key(path.stem, data)
    kept = load_kept(key, lambda: _parse(path, data, header)) if key else None
    if kept is not None:
        return kept
    model = _parse(path, data, header)
    try:
        root = model.as_tree()
    except SceneError as error:
        raise ModelError(f"model {path}: {error}") from error
    if key:
        save_kept(key, model)
    return root


def _parse(path: Path, data: bytes, header: dict[str, Any]) -> ModelData:
    """Parse a file with trimesh."""
    with _interrupted_afterwards():
        import trimesh

        try:
            scene = trimesh.load_scene(io.BytesIO(data), file_type="glb", process=False)
        except Exception as error:
            raise ModelError(f"model {path}: damaged glTF ({_one_line(error)}): export it again") from error
    if not any(isinstance(mesh, trimesh.Trimesh) and len(mesh.faces) for mesh in scene.geometry.values()):
        raise ModelError(f"model {path}: holds no triangle mesh, so there is nothing to draw")
    return _Reader(path, header, scene).read()


def _read_container(path: Path) -> tuple[bytes, dict[str, Any]]:
    """Return the file's bytes and its JSON header, after checking the container.

    The layout is that of the glTF 2.0 specification, section 4 "GLB file format": twelve bytes of magic,
    version and total length, then chunks, of which the first is JSON.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise ModelError(f"model {path}: no such file") from None
    except OSError as error:
        raise ModelError(f"model {path}: cannot be read ({error.strerror})") from None
    if data[:4] != b"glTF":
        raise ModelError(f"model {path}: not a binary glTF file (.glb): its first bytes are {data[:4]!r}")
    if len(data) < 20:
        raise ModelError(f"model {path}: truncated, it ends inside its header ({len(data)} bytes)")
    version, length, json_length = struct.unpack_from("<3I", data, 4)
    if version != 2:
        raise ModelError(f"model {path}: glTF version {version}, expected 2: export it as glTF 2")
    if len(data) < length:
        raise ModelError(f"model {path}: truncated, {len(data)} of {length} bytes are there")
    try:
        header = json.loads(data[20 : 20 + json_length])
    except ValueError as error:
        raise ModelError(f"model {path}: damaged glTF header ({_one_line(error)})") from None
    if not isinstance(header, dict):
        raise ModelError(f"model {path}: damaged glTF header (not a JSON object)")
    return data, header


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__


@contextmanager
def _interrupted_afterwards() -> Iterator[None]:
    """Delay Ctrl-C until the end of a block: trimesh would ignore it while it imports."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(before):
        yield
        return
    heard: list[tuple[int, FrameType | None]] = []
    signal.signal(signal.SIGINT, lambda number, frame: heard.append((number, frame)))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if heard:
            before(*heard[0])


class _Reader:
    """Converts a trimesh scene to data, with each geom, material and image once."""

    def __init__(self, path: Path, header: dict[str, Any], scene: Any) -> None:
        self.path = path
        self.scene = scene
        self.model = ModelData(path.stem)
        self.geoms: dict[str, int] = {}
        self.materials: dict[int, int] = {}
        self.images: dict[int, int] = {}
        materials = [made for made in header.get("materials", []) if isinstance(made, dict)]
        names = Counter(made.get("name") for made in materials)
        # only names that occur once tell which material is meant
        self.header_materials = {made.get("name"): made for made in materials if names[made.get("name")] == 1}
        self.children: dict[str, list[str]] = {}
        self.edges: dict[str, dict[str, Any]] = {}
        for (parent, child), edge in scene.graph.transforms.edge_data.items():
            self.children.setdefault(parent, []).append(child)
            self.edges[child] = edge

    def read(self) -> ModelData:
        base = self.scene.graph.base_frame
        waiting = [(-1, name) for name in self.children.get(base, [])]
        seen: set[str] = set()
        while waiting:
            parent, name = waiting.pop(0)
            if name in seen:
                raise ModelError(f"model {self.path}: node {name!r} has two parents or is its own ancestor")
            seen.add(name)
            children = self.children.get(name, [])
            primitives = [child for child in children if self._is_primitive(child)]
            geometries = [self.edges[node].get("geometry") for node in (name, *primitives)]
            geoms = tuple(
                self._geom(geometry)
                for geometry in geometries
                if geometry is not None and hasattr(self.scene.geometry[geometry], "faces")
            )
            matrix = matrix_from_gltf(self.edges[name].get("matrix", np.eye(4)))
            if not np.isfinite(matrix).all():
                raise ModelError(f"model {self.path}: node {name!r} has a transform that is not finite")
            moved = not np.array_equal(matrix, np.eye(4))
            self.model.nodes.append(NodeData(name, parent, matrix if moved else None, geoms))
            index = len(self.model.nodes) - 1
            waiting.extend((index, child) for child in children if not self._is_primitive(child))
        return self.model

    def _is_primitive(self, name: str) -> bool:
        """Return whether trimesh invented this node, for one of several primitives of a mesh."""
        mesh = self.scene.geometry.get(self.edges[name].get("geometry"))
        return mesh is not None and bool(mesh.metadata.get("from_gltf_primitive"))

    def _geom(self, name: str) -> int:
        if name not in self.geoms:
            mesh = self.scene.geometry[name]
            # only the file's own normals: Geom computes missing ones itself
            normals = mesh.vertex_normals if "vertex_normals" in mesh._cache.cache else None
            arrays = {
                "vertices": vectors_from_gltf(mesh.vertices),
                "triangles": mesh.faces,
                "normals": None if normals is None else _unit(vectors_from_gltf(normals)),
                "texcoords": getattr(mesh.visual, "uv", None),
                "colors": _vertex_colors(mesh),
            }
            given = {what: np.asarray(array) for what, array in arrays.items() if array is not None}
            material = self._material(getattr(mesh.visual, "material", None))
            self.geoms[name] = len(self.model.geoms)
            self.model.geoms.append(GeomData(name, material, given))
        return self.geoms[name]

    def _material(self, source: Any) -> int:
        key = id(source)
        if key not in self.materials:
            name = getattr(source, "name", None) or f"{self.path.stem} material {len(self.materials)}"
            header = self.header_materials.get(getattr(source, "name", None), {})
            cutoff = getattr(source, "alphaCutoff", None)
            made = MaterialData(
                name,
                base_color=_base_color(source, header).tolist(),
                image=self._image(source, header, name),
                alpha_mode=_ALPHA_MODES.get(getattr(source, "alphaMode", None) or "OPAQUE", "opaque"),
                alpha_cutoff=0.5 if cutoff is None else float(cutoff),
                double_sided=bool(getattr(source, "doubleSided", False)),
            )
            self.materials[key] = len(self.model.materials)
            self.model.materials.append(made)
        return self.materials[key]

    def _image(self, source: Any, header: dict[str, Any], name: str) -> int | None:
        image = getattr(source, "baseColorTexture", None)
        if image is None:
            # trimesh silently drops a texture that it cannot decode
            if "baseColorTexture" in header.get("pbrMetallicRoughness", {}):
                raise ModelError(f"model {self.path}: material {name!r} has a texture that cannot be read")
            return None
        key = id(image)
        if key not in self.images:
            try:
                pixels = np.asarray(image.convert("RGBA"))
            except (OSError, ValueError, SyntaxError) as error:
                raise ModelError(
                    f"model {self.path}: the texture of material {name!r} is damaged ({_one_line(error)})"
                ) from error
            self.images[key] = len(self.model.images)
            self.model.images.append(Texture.from_file(lambda: pixels, pixels.shape[1::-1], None, name))
        return self.images[key]


def _base_color(source: Any, header: dict[str, Any]) -> Float64:
    """Return the linear factor, from the header if possible: trimesh rounds it to eight bits."""
    exact = header.get("pbrMetallicRoughness", {}).get("baseColorFactor")
    if exact is not None:
        return np.asarray(exact, dtype=np.float64)
    rounded = getattr(source, "baseColorFactor", None)
    return np.ones(4) if rounded is None else np.asarray(rounded, dtype=np.float64) / 255.0


def _vertex_colors(mesh: Any) -> Float64 | None:
    """Return linear vertex colours in 0..1, from either of trimesh's two attributes."""
    visual = mesh.visual
    by_vertex = visual.kind == "vertex"
    stored = visual.vertex_colors if by_vertex else getattr(visual, "vertex_attributes", {}).get("color")
    if stored is None:
        return None
    colors = np.asarray(stored)
    scale = np.iinfo(colors.dtype).max if colors.dtype.kind == "u" else 1.0
    return np.asarray(colors / scale, dtype=np.float64)


def _unit(vectors: Float64) -> Float64:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0))
