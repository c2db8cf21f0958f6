"""A wrought-iron lantern at night on a mossy slice of a trunk, with fireflies around it."""

from __future__ import annotations

import math

import numpy as np
from gltf_writer import Gltf, turn, y_up

from builder.bark import end_grain
from builder.bonsai_paints import moss
from builder.canvas import opaque
from builder.gltf_parts import jpeg, png, primitive
from builder.lantern_log import TOP, log_face, log_side, moss_cushions, mushrooms
from builder.lantern_paints import hammered, log_bark, painted_glass, stained
from builder.noise import fractal, smooth, solid
from builder.rounding import rounded
from builder.solids import arc, ball, circle, grid, join, lathe, rectangle, sweep

SIZE = 5.0
"""No mesh reaches further: the file's unit, so that positions fit into shorts."""
LOW, HIGH = TOP + 0.42, TOP + 2.05
"""The panes' lower and upper edges."""
EAVES = HIGH + 0.03
VENT = EAVES + 0.72
CORNER = 0.82
"""Distance of the posts from the axis."""
FLAME = (1.0, 0.58, 0.22)
BURNS = 0.55 * LOW + 0.45 * HIGH
"""The height of the flame's middle."""
IRON = (0.20, 0.19, 0.185, 1.0)
LOOP = 8.0
"""Seconds after which the fireflies are where they were."""


def lantern():
    """The file. It is made in decimetres; a node above all makes metres of them."""
    gltf = Gltf()
    made = _Materials(gltf)
    root = gltf.node("lantern", scale=(0.1 * SIZE,) * 3)
    log = gltf.node("log", root, mesh=made.mesh("log", (log_side(), "bark"), (log_face(), "cut wood")))
    gltf.node("moss", log, mesh=made.mesh("moss", (moss_cushions(), "moss")))
    gltf.node("mushrooms", log, mesh=made.mesh("mushrooms", (mushrooms(), "mushroom")))
    cage = made.mesh("cage", (_cage(), "hammered iron"), (_ring(), "iron"), (_brass(), "brass"))
    cage = gltf.node("cage", root, mesh=cage)
    gltf.node("candle", cage, mesh=made.mesh("candle", (_candle(), "wax"), (_flame(), "flame")))
    side = made.mesh("side", (_side(), "iron"), (_rivets(), "brass"))
    pane = made.mesh("pane", (_pane(), "glass"))
    for k in range(6):
        gltf.node(f"side {k}", cage, mesh=side, rotation=turn((0, 1, 0), 60.0 * k))
        # every second one is its mirror image, two places on
        mirrored = (-1.0, 1.0, 1.0) if k % 2 else None
        gltf.node(f"pane {k}", cage, mesh=pane, rotation=turn((0, 1, 0), 60.0 * k), scale=mirrored)
    flame = gltf.light("point", FLAME, 0.06, "flame")
    gltf.node("flame", cage, light=flame, translation=_at(0.0, 0.0, BURNS))
    gltf.animation(_fireflies(gltf, made, root), "fireflies")
    _moonlight(gltf)
    _view(gltf)
    return gltf


