"""A field of spheres under any number of coloured lights: the scene plugin "spheres".

It is made for measurements. The geometry never changes, all lights have the same reach, and one parameter
sets their number, so the cost of a frame is a function of that number. 24 times a second one light takes a
step and the others stay, so a renderer may reuse parts of the last frame.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.parameter import KeyStep, Parameter
from firefly_sample.scene.random import uniform
from firefly_sample.scene.scene import Camera, Scene, VerticalGradient
from firefly_sample.scenes.plugin import Plugin, check_live, hue_colors, icosphere, seed_parameter

Float64 = NDArray[np.float64]

SIDE = 32.0
"""Side of the square ground around the origin, in scene units."""
ROWS = 16
"""Spheres along a side."""
RADIUS = 0.6
SUBDIVISIONS = 2
"""Subdivisions of an icosahedron: 320 triangles per sphere."""
REACH = 3.2
"""Reach of each light, in scene units."""
HEIGHTS = 0.4, 2.4
"""Range of the lights' heights above the ground."""
SPREAD = 1.0 / 1.32471795724474602596, 1.0 / 1.32471795724474602596**2, 0.5 * (5.0**0.5 - 1.0)
"""Steps from one light's centre to the next, as fractions of the ground and of the heights: on the ground the
additive recurrence of M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018, in height
that of the golden ratio. Any number of lights is distributed evenly, so each reaches the same number of
pixels
within 1 %; with random positions it differs by up to 6 %."""
EYE, VFOV = (0.0, -24.0, 14.0), 45.0
"""The camera's position, and its vertical field of view in degrees."""
POWER, POWER_LIGHTS = 2.6, 256
"""Factor of a light's colour, and the number of lights up to which it is used; see `light_power`."""
STEPS_A_SECOND = 24
"""Steps of all lights together per second, and of each light around its circle."""
CIRCLE = 0.5
"""Radius of the horizontal circle that each light moves along. Its position depends on (seed, k), the light's
position on it on the time and the number of lights."""
AMBIENT = (0.010, 0.012, 0.020)
SKY = VerticalGradient(horizon=(0.0042, 0.0036, 0.0085), zenith=(0.0008, 0.0009, 0.003))
EXPOSURE = 1.2
GROUND = (0.27, 0.26, 0.28, 1.0)

_CELLS = 32
"""Cells along a side of the ground, whose triangles are no larger than the spheres."""
_PAINTS = (
    (0.84, 0.82, 0.79, 1.0),
    (0.80, 0.66, 0.46, 1.0),
    (0.50, 0.64, 0.80, 1.0),
    (0.82, 0.54, 0.52, 1.0),
)
"""Base colours; half of the spheres have the first one."""
_SLACK = 1e-6
"""Tolerance in steps: a rounded time of k / 24 s counts as step k."""

_PARAMETERS = (
    seed_parameter("Which lights: where light k is, and its colour, comes from (seed, k)."),
    Parameter(
        "lights",
        int,
        256,
        "How many lights; the circles of the first ones stay where they are when there are more.",
        minimum=0,
        maximum=100_000,
        keys=(KeyStep("up", 1.25, help="more lights"), KeyStep("down", 0.8, help="fewer lights")),
    ),
)


def light_power(count: int) -> float:
    """Return the factor of the colours of `count` lights.

    It is constant up to 256 lights. Above, it falls as 1/count, so that the mean radiance of the picture
    stays about the same.
    """
    return POWER * min(1.0, POWER_LIGHTS / max(count, 1))


class _Lights:
    """Positions and colours of the lights. It refers to no node, so there is no cycle."""

    def __init__(self, seed: int, count: int) -> None:
        self.seed, self.count = seed, count
        k = np.arange(count)
        first = uniform(seed, np.arange(3), 0)
        low, high = HEIGHTS
        across = (first + np.multiply.outer(k, SPREAD)) % 1.0
        self._home: Float64 = np.array([SIDE, SIDE, high - low]) * across
        self._home += [-0.5 * SIDE, -0.5 * SIDE, low]
        start, one, other = uniform(seed, np.arange(3, 6)[:, None], k)
        self._start: Float64 = STEPS_A_SECOND * start
        self._colors = light_power(count) * _colors(self._home, one, other)

    def at(self, time: float) -> tuple[Float64, Float64, float]:
        """Return positions, colours and the reach of the lights at `time` (seconds).

        Light k takes step s, counted over all lights since time 0, if s mod count is k. Its position depends
        on the number of its own steps.
        """
        step = math.floor(time * STEPS_A_SECOND + _SLACK)
        own = (step - np.arange(self.count)) // max(self.count, 1) + 1
        angle = 2.0 * math.pi * (self._start + own % STEPS_A_SECOND) / STEPS_A_SECOND
        places = self._home.copy()
        places[:, 0] += CIRCLE * np.cos(angle)
        places[:, 1] += CIRCLE * np.sin(angle)
        return places, self._colors, REACH


