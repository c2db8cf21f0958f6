"""Panda3D's methods of a `firefly_sample.scene.nodepath.NodePath` that have no effect here, and say so.

Those that a program goes on without issue a `firefly_sample.errors.NoEffectWarning`, which Python shows
once for each line of a program. Those whose result a program needs raise a NodeError.
"""

from __future__ import annotations

import warnings
from typing import Any, NoReturn

from firefly_sample.errors import NodeError, NoEffectWarning
from firefly_sample.scene.path_base import PathBase


class PathNotes(PathBase):
    """The methods of a `NodePath` that have no effect."""

    __slots__ = ()

    # --- Shaders ---

    def set_shader_auto(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not needed: surfaces are lit for each pixel."""
        warn_no_effect("set_shader_auto is not needed: surfaces are lit for each pixel")

    def set_shader(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: surfaces are drawn by their materials."""
        warn_no_effect("set_shader is not there: surfaces are drawn by their materials")

    def set_shader_off(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not needed: nodes have no shaders."""
        warn_no_effect("set_shader_off is not needed: nodes have no shaders")

    def set_shader_input(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not needed: nodes have no shaders."""
        warn_no_effect("set_shader_input is not needed: nodes have no shaders")

    def set_shader_inputs(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not needed: nodes have no shaders."""
        warn_no_effect("set_shader_inputs is not needed: nodes have no shaders")

    def has_shader(self) -> bool:
        """Return False: nodes have no shaders."""
        return False

    def get_shader(self) -> None:
        """Return None: nodes have no shaders."""

    # --- Fog, and the order of drawing ---

    def set_fog(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: fog is not drawn."""
        warn_no_effect("set_fog is not there: fog is not drawn")

    def has_fog(self) -> bool:
        """Return False: there is no fog."""
        return False

    def get_fog(self) -> None:
        """Return None: there is no fog."""

    def set_bin(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: blended surfaces are drawn in the order of their depths."""
        warn_no_effect("set_bin is not there: blended surfaces are drawn in the order of their depths")

    def set_depth_test(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: all surfaces are tested against depths."""
        warn_no_effect("set_depth_test is not there: all surfaces are tested against depths")

    def set_depth_write(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: all surfaces that are not blended write depths."""
        warn_no_effect("set_depth_write is not there: all surfaces that are not blended write depths")

    def set_antialias(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: the setting supersample smooths edges."""
        warn_no_effect("set_antialias is not there: the setting supersample smooths edges")

    # --- States ---

    def set_attrib(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: set_color, set_material and others set what is drawn."""
        warn_no_effect("set_attrib is not there: set_color, set_material and others set what is drawn")

    def set_state(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: set_color, set_material and others set what is drawn."""
        warn_no_effect("set_state is not there: set_color, set_material and others set what is drawn")

    def get_state(self) -> NoReturn:
        """Raise NodeError: nodes have no RenderState."""
        raise self._error("get_state is not there: get_color, get_material and get_texture return its parts")

    def set_collide_mask(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: nothing collides."""
        warn_no_effect("set_collide_mask is not there: nothing collides")

    # --- Texture coordinates ---

    def set_tex_gen(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: texture coordinates are those of the Geoms."""
        warn_no_effect("set_tex_gen is not there: texture coordinates are those of the Geoms")

    def set_tex_projector(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: texture coordinates are those of the Geoms."""
        warn_no_effect("set_tex_projector is not there: texture coordinates are those of the Geoms")

    def set_tex_transform(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: texture coordinates are those of the Geoms."""
        warn_no_effect("set_tex_transform is not there: texture coordinates are those of the Geoms")

    def set_tex_offset(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: texture coordinates are those of the Geoms."""
        warn_no_effect("set_tex_offset is not there: texture coordinates are those of the Geoms")

    def set_tex_scale(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: texture coordinates are those of the Geoms."""
        warn_no_effect("set_tex_scale is not there: texture coordinates are those of the Geoms")

    def project_texture(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: texture coordinates are those of the Geoms."""
        warn_no_effect("project_texture is not there: texture coordinates are those of the Geoms")

    # --- The rest ---

    def set_occluder(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not needed: the depths of surfaces leave out what is behind them."""
        warn_no_effect("set_occluder is not needed: the depths of surfaces leave out what is behind them")

    def show_bounds(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: get_tight_bounds returns the box of the vertices."""
        warn_no_effect("show_bounds is not there: get_tight_bounds returns the box of the vertices")

    def set_billboard_point_eye(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: turn the node with look_at."""
        warn_no_effect("set_billboard_point_eye is not there: turn the node with look_at")

    def set_billboard_axis(self, *_: Any, **__: Any) -> None:
        """Do nothing. It is not there: turn the node with look_at."""
        warn_no_effect("set_billboard_axis is not there: turn the node with look_at")

    def flatten_light(self, *_: Any, **__: Any) -> int:
        """Do nothing, and return 0. It is not needed: Geoms that look alike are drawn by one call."""
        warn_no_effect("flatten_light is not needed: Geoms that look alike are drawn by one call")
        return 0

    def flatten_medium(self, *_: Any, **__: Any) -> int:
        """Do nothing, and return 0. It is not needed: Geoms that look alike are drawn by one call."""
        warn_no_effect("flatten_medium is not needed: Geoms that look alike are drawn by one call")
        return 0

    def flatten_strong(self, *_: Any, **__: Any) -> int:
        """Do nothing, and return 0. It is not needed: Geoms that look alike are drawn by one call."""
        warn_no_effect("flatten_strong is not needed: Geoms that look alike are drawn by one call")
        return 0

    def clear_model_nodes(self) -> int:
        """Do nothing, and return 0: the nodes of models are as any others."""
        return 0

    # --- What undoes any of these ---

    def clear_shader(self, *_: Any, **__: Any) -> None:
        """Do nothing: there is nothing to undo."""

    clear_shader_input = clear_fog = set_fog_off = clear_bin = clear_depth_test = clear_depth_write = (
        clear_shader
    )
    clear_antialias = clear_attrib = clear_tex_gen = clear_tex_projector = clear_tex_transform = clear_shader
    clear_project_texture = clear_occluder = hide_bounds = clear_billboard = clear_shader

    # --- Intervals ---

    def pos_interval(self, *_: Any, **__: Any) -> NoReturn:
        """Raise NodeError: intervals are not there."""
        raise self._no_interval("pos_interval")

    def hpr_interval(self, *_: Any, **__: Any) -> NoReturn:
        """Raise NodeError: intervals are not there."""
        raise self._no_interval("hpr_interval")

    def quat_interval(self, *_: Any, **__: Any) -> NoReturn:
        """Raise NodeError: intervals are not there."""
        raise self._no_interval("quat_interval")

    def scale_interval(self, *_: Any, **__: Any) -> NoReturn:
        """Raise NodeError: intervals are not there."""
        raise self._no_interval("scale_interval")

    def shear_interval(self, *_: Any, **__: Any) -> NoReturn:
        """Raise NodeError: intervals are not there."""
        raise self._no_interval("shear_interval")

    def color_interval(self, *_: Any, **__: Any) -> NoReturn:
        """Raise NodeError: intervals are not there."""
        raise self._no_interval("color_interval")

    def color_scale_interval(self, *_: Any, **__: Any) -> NoReturn:
        """Raise NodeError: intervals are not there."""
        raise self._no_interval("color_scale_interval")

    def pos_hpr_interval(self, *_: Any, **__: Any) -> NoReturn:
        """Raise NodeError: intervals are not there."""
        raise self._no_interval("pos_hpr_interval")

    def pos_hpr_scale_interval(self, *_: Any, **__: Any) -> NoReturn:
        """Raise NodeError: intervals are not there."""
        raise self._no_interval("pos_hpr_scale_interval")

    def _no_interval(self, name: str) -> NodeError:
        return self._error(
            f"{name} belongs to Panda3D's direct.interval: move nodes in the update method of a Scene"
        )


def warn_no_effect(message: str) -> None:
    """Issue the warning for a method whose caller called it; `message` begins with its name."""
    warnings.warn(f"NodePath.{message}", NoEffectWarning, stacklevel=3)
