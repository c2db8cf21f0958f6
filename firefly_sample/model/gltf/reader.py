"""A whole glTF file as `ModelData`: Z up, every loss named."""

from __future__ import annotations

from firefly_sample.losses import Losses
from firefly_sample.model.data import GeomData, ModelData, NodeData
from firefly_sample.model.gltf.animations import read_animation
from firefly_sample.model.gltf.cameras_lights import light_index, read_camera, read_light
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.extensions import check_extensions
from firefly_sample.model.gltf.images import Images
from firefly_sample.model.gltf.json_object import JsonObject
from firefly_sample.model.gltf.materials import Materials
from firefly_sample.model.gltf.meshes import count_targets, read_primitive
from firefly_sample.model.gltf.nodes import (
    Place,
    drawn_nodes,
    node_name,
    read_instances,
    read_skin,
    with_transform,
)


def read_gltf(
    document: Document, scene: str | int | None = None, max_texture_megapixels: float = 100.0
) -> ModelData:
    """Return everything that a scene of an open file contains.

    Parameters
    ----------
    document : Document
    scene : str, int or None
        The name or the index of the scene; see `drawn_nodes`.
    max_texture_megapixels : float
        Images with more million pixels are refused before they are decoded.

    Raises
    ------
    ModelError
        If anything is damaged, or the file requires an extension that is not implemented.
    """
    return _Reader(document, max_texture_megapixels).read(scene)


class _Reader:
    """Reads a file; each mesh, material, skin, camera and light once, where the first node uses it."""

    def __init__(self, document: Document, max_texture_megapixels: float) -> None:
        self.document = document
        self.losses = Losses()
        self.model = ModelData(document.path.stem)
        self.images = Images(document, max_texture_megapixels)
        self.materials = Materials(document, self.images, self.losses)
        self.geoms: dict[int, tuple[int, ...]] = {}
        self.places: dict[int, int] = {}
        self.used: dict[str, dict[int, int]] = {"skins": {}, "cameras": {}, "lights": {}}

    def read(self, scene: str | int | None) -> ModelData:
        document, model = self.document, self.model
        check_extensions(document, self.losses)
        drawn = drawn_nodes(document, scene)
        self.places = {place.node: index for index, place in enumerate(drawn)}
        nodes = document.items("nodes")
        for place in drawn:
            model.nodes.append(self._node(nodes[place.node], place))
        for index in range(document.count("animations")):
            animation = read_animation(document, index, self.places, self.losses)
            if animation is not None:
                model.animations.append(animation)
        model.materials, model.images = self.materials.found, self.images.found
        model.textures = self.materials.textures.found
        if not model.geoms:
            self.losses.add("the file has no triangles, lines or points, so that there is nothing to draw")
        model.losses = self.losses.lines()
        return model

    def _node(self, node: JsonObject, place: Place) -> NodeData:
        data = with_transform(NodeData(node_name(node, place.node), place.parent), node)
        if not place.shown:
            return data
        mesh, skin = node.index("mesh", "meshes"), node.index("skin", "skins")
        if mesh is not None:
            data.geoms = self._mesh(mesh)
            data.morph_weights = self._weights(node, mesh)
            data.instances = read_instances(node)
        if skin is not None and mesh is not None:
            data.skin = self._place("skins", skin)
            if not all("joints" in self.model.geoms[geom].arrays for geom in data.geoms):
                self.losses.add("meshes without joints do not follow the skin, of nodes", data.name)
            if data.instances is not None:
                self.losses.add("instances of skinned meshes are drawn once, of nodes", data.name)
                data.instances = None
        camera, light = node.index("camera", "cameras"), light_index(node)
        data.camera = None if camera is None else self._place("cameras", camera)
        data.light = None if light is None else self._place("lights", light)
        return data

    def _place(self, kind: str, index: int) -> int:
        """Return the place of a skin, camera or light in the model."""
        document, model, used = self.document, self.model, self.used[kind]
        if index not in used:
            used[index] = len(used)
            if kind == "skins":
                model.skins.append(read_skin(document, index, self.places))
            elif kind == "cameras":
                model.cameras.append(read_camera(document, index, self.losses))
            else:
                model.lights.append(read_light(document, index))
        return used[index]

    def _mesh(self, index: int) -> tuple[int, ...]:
        """Return the places of a mesh's geoms, one for each primitive that is drawn."""
        if index not in self.geoms:
            mesh = self.document.item("meshes", index, "mesh")
            name = mesh.text("name", "") or f"mesh {index}"
            primitives = mesh.objects("primitives")
            first = len(self.model.geoms)
            for number, primitive in enumerate(primitives):
                own = name if len(primitives) == 1 else f"{name} {number}"
                self._primitive(primitive, index, number, own)
            self.geoms[index] = tuple(range(first, len(self.model.geoms)))
        return self.geoms[index]

    def _primitive(self, primitive: JsonObject, mesh: int, number: int, name: str) -> None:
        material, uv_sets = self.materials.add(primitive.index("material", "materials"))
        made = self.materials.found[material]
        normal_set = None if made.normal_texture is None else made.normal_texcoord
        read = read_primitive(self.document, mesh, number, uv_sets, normal_set)
        for loss in read.losses:
            self.losses.add(f"{loss}, of meshes", name)
        if read.arrays is not None:
            if read.mode != "triangles":
                material = self.materials.of_marks(
                    material, "normals" in read.arrays, "tangents" in read.arrays
                )
            self.model.geoms.append(GeomData(name, material, read.arrays, read.flat, read.mode))

    def _weights(self, node: JsonObject, index: int) -> tuple[float, ...]:
        """Return the weights of a node's morph targets: its own, or else the mesh's defaults."""
        mesh = self.document.item("meshes", index, node.place("mesh"))
        count = count_targets(mesh)
        given = node.numbers("weights", None, None)
        owner, given = (node, given) if given is not None else (mesh, mesh.numbers("weights", None, None))
        if given is None:
            return (0.0,) * count
        if len(given) != count:
            raise owner.error("weights", f"are {len(given)} for {count} morph targets")
        return given
