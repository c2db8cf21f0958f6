"""A bonsai: a maple in autumn, in a glazed bowl on a stand."""

from __future__ import annotations

import math

import numpy as np
from gltf_writer import Gltf, turn, y_up

from builder.bonsai_paints import LAST, bark, glaze, maple_leaves, moss
from builder.branching import Branch, curve, taper
from builder.foliage import CELLS
from builder.gltf_parts import jpeg, png, primitive
from builder.noise import fractal, smooth, solid
from builder.randomness import Random
from builder.rounding import rounded
from builder.solids import arc, block, join, lathe
from builder.surface import Surface, add_card, add_tube, unit

OVAL = (1.72, 1.20)
"""Half lengths of the bowl's rim, in decimetres; pieces are turned round and then made oval."""
SIZE = 4.5
"""No mesh reaches further: the file's unit, so that positions fit into shorts."""
SOIL = 1.03
"""Height of the soil's edge."""
PADS = (
    # share of the trunk, direction in degrees, length of the branch, its rise, half width of the leaves
    (0.34, 8.0, 1.75, 0.10, (0.92, 0.74, 0.36)),
    (0.42, 196.0, 1.35, 0.12, (0.80, 0.66, 0.33)),
    (0.52, 92.0, 1.05, 0.15, (0.74, 0.70, 0.32)),
    (0.58, 318.0, 1.15, 0.18, (0.70, 0.60, 0.30)),
    (0.66, 158.0, 1.00, 0.25, (0.68, 0.58, 0.29)),
    (0.76, 28.0, 0.86, 0.30, (0.64, 0.56, 0.28)),
    (0.82, 250.0, 0.70, 0.35, (0.58, 0.54, 0.27)),
)
CROWN = (0.80, 0.70, 0.44)


def bonsai():
    """The file. It is made in decimetres; a node above all makes metres of them."""
    gltf = Gltf()
    wood, green = _tree(Random(900))
    leaves = gltf.texture(gltf.image(png(maple_leaves(910), 96), "maple leaves"))
    skin = gltf.texture(gltf.image(jpeg(bark(920), 78), "bark"))
    cushions = gltf.texture(gltf.image(jpeg(moss(930), 80), "moss"))
    celadon = gltf.texture(gltf.image(jpeg(glaze(940), 82), "glaze"))
    materials = {
        "wood": gltf.material("bark", texture=skin, roughness=0.9),
        "leaves": gltf.material(
            "maple leaves", texture=leaves, roughness=0.6, alphaMode="MASK", alphaCutoff=0.5, doubleSided=True
        ),
        "moss": gltf.material("moss", texture=gltf.slot(cushions, scale=[5.0, 5.0]), roughness=1.0),
        "glaze": gltf.material("celadon", texture=gltf.slot(celadon, scale=[4.0, 1.0]), roughness=0.22),
        "stand": gltf.material("rosewood", roughness=0.38),
        "stone": gltf.material("stone", roughness=0.85),
    }
    root = gltf.node("bonsai", scale=(0.1 * SIZE,) * 3)

    def show(name, part, kind, textured=True, parent=root, **placed):
        made = primitive(gltf, part, materials[kind], textured=textured, size=SIZE)
        return gltf.node(name, parent, mesh=gltf.mesh([made], name), **placed)

    show("stand", _stand(), "stand", textured=False)
    bowl = show("bowl", _bowl(), "glaze")
    show("soil", _soil(), "moss", parent=bowl)
    tree = show("trunk", wood.arrays(), "wood", translation=_at(-0.42, 0.0, SOIL + 0.02))
    show("leaves", green.arrays(), "leaves", parent=tree)
    show("fallen leaves", _fallen().arrays(), "leaves")
    stone = show("stone", _stone(), "stone", textured=False, translation=_at(0.86, -0.30, 1.08))
    again = {"mesh": gltf.json["nodes"][stone]["mesh"], "rotation": turn((0, 1, 0), 130.0)}
    gltf.node("pebble", root, translation=_at(0.52, -0.62, 1.06), scale=(0.45,) * 3, **again)
    return gltf


def _at(x, y, z):
    """glTF's translation to a place, in the file's unit."""
    return tuple(rounded(y_up((x, y, z)) / SIZE, 6))


def _oval(part):
    return part.scaled(OVAL[0], OVAL[1], 1.0)


# --- what stands still


