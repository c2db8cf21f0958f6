"""The counterpart of a node of Panda3D's graph."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from firefly_sample.errors import SceneError
from firefly_sample.losses import Losses
from firefly_sample.scene.nodepath import NodePath


@dataclass(eq=False)
class Followed:
    """The counterpart of a node as reached by one path."""

    source: Any  # panda3d.core.PandaNode
    path: NodePath
    below: dict[Any, Followed] = field(default_factory=dict)
    order: tuple[Any, ...] = ()
    transform: Any = None  # what of Panda3D's the path's transform was made from
    masks: tuple[int, int] | None = None
    content: tuple[Any, ...] = ()
    aside: list[NodePath] = field(default_factory=list)  # nodes below `path` that Panda3D does not have
    lens: NodePath | None = None  # of a camera: the node with the lens, if it is another one
    fault: SceneError | None = None  # of a camera: the reason why its lens is none of ours

    def note_fault(self, losses: Losses) -> None:
        """Name a camera whose lens is none of ours."""
        if self.fault is not None:
            losses.add(f"a camera keeps an ordinary lens ({self.fault})", self.source.get_name())
