"""pyrender's OffscreenRenderer, drawn by this package."""

from __future__ import annotations

import os
import threading
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import GpuError, OutputError, SceneError
from firefly_sample.frame import Frame, check_size
from firefly_sample.interop.pyrender.bridge import check_scene
from firefly_sample.interop.pyrender.conversions import Conversions, Treatment
from firefly_sample.interop.pyrender.mirror import SceneMirror
from firefly_sample.losses import ConversionWarning, Losses
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.transforms import vectors_to_gltf
from firefly_sample.settings import Settings
from firefly_sample.srgb import srgb_to_linear

DEFAULTS: dict[str, Any] = {"look": "pyrender", "tone": "none"}
"""The settings that differ from those of `Settings`."""
MOST_TOLD = 1000
"""The number of warnings that a renderer remembers; it repeats one after so many others."""
_TURNED = "normal", "normal_world", "position", "position_world"
"""Outputs of vectors, which are turned to pyrender's axes."""


class OffscreenRenderer:
    """Draws pyrender Scenes, with the interface of pyrender's class of that name.

    A scene that is rendered again is not converted again: only nodes, poses, lights, cameras and materials
    that changed are. As in pyrender, a mesh is taken as it is when it is first drawn: a change inside one of
    its arrays does not show, an array that is replaced does. Threads may share a renderer, and wait for each
    other.

    Parameters
    ----------
    viewport_width, viewport_height : int
        Pixels; both can be changed between renders.
    point_size : float
        Pixels along a side of the squares that points are drawn as.
    device : int, optional
        EGL device index; the environment variable EGL_DEVICE_ID, which pyrender reads, when absent.
    **settings
        Settings by name, see `firefly_sample.Settings`, on top of `DEFAULTS`. ``look="pyrender"``, the
        default, shades by pyrender's own formula, ``look="correct"`` by glTF's.

    Raises
    ------
    MissingPackageError
        If pyrender is not installed.
    OutputError, SettingsError, NoGpuError
        If a size or a setting is wrong, or there is no OpenGL.
    """

    def __init__(
        self,
        viewport_width: int,
        viewport_height: int,
        point_size: float = 1.0,
        *,
        device: int | None = None,
        **settings: Any,
    ) -> None:
        self._renderer: Renderer | None = None
        self.viewport_width, self.viewport_height = viewport_width, viewport_height
        self.point_size = point_size
        self.settings = Settings(**(DEFAULTS | settings))
        self._conversions = Conversions()
        self._depth_shift = 0.0
        self._mirrors: WeakKeyDictionary[Any, dict[Treatment, SceneMirror]] = WeakKeyDictionary()
        self._told: dict[str, None] = {}
        self._lock = threading.RLock()
        if device is None and os.environ.get("EGL_DEVICE_ID"):
            device = int(os.environ["EGL_DEVICE_ID"])
        self._renderer = Renderer(self._size, self.settings, device=device)

    @property
    def viewport_width(self) -> int:
        """Width of the picture in pixels."""
        return self._size[0]

    @viewport_width.setter
    def viewport_width(self, value: int) -> None:
        self._size = check_size((int(value), getattr(self, "_size", (1, 1))[1]))

    @property
    def viewport_height(self) -> int:
        """Height of the picture in pixels."""
        return self._size[1]

    @viewport_height.setter
    def viewport_height(self, value: int) -> None:
        self._size = check_size((self._size[0], int(value)))

    @property
    def point_size(self) -> float:
        """Pixels along a side of a point."""
        return self._point_size

    @point_size.setter
    def point_size(self, value: float) -> None:
        if not float(value) > 0.0:
            raise OutputError(f"point_size must be a number of pixels above 0, got {value!r}")
        self._point_size = float(value)

    @property
    def converted_meshes(self) -> int:
        """The number of primitives converted so far: it stays while the scenes' meshes do."""
        return self._conversions.meshes

    def render(
        self, scene: Any, flags: int = 0, seg_node_map: Mapping[Any, Any] | None = None
    ) -> NDArray[Any] | tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Draw a scene and return its colour and its depth.

        Parameters
        ----------
        scene : pyrender.Scene
        flags : int
            Values of pyrender's RenderFlags, combined with the bitwise or.
        seg_node_map : mapping of pyrender.Node to int or to 3 ints, optional
            The colour of each node with ``RenderFlags.SEG``, 0 to 255; a node that is missing is not drawn.

        Returns
        -------
        color : ndarray of uint8, shape (height, width, 3), with ``RenderFlags.RGBA`` (height, width, 4)
            Not returned with ``RenderFlags.DEPTH_ONLY``.
        depth : ndarray of float32, shape (height, width)
            Distance along the view axis in the scene's units; 0 where nothing is.

        Raises
        ------
        SceneError
            If it is no pyrender Scene or has no camera, or something in it cannot be drawn; the message
            names it.
        GpuError
            After `delete`.
        """
        from pyrender import RenderFlags

        check_scene("render", scene)
        with self._lock:
            if flags & RenderFlags.SEG:
                return self._segment(scene, flags, {} if seg_node_map is None else seg_node_map)
            if flags & RenderFlags.DEPTH_ONLY:
                return self._depth(self._draw(scene, self._treatment(flags).for_data, ("depth",)))
            return self._picture(scene, flags)

    def _picture(self, scene: Any, flags: int) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return the colour and the depth of an ordinary picture."""
        from pyrender import RenderFlags

        treatment = self._treatment(flags)
        mirror = self._mirror(scene, treatment)
        settings = self._settings(flags)
        drawn = self._update(mirror, scene, settings)
        apart = mirror.blends or treatment.vertex_normals or treatment.face_normals
        apart = apart or settings.supersample > 1
        outputs = ["color"] if apart else ["color", "depth"]
        alpha = float(scene.bg_color[3])
        if flags & RenderFlags.RGBA:
            outputs.append("color_alpha")
        frame = self._render(drawn, outputs, settings)
        color: NDArray[Any] = frame["color"]
        if flags & RenderFlags.RGBA:
            covered = frame["color_alpha"][..., 3:].astype(np.float64)
            color = np.dstack([color, np.rint(covered + (255.0 - covered) * alpha).astype(np.uint8)])
        if apart:
            frame = self._draw(scene, treatment.for_depth, ("depth",))
        return color.astype(np.uint8, copy=False), self._depth(frame)

    def render_outputs(
        self, scene: Any, outputs: Iterable[str] = ("color", "depth"), flags: int = 0
    ) -> dict[str, NDArray[Any]]:
        """Draw a scene and return any of our outputs, by name, in pyrender's axes.

        Parameters
        ----------
        scene : pyrender.Scene
        outputs : iterable of str
            Names from `firefly_sample.OUTPUTS`. Positions and normals are in pyrender's axes: those of the
            camera, x to the right, y up, z towards the viewer, or those of the world. "depth" is infinite
            where nothing is. "id" holds indices into the list that "nodes" holds.
        flags : int
            As for `render`, without SEG and DEPTH_ONLY.

        Returns
        -------
        dict of str to ndarray
            And under "nodes", if "id" is asked for, the list of the drawn pyrender Nodes.

        Raises
        ------
        OutputError
            If there is no such output, the look lacks it, or `flags` has SEG or DEPTH_ONLY.
        SceneError, GpuError
            As `render`.
        """
        from pyrender import RenderFlags

        names = (outputs,) if isinstance(outputs, str) else tuple(outputs)
        if flags & (RenderFlags.SEG | RenderFlags.DEPTH_ONLY):
            raise OutputError('render_outputs takes no SEG and DEPTH_ONLY: ask for the outputs "id", "depth"')
        check_scene("render_outputs", scene)
        with self._lock:
            mirror, settings = self._mirror(scene, self._treatment(flags)), self._settings(flags)
            frame = self._render(self._update(mirror, scene, settings), names, settings)
            drawn = mirror.drawn_nodes
        images: dict[str, Any] = dict(frame.images)
        for name in _TURNED:
            if name in images:
                images[name] = vectors_to_gltf(images[name]).astype(np.float32)
        if "id" in images:
            nodes = list(dict.fromkeys(drawn))
            numbers = {node: number for number, node in enumerate(nodes)}
            table = np.array([*(numbers[node] for node in drawn), -1], dtype=np.int32)
            images["id"], images["nodes"] = table[images["id"]], nodes
        return images

    def delete(self) -> None:
        """Free all OpenGL objects. Afterwards nothing can be rendered; a second call does nothing."""
        with self._lock:
            if self._renderer is not None:
                self._renderer.close()
                self._renderer = None

    def __del__(self) -> None:
        renderer = getattr(self, "_renderer", None)
        if renderer is not None:
            renderer.abandon()  # as silently as pyrender's

    def __enter__(self) -> OffscreenRenderer:
        return self

    def __exit__(self, *_: object) -> None:
        self.delete()

    # --- internals ---

    def _treatment(self, flags: int) -> Treatment:
        from pyrender import RenderFlags

        wireframe = "material"
        if flags & RenderFlags.ALL_WIREFRAME:
            wireframe = "all"
        elif flags & RenderFlags.ALL_SOLID:
            wireframe = "none"
        elif flags & RenderFlags.FLIP_WIREFRAME:
            wireframe = "flipped"
        shadows = {
            "directional": RenderFlags.SHADOWS_DIRECTIONAL,
            "point": RenderFlags.SHADOWS_POINT,
            "spot": RenderFlags.SHADOWS_SPOT,
        }
        lit = not flags & RenderFlags.FLAT
        return Treatment(
            both_sides=bool(flags & RenderFlags.SKIP_CULL_FACES),
            wireframe=wireframe,
            shadows=frozenset(kind for kind, flag in shadows.items() if lit and flags & flag),
            map_size=self.settings.shadow_resolution,
            vertex_normals=bool(flags & RenderFlags.VERTEX_NORMALS),
            face_normals=bool(flags & RenderFlags.FACE_NORMALS),
            look=self._settings(flags).look,
            facing=self.settings.look == "pyrender",
        )

    def _mirror(self, scene: Any, treatment: Treatment) -> SceneMirror:
        mirrors = self._mirrors.setdefault(scene, {})
        if treatment not in mirrors:
            mirrors[treatment] = SceneMirror(treatment, self._conversions)
        return mirrors[treatment]

    def _settings(self, flags: int) -> Settings:
        """Return the settings, with ``RenderFlags.FLAT`` those that show base colours as they are stored."""
        from pyrender import RenderFlags

        return self.settings.with_look("flat") if flags & RenderFlags.FLAT else self.settings

    def _update(
        self, mirror: SceneMirror, scene: Any, settings: Settings, shown: Mapping[Any, Any] | None = None
    ) -> Scene:
        drawn = mirror.update(scene, self._size, shown)
        for other in self._mirrors[scene].values():
            other.forget(scene)
        if drawn.root.get_render_mode_thickness() != self.point_size:
            drawn.root.set_render_mode_thickness(self.point_size)
        drawn.background = _background(scene, settings.look)
        losses, self._conversions.losses = self._conversions.losses, Losses()
        self._tell(losses.lines())
        self._depth_shift = mirror.depth_shift
        return drawn

    def _draw(
        self, scene: Any, treatment: Treatment, outputs: Iterable[str], shown: Mapping[Any, Any] | None = None
    ) -> Frame:
        settings = replace(self.settings, supersample=1)  # data is of the pixel's centre
        drawn = self._update(self._mirror(scene, treatment), scene, settings, shown)
        return self._render(drawn, outputs, settings)

    def _render(self, scene: Scene, outputs: Iterable[str], settings: Settings) -> Frame:
        renderer = self._renderer
        if renderer is None:
            raise GpuError("this OffscreenRenderer is deleted: make a new one")
        if renderer.size != self._size:
            renderer.resize(self._size)
        renderer.settings = settings
        frame = renderer.render(scene, outputs=outputs)
        self._tell(frame.warnings)
        return frame

    def _depth(self, frame: Frame) -> NDArray[np.float32]:
        """Return the distances of the frame that was drawn last, with pyrender's 0 in place of infinity."""
        depth: NDArray[Any] = frame["depth"]
        empty = np.isinf(depth)
        if self._depth_shift:
            depth += np.float32(self._depth_shift)
        np.copyto(depth, 0.0, where=empty)
        return depth

    def _tell(self, lines: Iterable[str]) -> None:
        """Warn of each line once, as far as `MOST_TOLD` goes."""
        for line in lines:
            if line not in self._told:
                self._told[line] = None
                if len(self._told) > MOST_TOLD:
                    del self._told[next(iter(self._told))]
                warnings.warn(line, ConversionWarning, stacklevel=4)

    def _segment(
        self, scene: Any, flags: int, colors: Mapping[Any, Any]
    ) -> NDArray[Any] | tuple[NDArray[np.uint8], NDArray[np.float32]]:
        from pyrender import RenderFlags

        treatment = self._treatment(flags).for_data
        mirror = self._mirror(scene, treatment)
        frame = self._draw(scene, treatment, ("id", "depth"), colors)
        drawn = mirror.drawn_nodes
        rows = {node: _three(node, colors[node]) for node in dict.fromkeys(drawn)}
        segments = [*(rows[node] for node in drawn), np.zeros(3)]  # the last is for -1, nothing
        table = np.rint(np.array(segments))
        if (table > 255.0).any():
            self._tell(["seg_node_map has numbers above 255, which become 255: give three numbers"])
        numbers: NDArray[Any] = frame["id"]
        depth, color = self._depth(frame), np.clip(table, 0, 255).astype(np.uint8).take(numbers, axis=0)
        if flags & RenderFlags.DEPTH_ONLY:
            return depth
        if flags & RenderFlags.RGBA:
            color = np.dstack([color, np.full(color.shape[:2], 255, dtype=np.uint8)])
        return color, depth


def _three(node: Any, color: Any) -> NDArray[np.float64]:
    """Return a colour of a node's segment, which pyrender lets be a single number, as three numbers."""
    try:
        numbers = np.asarray(color, dtype=np.float64).ravel()
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if len(numbers) not in (1, 3) or not (numbers >= 0.0).all():
        raise SceneError(
            f"seg_node_map must have a number from 0 to 255 or three for each node, got {color!r} for the "
            f"node {node.name or node.mesh.name!r}"
        )
    return np.broadcast_to(numbers, 3)


def _background(scene: Any, look: str) -> tuple[float, float, float]:
    """Return the linear colour that a look shows as the scene's background colour."""
    codes = np.clip(np.asarray(scene.bg_color[:3], dtype=np.float64), 0.0, 1.0)
    if look == "pyrender":
        codes = codes**2.2
    elif look != "flat":
        codes = srgb_to_linear(codes)
    red, green, blue = codes.tolist()
    return red, green, blue
