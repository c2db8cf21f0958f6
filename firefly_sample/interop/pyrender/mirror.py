"""A scene of our own that follows a pyrender Scene: each update changes only what has changed there."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from firefly_sample.errors import SceneError
from firefly_sample.interop.pyrender.cameras import Size, camera_from_pyrender, depth_shift
from firefly_sample.interop.pyrender.conversions import Conversions, Treatment
from firefly_sample.interop.pyrender.lights import light_from_pyrender
from firefly_sample.interop.pyrender.parts import MeshParts, Part
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.lights import AmbientLight
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Camera, Scene
from firefly_sample.scene.transform_state import TransformState
from firefly_sample.scene.transforms import matrix_from_gltf

SUN_MAP, LAMP_MAP = 2048, 512
"""Texels along a side of the shadow maps of directional lights and spotlights, and of a point light's six."""
MOST_TEXELS = 2**25
"""The most texels of all shadow maps together, half of the largest atlas; more lights get smaller maps."""


@dataclass(eq=False)
class _Followed:
    """A pyrender Node's counterpart: its path, the pose it was given, and what is at and below it."""

    path: NodePath
    pose: bytes = b""
    parts: Sequence[Part] = ()
    visible: bool = True
    state: tuple[Any, ...] = ()
    mirrored: bool = False
    """True if the node's pose turns triangles inside out."""


