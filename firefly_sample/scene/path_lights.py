"""The lights of a `firefly_sample.scene.nodepath.NodePath`'s surfaces: all of the scene's, or none."""

from __future__ import annotations

from typing import Any

from firefly_sample.scene.path_notes import warn_no_effect
from firefly_sample.scene.path_surfaces import PathSurfaces


class PathLights(PathSurfaces):
    """The methods of a `NodePath` that turn lights off and on."""

    __slots__ = ()

    def set_light(self, light: Any = None, priority: int = 0) -> None:
        """Light this node and everything below it by all lights, where `set_light_off` was called above.

        It is not needed for a light: every light of a scene lights everything in it.
        """
        warn_no_effect("set_light is not needed: every light of a scene lights everything in it")
        self._override(unlit=False, unlit_priority=self._priority("set_light", priority))

    def set_light_off(self, light: Any = None, priority: int = 0) -> None:
        """Draw this node and everything below it without light: surfaces show their base colours.

        ``set_light_off([priority])``. One light, ``set_light_off(light[, priority])``, cannot be turned off
        for some nodes: hide its node to turn it off for all.
        """
        if isinstance(light, int):
            light, priority = None, light
        if light is not None:
            warn_no_effect("set_light_off is not there for one light: hide the light's node to turn it off")
        else:
            self._override(unlit=True, unlit_priority=self._priority("set_light_off", priority))

    def clear_light(self, light: Any = None) -> None:
        """Undo `set_light_off`. One light cannot be taken from nodes: hide its node to turn it off."""
        if light is not None:
            warn_no_effect("clear_light is not there for one light: hide the light's node to turn it off")
        self._override(unlit=None, unlit_priority=0)

    def has_light(self, light: PathSurfaces) -> bool:
        """Return whether a light is one of the scene's: it is if both have the same root."""
        return not light.is_empty() and self._existing().top() is light._existing().top()

    def has_light_off(self) -> bool:
        """Return whether `set_light_off` was called for this node."""
        return bool(self._overrides().unlit)