class _Materials:
    """The materials by name, and meshes of pieces."""

    def __init__(self, gltf):
        self.gltf = gltf
        bark = gltf.texture(
            gltf.image(
                jpeg(log_bark(820), 80),
                "bark",
            )
        )
        face = gltf.texture(gltf.image(jpeg(opaque(1.45 * end_grain(830, 256))), "cut wood"))
        cushions = gltf.texture(gltf.image(jpeg(moss(840), 80), "moss"))
        glow = gltf.texture(gltf.image(jpeg(painted_glass(850), 88), "painted glass"))
        amber = gltf.texture(gltf.image(png(stained(850), 16), "amber"))
        dents = gltf.texture(gltf.image(jpeg(hammered(860), 80, subsampling=0), "dents"))
        self.textured = {"bark", "cut wood", "moss", "glass", "hammered iron"}
        self.known = {
            "iron": gltf.material("wrought iron", IRON, metallic=1.0, roughness=0.45),
            "hammered iron": gltf.material(
                "hammered iron",
                IRON,
                metallic=1.0,
                roughness=0.40,
                normalTexture=gltf.slot(dents, scale=[12.0, 3.0]),
            ),
            "brass": gltf.material("brass", (0.80, 0.52, 0.19, 1.0), metallic=1.0, roughness=0.36),
            "glass": gltf.material(
                "painted glass",
                texture=amber,
                roughness=0.15,
                emission=(1.0, 1.0, 1.0),
                emission_texture=glow,
                strength=3.2,
                alphaMode="BLEND",
            ),
            "wax": gltf.material("wax", (0.86, 0.74, 0.55, 1.0), roughness=0.5, emission=(0.40, 0.17, 0.04)),
            "flame": gltf.material("flame", (0.0, 0.0, 0.0, 1.0), emission=(1.0, 0.62, 0.22), strength=9.0),
            "bark": gltf.material("bark", texture=gltf.slot(bark, scale=[5.0, 1.0]), roughness=0.95),
            "cut wood": gltf.material("cut wood", texture=face, roughness=0.85),
            "moss": gltf.material("moss", texture=gltf.slot(cushions, scale=[5.0, 5.0]), roughness=1.0),
            "mushroom": gltf.material("mushroom", roughness=0.55),
            "firefly": gltf.material("firefly", roughness=0.5),
            "lamp": gltf.material(
                "firefly's lamp", (0.4, 0.5, 0.1, 1.0), emission=(0.72, 1.0, 0.22), strength=1.7
            ),
        }

    def mesh(self, name, *parts):
        pieces = [
            primitive(self.gltf, part, self.known[kind], textured=kind in self.textured, size=SIZE)
            for part, kind in parts
        ]
        return self.gltf.mesh(pieces, name)


def _at(x, y, z):
    """glTF's translation to a place, in the file's unit."""
    return tuple(rounded(y_up((x, y, z)) / SIZE, 6))


# --- light, camera, fireflies


def _moonlight(gltf):
    """Cold light from behind, and a little from the front; a light shines along its node's -Z."""
    for name, strength, heading, pitch in (("moon", 1.2, 205.0, -38.0), ("sky", 0.42, 20.0, -24.0)):
        light = gltf.light("directional", (0.50, 0.66, 1.0), strength, name)
        frame = gltf.node(f"{name} heading", rotation=turn((0, 1, 0), heading))
        gltf.node(name, frame, rotation=turn((1, 0, 0), pitch), light=light)


def _view(gltf):
    """A camera a little above, which looks at the middle; it looks along its node's -Z, too."""
    frame = gltf.node("tripod", translation=(0.0, 0.212, 0.0), rotation=turn((0, 1, 0), 14.0))
    tilt = gltf.node("tilt", frame, rotation=turn((1, 0, 0), -13.0))
    camera = gltf.camera(27.0, "view", znear=0.2, zfar=10.0)
    gltf.node("view", tilt, translation=(0.0, 0.0, 1.32), camera=camera)


def _fireflies(gltf, made, root):
    """Three insects with a light each; returns the channels of their flight."""
    body = made.mesh("firefly", (_insect(), "firefly"), (ball(0.042, 6, 10).scaled(1.0, 1.5, 1.0), "lamp"))
    glow = gltf.light("point", (0.72, 1.0, 0.22), 0.012, "firefly")
    times = np.linspace(0.0, LOOP, 33)
    channels = []
    for k, (x, y, z, size) in enumerate(
        ((-1.35, -0.85, 2.15, 0.42), (1.45, -0.55, 1.25, 0.36), (1.05, -1.1, 3.0, 0.30))
    ):
        angle = 2.0 * math.pi * (times / LOOP + 0.3 * k)
        around_it = np.stack([np.cos(angle), 0.8 * np.sin(angle), 0.5 * np.sin(2.0 * angle + k)], axis=1)
        places = y_up(np.array((x, y, z)) + size * around_it) / SIZE
        # head first: it flies along -Y of its own
        fly = gltf.node(f"firefly {k}", root, mesh=body, translation=tuple(rounded(places[0], 6)))
        gltf.node(f"firefly light {k}", fly, light=glow)
        channels.append((fly, "translation", times, places))
        ways = np.degrees(np.arctan2(np.cos(angle) * 0.8, -np.sin(angle))) + 90.0
        channels.append((fly, "rotation", times, turn((0, 1, 0), np.unwrap(ways, period=360.0))))
    return channels