class SceneMirror:
    """Follows one pyrender Scene in one `Treatment`.

    All nodes with a mesh, a light or a camera are children of one root, in world space, so that pyrender's
    own `Scene.get_pose` decides where they are.

    Attributes
    ----------
    scene : Scene
    depth_shift : float
        See `cameras.depth_shift`.
    """

    def __init__(self, treatment: Treatment, conversions: Conversions) -> None:
        self._treatment, self._conversions = treatment, conversions
        self._parts = MeshParts(treatment, conversions)
        self._root = NodePath("scene")
        self._camera = _Followed(self._root.attach_new_node(Camera("camera")))
        self.scene = Scene(self._root, self._camera.path)
        self.depth_shift = 0.0
        self._ambient = AmbientLight("ambient", (0.0, 0.0, 0.0))
        self._root.attach_new_node(self._ambient)
        self._meshes: dict[Any, _Followed] = {}
        self._lights: dict[Any, _Followed] = {}
        self._names: dict[str, int] = {}

    def update(self, source: Any, size: Size, shown: Container[Any] | None = None) -> Scene:
        """Bring the scene up to date with a pyrender Scene, and return it.

        Parameters
        ----------
        source : pyrender.Scene
        size : (int, int)
            Width and height of the picture in pixels.
        shown : container of pyrender Nodes, optional
            The only ones whose meshes are drawn.

        Raises
        ------
        SceneError
            If the scene has no camera, or something in it cannot be drawn; the message names it.
        """
        self.forget(source)
        present = source.nodes
        # the nodes are a set: only the graph of their transforms has them in their order
        nodes = [node for node in source._digraph if node in present]
        self._follow_camera(source, size)
        self._follow_meshes([node for node in nodes if node.mesh is not None])
        if not self._treatment.opaque:  # data need no light
            self._follow_lights([node for node in nodes if node.light is not None])
        self._place(source)
        self._show(shown)
        color = np.asarray(source.ambient_light, dtype=np.float64)[:3]
        if not np.array_equal(self._ambient.get_color(), color):
            self._ambient.set_color(color)
        return self.scene

    def forget(self, source: Any) -> None:
        """Drop the nodes that have left a pyrender Scene, or what they had."""
        present = source.nodes
        for followed, content in ((self._meshes, "mesh"), (self._lights, "light")):
            gone = [node for node in followed if node not in present or getattr(node, content) is None]
            for node in gone:
                followed.pop(node).path.remove_node()

    @property
    def drawn_nodes(self) -> list[Any]:
        """The pyrender Node of each geometry instance, by its number in the output "id"."""
        shown = [(node, each.path.node().children) for node, each in self._meshes.items() if each.visible]
        return [node for node, below in shown for _ in range(1 + len(below))]

    @property
    def blends(self) -> bool:
        """True if a surface that is drawn lets through what is behind it."""
        shown = {id(each.parts): each.parts for each in self._meshes.values() if each.visible}
        return any(part.blended for parts in shown.values() for part in parts)

    # --- poses ---

    def _place(self, source: Any) -> None:
        """Move what has moved, all at once: NumPy takes about as long for one matrix as for many."""
        camera = source.main_camera_node
        moved = []
        for node, followed in chain([(camera, self._camera)], self._meshes.items(), self._lights.items()):
            net = source.get_pose(node)
            pose = net.tobytes()
            if pose != followed.pose:
                moved.append((followed, net, pose))
        if not moved:
            return
        nets = np.array([net for _, net, _ in moved])
        fine = np.isfinite(nets).all(axis=(1, 2)) & np.isclose(nets[:, 3], (0.0, 0.0, 0.0, 1.0)).all(axis=1)
        if not fine.all():
            name = moved[int(np.argmin(fine))][0].path.get_name()
            raise SceneError(
                f"node {name!r}: its pose must be of finite numbers, with the last row 0, 0, 0, 1"
            )
        matrices = matrix_from_gltf(nets)
        matrices[:, :, 3] = 0.0, 0.0, 0.0, 1.0
        mirrored = (np.linalg.det(nets[:, :3, :3]) < 0.0).tolist()
        for (followed, _, pose), matrix, turned in zip(moved, matrices, mirrored, strict=True):
            followed.path.node().set_transform(TransformState.make_mat(matrix))
            followed.pose, followed.mirrored = pose, turned
        if moved[0][0] is self._camera:
            upper = nets[0, :3, :3]
            if not np.allclose(upper @ upper.T, np.eye(3), rtol=0.0, atol=1e-6):
                name = camera.name or "camera"
                self._conversions.losses.add("scale and shear of cameras are left out", name)

    # --- cameras ---

    def _follow_camera(self, source: Any, size: Size) -> None:
        node = source.main_camera_node
        if node is None:
            raise SceneError("the scene has no camera: add one, with its pose, before rendering")
        camera, followed = node.camera, self._camera
        matrix = np.asarray(camera.get_projection_matrix(width=size[0], height=size[1]))
        state = type(camera), size, camera.znear, camera.zfar, matrix.tobytes()
        if state != followed.state:
            name = node.name or camera.name or "camera"
            lens = camera_from_pyrender(camera, name, size, self._conversions.losses)
            if lens is None:
                raise SceneError(
                    f"camera {name!r}: no lens has the projection matrix of this {type(camera).__name__}: "
                    "it may scale and shift a perspective or parallel view, without mirroring or skew"
                )
            made = followed.path.node()
            assert isinstance(made, Camera)
            made.lens = lens
            self.depth_shift = depth_shift(camera, lens)
            followed.state = state

    # --- meshes ---

    def _follow_meshes(self, nodes: Iterable[Any]) -> None:
        for node in nodes:
            if node not in self._meshes:
                made = GeomNode(self._name(node, node.mesh, "mesh"))
                self._meshes[node] = _Followed(self._root.attach_new_node(made))

    def _show(self, shown: Container[Any] | None) -> None:
        """Show and hide nodes, and draw other parts of those whose meshes have changed."""
        found: dict[tuple[Any, bool], Sequence[Part]] = {}  # nodes share meshes
        for node, followed in self._meshes.items():
            mesh = node.mesh
            visible = bool(mesh.is_visible) and (shown is None or node in shown)
            if visible != followed.visible:
                (followed.path.show if visible else followed.path.hide)()
                followed.visible = visible
            if not visible:
                continue  # what is hidden need not be converted
            name = followed.path.get_name()
            if node.skin is not None or node.weights is not None or mesh.weights is not None:
                self._conversions.losses.add("skins and morph weights are left out", name)
            key = mesh, followed.mirrored
            parts = found.get(key)
            if parts is None:
                parts = found[key] = self._parts.of(*key, name)
            if parts is not followed.parts:
                _draw_parts(followed.path, parts)
                followed.parts = parts

    # --- lights ---

    def _follow_lights(self, nodes: Sequence[Any]) -> None:
        sizes = self._map_sizes(nodes)
        for node in nodes:
            light, followed = node.light, self._lights.get(node)
            resolution = sizes.get(_kind(light), 0)
            state = (type(light), resolution, *_light_numbers(light))
            if followed is None or state != followed.state:
                made = light_from_pyrender(
                    light,
                    self._name(node, light, "light"),
                    self._conversions.losses,
                    alike=self._treatment.alike,
                )
                if resolution:
                    made.set_shadow_caster(True, resolution)
                if followed is not None:
                    followed.path.remove_node()
                self._lights[node] = _Followed(self._root.attach_new_node(made), state=state)

    def _map_sizes(self, nodes: Iterable[Any]) -> dict[str, int]:
        """Return the texels along a side of the shadow maps of each kind of lights that casts shadows."""
        kinds, given = [_kind(node.light) for node in nodes], self._treatment.map_size
        counts = {kind: kinds.count(kind) for kind in self._treatment.shadows if kind in kinds}
        if given is not None:
            return dict.fromkeys(counts, given)
        sizes = {kind: LAMP_MAP if kind == "point" else SUN_MAP for kind in counts}
        maps = {kind: count * (6 if kind == "point" else 1) for kind, count in counts.items()}
        share = 1
        while sum(maps[kind] * size**2 for kind, size in sizes.items()) > MOST_TEXELS:
            sizes = {kind: size // 2 for kind, size in sizes.items()}
            share *= 2
        if share > 1:
            self._conversions.losses.add(
                f"{sum(maps.values())} shadow maps have 1/{share} of their usual texels a side, because all "
                "lights of a kind cast shadows: use the flags SHADOWS_DIRECTIONAL, SHADOWS_POINT and "
                "SHADOWS_SPOT for fewer kinds, from_pyrender and set_shadow_caster for fewer lights, or the "
                "setting shadow_resolution for another size"
            )
        return sizes

    # --- names ---

    def _name(self, node: Any, content: Any, kind: str) -> str:
        """Return a node's name, or else its content's, or else a kind and a number."""
        name = node.name or content.name
        if name:
            return str(name)
        self._names[kind] = self._names.get(kind, 0) + 1
        return f"{kind} {self._names[kind]}"


def _draw_parts(path: NodePath, parts: Iterable[Part]) -> None:
    """Make a node draw other parts: instances, lines and wireframes by nodes below it."""
    node = path.node()
    assert isinstance(node, GeomNode)
    for child in list(path.get_children()):
        child.remove_node()
    node.remove_all_geoms()
    for part in parts:
        if not part.apart:
            node.add_geom(part.geom, part.material)
            continue
        made = GeomNode(part.geom.name)
        made.add_geom(part.geom, part.material)
        below = path.attach_new_node(made)
        if part.wireframe:
            below.set_render_mode_wireframe()
        elif part.geom.mode == "lines":
            below.set_render_mode_thickness(1.0)
        if part.pose is not None:
            matrix = matrix_from_gltf(part.pose)
            matrix[:, 3] = 0.0, 0.0, 0.0, 1.0
            below.set_mat(matrix)


def _kind(light: Any) -> str:
    import pyrender

    if isinstance(light, pyrender.DirectionalLight):
        return "directional"
    return "spot" if isinstance(light, pyrender.SpotLight) else "point"


def _light_numbers(light: Any) -> tuple[Any, ...]:
    others = (getattr(light, name, None) for name in ("range", "innerConeAngle", "outerConeAngle"))
    return np.asarray(light.color).tobytes(), light.intensity, *others
