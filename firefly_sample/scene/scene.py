"""The scene: a root, a camera, a background, parameters, and its animation."""

from __future__ import annotations

import weakref
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

START_TIME = 5.0
"""Seconds at frame 0 of scenes that say nothing else."""


@dataclass(frozen=True)
class VerticalGradient:
    """A sky: the linear colour `horizon` at and below elevation 0, blended into `zenith` straight up.

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
        Bits; the camera sees a node that ``path.hide(mask)`` hides as long as this mask has a bit that `mask`
        lacks. To hide nodes from some cameras, give each camera a mask of one bit.
    """

    def __init__(
        self, name: str = "camera", lens: Lens | None = None, camera_mask: int = ALL_CAMERAS
    ) -> None:
        super().__init__(name)
        self.lens: Lens = lens if lens is not None else PerspectiveLens()
        self.camera_mask = camera_mask

    def get_lens(self) -> Lens:
        """Return the lens."""
        return self.lens

    def set_lens(self, lens: Lens) -> None:
        """Change the lens. NodeError if it is none."""
        if not isinstance(lens, Lens):
            raise NodeError(f"camera {self.name!r}: set_lens takes a Lens, got {lens!r}")
        self.lens = lens

    def copy_lens(self, lens: Lens) -> None:
        """Look through a copy of a lens; NodeError if it is none."""
        self.set_lens(lens)
        self.lens = lens.make_copy()

    def get_camera_mask(self) -> int:
        """Return the bits of `camera_mask`."""
        return self.camera_mask

    def set_camera_mask(self, mask: int) -> None:
        """Set the bits of `camera_mask`."""
        self.camera_mask = mask

    def set_transform(self, transform: TransformState) -> None:
        """Set the transform to the parents' space."""
        if self._children:  # a camera itself is not drawn, so without children nothing above it changes
            super().set_transform(transform)
        else:
            self.transform = transform
            self.revision += 1


class Scene:
    """The input of the renderer, built by a plugin. Subclass it for animation or live parameters.

    Parameters
    ----------
    root : NodePath, optional
        The root of the graph that is drawn. A new one when absent.
    camera : NodePath, optional
        A path to a `Camera` node; a new one under `root` when absent.
    background : sequence of 3 floats or VerticalGradient
        Linear colour of pixels without geometry.
    exposure : float or sequence of 3 floats
        Factor of the radiance before the tone curve, as is the setting of the same name. Three numbers also
        set a white balance.
    focus : sequence of 3 floats, optional
        The point that a viewer's camera turns around, in world space; the centre of the scene when absent.
        Only its distance along the view axis matters.
    """

    drag_help = ""
    """A description of `drag` for the window's help; empty if it does nothing."""

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
        self._animated = _AnimatedNodes()

    @property
    def camera_node(self) -> Camera:
        """The camera's node; NodeError if `camera` does not lead to a `Camera`."""
        node = self.camera.node()
        if not isinstance(node, Camera):
            raise NodeError(f"scene.camera must be a path to a Camera node, got {self.camera}")
        return node

    @property
    def lens(self) -> Lens:
        """The camera's lens."""
        return self.camera_node.lens

    def set(self, name: str, value: Any) -> None:
        """Change a live parameter; ParameterError if this scene has none of that name."""
        raise ParameterError(f"this scene has no live parameter {name!r} (tried to set it to {value!r})")

    def drag(self, right: float, down: float) -> dict[str, Any]:
        """Handle a drag with the right mouse button, in window heights.

        Return the values of the parameters that it changed, by name; if empty, the viewer moves the camera.
        """
        return {}

    def update(self, time: float) -> None:
        """Set the scene to its state at `time` (seconds), independently of earlier calls.

        This one moves the animated models below the root. A subclass that has some and overrides it calls
        ``super().update(time)``.
        """
        self._animated.animate(self.root.node(), time)


class _AnimatedNodes:
    """The nodes below a root that move by themselves, searched again only after the graph has changed.

    References are weak, so that a model that is removed is freed at once.
    """

    def __init__(self) -> None:
        self._top: weakref.ref[PandaNode] | None = None
        self._revision = 0
        self._nodes: list[weakref.ref[PandaNode]] = []

    def __reduce__(self) -> tuple[type[_AnimatedNodes], tuple[()]]:
        """Copy and pickle nothing: the copy of a scene searches its own graph."""
        return _AnimatedNodes, ()

    def animate(self, top: PandaNode, time: float) -> None:
        """Call `PandaNode.animate` of the nodes at and below `top` whose class overrides it."""
        if self._top is None or self._top() is not top or self._revision != top.subtree_revision:
            self._top = weakref.ref(top)
            plain = PandaNode.animate
            self._nodes = [
                weakref.ref(node) for node in top.iter_descendants() if type(node).animate is not plain
            ]
        for reference in self._nodes:
            if (node := reference()) is not None:
                node.animate(time)
        self._revision = top.subtree_revision  # which also counts what these have moved


class ScenePlugin(Protocol):
    """The object that an entry point of the group ``firefly_sample.scenes`` names.

    An optional attribute ``lights_parameter`` names the parameter for the number of lights if it is not
    called "lights". ``firefly measure speed`` varies it. An optional attribute ``start_time`` is the time of
    frame 0 in seconds, `START_TIME` when absent, and ``folder`` the name of the folder below ``captures`` and
    ``measured``, the scene's name when absent.

    An optional attribute ``settings`` is a dict of settings that suit the scene better than the defaults of
    `firefly_sample.Settings`, for example ``{"exposure": "auto"}``. The commands and the functions behind
    them start from these where no settings are given. A preset, the command line, the environment and TOML
    files take precedence.
    """

    @property
    def name(self) -> str:
        """The scene's name in messages."""

    @property
    def summary(self) -> str:
        """One sentence."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters that `build` takes."""

    def build(self, **parameters: Any) -> Scene:
        """Build a new scene from checked parameters."""