def _insect():
    """Head and wing cases, in front of the lamp."""
    case = ball(0.045, 6, 10).scaled(1.0, 1.9, 0.7).moved(0.0, -0.085, 0.014)
    head = ball(0.026, 5, 8).moved(0.0, -0.175, 0.010).painted((2.2, 0.5, 0.4))
    return join(case, head).painted((0.045, 0.030, 0.020))


# --- the lantern


def _cage():
    """Foot and roof, a little uneven in colour."""
    foot = _hexagonal(
        [
            (0.0, TOP + 0.08),
            (1.00, TOP + 0.08),
            (1.05, TOP + 0.12),
            (1.05, TOP + 0.20),
            (0.98, TOP + 0.25),
            (0.90, TOP + 0.32),
            (0.90, LOW - 0.05),
            (0.87, LOW),
            (0.74, LOW),
        ]
    )
    return join(foot, _roof()).painted(_worn)


def _candle():
    """A candle on the floor of the cage, and its wick."""
    top = BURNS - 0.38
    rim = [(0.23, LOW), (0.23, top - 0.02), (0.21, top), (0.15, top - 0.03), (0.0, top - 0.05)]
    wick = [(0.018, top - 0.06), (0.016, top + 0.08), (0.0, top + 0.09)]
    return join(lathe(rim, 20), lathe(wick, 6).painted((0.08, 0.05, 0.03)))


def _flame():
    s = np.linspace(0.0, 1.0, 12)
    width = 0.078 * np.sin(math.pi * s**0.62) ** 0.9
    return lathe(np.stack([width, BURNS - 0.32 + 0.44 * s], axis=1), 14)


def _side():
    """A sixth of what repeats: the post on +X with its foot, scroll and ridge, and the frame beside it."""
    foot = ball(0.11, 6, 12).scaled(1.0, 1.0, 0.8).moved(0.88, 0.0, TOP + 0.07)
    post = _upright(CORNER, LOW - 0.02, HIGH + 0.05, rectangle(0.11, 0.11, 0.022))
    slat = _upright(0.27, VENT - 0.02, VENT + 0.24, rectangle(0.06, 0.05, 0.012))
    slope = np.array([(radius, 0.0, z + 0.012) for radius, z in _slope()])
    ridge = sweep(slope, circle(0.036, 8), np.linspace(1.2, 0.8, len(slope)))
    tip = ball(0.055, 5, 8).moved(1.25, 0.0, EAVES + 0.10)
    frame = _frame().turned((0, 0, 1), 30.0)
    return join(foot, post, slat, ridge, tip, _bracket(), frame).painted(_worn)


def _upright(x, low, high, section):
    return sweep([(x, 0.0, low), (x, 0.0, high)], section, upright=(1.0, 0.0, 0.0))


def _worn(points):
    rust = smooth(0.25, 0.8, fractal(points, 870, 0.7, 3))[:, None]
    return (0.80 + 0.20 * solid(points, 875, 0.25))[:, None] * (
        1.0 + (np.array((1.0, 0.62, 0.40)) - 1.0) * rust
    )


def _hexagonal(profile):
    """A profile turned with six flat sides, whose corners are where the posts are."""
    return lathe(profile, 6)


