"""ModelRoot: the node at the root of a model file, which plays its animations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, Self

from firefly_sample.errors import NodeError, did_you_mean
from firefly_sample.scene.node import PandaNode, copy_nodes

if TYPE_CHECKING:
    from firefly_sample.model.pose import Pose
    from firefly_sample.scene.arrays import Float64

ALL = "all"
"""The name by which `ModelRoot.play` plays all animations at once."""


class Animation(Protocol):
    """An animation of a file."""

    @property
    def duration(self) -> float:
        """Seconds until it starts again; 0 if nothing moves."""


class ModelRoot(PandaNode):
    """The root of a model file.

    `Scene.update` updates every model below the scene's root. The pose of a model depends on the time, on
    what it plays, and on the transforms that you give to nodes that the animation does not move; so a joint
    can be turned by hand, and the skin follows. Joints belong together as in the file: a node that you
    rename, remove or put elsewhere still moves as before, and so do the vertices that follow it.

    Parameters
    ----------
    name : str
    warnings : iterable of str
        A line for each property of the file that is not drawn.

    Attributes
    ----------
    warnings : tuple of str

    Notes
    -----
    Geoms that follow joints or morph targets belong to one ModelRoot. Every copy of the model has its own,
    and moves by itself, whether it was made by ``copy.deepcopy``, ``pickle``, `NodePath.copy_to` or
    ``copy.copy``. Of a model that has something to move, ``copy.copy`` therefore copies the nodes below it
    too. A copy of some node below the model shares these Geoms, so it shows the pose of this model. To show
    one pose in many places, use `NodePath.instance_to`.
    """

    def __init__(self, name: str, warnings: Iterable[str] = ()) -> None:
        super().__init__(name)
        self.warnings: tuple[str, ...] = tuple(warnings)
        self._clips: dict[str, Any] = {}
        self._playing: str | None = None
        self._pose: Pose | None = None

    @property
    def animations(self) -> Mapping[str, Animation]:
        """The animations of the file by name, in its order; each has a `duration` in seconds."""
        return dict(self._clips)

    @property
    def playing(self) -> str | None:
        """The name of the animation that plays, "all", or None."""
        return self._playing

    def bind_pose(self, pose: Pose | None, clips: Mapping[str, Animation]) -> None:
        """Take over a pose and the animations by name, play the first one, and move to time 0.

        `firefly_sample.model.animated.bind` calls this once, when the model is made.
        """
        self._pose, self._clips = pose, dict(clips)
        self.play(next(iter(self._clips), None))
        self.update(0.0)

    def play(self, name: str | None) -> None:
        """Choose what `update` shows: an animation, "all" of them at once, or None, the file's rest pose.

        After loading, the first animation plays. Each one loops. If several of "all" move the same property,
        the last one counts. Nodes that the choice no longer moves go back to their transforms in the file.

        Raises
        ------
        NodeError
            If there is no animation of that name; the message lists those there are.
        """
        clips: list[Any]
        if name is None:
            clips = []
        elif name in self._clips:
            clips = [self._clips[name]]
        elif name == ALL:
            clips = list(self._clips.values())
        else:
            raise NodeError(
                f"model {self.name!r} has no animation {name!r}{did_you_mean(name, [*self._clips, ALL])}: "
                f"it has {', '.join(map(repr, self._clips)) or 'none'}"
            )
        self._playing = name
        self.choose(clips)

    def choose(self, clips: Sequence[Any]) -> None:
        """Make `update` show these of the animations, for `play`."""
        if self._pose is not None:
            self._pose.choose(clips)

    def update(self, time: float) -> None:
        """Move the model to its pose at `time` (seconds, may be negative), independently of earlier calls.

        Only what differs from the present pose is changed, so a pose that stays costs next to nothing.
        """
        if self._pose is not None:
            self._pose.update(time)

    def light(self, lit: bool | None) -> None:
        """Choose whether surfaces are lit, where the file's format leaves that to its lights."""

    def look_from(self, eye: Float64) -> None:
        """Show what depends on the camera as it is seen from there, if the file has such parts.

        `eye` is the matrix from the camera to this node's space, shape (4, 4), for row vectors.
        """

    def borrow(self, other: ModelRoot) -> bool:
        """Take over the animations of a file that has nothing else; return whether any fits."""
        return False

    def animate(self, time: float) -> None:
        """Move the model to its pose at `time`: see `update`."""
        self.update(time)

    def make_copy(self) -> Self:
        """Return a new root with the same attributes, without children, and so with nothing to move."""
        made = super().make_copy()
        made._pose = None
        return made

    def link_copy(self, made: PandaNode, copies: Mapping[PandaNode, PandaNode]) -> None:
        """Give the copy a pose of its own, whose nodes are the copied ones."""
        if self._pose is not None and isinstance(made, ModelRoot):
            made._pose = self._pose.copied(copies)

    def __copy__(self) -> PandaNode:
        if self._pose is None:
            return super().__copy__()
        return copy_nodes(self)[self]