class SpheresScene(Scene):
    """The spheres, their ground and the lights.

    Parameters
    ----------
    seed, lights
        See ``scene.parameters``; both can be changed later by `set`.
    """

    def __init__(self, seed: int = 7, lights: int = 256) -> None:
        root = NodePath("spheres")
        camera = root.attach_new_node(Camera("camera", PerspectiveLens(vfov=VFOV, near=1.0, far=100.0)))
        camera.set_pos(*EYE)
        camera.look_at(0.0, 0.0, 0.0)
        super().__init__(root, camera, background=SKY, exposure=EXPOSURE, focus=(0.0, 0.0, 0.0))
        root.attach_new_node(_ground())
        _place_spheres(root)
        root.attach_new_node(AmbientLight("sky", AMBIENT))
        # the function refers to no node, so there is no cycle
        self._swarm = _Swarm(_Lights(seed, lights))
        root.attach_new_node(PointLights("lights", function=self._swarm.at))

    def set(self, name: str, value: Any) -> None:
        """Change a parameter of the running scene.

        Raises
        ------
        ParameterError
            If there is no such parameter or the value is wrong.
        """
        checked = check_live("spheres", _PARAMETERS, name, value)
        before = self._swarm.lights
        given = {"seed": before.seed, "count": before.count}
        self._swarm.lights = _Lights(**given | {"count" if name == "lights" else name: checked})


class _Swarm:
    """The function of the node of lights, whose lights can be replaced."""

    def __init__(self, lights: _Lights) -> None:
        self.lights = lights

    def at(self, time: float) -> tuple[Float64, Float64, float]:
        return self.lights.at(time)


scene = Plugin(
    "spheres",
    "A field of spheres under any number of coloured lights, made to be measured.",
    _PARAMETERS,
    SpheresScene,
)


def _colors(place: Float64, one: Float64, other: Float64) -> Float64:
    """Return linear colours whose hues change slowly over the ground, with some scatter.

    Many lights of random hues would add up to the same grey everywhere; neighbours of similar hue do not.
    """
    drift = 0.78 + 0.019 * place[:, 0] + 0.15 * np.sin(0.23 * place[:, 1] - 0.08 * place[:, 0])
    hue = drift + 0.26 * (one - 0.5)
    return hue_colors(hue, 0.55 + 0.4 * other)


def _ground() -> GeomNode:
    """Return a horizontal square of many triangles: rasterisers are less accurate on very large ones."""
    line = SIDE * (np.arange(_CELLS + 1) / _CELLS - 0.5)
    x, y = np.meshgrid(line, line)
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    row, column = (index.ravel() for index in np.mgrid[:_CELLS, :_CELLS])
    corner = row * (_CELLS + 1) + column
    right, above, across = corner + 1, corner + _CELLS + 1, corner + _CELLS + 2
    triangles = np.concatenate(
        [np.stack([corner, right, across], axis=1), np.stack([corner, across, above], axis=1)]
    )
    node = GeomNode("ground")
    node.add_geom(
        Geom(vertices, triangles, np.tile((0.0, 0.0, 1.0), (len(vertices), 1)), name="ground"),
        Material("ground", GROUND),
    )
    return node


def _place_spheres(root: NodePath) -> None:
    """Add sixteen rows of sixteen spheres, which share their triangles and are one draw."""
    directions, triangles = icosphere(SUBDIVISIONS)
    geom = Geom(RADIUS * directions, triangles, directions, name="sphere")
    paints = [Material(f"paint {index}", color) for index, color in enumerate(_PAINTS)]
    u = uniform(1931, np.arange(2)[:, None], np.arange(ROWS * ROWS)[None, :])
    chosen = np.where(u[0] < 0.5, 0, 1 + np.floor(u[1] * (len(paints) - 1)).astype(int))
    group = root.attach_new_node("balls")
    line = SIDE * ((np.arange(ROWS) + 0.5) / ROWS - 0.5)
    for k, paint in enumerate(chosen):
        node = GeomNode("ball")
        node.add_geom(geom, paints[paint])
        path = group.attach_new_node(node)
        path.set_pos(line[k % ROWS], line[k // ROWS], RADIUS)
