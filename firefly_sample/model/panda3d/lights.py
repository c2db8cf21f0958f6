"""Lights of Panda3D as ours.

Colours stay as they are. A light's colour temperature is a colour for Panda3D, and so it is here. Priorities
are for renderers that draw a limited number of lights, and are not read.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from typing import Any

import numpy as np

from firefly_sample.losses import Losses
from firefly_sample.scene.arrays import LARGEST
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.light import Attenuation, FadingLight, Light, ShadowCaster
from firefly_sample.scene.lights import (
    SMALLEST_CONE,
    AmbientLight,
    DirectionalLight,
    PointLight,
    PointLights,
    Spotlight,
)
from firefly_sample.scene.node import PandaNode
from firefly_sample.settings import SHADOW_RESOLUTIONS

_Color = tuple[float, float, float]
_BLACK = 0.0, 0.0, 0.0
_FORWARD = 0.0, 1.0, 0.0
_WIDEST = 179.9
"""Degrees: the widest angle of a spotlight's lens."""
_LARGEST_EXPONENT = 1e6


def light_state(node: Any) -> Hashable:
    """Return all that `read_light` reads of a light: equal values as long as nothing of it has changed.

    Parameters
    ----------
    node : panda3d.core.Light
        A node, as all of Panda3D's lights are.
    """
    from panda3d import core

    color = tuple(node.get_color())
    if not isinstance(node, core.LightLensNode):
        return color
    state: tuple[Any, ...] = (
        color,
        tuple(node.get_specular_color()) if node.has_specular_color() else None,
        tuple(node.get_attenuation()),
        node.is_shadow_caster(),
    )
    if state[-1]:
        size = tuple(node.get_shadow_buffer_size())
        state += size, node.get_camera_mask().get_word(), node.get_initial_state()
    if isinstance(node, core.PointLight):
        state += node.get_max_distance(), tuple(node.get_point())
    elif isinstance(node, core.Spotlight):
        lens = node.get_lens()
        axis = tuple(lens.get_view_vector()), tuple(lens.get_nodal_point())
        state += node.get_max_distance(), node.get_exponent(), lens.get_hfov(), axis
    elif isinstance(node, core.DirectionalLight):
        state += (tuple(node.get_direction()),)
    return state


def read_light(node: Any, losses: Losses) -> PandaNode:
    """Return a light of Panda3D as a node of ours, without its transform.

    A point light that is not at its node's origin becomes `PointLights` with one light. A light of a kind
    without light in Panda3D's own shaders, such as a RectangleLight, becomes a plain node.

    Parameters
    ----------
    node : panda3d.core.Light
        A node, as all of Panda3D's lights are.
    losses : Losses
        Gets what is not drawn, or drawn differently.
    """
    from panda3d import core

    name = node.get_name()
    color = _color(node.get_color(), name, losses)
    made: Light
    if isinstance(node, core.AmbientLight):
        return AmbientLight(name, color)
    if isinstance(node, core.PointLight):
        if isinstance(node, core.SphereLight):
            losses.add("sphere lights shine from their centres, as in Panda3D's own shaders", name)
        if tuple(node.get_point()) != _BLACK:
            return _point_light_aside(node, color, losses)
        made = PointLight(name, color)
        _read_fading(made, node, losses)
    elif isinstance(node, core.Spotlight):
        made = Spotlight(name, color)
        _read_fading(made, node, losses)
        _read_cone(made, node, losses)
    elif isinstance(node, core.DirectionalLight):
        made = DirectionalLight(name, color)
        _read_direction(made, node, losses)
    else:
        losses.add(f"lights of the type {node.get_type().get_name()} give no light", name)
        return PandaNode(name)
    if node.has_specular_color() and made.get_color().any():
        made.set_specular_color(_color(node.get_specular_color(), name, losses))
    _read_shadows(made, node, losses)
    return made


def _point_light_aside(node: Any, color: _Color, losses: Losses) -> PointLights:
    """Return a point light that is not at its node's origin."""
    name = node.get_name()
    losses.add("point lights are at their points, which Panda3D's shader generator ignores", name)
    attenuation, end = _attenuation(node, losses), _end(node, losses)
    highlights = None
    if attenuation is None:
        color, attenuation = _BLACK, Attenuation.ENDLESS
    elif node.has_specular_color():
        highlights = _color(node.get_specular_color(), name, losses)
    made = PointLights(
        name,
        [tuple(node.get_point())],
        [color],
        end,
        attenuation=attenuation,
        specular_colors=highlights,
    )
    _read_shadows(made, node, losses)
    return made


