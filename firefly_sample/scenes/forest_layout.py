"""The forest's ground, and the positions of everything on it: some set by hand, the rest scattered by rules.

The layout is a constant of the scene: the scene's seed changes fireflies, not trees. The terrain's mesh and
the shading in its texture follow from it, so the models must be rebuilt after a change here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.scene.random import uniform

Float64 = NDArray[np.float64]
Bools = NDArray[np.bool_]

X_RANGE = (-260.0, 260.0)
Y_RANGE = (-230.0, 300.0)
CLEARING = (-4.0, 12.0, 58.0, 84.0)
"""Centre x and y, half width and half depth of the clearing, in scene units."""
_Stand = tuple[str, float, float, float, float]
"""Species, x, y, heading and scale of a thing, without its height."""
CAMERA = (-9.112, -211.077, 46.951)
"""The camera position of the original; nothing may stand between it and the near plane."""
_SEED = 2007
"""Seed of the scattered things; any other gives a different forest of the same kind."""


@cache
def _lattice(seed: int) -> Float64:
    return uniform(seed, np.arange(64)[:, None], np.arange(64)[None, :])


def ground_noise(x: ArrayLike, y: ArrayLike, seed: int, wavelength: float) -> Float64:
    """Return smooth noise in -1..1 at (x, y), in world space.

    It blends random values on a lattice by a quintic. The lattice's spacing is `wavelength` scene units; the
    noise repeats after 64 of them.
    """
    u, v = np.asarray(x, dtype=np.float64) / wavelength, np.asarray(y, dtype=np.float64) / wavelength
    i, j = np.floor(u), np.floor(v)
    a, b = u - i, v - j
    a = a * a * a * (a * (6.0 * a - 15.0) + 10.0)
    b = b * b * b * (b * (6.0 * b - 15.0) + 10.0)
    i, j = i.astype(np.int64) % 64, j.astype(np.int64) % 64
    right, up = (i + 1) % 64, (j + 1) % 64
    table = _lattice(seed)
    low = table[i, j] * (1.0 - a) + table[right, j] * a
    high = table[i, up] * (1.0 - a) + table[right, up] * a
    return np.asarray(2.0 * (low * (1.0 - b) + high * b) - 1.0)


def clearing_distance(x: ArrayLike, y: ArrayLike) -> Float64:
    """Return 0 at the clearing's centre, 1 on its rim, and more outside; the rim is not quite an ellipse."""
    cx, cy, half_width, half_depth = CLEARING
    u = (np.asarray(x, dtype=np.float64) - cx) / half_width
    v = (np.asarray(y, dtype=np.float64) - cy) / half_depth
    return np.asarray(np.hypot(u, v) * (1.0 + 0.12 * ground_noise(x, y, 11, 46.0)))


