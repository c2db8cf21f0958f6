"""Walk a scene graph and write a pyrender Scene, and the reverse."""

from __future__ import annotations

from functools import reduce
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.interop.pyrender.cameras import Size, camera_from_pyrender, camera_to_pyrender
from firefly_sample.interop.pyrender.lights import (
    light_from_pyrender,
    light_to_pyrender,
    point_lights_to_pyrender,
)
from firefly_sample.interop.pyrender.meshes import MeshReader, MeshWriter
from firefly_sample.losses import Losses
from firefly_sample.plan.view import camera_matrices
from firefly_sample.scene.color_scale import UNSCALED
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.light import FadingLight, Light
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLights
from firefly_sample.scene.node import PandaNode, inherit
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.render_mode import PLAIN, RenderMode
from firefly_sample.scene.scene import Camera, Scene, VerticalGradient
from firefly_sample.scene.surface_overrides import NOTHING, SurfaceOverrides, composed
from firefly_sample.scene.transforms import matrix_from_gltf, matrix_to_gltf
from firefly_sample.scene.traversal import iter_visible
from firefly_sample.srgb import linear_to_srgb, srgb_to_linear

Float64 = NDArray[np.float64]


Content = tuple[str, Any, Float64 | None]
"""A keyword of pyrender's Node, the object for it, and its matrix in node space; None is the identity."""

_NO_SIZES = "sizes of points are left out: pyrender's OffscreenRenderer takes one, as point_size"


class SceneWriter:
    """Writes a scene at a time, for which it must be updated already, as a pyrender Scene."""

    def __init__(self, scene: Scene, time: float, size: Size | None, losses: Losses) -> None:
        import pyrender

        self._scene, self._time, self._size, self._losses = scene, time, size, losses
        self._mask = scene.camera_node.camera_mask
        self._meshes = MeshWriter(losses)
        self._ambient = np.zeros(3)
        self._target = pyrender.Scene(bg_color=self._background())

    def write(self) -> Any:
        """Return the pyrender Scene."""
        root, camera = self._scene.root, self._scene.camera
        waiting: list[tuple[NodePath, Any, Float64]] = [(root, None, root.get_net_mat())]
        while waiting:
            path, parent, local = waiting.pop()
            node = self._write_node(path, parent, local)
            waiting.extend(
                (child, node, child.node().transform.get_mat()) for child in reversed(path.get_children())
            )
        if not root.is_ancestor_of(camera):
            self._write_node(camera, None, camera.get_net_mat())
        self._target.ambient_light = self._ambient
        self._note_light_limit()
        return self._target

    def _write_node(self, path: NodePath, parent: Any, local: Float64) -> Any:
        """Add a node and its contents below `parent`; contents with a matrix get a node of their own."""
        node = path.node()
        if node.has_tags():
            self._losses.add("tags are left out", node.name)
        contents = self._contents(path)
        held = {kind: content for kind, content, matrix in contents if matrix is None}
        written = last = self._add(node.name, parent, local, held)
        for kind, content, matrix in contents:
            if matrix is not None:
                last = self._add(content.name, written, matrix, {kind: content})
        if path == self._scene.camera:
            self._target.main_camera_node = last
        return written

    def _add(self, name: str, parent: Any, local: Float64, contents: dict[str, Any]) -> Any:
        import pyrender

        node = pyrender.Node(name=name, **contents)
        self._target.add_node(node, parent_node=parent)
        matrix = matrix_to_gltf(local)
        if (np.linalg.norm(matrix[:3, :3], axis=0) > 0.0).all():
            node.matrix = matrix  # finds translation, rotation and scale, if no axis is flat
        self._target.set_pose(node, matrix)  # pyrender 0.1.45 makes its matrix of those and loses shear
        return node

    def _contents(self, path: NodePath) -> list[Content]:
        node, net = path.node(), path.get_net_mat()
        if isinstance(node, Camera):
            return [self._camera(path, node)]
        first = next(iter_visible(path, self._mask), None)
        visible = first is not None and first.node is node
        match node:
            case GeomNode():
                mirrored = bool(np.linalg.det(net[:3, :3]) < 0)
                mode = _net_render_mode(path)
                if mode.thickness != 1.0 and any(geom.mode == "points" for geom, _ in node.geoms):
                    self._losses.add(_NO_SIZES, node.name)
                if first is not None and visible and first.depth_offset:
                    self._losses.add("depth offsets, which pyrender lacks, are left out", node.name)
                if first is not None and visible and first.color_scale != UNSCALED:
                    self._losses.add("colour scales, which pyrender lacks, are left out", node.name)
                look = path.get_net_material(), _net_overrides(path), path.get_net_color()
                mesh = self._meshes.mesh(node, *look, mode.mode == "wireframe", mirrored, visible)
                return [] if mesh is None else [("mesh", mesh, None)]
            case Sprites():
                self._losses.add("sprites, which pyrender lacks, are left out", node.name)
            case ParticleNode():
                self._losses.add("particles, which pyrender lacks, are left out", node.name)
            case PointLights() | Light() | AmbientLight() if not visible:
                self._losses.add("hidden lights, which pyrender lacks, are left out", node.name)
            case AmbientLight():
                self._ambient += node.get_color()
            case PointLights():
                lights = point_lights_to_pyrender(node, self._time, self._losses)
                return [("light", light, matrix) for light, matrix in lights]
            case FadingLight() | DirectionalLight():
                return [("light", *light_to_pyrender(node, net, self._losses))]
        return []

    def _camera(self, path: NodePath, node: Camera) -> Content:
        """Return a camera without its node's scale and shear, which the renderer ignores as well."""
        main = path == self._scene.camera
        camera, matrix = camera_to_pyrender(node.name, node.lens, self._size, self._losses, main)
        net = path.get_net_mat()
        view_to_world = camera_matrices(Scene(self._scene.root, path)).view_to_world
        if not np.allclose(net[:3, :3], view_to_world[:3, :3], rtol=0.0, atol=1e-9):
            rigid = view_to_world @ np.linalg.inv(net)
            matrix = rigid if matrix is None else matrix @ rigid
            matrix[:, 3] = 0.0, 0.0, 0.0, 1.0
        return "camera", camera, matrix

    def _background(self) -> Float64:
        """Return the background as pyrender shows it: an opaque sRGB colour."""
        color, name = self._scene.background, self._scene.root.get_name()
        if isinstance(color, VerticalGradient):
            if color.horizon != color.zenith:
                self._losses.add("a background's gradient becomes its horizon's colour", name)
            color = color.horizon
        if max(color) > 1.0:
            self._losses.add("a background brighter than 1 is clipped to 1", name)
        if (np.asarray(self._scene.exposure) != 1.0).any():
            self._losses.add("exposure, which pyrender lacks, is left out", name)
        return np.array([*linear_to_srgb(color), 1.0])

    def _note_light_limit(self) -> None:
        from pyrender.constants import MAX_N_LIGHTS

        for kind, nodes in (
            ("point lights", self._target.point_light_nodes),
            ("spotlights", self._target.spot_light_nodes),
            ("directional lights", self._target.directional_light_nodes),
        ):
            if len(nodes) > MAX_N_LIGHTS:
                loss = f"pyrender draws at most {MAX_N_LIGHTS} {kind} on a mesh, the nearest"
                for name in sorted(node.name for node in nodes):
                    self._losses.add(loss, name)


