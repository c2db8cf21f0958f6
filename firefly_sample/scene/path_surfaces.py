"""The texture, transparency and sides of surfaces at and below a `firefly_sample.scene.nodepath.NodePath`."""

from __future__ import annotations

from typing import Any

import numpy as np

from firefly_sample.scene.path_base import PathBase
from firefly_sample.scene.surface_overrides import NOTHING, OFF, TRANSPARENCIES, SurfaceOverrides
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import to_whole


class PathSurfaces(PathBase):
    """The methods of a `NodePath` that set parts of the materials at its node and below.

    `firefly_sample.scene.surface_overrides` has the rules.
    """

    __slots__ = ()

    def set_texture(self, texture: Texture, priority: int = 0) -> None:
        """Give this node and everything below it one texture.

        Materials with a texture of their own keep it, unless the priority is above 0.
        """
        if not isinstance(texture, Texture):
            raise self._error(f"set_texture takes a Texture, got {texture!r}")
        self._override(texture=texture, texture_priority=self._priority("set_texture", priority))

    def set_texture_off(self, priority: int = 0) -> None:
        """Draw this node and everything below it without textures of the base colour.

        Textures that are set below, and those of materials, are drawn, unless the priority is above 0.
        """
        self._override(texture=OFF, texture_priority=self._priority("set_texture_off", priority))

    def clear_texture(self) -> None:
        """Remove this node's own texture, or that it has none; it inherits again."""
        self._override(texture=None, texture_priority=0)

    def has_texture(self) -> bool:
        """Return whether this node itself has a texture."""
        return self.get_texture() is not None

    def has_texture_off(self) -> bool:
        """Return whether `set_texture_off` was called for this node."""
        return self._overrides().texture == OFF

    def get_texture(self) -> Texture | None:
        """Return this node's own texture, None if it has none."""
        own = self._overrides().texture
        return own if isinstance(own, Texture) else None

    def set_transparency(self, mode: int, priority: int = 0) -> None:
        """Set how surfaces at this node and below it let through what is behind them.

        The modes are Panda3D's numbers: 0, none, is opaque; 1, alpha, and 6, dual, are blended; 5, binary,
        and 3 and 4, multisample, are cut out where alpha is below the material's `alpha_cutoff`. True is 1.
        Materials that are not opaque keep their own mode, unless the priority is above 0. NodeError for
        other modes: 2, premultiplied alpha, is not drawn here.
        """
        whole = int(mode) if isinstance(mode, int | np.integer) else None
        if whole not in TRANSPARENCIES:
            raise self._error(
                f"set_transparency takes one of the modes {', '.join(map(str, TRANSPARENCIES))} of Panda3D's "
                f"TransparencyAttrib (0 is none, 1 alpha, 5 binary), got {mode!r}"
            )
        self._override(transparency=whole, transparency_priority=self._priority("set_transparency", priority))

    def clear_transparency(self) -> None:
        """Remove this node's own mode of transparency; it inherits again."""
        self._override(transparency=None, transparency_priority=0)

    def has_transparency(self) -> bool:
        """Return whether this node itself has a mode of transparency."""
        return self._overrides().transparency is not None

    def get_transparency(self) -> int:
        """Return this node's own mode of transparency, 0 if it has none."""
        return self._overrides().transparency or 0

    def set_two_sided(self, two_sided: bool, priority: int = 0) -> None:
        """Choose whether both sides of surfaces at this node and below it are drawn.

        Materials that are drawn from both sides stay so, unless the priority is above 0.
        """
        self._override(
            two_sided=bool(two_sided), two_sided_priority=self._priority("set_two_sided", priority)
        )

    def clear_two_sided(self) -> None:
        """Remove this node's own choice of sides; it inherits again."""
        self._override(two_sided=None, two_sided_priority=0)

    def has_two_sided(self) -> bool:
        """Return whether this node itself has a choice of sides."""
        return self._overrides().two_sided is not None

    def get_two_sided(self) -> bool:
        """Return whether this node itself has both sides drawn, False if it has no choice of its own."""
        return bool(self._overrides().two_sided)

    def _overrides(self) -> SurfaceOverrides:
        return self.node().overrides or NOTHING

    def _override(self, **changes: Any) -> None:
        node, changed = self.node(), self._overrides()._replace(**changes)
        node.overrides = None if changed == NOTHING else changed
        node.mark_changed()

    def _priority(self, what: str, priority: int) -> int:
        whole = to_whole(priority)
        if whole is None:
            raise self._error(f"{what} takes a whole number as priority, got {priority!r}")
        return whole
