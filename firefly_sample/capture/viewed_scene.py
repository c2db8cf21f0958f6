"""A scene that is seen from one of several views."""

from __future__ import annotations

from typing import Any

from firefly_sample.capture.views import OrbitViews, Views
from firefly_sample.errors import LensError
from firefly_sample.memo import Memo
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.other_camera import SceneWithCamera, focus_of
from firefly_sample.scene.scene import Camera, Scene


class ViewedScene(SceneWithCamera):
    """A scene with a camera that stands at one of several views; the scene's own camera is left alone.

    Frames are right for each view and time in any order. Between views of one moment the scene is not updated
    again, so all that is kept while nothing moves is kept; nobody else may update the scene meanwhile.

    Parameters
    ----------
    scene : Scene
    views : Views
    size : (int, int)
        Of the pictures, in pixels.
    start : float
        Seconds. If the scene has no focus, an orbit goes around the centre that the scene has at this time,
        so that it does not sway with what moves.

    Attributes
    ----------
    view : int
        The view at which the next `update` puts the camera.

    Raises
    ------
    OutputError
        If a view's intrinsics are for pictures of another shape.
    """

    def __init__(self, scene: Scene, views: Views, size: tuple[int, int], start: float = 0.0) -> None:
        views.check_size(size)
        own = scene.camera_node
        # named like the scene's own camera, whose path is what messages say
        super().__init__(scene, NodePath(Camera(str(scene.camera), own.lens, own.camera_mask)))
        self.view = 0
        self._views = views
        self._lens: Memo[Lens] = Memo()
        self._moment: tuple[Any, ...] | None = None
        self._center = None
        if scene.focus is None and isinstance(views, OrbitViews) and len(views) > 1:
            scene.update(start)
            self._center = focus_of(scene)

    @property
    def scene(self) -> Scene:
        """The scene with its own camera."""
        return self._scene

    def lenses(self) -> list[Lens]:
        """Return the lenses of the views, each once; the scene's own is as it is now."""
        own = self._scene.lens
        given = dict.fromkeys(map(self._views.lens, range(len(self._views))))
        return [own if lens is None else lens.make(own) for lens in given]

    def set(self, name: str, value: Any) -> None:
        """Change a live parameter of the scene."""
        self._moment = None
        self._scene.set(name, value)

    def update(self, time: float) -> None:
        """Set the scene to its state at `time` (seconds), and the camera to `view`."""
        if self._moment is None or self._moment != self._state(time):
            self._moment = None
            super().update(time)
            self._moment = self._state(time)
        own, camera = self._scene.camera_node, self.camera_node
        camera.camera_mask = own.camera_mask
        focus = self._center if self._scene.focus is None else focus_of(self._scene)
        self.camera.set_transform(self._views.transform(self.view, self._scene, focus))
        lens = self._views.lens(self.view)
        try:
            camera.lens = (
                own.lens
                if lens is None
                else self._lens.get((lens, own.lens, own.lens.revision), lambda: lens.make(own.lens))
            )
        except LensError as error:
            raise LensError(f"view {self.view}: {error}") from None

    def _state(self, time: float) -> tuple[Any, ...]:
        """Return a key that changes when somebody else has moved the scene."""
        scene = self._scene
        moved = scene.camera.get_net_transform().get_mat().tobytes()
        return time, scene.root, scene.root.get_top().node().subtree_revision, moved
