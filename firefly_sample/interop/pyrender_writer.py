"""Walks a scene graph and writes a pyrender Scene."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.interop.losses import Losses
from firefly_sample.interop.pyrender_cameras import Size, camera_to_pyrender
from firefly_sample.interop.pyrender_lights import light_to_pyrender, point_lights_to_pyrender
from firefly_sample.interop.pyrender_meshes import MeshWriter
from firefly_sample.plan.view import camera_matrices
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.light import FadingLight
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLights
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Camera, Scene, VerticalGradient
from firefly_sample.scene.transforms import matrix_to_gltf
from firefly_sample.scene.traversal import iter_visible
from firefly_sample.srgb import linear_to_srgb

Float64 = NDArray[np.float64]


class _Content(NamedTuple):
    """What a node holds for pyrender: the keyword and the object, and where it stands in the node's space.

    Only content without a place can be held by the node itself.
    """

    kind: str
    thing: Any
    place: Float64 | None


def write_scene(scene: Scene, time: float, size: Size | None, losses: Losses) -> Any:
    """See `firefly_sample.interop.pyrender_bridge.to_pyrender`."""
    scene.update(time)
    return _Writer(scene, time, size, losses).write()


class _Writer:
    def __init__(self, scene: Scene, time: float, size: Size | None, losses: Losses) -> None:
        import pyrender

        self._scene, self._time, self._size, self._losses = scene, time, size, losses
        self._mask = scene.camera_node.camera_mask
        self._meshes = MeshWriter(losses)
        self._ambient = np.zeros(3)
        self._target = pyrender.Scene(bg_color=self._background())

    def write(self) -> Any:
        root, camera = self._scene.root, self._scene.camera
        waiting: list[tuple[NodePath, Any, Float64]] = [(root, None, root.get_net_mat())]
        while waiting:
            path, above, local = waiting.pop()
            here = self._write_node(path, above, local)
            waiting.extend(
                (child, here, child.node().transform.get_mat()) for child in reversed(path.get_children())
            )
        if not root.is_ancestor_of(camera):
            self._write_node(camera, None, camera.get_net_mat())
        self._target.ambient_light = self._ambient
        self._note_crowds()
        return self._target

    def _write_node(self, path: NodePath, above: Any, local: Float64) -> Any:
        """Add a node and what it holds below `above`; what stands elsewhere in it is on a node below."""
        node = path.node()
        if node.tags:
            self._losses.add("tags are left out", node.name)
        contents = self._contents(path)
        own = {content.kind: content.thing for content in contents if content.place is None}
        here = holder = self._add(node.name, above, local, own)
        for kind, thing, place in contents:
            if place is not None:
                holder = self._add(thing.name, here, place, {kind: thing})
        if path == self._scene.camera:
            self._target.main_camera_node = holder
        return here

    def _add(self, name: str, above: Any, local: Float64, own: dict[str, Any]) -> Any:
        import pyrender

        node = pyrender.Node(name=name, **own)
        self._target.add_node(node, parent_node=above)
        matrix = matrix_to_gltf(local)
        if (np.linalg.norm(matrix[:3, :3], axis=0) > 0.0).all():
            node.matrix = matrix  # finds translation, rotation and scale, if no axis is flat
        self._target.set_pose(node, matrix)  # pyrender 0.1.45 makes its matrix of those and loses shear
        return node

    def _contents(self, path: NodePath) -> list[_Content]:
        node, net = path.node(), path.get_net_mat()
        if isinstance(node, Camera):
            return [self._camera(path, node)]
        if not isinstance(
            node,
            GeomNode | PointLights | FadingLight | DirectionalLight | AmbientLight | Sprites | ParticleNode,
        ):
            return []
        first = next(iter_visible(path, self._mask), None)
        visible = first is not None and first.node is node
        if isinstance(node, GeomNode):
            mirrored = bool(np.linalg.det(net[:3, :3]) < 0)
            mesh = self._meshes.mesh(node, path.get_net_material(), path.get_net_color(), mirrored, visible)
            return [] if mesh is None else [_Content("mesh", mesh, None)]
        if isinstance(node, Sprites):
            self._losses.add("sprites, which pyrender lacks, are left out", node.name)
        elif isinstance(node, ParticleNode):
            self._losses.add("particles, which pyrender lacks, are left out", node.name)
        elif not visible:
            self._losses.add("hidden lights, which pyrender lacks, are left out", node.name)
        elif isinstance(node, AmbientLight):
            self._ambient += node.get_color()
        elif isinstance(node, PointLights):
            lights = point_lights_to_pyrender(node, self._time, self._losses)
            return [_Content("light", light, place) for light, place in lights]
        else:
            return [_Content("light", *light_to_pyrender(node, net, self._losses))]
        return []

    def _camera(self, path: NodePath, node: Camera) -> _Content:
        """Return a camera without the scale and shear that its node may have, as the renderer takes it."""
        main = path == self._scene.camera
        camera, place = camera_to_pyrender(node.name, node.lens, self._size, self._losses, main)
        net = path.get_net_mat()
        view_to_world = camera_matrices(Scene(self._scene.root, path)).view_to_world
        if not np.allclose(net[:3, :3], view_to_world[:3, :3], rtol=0.0, atol=1e-9):
            rigid = view_to_world @ np.linalg.inv(net)
            place = rigid if place is None else place @ rigid
            place[:, 3] = 0.0, 0.0, 0.0, 1.0
        return _Content("camera", camera, place)

    def _background(self) -> Float64:
        """The background as pyrender shows it: an sRGB colour, and opaque."""
        given, name = self._scene.background, self._scene.root.get_name()
        if isinstance(given, VerticalGradient):
            if given.horizon != given.zenith:
                self._losses.add("a background's gradient becomes its horizon's colour", name)
            given = given.horizon
        if max(given) > 1.0:
            self._losses.add("a background brighter than 1 is cut off there", name)
        if (np.asarray(self._scene.exposure) != 1.0).any():
            self._losses.add("exposure, which pyrender lacks, is left out", name)
        return np.array([*linear_to_srgb(given), 1.0])

    def _note_crowds(self) -> None:
        from pyrender.constants import MAX_N_LIGHTS

        target = self._target
        for kind, nodes in (
            ("point lights", target.point_light_nodes),
            ("spotlights", target.spot_light_nodes),
            ("directional lights", target.directional_light_nodes),
        ):
            if len(nodes) > MAX_N_LIGHTS:
                for name in sorted(node.name for node in nodes):
                    self._losses.add(
                        f"pyrender draws at most {MAX_N_LIGHTS} {kind} on a mesh, the nearest", name
                    )
