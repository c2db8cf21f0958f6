"""A grid of cats under a grid of coloured light bulbs: the scene plugin "lightbulbs".

It is a case for deferred shading: hundreds of lights of short range. A cat is 1.3 units high and sits 2.3
units from the next. A bulb hovers 1.9 units above the middle between four cats. Its light fades by 1/(1 +
d^2) and ends at 3 units, with a smooth window: it reaches the four cats around it, about two units away, but
not the next ones, 3.8 units away.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.assets import model_path
from firefly_sample.model.load import load_model
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.light import Attenuation
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLights
from firefly_sample.scene.material import Material
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.random import uniform
from firefly_sample.scene.scene import VerticalGradient
from firefly_sample.scenes.plugin import (
    LiveScene,
    Plugin,
    find_part,
    hue_colors,
    seed_parameter,
    set_visible,
    sphere_directions,
    switch,
)

Float64 = NDArray[np.float64]

SPACING = 2.3
"""Distance between cats, in scene units; each has a slab of the plinth."""
CAT_SCALE = 1.3
PLINTH_HEIGHT = 3.0
BULB_HEIGHT = 1.9
BULB_RADIUS = 0.2
BULB_ATTENUATION = Attenuation.INVERSE_SQUARE
BULB_REACH = 3.0
BULB_POWER = 4.5
"""Factor of the colour of a bulb's light."""
BULB_EMISSION = 1.1
"""Factor of the colour of the bulb itself."""
HALO_RADIUS, HALO_RADIANCE = 0.42, 0.30
"""Radius and radiance of the glow around a bulb, as in a lens."""
HOVER_HEIGHT, HOVER_SECONDS = 0.35, (3.0, 5.0)
SUN_COLOR, SUN_HPR = (1.25, 1.13, 0.95), (-38.0, -42.0, 0.0)
SUN_MAP, SHADOW_DISTANCE = 2048, 1.6
"""Texels of the sun's shadow map, and its shadow distance in sizes of the plinth (10 units are added)."""
NIGHT, DAY = (0.030, 0.033, 0.050), (0.11, 0.135, 0.19)
"""Ambient light without and with the sun."""
SKY = VerticalGradient(horizon=(0.0045, 0.0035, 0.010), zenith=(0.0010, 0.0012, 0.0040))
FUR_SHINE, STONE_SHINE = (0.035, 18.0), (0.10, 60.0)
"""Specular reflectance and shininess."""

_PLANETS = (
    ("gas giant", (-92.0, 118.0, 17.5), 18.0, 25.0),
    ("ringed planet", (-9.0, 122.0, 27.0), 8.0, -18.0),
    ("ocean planet", (-37.0, 84.0, 14.5), 5.0, 8.0),
    ("rocky planet", (10.0, 62.0, 8.0), 2.2, -12.0),
    ("moon", (-27.0, 76.0, 19.0), 1.3, 0.0),
)
"""Name, position, radius, and the tilt of the axis in degrees, around a plinth of `_PLINTH`."""
_PLINTH = 46.0
"""A side of the plinth of 20 cats; around a larger one, planets and stars are larger and farther alike."""
_STARS, _STAR_DISTANCE, _FAR = 700, 320.0, 400.0

_PARAMETERS = (
    seed_parameter(
        "Which colours: every random number about bulb k or cat k comes from (seed, k).", live=False
    ),
    Parameter("columns", int, 20, "Cats, and bulbs, from left to right.", minimum=1, maximum=100, live=False),
    Parameter("rows", int, 20, "Cats, and bulbs, from front to back.", minimum=1, maximum=100, live=False),
    switch("bulbs", True, "Whether the light bulbs are on.", "b", "bulbs on, off"),
    switch("sun", False, "Whether the sun shines.", "u", "sun on, off"),
    switch("hover", True, "Whether the bulbs hover up and down.", "h", "hover, rest"),
    switch("shadows", True, "Whether the sun casts shadows.", "k", "shadows on, off"),
)


