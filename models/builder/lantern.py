"""A wrought-iron lantern at night on a mossy slice of a trunk, with fireflies around it."""

from __future__ import annotations

import math

import numpy as np
from gltf_writer import Gltf, turn, y_up

from builder.bark import end_grain, furrowed
from builder.bonsai_paints import moss
from builder.canvas import Canvas, opaque
from builder.gltf_parts import jpeg, primitive
from builder.noise import fractal, smooth, solid, spectral
from builder.randomness import Random
from builder.solids import Piece, arc, ball, circle, grid, join, lathe, rectangle, sweep

SIZE = 5.0
"""No mesh reaches further: the file's unit, so that positions fit into shorts."""
TOP = 0.55
"""Height of the cut face on which the lantern stands; all lengths are in decimetres."""
LOW, HIGH = TOP + 0.42, TOP + 2.05
"""The panes' lower and upper edges."""
EAVES = HIGH + 0.03
VENT = EAVES + 0.72
CORNER = 0.82
"""Distance of the posts from the axis."""
FLAME = (1.0, 0.58, 0.22)
LOOP = 8.0
"""Seconds after which the fireflies are where they were."""


def lantern():
    """The file. It is made in decimetres; a node above all makes metres of them."""
    gltf = Gltf()
    made = _Materials(gltf)
    root = gltf.node("lantern", scale=(0.1 * SIZE,) * 3)
    log = gltf.node("log", root, mesh=made.mesh("log", (_log_side(), "bark"), (_log_face(), "cut wood")))
    gltf.node("moss", log, mesh=made.mesh("moss", (_moss(), "moss")))
    gltf.node("mushrooms", log, mesh=made.mesh("mushrooms", (_mushrooms(), "mushroom")))
    cage = gltf.node("cage", root, mesh=made.mesh("cage", (_cage(), "iron"), (_brass(), "brass")))
    side = made.mesh("side", (_side(), "iron"), (_rivets(), "brass"))
    pane = made.mesh("pane", (_pane(), "glass"))
    for k in range(6):
        gltf.node(f"side {k}", cage, mesh=side, rotation=turn((0, 1, 0), 60.0 * k))
        # every second one is its mirror image, two places on
        mirrored = (-1.0, 1.0, 1.0) if k % 2 else None
        gltf.node(f"pane {k}", cage, mesh=pane, rotation=turn((0, 1, 0), 60.0 * k), scale=mirrored)
    flame = gltf.light("point", FLAME, 0.32, "flame")
    gltf.node("flame", cage, light=flame, translation=_at(0.0, 0.0, 0.55 * LOW + 0.45 * HIGH))
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
        face = gltf.texture(gltf.image(jpeg(opaque(end_grain(830, 256))), "cut wood"))
        cushions = gltf.texture(gltf.image(jpeg(moss(840), 80), "moss"))
        glow = gltf.texture(gltf.image(jpeg(painted_glass(850), 88), "painted glass"))
        self.textured = {"bark", "cut wood", "moss", "glass"}
        self.known = {
            "iron": gltf.material("wrought iron", (0.115, 0.105, 0.10, 1.0), metallic=1.0, roughness=0.48),
            "brass": gltf.material("brass", (0.60, 0.34, 0.09, 1.0), metallic=1.0, roughness=0.30),
            "glass": gltf.material(
                "painted glass",
                (0.30, 0.16, 0.06, 1.0),
                roughness=0.20,
                emission=(1.0, 1.0, 1.0),
                emission_texture=glow,
                strength=2.3,
            ),
            "bark": gltf.material("bark", texture=gltf.slot(bark, scale=[5.0, 1.0]), roughness=0.95),
            "cut wood": gltf.material("cut wood", texture=face, roughness=0.85),
            "moss": gltf.material("moss", texture=gltf.slot(cushions, scale=[5.0, 5.0]), roughness=1.0),
            "mushroom": gltf.material("mushroom", roughness=0.55),
            "firefly": gltf.material("firefly", roughness=0.5),
            "lamp": gltf.material(
                "firefly's lamp", (0.4, 0.5, 0.1, 1.0), emission=(0.72, 1.0, 0.22), strength=2.2
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
    return tuple(np.round(y_up((x, y, z)) / SIZE, 6))


# --- light, camera, fireflies


def _moonlight(gltf):
    """Cold light from behind, and a little from the front; a light shines along its node's -Z."""
    for name, strength, heading, pitch in (("moon", 1.1, 205.0, -38.0), ("sky", 0.34, 20.0, -24.0)):
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
        fly = gltf.node(f"firefly {k}", root, mesh=body, translation=tuple(np.round(places[0], 6)))
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


# --- the slice of wood


def _log_side():
    bulge = [(2.42, 0.0), (2.50, 0.10), (2.50, 0.38), (2.44, TOP - 0.05), (2.38, TOP)]
    return lathe(bulge, 72).bent(_lobed)


def _log_face():
    """The cut face; its texture is laid on from above."""
    face = lathe([(r, TOP) for r in (2.38, 1.6, 0.8, 0.0)], 72)
    flat = 0.5 + 0.5 * face.points[:, :2] / 2.45
    return Piece(face.points, face.triangles, flat, face.colors).bent(_lobed)


def _lobed(points):
    """Not quite round, as trees are."""
    angle = np.arctan2(points[:, 1], points[:, 0])
    grown = 1.0 + 0.035 * np.sin(3.0 * angle + 0.6) + 0.02 * np.sin(7.0 * angle + 2.0)
    return points * np.stack([grown, grown, np.ones_like(grown)], axis=1)


def _moss():
    """Cushions on the face, and one that hangs over the edge."""
    random = Random(860)
    cushions = []
    for x, y, size in (
        (-1.25, -1.25, 0.62),
        (-1.72, -0.75, 0.50),
        (-0.72, -1.62, 0.42),
        (1.62, -0.95, 0.40),
        (1.30, 1.25, 0.60),
        (-1.40, 1.30, 0.55),
        (1.95, -0.45, 0.30),
    ):
        dome = lathe([(1.0, -0.10), (0.97, 0.05), *arc((0.0, 0.0), 1.0, 22.0, 90.0, 4)], 18)
        seed = random.below(1000)

        def swell(points, seed=seed):
            return points * (1.0 + 0.20 * fractal(points, seed, 0.8, 3))[:, None]

        cushion = dome.bent(swell).scaled(size, size * 0.85, size * 0.34)
        cushions.append(cushion.turned((0, 0, 1), 360.0 * random.units(1)[0]).moved(x, y, TOP - 0.01))
    whole = join(*cushions)
    flat = whole.points[:, :2] / 5.0 + 0.5
    deep = whole.painted(lambda points: 0.45 + 0.55 * smooth(TOP - 0.04, TOP + 0.16, points[:, 2]))
    return Piece(deep.points, deep.triangles, np.clip(flat, 0.0, 1.0), deep.colors)


def _mushrooms():
    """A family of small ones in the moss."""
    grown = []
    for x, y, height, lean in (
        (-1.42, -1.05, 0.62, 9.0),
        (-1.22, -1.38, 0.44, -12.0),
        (-1.62, -1.22, 0.36, 14.0),
        (1.66, -1.02, 0.40, -8.0),
    ):
        stem = sweep([(0, 0, 0), (0.02, 0, 0.5), (0, 0, 1.0)], circle(0.075, 8), [1.25, 0.9, 0.8])
        stem = stem.painted((0.62, 0.52, 0.38))
        cap = lathe(
            [(0.0, 0.88), (0.20, 0.86), (0.33, 0.80), *arc((0.0, 0.72), 0.36, 14.0, 90.0, 5)], 16
        ).painted(lambda points: _cap_tone(points))
        whole = join(stem, cap).scaled(0.8 * height + 0.1, 0.8 * height + 0.1, height)
        grown.append(whole.turned((1, 0.4, 0), lean).moved(x, y, TOP + 0.06))
    return join(*grown)


def _cap_tone(points):
    """Red-brown above, pale gills below and a pale rim."""
    upper = smooth(0.80, 0.84, points[:, 2])[:, None]
    rim = smooth(0.30, 0.36, np.hypot(points[:, 0], points[:, 1]))[:, None] * 0.5
    top = np.array((0.50, 0.115, 0.035)) * (1.0 - rim) + np.array((0.68, 0.40, 0.20)) * rim
    return np.array((0.50, 0.38, 0.26)) * (1.0 - upper) + top * upper


# --- the lantern


def _cage():
    """Foot, posts, frames, roof and ring of iron, a little uneven in colour."""
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
            (0.0, LOW),
        ]
    )
    return join(foot, _roof(), _ring()).painted(_worn)


