"""Walks a pyrender Scene and builds a scene graph."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.interop.losses import Losses
from firefly_sample.interop.pyrender_cameras import Size, camera_from_pyrender
from firefly_sample.interop.pyrender_lights import light_from_pyrender
from firefly_sample.interop.pyrender_meshes import MeshReader
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.lights import AmbientLight
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Camera, Scene
from firefly_sample.scene.transforms import matrix_from_gltf
from firefly_sample.srgb import srgb_to_linear

Float64 = NDArray[np.float64]


def read_scene(scene: Any, size: Size | None, losses: Losses) -> Scene:
    """See `firefly_sample.interop.pyrender_bridge.from_pyrender`."""
    return _Reader(scene, size, losses).read()


class _Reader:
    def __init__(self, scene: Any, size: Size | None, losses: Losses) -> None:
        self._source, self._size, self._losses = scene, size, losses
        self._meshes = MeshReader(losses)
        self._camera: NodePath | None = None
        self._given = {node.name for node in scene.nodes}
        self._counts: dict[str, int] = {}

    def read(self) -> Scene:
        source = self._source
        below = {child for node in source.nodes for child in node.children}
        # The nodes are a set; only the graph of their transforms remembers in which order they came.
        tops = [node for node in source._digraph if node in source.nodes and node not in below]
        tops.sort(key=lambda node: node.name or "")
        root = NodePath() if len(tops) == 1 and not source.name else NodePath(source.name or "root")
        waiting = [(node, root, np.eye(4)) for node in reversed(tops)]
        while waiting:
            node, parent, above = waiting.pop()
            local = _matrix(node.matrix)
            net = local @ above
            path = self._read_node(node, parent, net)
            path.set_mat(local)
            waiting.extend((child, path, net) for child in reversed(node.children))
            if root.is_empty():
                root = path
        if source.ambient_light.any():
            root.attach_new_node(AmbientLight("ambient", source.ambient_light.astype(np.float64)))
        if source.bg_color[3] != 1.0:
            self._losses.add("a background's alpha is left out", source.name or "scene")
        red, green, blue = srgb_to_linear(np.clip(source.bg_color[:3].astype(np.float64), 0.0, 1.0)).tolist()
        return Scene(root, self._camera, (red, green, blue))

    def _read_node(self, node: Any, parent: NodePath, net: Float64) -> NodePath:
        """Attach a node: of the one thing it holds, or a plain one with a node for each of several below."""
        name = self._name(node)
        if node.skin is not None or node.weights is not None:
            self._losses.add("skins and morph weights are left out", name)
        contents: list[PandaNode] = []
        hidden = node.mesh is not None and not node.mesh.is_visible
        if node.mesh is not None:
            contents.append(self._mesh(node.mesh, name, net))
        if node.light is not None:
            contents.append(light_from_pyrender(node.light, name, self._losses))
        if node.camera is not None:
            lens = camera_from_pyrender(node.camera, name, self._size, self._losses)
            if lens is not None:
                contents.append(Camera(name, lens))
        # hiding hides what is below, too
        alone = len(contents) == 1 and not (hidden and node.children)
        path = parent.attach_new_node(contents[0] if alone else name)
        for content in contents:
            place = path if alone else path.attach_new_node(content)
            if hidden and isinstance(content, GeomNode):
                place.hide()
            if node is self._source.main_camera_node and isinstance(content, Camera):
                self._camera = place
                self._check_scale(name, net)
        return path

    def _name(self, node: Any) -> str:
        """A node's name; of one without, that of what it holds, or else the kind of that and a number."""
        held = [kind for kind in ("mesh", "light", "camera") if getattr(node, kind) is not None]
        for thing in (node, *(getattr(node, kind) for kind in held)):
            if thing.name:
                return str(thing.name)
        kind = held[0] if held else "node"
        while True:
            self._counts[kind] = self._counts.get(kind, 0) + 1
            name = f"{kind} {self._counts[kind]}"
            if name not in self._given:
                return name

    def _mesh(self, mesh: Any, name: str, net: Float64) -> GeomNode:
        made = GeomNode(name)
        for index, (geom, material, pose) in enumerate(self._meshes.parts(mesh, name, net)):
            if pose is None:
                made.add_geom(geom, material)
            else:
                instance = GeomNode(f"{name}[{index}]")
                instance.add_geom(geom, material)
                NodePath(instance).set_mat(_matrix(pose))
                made.add_child(instance)
        return made

    def _check_scale(self, name: str, net: Float64) -> None:
        upper = net[:3, :3]
        if not np.allclose(upper @ upper.T, np.eye(3), rtol=0.0, atol=1e-6):
            self._losses.add("scale and shear of cameras are left out", name)


def _matrix(given: Any) -> Float64:
    """A matrix of pyrender's as ours; rounding in its last row, which pyrender lets pass, is removed."""
    matrix = np.array(given, dtype=np.float64)
    if np.allclose(matrix[3], (0.0, 0.0, 0.0, 1.0)):
        matrix[3] = 0.0, 0.0, 0.0, 1.0
    return matrix_from_gltf(matrix)