class _Bulbs:
    """Positions and colours of the bulbs. It refers to no node, so there is no cycle."""

    def __init__(self, seed: int, columns: int, rows: int) -> None:
        count = columns * rows
        u = uniform(seed, np.arange(5)[:, None], np.arange(count)[None, :])
        column, row = np.arange(count) % columns, np.arange(count) // columns
        # between four cats: half a step right of each cat and before its face, also of those in the first row
        x, y = _grid(column, columns) + 0.5 * SPACING, _grid(row, rows) - 0.5 * SPACING
        self._home: Float64 = np.stack([x, y, np.full(count, BULB_HEIGHT)], axis=1)
        self.colors = hue_colors(u[0], 0.66 + 0.26 * u[1])  # neither pale nor of one channel alone
        low, high = HOVER_SECONDS
        self._period: Float64 = low + (high - low) * u[2]
        self._phase = u[3]
        self.hovering = True

    def at(self, time: float) -> Float64:
        """Return the centres at `time` (seconds), shape (n, 3)."""
        positions = self._home.copy()
        if self.hovering:
            turns = np.fmod(time, self._period) / self._period + self._phase
            positions[:, 2] += HOVER_HEIGHT * np.sin(2.0 * math.pi * turns)
        return positions

    def lights(self, time: float) -> tuple[Float64, Float64, float]:
        """Return positions, colours and the max distance of the lights."""
        return self.at(time), BULB_POWER * self.colors, BULB_REACH

    def halos(self, time: float) -> tuple[Float64, Float64, float]:
        """Return positions, colours and the radius of the glow."""
        return self.at(time), HALO_RADIANCE * self.colors, HALO_RADIUS


class LightbulbsScene(LiveScene):
    """Cats, bulbs, planets and a sun; `bulbs`, `sun`, `hover` and `shadows` are live.

    Raises
    ------
    ModelError
        If a file in models/ is missing or damaged.
    """

    def __init__(self, **parameters: Any) -> None:
        lens = PerspectiveLens(vfov=38.0, near=0.5, far=_FAR)
        super().__init__("lightbulbs", _PARAMETERS, parameters, lens, background=SKY)
        seed, columns, rows = (self.values[name] for name in ("seed", "columns", "rows"))
        size = SPACING * max(columns, rows)
        around = max(1.0, size / _PLINTH)
        lens.set_far(around * _FAR)
        self.camera.set_pos(0.30 * size, -(0.52 * size + 7.0), 0.13 * size + 2.0)
        self.focus = (-0.02 * size, -0.02 * size, 0.045 * size + 0.3)
        self.camera.look_at(*self.focus)
        _place_cats(self.root, seed, columns, rows)
        _place_planets(self.root, around)
        self.root.attach_new_node(Sprites("stars", *_stars(around)))
        self._bulbs = _Bulbs(seed, columns, rows)
        self._spheres = _place_bulbs(self.root, columns * rows)
        self._lights = self.root.attach_new_node(
            PointLights("bulb lights", function=self._bulbs.lights, attenuation=BULB_ATTENUATION)
        )
        self._halos = self.root.attach_new_node(Sprites("halos", function=self._bulbs.halos))
        self._sun = DirectionalLight("sun", SUN_COLOR)
        self._sun.set_shadow_distance(SHADOW_DISTANCE * size + 10.0)
        self._sun_path = self.root.attach_new_node(self._sun)
        self._sun_path.set_hpr(*SUN_HPR)
        self._ambient = AmbientLight("sky")
        self.root.attach_new_node(self._ambient)
        self._updated: float | None = None
        for name in ("bulbs", "sun", "hover", "shadows"):
            self.apply(name)

    def apply(self, name: str) -> None:
        """Put the new value of a live parameter into effect."""
        on = self.values[name]
        if name == "bulbs":
            set_visible(self._lights, on)
            set_visible(self._halos, on)
            for path, color in zip(self._spheres, self._bulbs.colors, strict=True):
                material = path.node().material
                assert material is not None
                material.set_emission(BULB_EMISSION * color if on else np.zeros(3))
        elif name == "sun":
            set_visible(self._sun_path, on)
            self._ambient.set_color(DAY if on else NIGHT)
        elif name == "hover":
            self._bulbs.hovering = on
            self._updated = None
        else:
            self._sun.set_shadow_caster(on, SUN_MAP)

    def update(self, time: float) -> None:
        """Move the bulbs to their positions at `time`; lights and glow are functions of time."""
        wanted = time if self._bulbs.hovering else 0.0
        if wanted != self._updated:
            self._updated = wanted
            for path, position in zip(self._spheres, self._bulbs.at(wanted), strict=True):
                path.set_pos(*position)