def _side():
    """A sixth of what repeats: the post on +X with its foot, scroll and ridge, and the frame beside it."""
    foot = ball(0.11, 6, 12).scaled(1.0, 1.0, 0.8).moved(0.88, 0.0, TOP + 0.07)
    post = _upright(CORNER, LOW - 0.02, HIGH + 0.05, rectangle(0.11, 0.11, 0.022))
    slat = _upright(0.27, VENT - 0.02, VENT + 0.24, rectangle(0.06, 0.05, 0.012))
    slope = np.array([(radius, 0.0, z + 0.012) for radius, z in _slope()])
    ridge = sweep(slope, circle(0.036, 6), np.linspace(1.2, 0.8, len(slope)))
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
    return ring.turned((1, 0, 0), 16.0).turned((0, 0, 1), 20.0).moved(0.0, -0.06, HIGH + 1.73)


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
    curl = sweep(scroll, circle(0.028, 6), 1.0 - 0.35 * s)
    s = np.linspace(0.0, 1.0, 8)
    tail = np.stack([0.885 + 0.20 * s**2, 0.0 * s, HIGH - 0.85 + 0.89 * s], axis=1)
    knob = ball(0.045, 5, 8).moved(*scroll[-1])
    return join(curl, knob, sweep(tail, circle(0.028, 6)))