def _color(color: Any, name: str, losses: Losses) -> _Color:
    """Return the red, green and blue of a colour, each of 0 to the largest number that is sent to the GPU."""
    given = np.array(tuple(color)[:3], dtype=np.float64)
    if not np.isfinite(given).all():
        losses.add("colors of lights that are not finite are black", name)
        return _BLACK
    if given.min() < 0.0:
        losses.add("lights take no light away: negative colors are 0", name)
    red, green, blue = np.clip(given, 0.0, LARGEST).tolist()
    return red, green, blue


def _read_fading(made: FadingLight, node: Any, losses: Losses) -> None:
    attenuation = _attenuation(node, losses)
    if attenuation is None:
        made.set_color(_BLACK)
    else:
        made.set_attenuation(attenuation)
    made.set_max_distance(_end(node, losses))


def _attenuation(node: Any, losses: Losses) -> Attenuation | None:
    """Return the attenuation of a light, or None where Panda3D would divide by 0 everywhere."""
    name = node.get_name()
    given = np.array(tuple(node.get_attenuation()), dtype=np.float64)
    if not np.isfinite(given).all() or given.max() > 1e30:
        losses.add("lights whose attenuation is not finite are dark", name)
        return None
    if given.min() < 0.0:
        losses.add("negative coefficients of attenuation are 0", name)
    found = np.clip(given, 0.0, None)
    if found.max() < 1e-30:
        losses.add("lights with the attenuation (0, 0, 0), which divides by 0, are dark", name)
        return None
    return Attenuation(*found.tolist())


def _end(node: Any, losses: Losses) -> float:
    """Return the distance at which a light ends."""
    end = node.get_max_distance()
    if math.isinf(end) and end > 0.0:
        return math.inf
    losses.add("lights end at their max distances, which Panda3D's shader generator ignores", node.get_name())
    return max(end, 0.0) if math.isfinite(end) else 0.0


def _read_direction(made: DirectionalLight, node: Any, losses: Losses) -> None:
    direction = tuple(node.get_direction())
    if not (np.isfinite(direction).all() and any(direction)):
        losses.add("directional lights without a direction are dark", made.name)
        made.set_color(_BLACK)
    elif direction != _FORWARD:
        made.set_direction(direction)


def _read_cone(made: Spotlight, node: Any, losses: Losses) -> None:
    """Read the cone, which is as wide as the horizontal field of view of the light's lens."""
    lens, name = node.get_lens(), made.name
    angle = lens.get_hfov()
    if not 2.0 * SMALLEST_CONE <= angle <= 180.0:
        losses.add(f"spotlights have cones of {2.0 * SMALLEST_CONE:g} to {_WIDEST:g} degrees", name)
    if math.isfinite(angle):
        made.set_lens(PerspectiveLens(fov=min(max(angle, 2.0 * SMALLEST_CONE), _WIDEST)))
    exponent = node.get_exponent()
    if not 0.0 <= exponent <= _LARGEST_EXPONENT:
        losses.add(f"spotlights have exponents of 0 to {_LARGEST_EXPONENT:g}", name)
    made.set_exponent(min(max(exponent, 0.0), _LARGEST_EXPONENT) if math.isfinite(exponent) else 0.0)
    ahead = np.array([*lens.get_view_vector(), *lens.get_nodal_point()])
    if np.abs(ahead - (*_FORWARD, 0.0, 0.0, 0.0)).max() > 1e-6:
        losses.add("spotlights shine along their nodes, however their lenses are turned", name)


def _read_shadows(made: ShadowCaster, node: Any, losses: Losses) -> None:
    if not node.is_shadow_caster():
        return
    name = made.name
    low, high = SHADOW_RESOLUTIONS
    given = max(node.get_shadow_buffer_size())
    if not low <= given <= high:
        losses.add(f"shadow maps have {low} to {high} texels on each side", name)
    made.set_shadow_caster(True, min(max(given, low), high))
    made.camera_mask = node.get_camera_mask().get_word()
    if isinstance(made, DirectionalLight):
        losses.add("directional lights cast shadows in all of the view, not only in their lenses' film", name)
    if node.get_initial_state() != type(node)("").get_initial_state():
        losses.add("the initial states of shadow casters are not used", name)