def _frame():
    """The bars around a pane whose middle is on +X: sill, lintel with an arch, and two thin crossbars."""
    apothem = CORNER * math.cos(math.pi / 6.0)
    half = 0.5 * CORNER - 0.02
    bar = rectangle(0.07, 0.07, 0.015)
    sill = sweep([(apothem, -half, LOW + 0.03), (apothem, half, LOW + 0.03)], bar, upright=(1, 0, 0))
    lintel = sweep([(apothem, -half, HIGH), (apothem, half, HIGH)], bar, upright=(1, 0, 0))
    s = np.linspace(0.0, 1.0, 9)
    rise = 0.30 * (1.0 - np.abs(2.0 * s - 1.0) ** 1.6)
    arch = np.stack([0.0 * s + apothem, half * (2.0 * s - 1.0), HIGH - 0.36 + rise], axis=1)
    bow = sweep(arch, rectangle(0.045, 0.045, 0.010), upright=(1, 0, 0))
    low = HIGH - 0.36
    line = sweep(
        [(apothem, -half, low), (apothem, half, low)],
        rectangle(0.035, 0.035, 0.0)[[0, 1, 3, 5]],
        upright=(1, 0, 0),
    )
    stem = sweep(
        [(apothem, 0.0, low), (apothem, 0.0, HIGH)],
        rectangle(0.035, 0.035, 0.0)[[0, 1, 3, 5]],
        upright=(1, 0, 0),
    )
    return join(sill, lintel, bow, line, stem)


def _slope():
    """(radius, height) of the roof at its corners."""
    return [(1.22 - 0.86 * s, EAVES + 0.10 + 0.62 * s**1.7) for s in np.linspace(0.0, 1.0, 7)]


def _roof():
    """A roof that sweeps up to a vent with a cap of its own."""
    roof = _hexagonal([(0.70, EAVES), (1.20, EAVES + 0.02), (1.24, EAVES + 0.05), *_slope()])
    cap = [(0.0, 0.20), (0.44, 0.20), (0.46, 0.23), (0.28, 0.36), (0.12, 0.50), (0.0, 0.52)]
    return join(roof, _hexagonal(cap).moved(0.0, 0.0, VENT))


def _ring():
    """The ring to carry it by, leaning a little to one side."""
    angle = np.linspace(0.0, 2.0 * math.pi, 33)[:-1]
    path = np.stack([0.36 * np.cos(angle), 0.0 * angle, 0.36 * np.sin(angle)], axis=1)
    ring = sweep(path, circle(0.042, 8), closed=True)
    return ring.turned((1, 0, 0), 16.0).turned((0, 0, 1), 20.0).moved(0.0, -0.06, HIGH + 1.73).painted(_worn)


def _brass():
    """The finial, and a band around the foot."""
    top = VENT + 0.50
    knob = arc((0.0, top + 0.09), 0.10, -50.0, 60.0, 6)
    finial = lathe([(0.06, top), *knob, (0.03, top + 0.20), (0.0, top + 0.205)], 16)
    band = [(0.915, -0.15), (0.93, -0.135), (0.93, -0.095), (0.915, -0.08)]
    return join(finial, _hexagonal(band).moved(0.0, 0.0, LOW))


def _rivets():
    rivet = ball(0.042, 4, 8).moved(0.885)
    return join(rivet.moved(0.0, 0.0, LOW - 0.10), rivet.moved(0.0, 0.0, HIGH + 0.02))


def _bracket():
    """A scroll under the eaves, outside a post on +X."""
    s = np.linspace(0.0, 1.0, 19)
    spin = np.radians(95.0 + 500.0 * s)
    size = 0.21 * (1.0 - 0.78 * s)
    scroll = np.stack([1.10 + size * np.cos(spin), 0.0 * s, HIGH - 0.17 + size * np.sin(spin)], axis=1)
    curl = sweep(scroll, circle(0.028, 8), 1.0 - 0.35 * s)
    s = np.linspace(0.0, 1.0, 8)
    tail = np.stack([0.885 + 0.20 * s**2, 0.0 * s, HIGH - 0.85 + 0.89 * s], axis=1)
    knob = ball(0.045, 5, 8).moved(*scroll[-1])
    return join(curl, knob, sweep(tail, circle(0.028, 8)))


def _pane():
    """A pane whose middle is on +X, seen from outside; it stands behind its bars."""
    place = CORNER * math.cos(math.pi / 6.0) - 0.035
    half = 0.5 * CORNER - 0.03
    corners = [[(place, -half, LOW), (place, half, LOW)], [(place, -half, HIGH), (place, half, HIGH)]]
    return grid(np.array(corners)).turned((0, 0, 1), 30.0)
