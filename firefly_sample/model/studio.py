"""Lights, a backdrop and a ground for models that have none, as in a photo studio.

All lights are directional, so the same numbers fit models of every size. They are placed relative to the
camera's heading, so that a model is lit alike from wherever it is seen.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from firefly_sample.errors import SceneError
from firefly_sample.model.framing import visible_bounds
from firefly_sample.scene.arrays import LARGEST, Float64
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lights import AmbientLight, DirectionalLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Color, Scene, VerticalGradient


class StudioLight(NamedTuple):
    """A directional light: where it stands as seen from the model, in degrees, and its colour.

    `azimuth` is to the right of the camera, `elevation` above the horizon.
    """

    name: str
    azimuth: float
    elevation: float
    color: Color


KEY = StudioLight("key light", -30.0, 55.0, (1.32, 1.28, 1.22))
"""The main light, from the left and above; the only one with a shadow. It is so high that little
or nothing of a wide model's shadow is outside the picture."""
FILL = StudioLight("fill light", 65.0, 20.0, (0.36, 0.38, 0.41))
"""Brightens the side that the key light leaves dark."""
AMBIENT: Color = (0.29, 0.30, 0.31)
GROUND: Color = ((637 / 1023) ** 2, (646 / 1023) ** 2, (664 / 1023) ** 2)
"""The ground's base colour. The default format of base colours, sqrt10, stores it exactly. Otherwise the
ground could differ from the backdrop by one code, and its edge would show."""
SHADOW_MAP = 2048
"""Texels along a side of the key light's shadow map."""
GROUND_RADIUS = 3.5
"""In radii of the model, whose shadow ends at 1 + 2 / tan(55 degrees)."""
_CORNERS = 96
GROUND_GAP = 1e-3
"""The distance from the model down to the ground, in radii of the model. At 0, a flat model would lie in the
ground."""


def _level_light() -> Float64:
    """Return the light on a level surface, shape (3,)."""
    light = np.array(AMBIENT)
    for made in (KEY, FILL):
        light += math.sin(math.radians(made.elevation)) * np.array(made.color)
    return light


BACKDROP = VerticalGradient(horizon=tuple((_level_light() * GROUND).tolist()), zenith=(0.26, 0.28, 0.32))
"""At and below the horizon it has the colour of the lit ground."""


def add_default_lights(scene: Scene, factor: float = 1.0) -> NodePath:
    """Add a key light with a shadow, a fill and ambient light, and a neutral backdrop.

    Call it after the camera was placed: the lights stand relative to its heading. Returns the path of a new
    node below the root that holds the lights, to hide or to remove them. `factor` dims lights and backdrop.
    """
    lights = scene.root.attach_new_node("default lights")
    heading = scene.camera.get_net_transform().get_hpr()[0]
    for made in (KEY, FILL):
        light = DirectionalLight(made.name, _times(made.color, factor))
        light.set_shadow_caster(made is KEY, SHADOW_MAP)
        lights.attach_new_node(light).set_hpr(heading + made.azimuth, -made.elevation, 0.0)
    lights.attach_new_node(AmbientLight("ambient light", _times(AMBIENT, factor)))
    scene.background = VerticalGradient(_times(BACKDROP.horizon, factor), _times(BACKDROP.zenith, factor))
    return lights


def _times(color: Color, factor: float) -> Color:
    red, green, blue = color
    return (red * factor, green * factor, blue * factor)


def add_ground(
    scene: Scene, path: NodePath | None = None, *, turns: bool = False, times: Iterable[float] = ()
) -> NodePath:
    """Add a ground below everything visible at and below a path, by default the root; return its path.

    `turns` and `times` are as for `frame_camera`. In the default lights the ground has exactly the backdrop's
    colour, so that only the model's shadow shows on it. It is seen from above alone.
    """
    bounds = visible_bounds(scene, path, turns=turns, times=times)
    radius = bounds.radius if bounds.radius > 0.0 else 1.0
    if GROUND_RADIUS * radius > LARGEST:
        raise SceneError(f"too large for a ground, with a radius of {radius:g}: scale it down")
    angle = np.arange(_CORNERS) * (2.0 * math.pi / _CORNERS)
    rim = GROUND_RADIUS * radius * np.stack([np.cos(angle), np.sin(angle), np.zeros(_CORNERS)], axis=1)
    middle = np.arange(1, _CORNERS - 1)
    fan = np.stack([np.zeros_like(middle), middle, middle + 1], axis=1)
    node = GeomNode("ground")
    node.add_geom(Geom(rim, fan, name="ground"), Material("ground", (*GROUND, 1.0)))
    ground = scene.root.attach_new_node(node)
    x, y, _ = bounds.center
    ground.set_pos(x, y, bounds.low - GROUND_GAP * radius)
    return ground
