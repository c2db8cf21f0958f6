"""A field of spheres under any number of coloured lights: the scene plugin "spheres".

It is made for measurements. The geometry never changes, all lights have the same reach, and one parameter
sets their number, so the cost of a frame is a function of that number. 24 times a second one light takes a
step and the others stay, so a renderer may reuse parts of the last frame.
"""

from __future__ import annotations

import itertools
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
from firefly_sample.scene.scene import VerticalGradient
from firefly_sample.scenes.plugin import LiveScene, Plugin, hue_colors, seed_parameter, with_keys

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
pixels within 1 %; with random positions it differs by up to 6 %."""
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
    with_keys(
        Parameter(
            "lights",
            int,
            256,
            "How many lights; each moves on a circle, and more lights do not move the first ones.",
            minimum=0,
            maximum=100_000,
        ),
        KeyStep("up", 1.25, help="more lights"),
        KeyStep("down", 0.8, help="fewer lights"),
    ),
)


def light_power(count: int) -> float:
    """Return the factor of the colours of `count` lights.

    It is constant up to 256 lights. Above, it falls as 1/count, so that the mean radiance of the picture
    stays about the same.
    """
    return POWER * min(1.0, POWER_LIGHTS / max(count, 1))


class _Lights:
    """Positions and colours of the lights."""

    def __init__(self, seed: int, count: int) -> None:
        self._count = count
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
        own = (step - np.arange(self._count)) // max(self._count, 1) + 1
        angle = 2.0 * math.pi * (self._start + own % STEPS_A_SECOND) / STEPS_A_SECOND
        positions = self._home.copy()
        positions[:, 0] += CIRCLE * np.cos(angle)
        positions[:, 1] += CIRCLE * np.sin(angle)
        return positions, self._colors, REACH


class SpheresScene(LiveScene):
    """The spheres, their ground and the lights; all parameters are live."""

    def __init__(self, **parameters: Any) -> None:
        lens = PerspectiveLens(vfov=VFOV, near=1.0, far=100.0)
        super().__init__(
            "spheres", _PARAMETERS, parameters, lens, background=SKY, exposure=EXPOSURE, focus=(0.0, 0.0, 0.0)
        )
        self.camera.set_pos(*EYE)
        self.camera.look_at(0.0, 0.0, 0.0)
        self.root.attach_new_node(_ground())
        _place_spheres(self.root)
        self.root.attach_new_node(AmbientLight("sky", AMBIENT))
        self._lights = PointLights("lights")
        self.root.attach_new_node(self._lights)
        self.apply("lights")

    def apply(self, name: str) -> None:
        """Replace the lights, by any of the two parameters."""
        self._lights.function = _Lights(self.values["seed"], self.values["lights"]).at


scene = Plugin(
    "spheres",
    "A field of spheres under any number of coloured lights, made to be measured.",
    _PARAMETERS,
    SpheresScene,
)


def _colors(positions: Float64, one: Float64, other: Float64) -> Float64:
    """Return linear colours whose hues change slowly over the ground, with some scatter.

    Many lights of random hues would add up to the same grey everywhere; neighbours of similar hue do not.
    """
    drift = 0.78 + 0.019 * positions[:, 0]
    drift = drift + 0.15 * np.sin(0.23 * positions[:, 1] - 0.08 * positions[:, 0])
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
    normals = np.tile((0.0, 0.0, 1.0), (len(vertices), 1))
    node = GeomNode("ground")
    node.add_geom(Geom(vertices, triangles, normals, name="ground"), Material("ground", GROUND))
    return node


def _place_spheres(root: NodePath) -> None:
    """Add sixteen rows of sixteen spheres, which share their triangles and are one draw."""
    directions, triangles = _icosphere()
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


def _icosphere() -> tuple[Float64, NDArray[np.int32]]:
    """Return corners (and normals) of a unit sphere, and triangles that are counter-clockwise from outside.

    It is an icosahedron whose triangles are divided into four `SUBDIVISIONS` times.
    """
    golden = (1.0 + 5.0**0.5) / 2.0
    flat = np.array([(a, b * golden, 0.0) for a in (-1.0, 1.0) for b in (-1.0, 1.0)])
    corners = np.concatenate([np.roll(flat, shift, axis=1) for shift in range(3)])
    # an edge has length 2; a face is three corners at that distance, ordered so that it faces outwards
    near = np.abs(np.linalg.norm(corners[:, None] - corners, axis=2) - 2.0) < 1e-9
    triangles = [
        (a, b, c) if np.linalg.det(corners[[a, b, c]]) > 0.0 else (a, c, b)
        for a, b, c in itertools.combinations(range(12), 3)
        if near[a, b] and near[b, c] and near[c, a]
    ]
    points = [corner / np.linalg.norm(corner) for corner in corners]
    middles: dict[frozenset[int], int] = {}

    def middle(one: int, other: int) -> int:
        edge = frozenset((one, other))
        if edge not in middles:
            middles[edge] = len(points)
            between = points[one] + points[other]
            points.append(between / np.linalg.norm(between))
        return middles[edge]

    for _ in range(SUBDIVISIONS):
        divided = []
        for a, b, c in triangles:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            divided += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = divided
    return np.array(points), np.array(triangles, dtype=np.int32)
