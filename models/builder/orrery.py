"""An orrery: six planets on brass arms, driven by toothed wheels, under a gilded sun."""

from __future__ import annotations

import math

import numpy as np
from gltf_writer import Gltf, turn, y_up

from builder.gltf_parts import primitive
from builder.noise import fractal, solid
from builder.orrery_bodies import PAINTED, rocky, saturns_ring, sun
from builder.rounding import rounded
from builder.solids import (
    arc,
    around,
    ball,
    circle,
    join,
    lathe,
    piece,
    rectangle,
    sweep,
)

LOOP = 48.0
"""Seconds after which everything is where it was."""
MODULE = 0.034
"""Size of a tooth: a wheel of n teeth has the radius n * MODULE / 2."""
TEETH = 60
"""Teeth of two wheels that meet: both shafts are the same distance apart for all pairs."""
SHAFT_TURNS = 12
"""Turns of the shaft in a loop; a wheel of n teeth on the column turns SHAFT_TURNS * (60 - n) / n times."""
SIZE = 4.0
"""No mesh reaches further: the file's unit, so that positions fit into shorts."""
PLANE, FLOOR = 3.05, 1.62
"""Height of the planets, and of the lowest arm."""
PLANETS = (
    # name, teeth on the column, arm, radius, where it starts in degrees
    ("mercury", 20, 0.50, 0.085, 200.0),
    ("venus", 30, 0.75, 0.125, 75.0),
    ("earth", 36, 1.16, 0.150, -112.0),
    ("mars", 40, 1.58, 0.115, 135.0),
    ("jupiter", 45, 1.99, 0.270, 222.0),
    ("saturn", 48, 2.66, 0.200, 0.0),
)
WHEELS = (30, 48)
"""Those of the wheels on the column that are seen; the others turn inside it."""
MOON, MOON_TURNS = 0.48, 32
"""The moon's arm, in halves of a decimetre, and its turns about the earth in a loop."""


def orrery():
    """The file. It is made in decimetres; a node above all makes metres of them."""
    gltf = Gltf()
    made = _Parts(gltf)
    root = gltf.node("orrery", scale=(0.1 * SIZE,) * 3)
    gltf.node("stand", root, mesh=made.mesh("stand", [(_stand(), "walnut"), (_fittings(), "brass")]))
    gltf.node("dial", root, mesh=made.mesh("dial", [(_dial(), "enamel"), (_ticks(), "steel")]))
    cradle = made.mesh("cradle", [(_cradle(), "brass")])
    for k, degrees in enumerate((45.0, 135.0, 225.0, 315.0)):
        mirrored = (-1.0, 1.0, 1.0) if k % 2 else None
        gltf.node(f"cradle {k}", root, mesh=cradle, rotation=turn((0, 1, 0), degrees), scale=mirrored)
    gltf.node("horizon", root, mesh=made.mesh("horizon", [(_horizon(), "brass"), (_degrees(), "steel")]))
    gltf.node("sun", root, mesh=made.mesh("sun", [(sun(), "gilt")], 75.0), translation=_up(PLANE))
    channels = [*_wheels(gltf, made, root), *_planets(gltf, made, root)]
    gltf.animation(channels, "clockwork")
    return gltf


class _Parts:
    """The materials, and meshes of pieces."""

    def __init__(self, gltf):
        self.gltf = gltf
        self.materials = {
            "brass": gltf.material("brass", (0.80, 0.52, 0.19, 1.0), metallic=1.0, roughness=0.40),
            "steel": gltf.material("blued steel", (0.055, 0.065, 0.11, 1.0), metallic=1.0, roughness=0.35),
            "walnut": gltf.material("walnut", (1.0, 1.0, 1.0, 1.0), roughness=0.42),
            "enamel": gltf.material("enamel", (0.86, 0.83, 0.75, 1.0), roughness=0.25),
            "planets": gltf.material("painted ivory", (1.0, 1.0, 1.0, 1.0), roughness=0.45),
            "gilt": gltf.material(
                "gilt", (0.90, 0.50, 0.10, 1.0), metallic=1.0, roughness=0.35, emission=(0.24, 0.09, 0.01)
            ),
        }
        self.meshes = {}

    def mesh(self, name, parts, angle=50.0):
        if name not in self.meshes:
            pieces = [
                primitive(self.gltf, part, self.materials[kind], angle, size=SIZE) for part, kind in parts
            ]
            self.meshes[name] = self.gltf.mesh(pieces, name)
        return self.meshes[name]


def _up(z, x=0.0):
    """glTF's translation to a place at a height, in the file's unit."""
    return tuple(rounded(y_up((x, 0.0, z)) / SIZE, 6))