class SceneReader:
    """Builds a Scene from a pyrender Scene."""

    def __init__(self, scene: Any, size: Size | None, losses: Losses) -> None:
        self._source, self._size, self._losses = scene, size, losses
        self._meshes = MeshReader(losses)
        self._camera: NodePath | None = None
        self._taken_names = {node.name for node in scene.nodes}
        self._numbers: dict[str, count[int]] = {}

    def read(self) -> Scene:
        """Return the Scene."""
        source = self._source
        below = {child for node in source.nodes for child in node.children}
        # the nodes are a set: only the graph of their transforms has them in their order
        tops = [node for node in source._digraph if node in source.nodes and node not in below]
        tops.sort(key=lambda node: node.name or "")
        root = NodePath() if len(tops) == 1 and not source.name else NodePath(source.name or "root")
        waiting = [(node, root, np.eye(4)) for node in reversed(tops)]
        while waiting:
            node, parent, parent_net = waiting.pop()
            local = _matrix(node.matrix)
            net = local @ parent_net
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
        """Attach a node that is its one content, or a plain node with a child for each of several."""
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
        # hiding a node hides its children as well
        single = len(contents) == 1 and not (hidden and node.children)
        path = parent.attach_new_node(contents[0] if single else name)
        for content in contents:
            content_path = path if single else path.attach_new_node(content)
            if hidden and isinstance(content, GeomNode):
                content_path.hide()
            if node is self._source.main_camera_node and isinstance(content, Camera):
                self._camera = content_path
                upper = net[:3, :3]
                if not np.allclose(upper @ upper.T, np.eye(3), rtol=0.0, atol=1e-6):
                    self._losses.add("scale and shear of cameras are left out", name)
        return path

    def _name(self, node: Any) -> str:
        """Return a node's name, or else that of its content, or else the content's kind and a number."""
        kinds = [kind for kind in ("mesh", "light", "camera") if getattr(node, kind) is not None]
        for named in (node, *(getattr(node, kind) for kind in kinds)):
            if named.name:
                return str(named.name)
        kind = kinds[0] if kinds else "node"
        numbered = (f"{kind} {number}" for number in self._numbers.setdefault(kind, count(1)))
        return next(name for name in numbered if name not in self._taken_names)

    def _mesh(self, mesh: Any, name: str, net: Float64) -> GeomNode:
        node = GeomNode(name)
        for index, (geom, material, pose, wireframe) in enumerate(self._meshes.parts(mesh, name, net)):
            if pose is None and not wireframe:
                node.add_geom(geom, material)
                continue
            below = GeomNode(f"{name}[{index}]")
            below.add_geom(geom, material)
            if pose is not None:
                NodePath(below).set_mat(_matrix(pose))
            if wireframe:
                NodePath(below).set_render_mode_wireframe()
            node.add_child(below)
        return node


def _net_render_mode(path: NodePath) -> RenderMode:
    """Return the render mode at a node after inheriting."""
    mode, priority = None, 0
    for step in reversed(path.get_ancestors()):
        node = step.node()
        mode, priority = inherit(mode, priority, node.render_mode, node.render_mode_priority)
    return mode or PLAIN


def _net_overrides(path: NodePath) -> SurfaceOverrides:
    """Return what replaces parts of the materials at a node after inheriting."""
    own = [step.node().overrides for step in reversed(path.get_ancestors())]
    return reduce(composed, [overrides for overrides in own if overrides is not None], NOTHING)


def _matrix(given: Any) -> Float64:
    """Return a pyrender matrix in our axes, without the rounding in its last row that pyrender allows."""
    matrix = np.array(given, dtype=np.float64)
    if np.allclose(matrix[3], (0.0, 0.0, 0.0, 1.0)):
        matrix[3] = 0.0, 0.0, 0.0, 1.0
    return matrix_from_gltf(matrix)