def _bowl():
    """A bowl with a foot and a lip; its texture goes once around and from foot to rim."""
    profile = [
        (0.60, 0.30),
        *arc((0.66, 0.34), 0.035, -110.0, 20.0, 3),
        (0.70, 0.42),
        (0.84, 0.56),
        (0.935, 0.76),
        (0.975, 0.98),
        *arc((1.005, 1.07), 0.035, -90.0, 90.0, 5),
        (0.95, 1.10),
        (0.925, 1.04),
        (0.915, 0.94),
    ]
    return _oval(lathe(profile, 44))


def _soil():
    """Mossy ground that rises towards the tree; its texture is laid on from above."""
    mound = lathe([(r, 0.0) for r in np.linspace(0.94, 0.0, 9)], 32)

    def rise(points):
        swell = np.exp(-2.6 * ((points[:, 0] + 0.25) ** 2 + points[:, 1] ** 2))
        bumps = 0.045 * fractal(points * 2.0, 950, 0.9, 2)
        edge = smooth(0.94, 0.75, np.linalg.norm(points[:, :2], axis=1))
        return points + np.stack(
            [0.0 * swell, 0.0 * swell, SOIL - 0.03 + (0.20 * swell + bumps) * edge], axis=1
        )

    ground = mound.bent(rise)
    flat = 0.5 + 0.5 * ground.points[:, :2]
    return _oval(type(ground)(ground.points, ground.triangles, flat, ground.colors))


def _stand():
    """A low table with rounded feet."""
    top = block(3.9, 2.8, 0.13, 0.03).moved(0.0, 0.0, 0.23)
    apron = block(3.6, 2.5, 0.09, 0.02).moved(0.0, 0.0, 0.13)
    foot = block(0.34, 0.34, 0.20, 0.04)
    feet = [foot.moved(x, y, 0.10) for x in (-1.66, 1.66) for y in (-1.10, 1.10)]
    return join(top, apron, *feet).painted(_rosewood)


def _rosewood(points):
    tone = 0.75 + 0.25 * np.sin(9.0 * points[:, 1] + 3.0 * points[:, 0])
    return np.array((0.085, 0.030, 0.018)) * tone[:, None]


def _stone():
    """A worn stone, greyer above."""
    ball = lathe(arc((0.0, 0.0), 1.0, -90.0, 90.0, 10), 16)

    def worn(points):
        grown = 1.0 + 0.28 * solid(points, 960, 0.9) + 0.10 * solid(points, 961, 0.4)
        return points * grown[:, None] * (0.30, 0.22, 0.17)

    def tone(points):
        shade = 0.75 + 0.35 * fractal(points * 4.0, 965, 0.8, 3)
        return np.array((0.20, 0.195, 0.185)) * np.clip(shade, 0.3, 1.4)[:, None]

    return ball.bent(worn).painted(tone)


# --- the tree


def _tree(random):
    """(wood, leaves) of a maple whose foot is at the origin."""
    wood, green = Surface(), Surface()
    t = np.linspace(0.0, 1.0, 18)
    sway = np.sin(2.0 * math.pi * (0.92 * t + 0.02)) * (1.0 - 0.45 * t)
    path = np.stack(
        [0.62 * sway + 0.45 * t, 0.20 * np.sin(5.2 * t + 0.4) * (1.0 - 0.3 * t), 3.05 * t], axis=1
    )
    # it leaves the ground upright, and begins below
    path[:, :2] = (path[:, :2] - path[0, :2]) * smooth(-0.06, 0.30, t)[:, None]
    path[0] = (0.0, 0.0, -0.12)
    radii = 0.27 * (1.0 - t) ** 0.8 + 0.05 + 0.15 * np.exp(-t * 12.0)
    trunk = Branch(path, radii, 0)

    def fluted(k, angle):
        return 1.0 + (0.16 * math.exp(-0.35 * k) + 0.035) * np.sin(5.0 * angle + 0.13 * k)

    add_tube(wood, path, radii, 16, (0.62, 1.0), profile=fluted)
    _roots(wood, random)
    for number, (share, degrees, length, rise, size) in enumerate(PADS):
        start, _, radius = trunk.at(share)
        out = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), rise])
        limb = curve(random, start, out, length, 5, 0.20, -0.25)
        thick = 0.62 * radius
        add_tube(wood, limb, taper(thick, 0.03, 5), 7, (0.62, 1.0), offset=random.units(1)[0])
        middle = limb[-1] * 0.8 + limb[3] * 0.2 + (0.0, 0.0, 0.10)
        _twigs(wood, limb, middle, size, random)
        _pad(green, middle, size, number, random)
    _twigs(wood, path[-6:], path[-1], CROWN, random)
    _pad(green, path[-1] + (0.0, 0.0, -0.02), CROWN, len(PADS), random)
    return wood, green