def _course(turns, start=0.0):
    """Times and rotations about the vertical, a key for each third of a turn."""
    keys = 3 * abs(turns)
    degrees = start + np.linspace(0.0, 360.0 * turns, keys + 1)
    rotations = turn((0, 1, 0), degrees)
    return np.linspace(0.0, LOOP, keys + 1), rotations


def _wheels(gltf, made, root):
    """Wheels on the column and on the shaft beside it; returns their channels."""
    shaft = gltf.node("shaft", root, translation=_up(0.0, TEETH * MODULE / 2.0))
    gltf.node("shaft rod", shaft, mesh=made.mesh("rod", [(_rod(), "brass")]), **_rod_placed(0.42, 1.5, 1.6))
    channels = []
    for k, teeth in enumerate(WHEELS):
        height = 0.74 + 0.40 * k
        other = TEETH - teeth
        wheel = gltf.node(f"wheel of {teeth}", root, translation=_up(height), mesh=_wheel_mesh(made, teeth))
        # half a tooth aside, so that teeth meet gaps
        channels.append((wheel, "rotation", *_course(SHAFT_TURNS * other // teeth)))
        pinion = gltf.node(
            f"pinion of {other}", shaft, translation=_up(height), mesh=_wheel_mesh(made, other)
        )
        start = 180.0 + 180.0 / other
        channels.append((pinion, "rotation", *_course(-SHAFT_TURNS, start)))
    return channels


def _wheel_mesh(made, teeth):
    return made.mesh(f"wheel of {teeth}", [(_wheel(teeth), "brass")], 30.0)


def _planets(gltf, made, root):
    """Arms with their planets; returns their channels."""
    rod = made.mesh("rod", [(_rod(), "brass")])
    hub = made.mesh("hub", [(_hub(), "brass")], 30.0)
    weight = made.mesh("weight", [(_weight(), "brass")])
    moon = None
    channels = []
    for k, (name, teeth, reach, radius, start) in enumerate(reversed(PLANETS)):
        height = FLOOR + 0.17 * k
        arm = gltf.node(
            f"{name} arm", root, translation=_up(height), rotation=turn((0, 1, 0), start), mesh=hub
        )
        turns = SHAFT_TURNS * (TEETH - teeth) // teeth
        channels.append((arm, "rotation", *_course(turns, start)))
        back = 0.30 + 0.12 * reach
        along = turn((0, 0, 1), -90.0)
        gltf.node(f"{name} rod", arm, mesh=rod, rotation=along, scale=(1.0, reach, 1.0))
        gltf.node(f"{name} tail", arm, mesh=rod, rotation=turn((0, 0, 1), 90.0), scale=(0.8, back, 0.8))
        size = 0.55 + 0.2 * reach
        gltf.node(f"{name} weight", arm, mesh=weight, translation=_up(0.0, -back), scale=(size, size, size))
        stem = gltf.node(f"{name} stem", arm, translation=_up(0.0, reach))
        rise = PLANE - height
        gltf.node(f"{name} stem rod", stem, mesh=rod, scale=(0.75, rise, 0.75))
        gltf.node(f"{name} collar", stem, mesh=weight, scale=(0.5, 0.5, 0.5))
        body = gltf.node(name, stem, translation=_up(rise), mesh=_planet_mesh(made, name))
        gltf.json["nodes"][body]["scale"] = [radius] * 3
        if name == "saturn":
            gltf.json["nodes"][body]["rotation"] = turn((1, 0, 0.4), 22.0).tolist()
        if name == "earth":
            moon = gltf.node("moon arm", stem, translation=_up(rise - 0.26), mesh=hub, scale=(0.5, 0.5, 0.5))
            channels.append((moon, "rotation", *_course(MOON_TURNS)))
            gltf.node("moon rod", moon, mesh=rod, rotation=along, scale=(0.6, MOON, 0.6))
            gltf.node("moon stem", moon, mesh=rod, translation=_up(0.0, MOON), scale=(0.6, 0.52, 0.6))
            grey = made.mesh("moon", [(rocky(700, (0.50, 0.49, 0.47), (0.26, 0.25, 0.25)), "planets")])
            gltf.node("moon", moon, mesh=grey, translation=_up(0.52, MOON), scale=(0.09, 0.09, 0.09))
    return channels


def _planet_mesh(made, name):
    body = PAINTED[name]()
    parts = [(body, "planets")]
    if name == "saturn":
        parts[0] = (join(body, saturns_ring()), "planets")
    return made.mesh(name, parts)


# --- the stand


def _stand():
    """A turned foot of walnut."""
    profile = [
        (0.0, 0.10),
        *arc((1.77, 0.17), 0.07, -90.0, 60.0, 4),
        *arc((1.72, 0.30), 0.10, 240.0, 150.0, 3),
        *arc((1.58, 0.43), 0.03, 0.0, 90.0, 2),
        (1.48, 0.46),
        (0.0, 0.46),
    ]
    return lathe(profile, 60).painted(_grain)


def _grain(points):
    """Streaks along the board, and rings across them."""
    along = points * (0.25, 1.0, 1.0)
    wander = 0.16 * fractal(along, 41, 1.3, 3)
    rings = 0.5 + 0.5 * np.sin(26.0 * (points[:, 1] + 0.35 * points[:, 2] + wander))
    pores = 0.5 + 0.5 * solid(points * (1.0, 9.0, 9.0), 44, 0.5)
    tone = 0.25 + 0.5 * rings + 0.25 * pores
    light, dark = np.array((0.255, 0.118, 0.052)), np.array((0.088, 0.037, 0.017))
    return dark + (light - dark) * tone[:, None]


def _fittings():
    """Feet, bearings, pillars with the bridge that they carry, and the column."""
    foot = lathe([(0.12, 0.0), *arc((0.12, 0.07), 0.07, -60.0, 60.0, 3), (0.06, 0.14)], 12)
    feet = around(foot.moved(1.42), 4, 45.0)
    bearing = lathe([(0.24, 0.46), (0.24, 0.51), (0.22, 0.53), (0.05, 0.53)], 20)
    bearings = join(bearing, bearing.scaled(0.7, 0.7, 1.0).moved(TEETH * MODULE / 2.0))
    pillar = [
        *arc((0.07, 0.50), 0.04, -70.0, 60.0, 3),
        (0.04, 0.58),
        (0.034, 0.95),
        (0.04, 1.34),
        (0.11, 1.40),
        (0.11, 1.51),
        *arc((0.0, 1.56), 0.06, -50.0, 60.0, 3),
        (0.0, 1.62),
    ]
    pillars = join(*(lathe(pillar, 12).moved(x, y) for x, y in _PILLARS))
    column = [
        (0.10, 0.53),
        (0.10, FLOOR - 0.10),
        (0.085, FLOOR - 0.08),
        (0.085, PLANE - 0.62),
        *arc((0.085, PLANE - 0.56), 0.05, -80.0, 80.0, 3),
        (0.05, PLANE - 0.48),
        (0.05, PLANE - 0.25),
    ]
    return join(feet, bearings, pillars, lathe(column, 16), _bridge())


_PILLARS = ((-0.98, 0.55), (-0.98, -0.55), (1.42, 0.82), (1.42, -0.82))


def _bridge():
    """The upper plate: flat bars from the column to the pillars, and to the shaft's jewel."""
    shaft = TEETH * MODULE / 2.0
    flat = rectangle(0.055, 0.15, 0.015)
    bars = [
        sweep([(x, y, 1.47), (0.0, 0.0, 1.47)], flat, upright=(0.0, 0.0, 1.0))
        for x, y in (*_PILLARS, (shaft, 0.0))
    ]
    boss = lathe([(0.0, 1.43), (0.26, 1.43), (0.26, 1.50), (0.24, 1.52), (0.0, 1.52)], 24)
    return join(*bars, boss, boss.scaled(0.5, 0.5, 1.0).moved(shaft))


def _dial():
    """A ring of enamel around the wheels, sunk in the foot."""
    return lathe([*arc((1.47, 0.47), 0.012, 0.0, 90.0, 2), (1.22, 0.482), (1.21, 0.47)], 72)


def _ticks():
    """A mark for each of 72, every sixth a long one, raised."""
    marks = []
    for k in range(72):
        long = k % 6 == 0
        x, y = (0.17, 0.026) if long else (0.07, 0.012)
        marks.append(_slip(x, y, 0.006).moved(1.445 - x / 2.0, 0.0, 0.482).turned((0, 0, 1), 5.0 * k))
    return join(*marks)


def _slip(x, y, z):
    """A rectangle that floats at a height: an engraved mark."""
    a, b = x / 2.0, y / 2.0
    return piece([(-a, -b, z), (a, -b, z), (a, b, z), (-a, b, z)], [(0, 1, 2), (0, 2, 3)])


# --- the cradle and the horizon

RIM = 3.15
RIM_HEIGHT = 2.35


def _cradle():
    """A rib that curves from the foot up to the horizon, with a scroll at one side."""
    t = np.linspace(0.0, 1.0, 15)
    angle = np.radians(-90.0 + 90.0 * t)
    x = 1.66 + (RIM - 0.05 - 1.66) * np.cos(angle)
    z = 0.33 + (RIM_HEIGHT - 0.33) * (1.0 + np.sin(angle))
    rib = sweep(
        np.stack([x, 0.0 * t, z], axis=1),
        rectangle(0.085, 0.055, 0.02),
        1.15 - 0.45 * t,
        upright=(0.0, 0.0, 1.0),
    )
    s = np.linspace(0.0, 1.0, 21)
    spin = np.radians(150.0 - 560.0 * s)
    size = 0.30 * (1.0 - 0.80 * s)
    middle = np.array((2.36, 0.0, 0.98))
    scroll = middle + np.stack([size * np.cos(spin), 0.10 * s, size * np.sin(spin)], axis=1)
    curl = sweep(scroll, circle(0.036, 8), 1.0 - 0.45 * s)
    return join(rib, curl, ball(0.062, 6, 12).moved(*scroll[-1]))


def _horizon():
    """The ring around it all."""
    low, high = RIM_HEIGHT - 0.06, RIM_HEIGHT + 0.06
    inner, outer = RIM - 0.08, RIM + 0.08
    ring = [
        (inner, low),
        (outer, low),
        *arc((outer, RIM_HEIGHT), 0.06, -90.0, 90.0, 3),
        (inner, high),
        (inner, low),
    ]
    return lathe(ring, 72)


def _degrees():
    marks = []
    for k in range(72):
        x, y = (0.11, 0.03) if k % 6 == 0 else (0.05, 0.014)
        marks.append(_slip(x, y, 0.006).moved(RIM, 0.0, RIM_HEIGHT + 0.06).turned((0, 0, 1), 5.0 * k))
    return join(*marks)


# --- moving parts


def _rod():
    """A rod of length 1 upwards, a little thinner at its end."""
    return sweep([(0.0, 0.0, 0.0), (0.0, 0.0, 1.0)], circle(0.038, 10), [1.0, 0.72])


def _rod_placed(low, high, thick):
    return {"translation": _up(low), "scale": (thick, high - low, thick)}


def _hub():
    profile = [
        (0.09, -0.07),
        (0.15, -0.07),
        (0.165, -0.05),
        (0.165, -0.03),
        (0.13, -0.015),
        (0.13, 0.015),
        (0.165, 0.03),
        (0.165, 0.05),
        (0.15, 0.07),
        (0.09, 0.07),
    ]
    return lathe(profile, 24)


def _weight():
    """A turned knob about the end of a rod."""
    profile = [(0.0, -0.11), *arc((0.0, 0.0), 0.11, -70.0, 70.0, 8), (0.0, 0.11)]
    return lathe(profile, 16)


def _bar(start, end, width, height):
    """A plain bar along X without ends."""
    return sweep([(start, 0.0, 0.0), (end, 0.0, 0.0)], rectangle(width, height, 0.0)[[0, 1, 3, 5]])


def _wheel(teeth):
    """A spoked wheel with a tooth at angle 0, from -0.05 to 0.05."""
    radius = teeth * MODULE / 2.0
    tip, root, rim = radius + 0.85 * MODULE, radius - 1.05 * MODULE, radius - 0.11
    spoked = rim > 0.22
    rim = rim if spoked else 0.06
    pitch = 2.0 * math.pi / teeth
    steps = np.array((-0.5, -0.17, 0.17)) * pitch
    reach = np.array((root, tip, tip))
    angle = (np.arange(teeth)[:, None] * pitch + steps).reshape(-1)
    outline = np.tile(reach, teeth)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    inner_angle = (np.arange(teeth) - 0.5) * pitch
    inner = rim * np.stack([np.cos(inner_angle), np.sin(inner_angle)], axis=1)
    n, half = 3 * teeth, 0.05
    flat = np.concatenate([outline, inner])
    points = np.concatenate([np.c_[flat, np.full(len(flat), z)] for z in (-half, half)])
    upper = n + teeth
    tooth = np.arange(teeth)
    here, there = n + tooth, n + (tooth + 1) % teeth
    valley, rise, fall = (3 * tooth + k for k in range(3))
    following = 3 * ((tooth + 1) % teeth)
    corners = ((valley, rise, here), (rise, fall, here), (fall, there, here), (fall, following, there))
    face = np.concatenate([np.stack(three, axis=1) for three in corners])
    k = np.arange(n)
    k1 = (k + 1) % n
    wall = np.concatenate([np.stack([k, k1, k1 + upper], 1), np.stack([k, k1 + upper, k + upper], 1)])
    hole = np.concatenate(
        [np.stack([there, here, here + upper], 1), np.stack([there, here + upper, there + upper], 1)]
    )
    made = [piece(points, np.concatenate([face + upper, face[:, ::-1], wall, hole]))]
    if spoked:
        spoke = _bar(0.10, rim + 0.03, 0.075, 0.06)
        made.append(around(spoke, 5, 18.0))
    made.append(
        lathe([(0.06, -0.08), (0.13, -0.08), (0.15, -0.06), (0.15, 0.06), (0.13, 0.08), (0.06, 0.08)], 18)
    )
    return join(*made)
