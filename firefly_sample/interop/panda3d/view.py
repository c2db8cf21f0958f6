"""A live Panda3D program, drawn by our renderer in Panda3D's own window."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING, Any

from firefly_sample.errors import OutputError, SceneError
from firefly_sample.frame import Frame, check_outputs
from firefly_sample.interop.panda3d.bridge import check_paths
from firefly_sample.interop.panda3d.mirror import GraphMirror
from firefly_sample.interop.panda3d.screen import Screen
from firefly_sample.interop.panda3d.worker import Worker
from firefly_sample.losses import ConversionWarning
from firefly_sample.model.panda3d.package import import_panda3d
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings
from firefly_sample.srgb import linear_to_srgb, srgb_to_linear

if TYPE_CHECKING:
    from panda3d import core

_SORT, _PRIORITY = 49, -1000
"""Panda3D draws at 50; of the tasks at 49, those with a higher priority come before ours."""


class FireflyView:
    """Shows a camera's view of a running ShowBase, drawn by our renderer, in place of Panda3D's own picture.

    Panda3D's 2D layer stays on top: text, DirectGUI, the mouse. Before each frame of Panda3D the graph is
    looked through for what has changed, drawn, and shown in that frame. Panda3D does not draw the camera's
    region meanwhile.

    The view ends with `close`, with the program, and with its window. It is a context manager. An error ends
    it too: Panda3D's own picture is back, and ``taskMgr.run()`` raises the error.

    Parameters
    ----------
    base : direct.showbase.ShowBase.ShowBase
    camera : panda3d.core.NodePath, optional
        A path to a Camera with a region in a window or buffer; ``base.cam`` when absent. Each camera can have
        a view.
    outputs : iterable of str
        Names from `firefly_sample.OUTPUTS` that `frame` has besides "color".
    device : int, optional
        EGL device index.
    **settings
        Settings by name, see `firefly_sample.Settings`; ``look="panda3d"`` when absent.

    Raises
    ------
    MissingPackageError
        If Panda3D is not installed.
    SceneError
        If the camera has no region, or another view.
    OutputError, SettingsError, NoGpuError
        If an output or a setting is wrong, or there is no OpenGL.

    Warns
    -----
    ConversionWarning
        Once for each kind of thing that is not drawn, or is drawn differently, with the names of the nodes,
        as soon as it is in the graph.

    Examples
    --------
    >>> from direct.showbase.ShowBase import ShowBase  # doctest: +SKIP
    >>> base = ShowBase()  # doctest: +SKIP
    >>> view = FireflyView(base)  # doctest: +SKIP
    >>> base.run()  # doctest: +SKIP
    """

    settings: Settings
    """Can be replaced: the next frame has the new ones."""
    milliseconds: dict[str, float]
    """Time of the parts of the last frame: "graph" to follow Panda3D's, "picture" to draw and read it,
    "hand over" to give it to Panda3D."""

    def __init__(
        self,
        base: Any,
        camera: core.NodePath | None = None,
        *,
        outputs: Iterable[str] = (),
        device: int | None = None,
        **settings: Any,
    ) -> None:
        core = import_panda3d()
        camera = base.cam if camera is None else camera
        check_paths("FireflyView", core.NodePath("render"), camera)
        region = _region_of(camera)
        self.settings = Settings(**({"look": "panda3d"} | settings))
        self.outputs = outputs
        self.milliseconds = {}
        self._base, self._camera, self._region = base, camera, region
        self._frame: Frame | None = None
        self._told: set[str] = set()
        node = camera.node()
        self._mirror = GraphMirror(
            camera.get_top() if node.get_scene().is_empty() else node.get_scene(), camera
        )
        self._worker = Worker("FireflyView")
        try:
            size = max(region.get_pixel_width(), 1), max(region.get_pixel_height(), 1)
            with warnings.catch_warnings(record=True) as caught:
                self._renderer = self._worker.call(partial(Renderer, size, self.settings, device=device))
            for warning in caught:
                warnings.warn(warning.message, stacklevel=2)
        except BaseException:
            self._worker.stop()
            raise
        self._screen = Screen(region)
        self._clock = core.ClockObject.get_global_clock()
        self._is_open = True
        node.set_python_tag(_TAG, self)
        base.finalExitCallbacks.append(self.close)
        self._task = base.taskMgr.add(
            self._next, "FireflyView", sort=_SORT, priority=_PRIORITY, uponDeath=lambda _: self._end()
        )

    @property
    def outputs(self) -> tuple[str, ...]:
        """The outputs of `frame`, first "color"; those besides it can be set."""
        return self._outputs

    @outputs.setter
    def outputs(self, names: Iterable[str]) -> None:
        names = (names,) if isinstance(names, str) else tuple(names)
        self._outputs = check_outputs(("color", *names))

    @property
    def frame(self) -> Frame:
        """The frame that was drawn last, without Panda3D's 2D layer.

        Raises
        ------
        OutputError
            If none was drawn yet: ``base.taskMgr.step()`` draws one.
        """
        if self._frame is None:
            raise OutputError("this view has no frame yet: base.taskMgr.step() draws one")
        return self._frame

    @property
    def scene(self) -> Scene:
        """The scene of ours that follows Panda3D's graph; a change in it does not last."""
        return self._mirror.scene

    @property
    def is_open(self) -> bool:
        """True until the view has ended."""
        return self._is_open

    def close(self) -> None:
        """Show Panda3D's own picture again, and free the renderer; a second call does nothing."""
        if self._is_open:
            self._base.taskMgr.remove(self._task)
        self._end()

    destroy = close
    """The same, by the name that Panda3D's classes have."""

    def _end(self) -> None:
        """Close all but the task, which ends by itself if this is called by it."""
        if not self._is_open:
            return
        self._is_open = False
        if self.close in self._base.finalExitCallbacks:
            self._base.finalExitCallbacks.remove(self.close)
        if not self._camera.is_empty():
            self._camera.node().clear_python_tag(_TAG)
        self._screen.close()
        try:
            self._worker.call(self._renderer.close)
        finally:
            self._worker.stop()

    def __enter__(self) -> FireflyView:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _next(self, task: Any) -> Any:
        """Draw and show the graph as it is now: a task of Panda3D."""
        if not self._is_open:  # Panda3D may call it once more after an error
            return task.done
        try:
            if self._camera.is_empty() or self._region.get_camera() != self._camera:
                self._end()  # Panda3D has closed the window
                self._tell_end(self._region.get_camera())
                return task.done
            if self._screen.is_shown and min(self._screen.size) > 0:
                self._draw()
        except BaseException:
            self._end()
            raise
        return task.cont

    def _tell_end(self, other: Any) -> None:
        """Say why the view ends where the program goes on: its region has another camera."""
        if not other.is_empty() and not self._camera.is_empty():
            text = (
                f"FireflyView has ended: the region of the camera {self._camera.get_name()!r} shows the "
                f"camera {other.get_name()!r} now; make filters of Panda3D before the view"
            )
            warnings.warn(text, ConversionWarning, stacklevel=2)

    def _draw(self) -> None:
        times = [perf_counter()]
        scene = self._mirror.update()
        scene.background = self._background()
        times.append(perf_counter())
        self._frame = self._worker.call(partial(self._render, scene, self._clock.get_frame_time()))
        times.append(perf_counter())
        self._screen.show(self._frame["color"])
        times.append(perf_counter())
        parts = zip(("graph", "picture", "hand over"), times, times[1:], strict=False)
        self.milliseconds = {name: 1e3 * (end - start) for name, start, end in parts}
        self._warn(self._frame)

    def _background(self) -> tuple[float, float, float]:
        """Return the colour that the look shows as Panda3D shows that of the window."""
        color, encoded = self._screen.background, self.settings.look == "panda3d"
        if encoded == (not self._screen.is_srgb):
            return color
        red, green, blue = (linear_to_srgb(color) if encoded else srgb_to_linear(color)).tolist()
        return red, green, blue

    def _render(self, scene: Scene, time: float) -> Frame:
        self._renderer.settings = self.settings
        if self._renderer.size != self._screen.size:
            self._renderer.resize(self._screen.size)
        return self._renderer.render(scene, time, self._outputs)

    def _warn(self, frame: Frame) -> None:
        """Say what is new among that which is not drawn as it is in Panda3D."""
        self._mirror.losses.warn_new(stacklevel=2)
        for text in frame.warnings:
            kind = _DETAIL.sub("", text)  # while things move, each frame may have others
            if kind not in self._told:
                self._told.add(kind)
                warnings.warn(text, ConversionWarning, stacklevel=2)


_NAMES = r"'[^']*'(?:,? (?:and )?(?:'[^']*'|[\d,]+ more))*"
_DETAIL = re.compile(rf"\([^()]*\)|{_NAMES}|[\d.,]+")
"""Matches the parts of a warning that may differ within one kind: parentheses, names and numbers."""
_TAG = "firefly_sample.FireflyView"


def _region_of(camera: Any) -> Any:
    """Return the region that shows what a camera sees."""
    node = camera.node()
    if node.has_python_tag(_TAG):
        raise SceneError(f"the camera {node.get_name()!r} has a view already: close() that first")
    regions = [node.get_display_region(index) for index in range(node.get_num_display_regions())]
    regions = [region for region in regions if region.is_active()]
    # a buffer that is new is not valid yet, and one that was removed, as by filters, keeps its region
    regions.sort(key=lambda region: not region.get_window().is_valid())
    if regions:
        return regions[0]
    raise SceneError(
        f"the camera {node.get_name()!r} has no active display region, in which to show its view"
    )
