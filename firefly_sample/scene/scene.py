"""A scene: a root, a camera, a background, parameters, and where everything is at a time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from firefly_sample.errors import NodeError, ParameterError
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.node import ALL_CAMERAS, PandaNode
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scene.transform_state import TransformState

Color = tuple[float, float, float]


@dataclass(frozen=True)
class VerticalGradient:
    """A sky: `horizon` (linear colour) at and below elevation 0, turning into `zenith` straight up.

    The colour at the elevation e is mix(horizon, zenith, sqrt(max(sin e, 0))).
    """

    horizon: Color
    zenith: Color


class Camera(PandaNode):
    """A node that looks along its +Y axis through a lens.

    Parameters
    ----------
    name : str
    lens : Lens, optional
        A `PerspectiveLens` when absent.
    camera_mask : int
        Bits; a node that ``path.hide(mask)`` hides is seen as long as this mask has a bit that `mask` lacks.
        Give cameras masks of a bit each to hide things from some of them.
    """

    def __init__(
        self, name: str = "camera", lens: Lens | None = None, camera_mask: int = ALL_CAMERAS
    ) -> None:
        super().__init__(name)
        self.lens: Lens = lens if lens is not None else PerspectiveLens()
        self.camera_mask = camera_mask

    def set_transform(self, transform: TransformState) -> None:
        """Put the camera somewhere else in its parents.

        Nothing is seen of a camera: where nothing hangs below it, nothing that is seen has changed.
        """
        if self._children:
            super().set_transform(transform)
        else:
            self.transform = transform
            self.revision += 1


class Scene:
    """What a plugin builds and the renderer draws. Subclass it to animate nodes or take live parameters.

    Parameters
    ----------
    root : NodePath, optional
        The top of the graph; everything below it may be drawn. A new one when absent.
    camera : NodePath, optional
        A path to a `Camera` node; a new one under `root` when absent.
    background : sequence of 3 floats or VerticalGradient
        Linear colour written where nothing was drawn.
    exposure : float or sequence of 3 floats
        How a photographer would expose this scene: radiance is multiplied by it, and by the setting of the
        same name, before the tone curve. Three numbers are a white balance as well.
    focus : sequence of 3 floats, optional
        What a viewer turns its camera around, world space; the middle of everything when absent. It counts
        only how far it is along the view axis.
    """

    drag_help = ""
    """What `drag` does, in a few words for the window's help; empty where it does nothing."""

    def __init__(
        self,
        root: NodePath | None = None,
        camera: NodePath | None = None,
        background: Color | VerticalGradient = (0.0, 0.0, 0.0),
        exposure: float | Color = 1.0,
        focus: tuple[float, float, float] | None = None,
    ) -> None:
        self.root = root if root is not None else NodePath("root")
        self.camera = camera if camera is not None else self.root.attach_new_node(Camera())
        self.background = background
        self.exposure = exposure
        self.focus = focus

    @property
    def camera_node(self) -> Camera:
        """The node at the end of `camera`.

        Raises
        ------
        NodeError
            If it is not a `Camera`.
        """
        node = self.camera.node()
        if not isinstance(node, Camera):
            raise NodeError(f"scene.camera must be a path to a Camera node, got {self.camera}")
        return node

    @property
    def lens(self) -> Lens:
        """The camera's lens."""
        return self.camera_node.lens

    def set(self, name: str, value: Any) -> None:
        """Change a live parameter.

        Raises
        ------
        ParameterError
            If this scene has no live parameter `name`.
        """
        raise ParameterError(f"this scene has no live parameter {name!r} (tried to set it to {value!r})")

    def drag(self, right: float, down: float) -> dict[str, Any]:
        """Answer a drag of the mouse with the right button, in heights of the window.

        Returns
        -------
        dict of str to object
            The parameters that it has changed, and their values; empty where the scene has no use for it, so
            that the camera is moved.
        """
        return {}

    def update(self, time: float) -> None:
        """Put everything where it is at `time` (seconds); must not depend on earlier calls."""


class ScenePlugin(Protocol):
    """What an entry point of the group ``firefly_sample.scenes`` names.

    It may have an attribute ``lights_parameter`` as well: the name of the parameter that says how many lights
    there are, where that is not "lights". ``firefly measure speed`` varies it.
    """

    name: str
    summary: str
    parameters: tuple[Parameter, ...]

    def build(self, **parameters: Any) -> Scene:
        """A new scene from checked parameters."""