def _ramp(t: Float64) -> Float64:
    """Return 0 below 0, 1 above 1, and a smooth step between."""
    t = np.clip(t, 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def ground_height(x: ArrayLike, y: ArrayLike) -> Float64:
    """Return the height of the ground at (x, y), in scene units; arrays broadcast.

    It is a shallow hollow with a few humps, banks on both sides, and a wooded rise at the back.
    """
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    out = _ramp((clearing_distance(x, y) - 0.75) / 1.1)
    height = 1.1 * ground_noise(x, y, 1, 37.0) + 0.45 * ground_noise(x, y, 2, 15.0)
    height = height + out * (5.0 * ground_noise(x, y, 3, 74.0) + 1.6 * ground_noise(x, y, 4, 29.0) + 2.0)
    height = height + 26.0 * _ramp((y - 120.0) / 190.0) * (1.0 + 0.35 * ground_noise(x, y, 5, 120.0))
    height = height + 14.0 * _ramp((np.abs(x + 10.0) - 70.0) / 170.0)
    return np.asarray(height - 1.5 * (1.0 - out))


def ground_slope(x: ArrayLike, y: ArrayLike) -> tuple[Float64, Float64]:
    """Return the derivatives of `ground_height` along x and y, by central differences over half a unit."""
    x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
    along_x = (ground_height(x + 0.25, y) - ground_height(x - 0.25, y)) / 0.5
    return along_x, (ground_height(x, y + 0.25) - ground_height(x, y - 0.25)) / 0.5


@dataclass(frozen=True)
class Species:
    """The requirements of one model on its position; lengths are in scene units, at scale 1.

    Attributes
    ----------
    file : str
        The name of its .glb file, without the ending; the node in it has the name of the species.
    kind : {"tree", "bush", "prop", "grass"}
    foot : float
        Radius at the ground; feet do not overlap.
    crown : float
        Radius of the crown, which stays behind the camera's near plane.
    sink : float
        Depth of the origin in the ground.
    tilt : float
        Fraction of the ground's slope that it follows: 0 upright, 1 fully.
    length : float
        Distance along its own X axis over which the slope is measured.
    """

    file: str
    kind: str
    foot: float
    crown: float = 0.0
    sink: float = 0.2
    tilt: float = 0.0
    length: float = 1.0


SPECIES: dict[str, Species] = {
    "oak": Species("oak", "tree", 6.5, 38.0),
    "tall oak": Species("oak", "tree", 5.7, 31.0),
    "young oak": Species("oak", "tree", 1.3, 9.0),
    "birch": Species("birch", "tree", 3.2, 26.0),
    "slim birch": Species("birch", "tree", 2.2, 17.0),
    "spruce": Species("spruce", "tree", 3.9, 22.0),
    "slim spruce": Species("spruce", "tree", 3.0, 15.0),
    "young spruce": Species("spruce", "tree", 1.2, 9.0),
    "pine": Species("pine", "tree", 3.6, 24.0),
    "dead tree": Species("dead_tree", "tree", 5.0, 16.0),
    "hazel": Species("bushes", "bush", 3.0, 13.0, 0.2, 0.3),
    "bramble": Species("bushes", "bush", 4.1, 10.0, 0.2, 0.8),
    "fern": Species("fern", "bush", 1.0, 8.0, 0.1, 0.7),
    "stump": Species("stump", "prop", 8.4, 0.0, 0.5, 0.5),
    "fallen trunk": Species("fallen_trunk", "prop", 0.0, 0.0, 0.5, 1.0, 42.0),
    "boulder": Species("rocks", "prop", 8.7, 0.0, 0.6, 0.5),
    "rock": Species("rocks", "prop", 6.4, 0.0, 0.3, 0.6),
    "stone": Species("rocks", "prop", 4.7, 0.0, 0.2, 0.8),
    "fly agaric": Species("mushrooms", "prop", 5.2, 0.0, 0.15, 0.8),
    "brown mushroom": Species("mushrooms", "prop", 3.9, 0.0, 0.15, 0.8),
    "grass": Species("grass", "grass", 0.0, 0.0, 0.15, 0.9),
    "tall grass": Species("grass", "grass", 0.0, 0.0, 0.15, 0.9),
}
"""Every model of the forest but the terrain, by its name in the layout."""


@dataclass(frozen=True)
class Placement:
    """One thing: its species, its origin in world space, Panda3D's H, P and R in degrees, and its scale."""

    species: str
    x: float
    y: float
    z: float
    heading: float
    pitch: float
    roll: float
    scale: float

    @property
    def foot(self) -> float:
        """Radius at the ground, in scene units."""
        return SPECIES[self.species].foot * self.scale


_COMPOSED: tuple[_Stand, ...] = (
    # Trunks that frame the view, then what the eye finds in the clearing: species, x, y, heading, scale.
    ("pine", -39.0, -118.0, 40.0, 1.0),
    ("birch", 24.5, -112.0, 200.0, 0.95),
    ("slim birch", 31.5, -98.0, 75.0, 1.0),
    ("oak", -74.0, -38.0, 10.0, 1.0),
    ("tall oak", 66.0, -22.0, 130.0, 1.0),
    ("dead tree", 30.0, 92.0, 30.0, 1.1),
    ("young oak", -50.0, 18.0, 0.0, 1.0),
    ("young spruce", 46.0, 8.0, 0.0, 1.1),
    ("young spruce", -58.0, 66.0, 70.0, 0.9),
    ("stump", 9.0, -50.0, 24.0, 1.0),
    ("boulder", -43.0, -34.0, 60.0, 1.0),
    ("rock", -31.5, -44.0, 200.0, 0.9),
    ("stone", -45.5, -49.0, 20.0, 0.9),
    ("rock", 33.0, -18.0, 120.0, 0.85),
    ("fly agaric", -5.0, -57.0, 0.0, 1.0),
    ("fly agaric", -21.0, -66.0, 130.0, 0.8),
    ("brown mushroom", 22.0, -58.5, 40.0, 1.0),
    ("brown mushroom", -27.0, -33.0, 70.0, 0.9),
    ("hazel", 38.0, -52.0, 30.0, 1.0),
    ("bramble", -52.0, -58.0, 90.0, 1.0),
    ("fern", -35.0, -74.0, 0.0, 1.0),
    ("fern", -28.0, -80.0, 140.0, 0.9),
    ("fern", 20.5, -72.0, 60.0, 1.0),
    ("fern", 27.0, -66.0, 200.0, 0.85),
    ("fern", -30.0, -56.0, 300.0, 0.8),
)
_FALLEN = ("fallen trunk", -22.0, -4.0, 24.0, 1.0)
_FALLEN_FEET = tuple(
    (-22.0 + t * 0.914, -4.0 + t * 0.407, 3.6) for t in (-23, -18, -12, -6, 0, 6, 12, 18, 23)
)
"""The feet of the fallen trunk: a row of discs along it."""


class _Ground:
    """The occupied ground: discs (x, y, radius)."""

    def __init__(self) -> None:
        self.discs = np.array(_FALLEN_FEET)

    def take(self, x: float, y: float, radius: float) -> None:
        self.discs = np.vstack([self.discs, [x, y, radius]])

    def room(self, x: float, y: float) -> float:
        """Return the distance from (x, y) to the nearest disc's edge."""
        gaps = np.hypot(self.discs[:, 0] - x, self.discs[:, 1] - y) - self.discs[:, 2]
        return float(gaps.min())


@dataclass(frozen=True)
class _Strewing:
    """A rule for scattering; `where` is the chance of a thing. It and `weights` take x and y of all tries."""

    species: tuple[str, ...]
    weights: Callable[[Float64, Float64], tuple[ArrayLike, ...]]
    tries: int
    gap: float
    scales: tuple[float, float]
    where: Callable[[Float64, Float64], Float64]
    x_range: tuple[float, float] = (X_RANGE[0] + 12.0, X_RANGE[1] - 12.0)
    y_range: tuple[float, float] = (Y_RANGE[0] + 12.0, Y_RANGE[1] - 12.0)


def _in_view(x: Float64, y: Float64, margin: float = 10.0) -> Bools:
    return np.abs(x - CAMERA[0]) < 0.36 * (y - CAMERA[1]) + margin


def _glade(x: Float64, y: Float64) -> Bools:
    """Return whether points are in the gap behind the clearing, through which the sky is seen."""
    slope = (x - CAMERA[0]) / (y - CAMERA[1])
    return (y > -60.0) & (y < 178.0) & (slope > -0.20) & (slope < 0.13)


def _wood(x: Float64, y: Float64) -> Float64:
    """Return the chance of a tree: 0 in clearing and glade and in front of the camera, less out of view."""
    none = (clearing_distance(x, y) < 1.08) | _glade(x, y) | ((y < -60.0) & _in_view(x, y, 22.0))
    return np.where(none, 0.0, np.where(_in_view(x, y, 15.0), 1.0, 0.30))


def _tree_weights(x: Float64, y: Float64) -> tuple[ArrayLike, ...]:
    """Return weights of species: oaks and birches near the clearing, spruces behind and in groups."""
    far = np.clip((clearing_distance(x, y) - 1.1) / 1.2, 0.0, 1.0)
    group = 0.5 + 0.5 * ground_noise(x, y, 21, 70.0)
    near = 1.0 - far
    mixed = (
        1.1 * near,
        1.2 * near + 0.25 * far,
        1.1 * near + 0.5 * far * group,
        0.8 * near + 1.5 * far * group,
        0.35 + 0.9 * far * (1.0 - group),
        0.2 + 2.6 * far * (1.0 - group),
        0.5,
    )
    # only slim trees stand behind the glade, so that the sky is seen between them
    spires = (0.0, 0.0, 0.0, 0.12, 0.25, 1.0, 0.0)
    behind = (y > 170.0) & _glade(x, 0.9 * y - 20.0)
    columns = zip(spires, np.broadcast_arrays(*mixed), strict=True)
    return tuple(np.where(behind, alone, other) for alone, other in columns)


def _undergrowth(x: Float64, y: Float64) -> Float64:
    none = ~_in_view(x, y) | (y < -104.0) | (y > 190.0) | ((y < -40.0) & (x > -18.0) & (x < 26.0))
    patches = 0.5 + 0.5 * ground_noise(x, y, 22, 26.0)
    return np.where(none, 0.0, np.clip((clearing_distance(x, y) - 0.62) / 0.4, 0.0, 1.0) * patches)


def _young(x: Float64, y: Float64) -> Float64:
    rim = clearing_distance(x, y)
    return np.where(_in_view(x, y) & (rim > 0.9) & (rim < 1.9) & (y > -60.0), 1.0, 0.0)


def _ridge(x: Float64, y: Float64) -> Float64:
    return np.where(_glade(x, 0.65 * y), 0.8, 0.0)


def _stones(x: Float64, y: Float64) -> Float64:
    here = _in_view(x, y) & (y > -104.0) & (y < 170.0) & (clearing_distance(x, y) > 0.5)
    return np.where(here, 0.7, 0.0)


def _meadow(x: Float64, y: Float64) -> Float64:
    """Return the chance of a tuft: in patches, denser in the clearing and in front."""
    patches = 0.55 + 0.45 * ground_noise(x, y, 23, 19.0) + 0.25 * ground_noise(x, y, 24, 7.0)
    open_ = np.where(clearing_distance(x, y) < 1.05, 1.0, 0.55)
    chance = open_ * np.maximum(0.0, patches) * np.where(y < 70.0, 1.0, 0.5)
    return np.where(_in_view(x, y, 4.0) & (y <= 150.0), chance, 0.0)


_STREWN: tuple[_Strewing, ...] = (
    _Strewing(
        ("oak", "tall oak", "birch", "slim birch", "spruce", "slim spruce", "pine"),
        _tree_weights,
        2600,
        21.0,
        (0.85, 1.12),
        _wood,
    ),
    _Strewing(
        ("young oak", "young spruce"), lambda x, y: (1.0, 1.0), 160, 9.0, (0.7, 1.15), _young
    ),
    _Strewing(
        ("young spruce",), lambda x, y: (1.0,), 120, 9.0, (0.8, 1.4), _ridge, (-110.0, 90.0), (165.0, 275.0)
    ),
    _Strewing(("hazel", "bramble"), lambda x, y: (1.0, 1.0), 300, 7.0, (0.75, 1.2), _undergrowth),
    _Strewing(("rock", "stone", "boulder"), lambda x, y: (0.8, 1.2, 0.15), 60, 3.0, (0.5, 1.0), _stones),
    _Strewing(("fern",), lambda x, y: (1.0,), 420, 2.6, (0.65, 1.1), _undergrowth),
    _Strewing(
        ("fly agaric", "brown mushroom"), lambda x, y: (0.7, 1.2), 34, 2.0, (0.45, 0.8), _stones,
        (-70.0, 70.0), (-100.0, 60.0),
    ),
    _Strewing(
        ("grass", "tall grass"), lambda x, y: (1.0, 0.45), 3000, 0.4, (0.6, 1.15), _meadow,
        (-110.0, 110.0), (-112.0, 150.0),
    ),
)  # fmt: skip


@cache
def place_forest() -> tuple[Placement, ...]:
    """Return everything in the forest and its position; always the same.

    Things set by hand come first, then trees, bushes, stones, ferns, mushrooms and grass, at random positions
    that are kept if the rule allows them and the foot overlaps no earlier one (dart throwing, the simplest
    method for a Poisson-disc pattern).
    """
    ground = _Ground()
    for species, x, y, _, scale in _COMPOSED:
        ground.take(x, y, SPECIES[species].foot * scale)
    found = [_FALLEN, *_COMPOSED]
    for stream, rule in enumerate(_STREWN):
        found.extend(_strew(rule, stream, ground))
    return _settle(found)


def _strew(rule: _Strewing, stream: int, ground: _Ground) -> Iterator[_Stand]:
    """Yield the things of one rule for which there is room, and occupy the ground; grass occupies none."""
    draws = uniform(_SEED, 8 * stream + np.arange(6)[:, None], np.arange(rule.tries)[None, :])
    u, v, chance, which, turn, size = draws
    x = rule.x_range[0] + (rule.x_range[1] - rule.x_range[0]) * u
    y = rule.y_range[0] + (rule.y_range[1] - rule.y_range[0]) * v
    kept = np.flatnonzero(chance < rule.where(x, y))
    x, y = x[kept], y[kept]
    weights = np.cumsum([np.broadcast_to(weight, x.shape) for weight in rule.weights(x, y)], axis=0)
    numbers = np.minimum((weights < which[kept] * weights[-1]).sum(axis=0), len(weights) - 1)
    scales = rule.scales[0] + (rule.scales[1] - rule.scales[0]) * size[kept]
    columns = (column.tolist() for column in (numbers, x, y, 360.0 * turn[kept], scales))
    for number, px, py, heading, scale in zip(*columns, strict=True):
        name = rule.species[number]
        species = SPECIES[name]
        foot, crown = species.foot * scale, species.crown * scale
        away = math.hypot(px - CAMERA[0], py - CAMERA[1])
        if ground.room(px, py) < foot + rule.gap or not 62.0 + crown < away < 492.0 - crown:
            continue
        if species.kind != "grass":
            ground.take(px, py, foot)
        yield name, px, py, heading, scale


def _settle(stands: list[_Stand]) -> tuple[Placement, ...]:
    """Put things on the ground, with the depth and tilt of their species."""
    kinds = [SPECIES[stand[0]] for stand in stands]
    x, y = np.array([stand[1:3] for stand in stands]).T
    turns = [math.radians(stand[3]) for stand in stands]
    cos, sin = np.array([math.cos(turn) for turn in turns]), np.array([math.sin(turn) for turn in turns])
    # the heading turns +X into (cos, sin) and +Y into (-sin, cos)
    rise_x, middle = _lie(x, y, cos, sin, np.array([kind.length for kind in kinds]))
    rise_y, _ = _lie(x, y, -sin, cos, np.ones(len(kinds)))
    columns = (column.tolist() for column in (middle, rise_x, rise_y))
    placed = []
    for (species, px, py, heading, scale), kind, height, along_x, along_y in zip(
        stands, kinds, *columns, strict=True
    ):
        pitch = math.degrees(math.atan(kind.tilt * along_y))
        roll = -math.degrees(math.atan(kind.tilt * along_x))
        placed.append(Placement(species, px, py, height - kind.sink * scale, heading, pitch, roll, scale))
    return tuple(placed)


def _lie(x: Float64, y: Float64, dx: Float64, dy: Float64, length: Float64) -> tuple[Float64, Float64]:
    """Return slope and height at the middle of sticks that lie on the ground along (dx, dy)."""
    t = 0.5 * length * np.array([[-1.0], [0.0], [1.0]])
    low, middle, high = ground_height(x + t * dx, y + t * dy)
    return (high - low) / length, np.minimum(middle, 0.5 * (low + high))
