"""A Wavefront OBJ file, with its material libraries and textures, as a `ModelData`."""

from __future__ import annotations

from pathlib import Path

from firefly_sample.errors import ModelError
from firefly_sample.losses import Losses
from firefly_sample.model.data import MaterialData, ModelData, NodeData, TextureData
from firefly_sample.model.folder import Folder
from firefly_sample.model.formats import Up
from firefly_sample.model.mtl import MtlMaterial, parse_mtl
from firefly_sample.model.obj import ObjMesh, parse_obj
from firefly_sample.model.plain_meshes import PLAIN, PLAIN_COLORED, linear_color, linear_colors, make_geom
from firefly_sample.scene.arrays import Float64


def read_obj(path: Path, up: Up, folder: Folder, losses: Losses) -> ModelData:
    """Return the content of an OBJ file: a node for each object, a geom for each of its materials.

    Raises
    ------
    ModelError
        If a line cannot be read, of the file or of a library, or a texture is too large.
    """
    try:
        parsed = parse_obj(_decode(path.read_bytes()), losses)
    except ValueError as error:
        raise ModelError(f"model {path}: {error}") from None
    builder = _Builder(path, folder, losses)
    for library in parsed.libraries:
        builder.read_library(library)
    for mesh in parsed.meshes:
        builder.add(mesh, up)
    return builder.model


def _decode(data: bytes) -> str:
    """Return a text that is UTF-8 or, if it is not, Latin-1, in which all bytes stand for something."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


class _Builder:
    """Collects the nodes, geoms and materials of a file."""

    def __init__(self, path: Path, folder: Folder, losses: Losses) -> None:
        self.path = path
        self.folder = folder
        self.losses = losses
        self.model = ModelData(path.stem)
        self.library: dict[str, MtlMaterial] = {}
        self.materials: dict[tuple[str, bool], int] = {}
        self.textures: dict[tuple[str, str], int | None] = {}
        self.nodes: dict[str, NodeData] = {}

    def read_library(self, names: str) -> None:
        """Read the library of this name, or those of these names if no file is called so."""
        for name in [names] if self.folder.find(names) else names.split():
            data = self.folder.read(name, "material libraries")
            try:
                found = {} if data is None else parse_mtl(_decode(data), self.losses)
            except ValueError as error:
                raise ModelError(f"model {self.path}: material library {name!r}: {error}") from None
            self.library = found | self.library

    def add(self, mesh: ObjMesh, up: Up) -> None:
        arrays = dict(mesh.arrays)
        if "colors" in arrays:
            arrays["colors"] = linear_colors(_shares(arrays["colors"]))
        material = self._material(mesh.material, "colors" in arrays)
        name = mesh.node or mesh.material or self.path.stem
        geom = make_geom(f"model {self.path}", name, material, mesh.triangles, arrays, up, mesh.groups)
        if geom is None:
            return
        if mesh.node not in self.nodes:
            self.nodes[mesh.node] = NodeData(mesh.node or self.path.stem, -1)
            self.model.nodes.append(self.nodes[mesh.node])
        self.nodes[mesh.node].geoms += (len(self.model.geoms),)
        self.model.geoms.append(geom)

    def _material(self, name: str, colored: bool) -> int:
        found = self.library.get(name)
        if name and found is None:
            self.losses.add("materials not found in a library", name)
        key = (name if found else "", colored)
        if key not in self.materials:
            plain = PLAIN_COLORED if colored else PLAIN
            self.materials[key] = len(self.model.materials)
            self.model.materials.append(plain if found is None else self._made(found))
        return self.materials[key]

    def _made(self, source: MtlMaterial) -> MaterialData:
        texture = self._texture(source, "map_kd")
        emission_texture = self._texture(source, "map_ke")
        mask, shown = source.maps.get("map_d"), source.maps.get("map_kd")
        cut_out = mask is not None and shown is not None and mask.name == shown.name and texture is not None
        if mask is not None and not cut_out:
            self.losses.add("opacity textures other than the diffuse texture, of materials", source.name)
        # a texture on black is an exporter's slip: it is meant to be seen
        black = texture is not None and not any(source.diffuse)
        diffuse = (1.0, 1.0, 1.0) if black else linear_color(source.diffuse)
        shines = source.shines
        emission = linear_color(source.emission)
        if emission_texture is not None and emission == (0.0, 0.0, 0.0):
            emission = (1.0, 1.0, 1.0)
        return MaterialData(
            source.name,
            base_color=(*diffuse, source.opacity),
            texture=texture,
            alpha_mode="mask" if cut_out else "blend" if source.opacity < 1.0 else "opaque",
            double_sided=True,
            emission=emission,
            emission_texture=emission_texture,
            specular=linear_color(source.specular) if shines else (0.0, 0.0, 0.0),
            shininess=min(source.exponent, 1e6) if shines else 0.0,
        )

    def _texture(self, source: MtlMaterial, statement: str) -> int | None:
        used = source.maps.get(statement)
        if used is None:
            return None
        key = (used.name, used.wrap)
        if key not in self.textures:
            image = self.folder.image(used.name)
            self.textures[key] = None if image is None else len(self.model.textures)
            if image is not None:
                if image not in self.model.images:
                    self.model.images.append(image)
                self.model.textures.append(
                    TextureData(self.model.images.index(image), wrap_u=used.wrap, wrap_v=used.wrap)
                )
        return self.textures[key]


def _shares(colors: Float64) -> Float64:
    """Return vertex colours as 0..1: some programs write them as 0..255."""
    return colors / 255.0 if colors.max(initial=0.0) > 1.0 else colors