def _pane():
    """A pane whose middle is on +X, seen from outside; it stands behind its bars."""
    place = CORNER * math.cos(math.pi / 6.0) - 0.035
    half = 0.5 * CORNER - 0.03
    corners = [[(place, -half, LOW), (place, half, LOW)], [(place, -half, HIGH), (place, half, HIGH)]]
    return grid(np.array(corners)).turned((0, 0, 1), 30.0)


def log_bark(seed):
    """Oak's bark, whose texture goes five times around the log."""
    fine = furrowed(seed, (512, 1024), (0.30, 0.23, 0.17), (0.07, 0.05, 0.04), (4, 12))
    return opaque(fine.reshape(128, 4, 256, 4, 3).mean((1, 3)))


def painted_glass(seed, shape=(384, 192)):
    """The light of a flame through amber glass with grasses painted on it, as emission."""
    random = Random(seed)
    height, width = shape
    canvas = Canvas(2 * width, 2 * height, (0.0, 0.0, 0.0))
    reach = height / width
    for k in range(15):
        x, lean = random.between(0.02, 0.98), random.around(0.0, 0.30)
        tall = reach * random.between(0.16, 0.52)
        s = np.linspace(0.0, 1.0, 9)
        stalk = [np.array((x + lean * t * t * tall, tall * t)) for t in s]
        canvas.twig(stalk, 0.011 * (1.0 - 0.8 * s), (0, 0, 0))
        if k % 3 == 0:
            for j in range(7):
                at = stalk[8] * (1.0 - 0.05 * j) + stalk[5] * 0.05 * j
                side = 1.0 if j % 2 else -1.0
                canvas.leaf(
                    at[0],
                    at[1],
                    math.pi / 2.0 - side * 0.7,
                    0.07,
                    lambda t: 0.22 * np.sin(np.pi * t),
                    (0, 0, 0),
                )
        elif k % 3 == 1:
            for j in range(8):
                at = stalk[j]
                for side in (1.0, -1.0):
                    size = 0.13 * (1.0 - 0.09 * j)
                    outline = _frond
                    canvas.leaf(at[0], at[1], math.pi / 2.0 - lean - side * 1.05, size, outline, (0, 0, 0))
    cover = canvas.alpha.reshape(height, 2, width, 2).mean((1, 3))
    y = reach * (height - 0.5 - np.arange(height)[:, None]) / height
    x = (np.arange(width)[None, :] + 0.5) / width
    away = np.hypot((x - 0.5) * 1.1, (y - 0.42 * reach) * 0.72)
    cloud = 1.0 + 0.10 * spectral(shape, seed + 1, (20, 160), 1.1)
    glow = (0.14 + 1.0 * np.exp(-((away / 0.42) ** 2))) * cloud
    flame = np.exp(-(((x - 0.5) / 0.055) ** 2) - ((y - 0.44 * reach) / 0.17) ** 2)
    color = glow[..., None] * np.array((0.95, 0.36, 0.06)) + 0.6 * flame[..., None] * np.array(
        (1.0, 0.8, 0.45)
    )
    color = color * (1.0 - 0.93 * cover[..., None])
    for _ in range(6):
        px, py = random.between(0.12, 0.88), reach * random.between(0.45, 0.85)
        spark = np.exp(-(((x - px) ** 2 + (y - py) ** 2) / 0.016**2))
        color = color + spark[..., None] * np.array((0.75, 1.0, 0.25))
    return opaque(np.clip(color, 0.0, 1.0))


def _frond(t):
    """Half the width of a leaflet."""
    return 0.16 * np.sin(np.pi * np.clip(t, 0.0, 1.0) ** 0.8)