def _roots(wood, random):
    """Roots that leave the foot and go down into the moss."""
    for k in range(7):
        angle = 2.0 * math.pi * (k + random.between(0.0, 0.5)) / 7
        out = np.array([math.cos(angle), math.sin(angle), 0.0])
        length = random.between(0.7, 1.0)
        s = np.linspace(0.0, 1.0, 6)
        bend = np.cross((0.0, 0.0, 1.0), out) * random.around(0.0, 0.25)
        path = out * (0.06 + length * s[:, None]) + bend * (s**2)[:, None]
        path[:, 2] = 0.20 * (1.0 - s) ** 1.4 - 0.12 * s
        add_tube(wood, path, 0.15 * (1.0 - 0.75 * s), 6, (0.62, 1.0), offset=random.units(1)[0])


def _twigs(wood, limb, middle, size, random):
    """Thin branches from a limb into its leaves."""
    for k in range(4):
        start = limb[2 + k * (len(limb) - 3) // 4]
        angle = 2.399963 * k + random.around(0.0, 0.5)
        end = middle + np.array([math.cos(angle), math.sin(angle), 0.25]) * np.asarray(size) * 0.7
        half = (start + end) / 2.0 + (0.0, 0.0, 0.06)
        add_tube(wood, np.array([start, half, end]), np.array([0.035, 0.026, 0.014]), 5, (0.3, 0.6))


def _pad(green, middle, size, number, random):
    """A cloud of leaves: sprays that lie on a flat dome, the lower ones darker."""
    pad = Surface()
    size = np.asarray(size)
    count = int(190 * size[0] * size[1] + 44)
    warm = random.units(3)
    for k in range(count):
        angle = 2.399963 * k + random.around(0.0, 0.4)
        across = math.sqrt((k + 0.5) / count)
        height = math.sqrt(max(1.0 - across**2, 0.0)) * random.between(0.35, 1.0) - 0.25 * random.units(1)[0]
        out = np.array([math.cos(angle), math.sin(angle), 0.0])
        root = middle + (out * across * 0.86 + (0.0, 0.0, height)) * size
        heading = unit(out + 0.5 * random.direction() + (0.0, 0.0, 0.25 * height))
        facing = unit(np.array([0.0, 0.0, 1.0]) + 0.55 * out + 0.45 * random.direction())
        length = random.between(0.36, 0.52)
        # from crimson to gold, each pad a little different
        gold = 0.40 + 0.35 * warm[0] + 0.65 * random.units(1)[0]
        tint = np.array([0.86 + 0.14 * gold, gold, 0.8])
        shade = 0.36 + 0.64 * smooth(-0.25, 0.75, height) * (0.75 + 0.25 * across)
        cell = CELLS[random.below(3)]
        back = root - heading * 0.4 * length
        color = np.clip(tint * shade, 0.0, 1.0)
        add_card(pad, back, heading, facing, (length, length), cell, droop=0.5, color=color)
    pad.bend_normals(middle - (0.0, 0.0, 0.5 * size[2]), size, 0.72)
    for array in ("vertices", "normals", "texcoords", "colors"):
        getattr(green, array).extend(getattr(pad, array))
    green.triangles.extend(part + green.count for part in pad.triangles)
    green.count += pad.count


def _fallen():
    """Single leaves on the moss and on the stand, each on its own height."""
    random = Random(970)
    leaves = Surface()
    spots = [
        (-0.95, -0.45),
        (0.15, -0.70),
        (0.62, 0.40),
        (-0.30, -0.80),
        (1.12, 0.10),
        (-1.2, 0.15),
        (0.2, 0.55),
    ]
    places = [(*spot, SOIL + 0.09) for spot in spots]
    places += [(-1.55, -1.15, 0.301), (0.55, -1.27, 0.304), (1.62, -1.02, 0.307), (1.30, -1.24, 0.310)]
    for x, y, z in places:
        angle = 2.0 * math.pi * random.units(1)[0]
        heading = np.array([math.cos(angle), math.sin(angle), 0.0])
        up = np.array([0.0, 0.0, 1.0]) + 0.10 * random.direction()
        size = random.between(0.40, 0.52)
        color = 0.72 + 0.28 * random.units(3)
        add_card(leaves, (x, y, z), heading, up, (size, size), CELLS[LAST], color=color)
    return leaves