scene = Plugin(
    "lightbulbs",
    "A grid of cats under a grid of coloured light bulbs, with planets and a sun.",
    _PARAMETERS,
    LightbulbsScene,
)


def _grid(index: Any, count: int) -> Any:
    """Return coordinates of a row of things, centred at 0."""
    return (index - 0.5 * (count - 1)) * SPACING


def _place_cats(root: NodePath, seed: int, columns: int, rows: int) -> None:
    """Add the plinth, and a cat on each of its slabs that looks roughly ahead."""
    plinth = find_part(load_model(model_path("plinth.glb")), "plinth")
    (geom, stone), *_ = plinth.geoms
    stone.set_specular(np.full(3, STONE_SHINE[0]))
    stone.set_shininess(STONE_SHINE[1])
    node = GeomNode("plinth")
    node.add_geom(_paved(geom, columns, rows), stone)
    path = root.attach_new_node(node)
    path.set_scale(SPACING * columns, SPACING * rows, PLINTH_HEIGHT)

    cat = find_part(load_model(model_path("cat.glb")), "cat")
    for _, fur in cat.geoms:
        fur.set_specular(np.full(3, FUR_SHINE[0]))
        fur.set_shininess(FUR_SHINE[1])
    cats = root.attach_new_node("cats")
    count = columns * rows
    u = uniform(seed, np.arange(8, 11)[:, None], np.arange(count)[None, :])
    # most look ahead, some wherever they like
    turn = 25.0 * (2.0 * u[0] - 1.0) * (1.0 + 5.0 * (u[1] > 0.85))
    for k in range(count):
        path = cats.attach_new_node(cat.make_copy())
        path.set_pos(_grid(k % columns, columns), _grid(k // columns, rows), 0.0)
        path.set_h(turn[k])
        path.set_scale(CAT_SCALE * (0.94 + 0.12 * u[2, k]))


def _paved(geom: Geom, columns: int, rows: int) -> Geom:
    """Return the plinth's Geom, made for 20 by 20 slabs, with a slab for each cat."""
    across = np.abs(geom.normals)
    top_or_ends = across[:, 1] >= across[:, 0]
    u, v = geom.texcoords.T
    # the texture holds five slabs; 2 is the middle of the plinth, where four slabs meet
    slabs_u = np.where(top_or_ends | (across[:, 2] > 0.5), columns, rows)
    v = np.where(across[:, 2] > 0.5, 2.0 + (v - 2.0) * rows / 20.0 + 0.1 * (rows % 2), v)
    u = 2.0 + (u - 2.0) * slabs_u / 20.0 + 0.1 * (slabs_u % 2)
    return Geom(geom.vertices, geom.triangles, geom.normals, np.stack([u, v], axis=1), name=geom.name)


def _place_planets(root: NodePath, around: float) -> None:
    planets = root.attach_new_node("planets")
    planets.set_scale(around)
    file = load_model(model_path("planets.glb"))
    for name, position, radius, tilt in _PLANETS:
        path = planets.attach_new_node(find_part(file, name))
        path.set_pos_hpr_scale(*position, 0.0, 0.0, tilt, radius, radius, radius)


def _place_bulbs(root: NodePath, count: int) -> list[NodePath]:
    """Add a sphere for each bulb, with its own material; they are still one draw."""
    (glass, _), *_ = find_part(load_model(model_path("bulb.glb")), "bulb").geoms
    node = root.attach_new_node("bulbs")
    paths = []
    for _ in range(count):
        sphere = GeomNode("bulb")
        sphere.add_geom(glass)
        path = node.attach_new_node(sphere)
        path.set_material(Material("bulb", (0.05, 0.05, 0.055, 1.0), specular=(0.3,) * 3, shininess=80.0))
        paths.append(path)
    return paths


def _stars(around: float) -> tuple[Float64, Float64, Float64]:
    """Return positions, colours and radii of distant dots in all directions."""
    u = uniform(1919, np.arange(5)[:, None], np.arange(_STARS)[None, :])
    tint = np.stack([0.8 + 0.4 * u[2], np.ones(_STARS), 1.2 - 0.4 * u[2]], axis=1)
    radii = around * (0.3 + 0.25 * u[4])
    colors = tint * (0.15 + 1.6 * u[3] ** 4)[:, None]
    return around * _STAR_DISTANCE * sphere_directions(u[0], u[1]), colors, radii
