"""What is in each .glb file: parts by name, each a list of surfaces with their paint."""

from __future__ import annotations

from functools import lru_cache

from builder import bark, conifers, foliage, furniture, giants, needles, plants, props, trees, worlds
from builder.bonsai import bonsai
from builder.canvas import opaque
from builder.cat_model import sitting_cat
from builder.export import Paint
from builder.lantern import lantern
from builder.orrery import orrery
from builder.sphere import cube_sphere
from builder.terrain import terrain, terrain_texture
from builder.walker import walker


@lru_cache(maxsize=1)
def _oak_bark():
    return Paint("oak bark", opaque(bark.furrowed(10)), jpeg=True)


@lru_cache(maxsize=1)
def _cut_wood():
    return Paint("cut wood", opaque(bark.end_grain(60)), jpeg=True)


def _oak():
    pixels = foliage.leafy_cards(
        100, foliage.lobed(0.33), ((0.05, 0.12, 0.02), (0.12, 0.22, 0.04)), leaf=0.062, count=140
    )
    leaves = Paint("oak leaves", pixels)
    kinds = {"oak": (1, trees.OAK), "tall oak": (2, trees.OAK_TALL), "young oak": (3, trees.OAK_YOUNG)}
    return _trees(kinds, trees.broadleaf, _oak_bark(), leaves)


def _birch():
    outline = foliage.toothed(0.36, 0.9, 0.35)
    tones = ((0.08, 0.16, 0.03), (0.16, 0.27, 0.05))
    leaves = Paint(
        "birch leaves", foliage.leafy_cards(110, outline, tones, leaf=0.042, count=230, spray=1.25)
    )
    skin = Paint("birch bark", opaque(bark.birch(20)), jpeg=True)
    kinds = {"birch": (4, trees.BIRCH), "slim birch": (5, trees.BIRCH_SLIM)}
    return _trees(kinds, trees.broadleaf, skin, leaves)


def _spruce():
    boughs = Paint("spruce boughs", needles.spruce_boughs(120))
    skin = Paint("spruce bark", opaque(bark.scaly(30)), jpeg=True)
    kinds = {
        "spruce": (6, conifers.SPRUCE),
        "slim spruce": (7, conifers.SPRUCE_SLIM),
        "young spruce": (8, conifers.SPRUCE_YOUNG),
    }
    return _trees(kinds, conifers.spruce, skin, boughs)


def _pine():
    tufts = Paint("pine tufts", needles.pine_tufts(130))
    skin = Paint("pine bark", opaque(bark.scaly(40, counts=(14, 8), red=0.8)), jpeg=True)
    return _trees({"pine": (9, conifers.PINE)}, conifers.pine, skin, tufts)


def _trees(kinds, grow, skin, leaves):
    parts = {}
    for name, (seed, kind) in kinds.items():
        wood, green = grow(seed, kind)
        parts[name] = [(wood, skin), (green, leaves)]
    return parts


def _dead_tree():
    return {"dead tree": [(conifers.dead_tree(9), Paint("bare wood", opaque(bark.bare(50)), jpeg=True))]}


def _bushes():
    tones = ((0.035, 0.085, 0.02), (0.085, 0.16, 0.04))
    leaves = Paint("bush leaves", foliage.leafy_cards(160, foliage.oval(0.42, 0.8, 0.5), tones, 0.055, 170))
    stems = Paint("bush stems", opaque(bark.bare(51, (256, 128))), jpeg=True)
    parts = {}
    for name, surfaces in {
        "hazel": plants.bush(240, 14.0, 8.5, 11, 6.5, -0.3),
        "bramble": plants.bush(241, 7.5, 7.5, 10, 5.5, -0.6),
    }.items():
        parts[name] = list(zip(surfaces, (stems, leaves), strict=True))
    return parts


def _fern():
    return {"fern": [(plants.fern(220), Paint("fern fronds", needles.fern_fronds(140)))]}


def _grass():
    blades = Paint("grass blades", needles.grass_blades(150))
    return {
        "grass": [(plants.grass(230), blades)],
        "tall grass": [(plants.grass(231, 6, 2.2, (4.6, 5.4), (0.95, 0.92, 0.85)), blades)],
    }


def _stump():
    skin, face = props.stump(200)
    axe = props.axe((0.6, -0.8, 6.1), -0.5)
    steel = Paint("axe", props.axe_texture(202), jpeg=True)
    return {"stump": [(skin, _oak_bark()), (face, _cut_wood()), (axe, steel)]}


def _fallen_trunk():
    skin, face = props.fallen_trunk(260)
    return {"fallen trunk": [(skin, _oak_bark()), (face, _cut_wood())]}


def _rocks():
    sizes = {"rock": (6.0, 5.0, 4.0), "stone": (3.5, 4.4, 2.8), "boulder": (8.6, 6.8, 6.2)}
    parts = {}
    for k, (name, size) in enumerate(sizes.items()):
        surface, pixels = props.rock(210 + k, size)
        parts[name] = [(surface, Paint(f"{name} skin", pixels, jpeg=True))]
    return parts


def _mushrooms():
    red = props.mushroom_texture(251, (0.42, 0.035, 0.02), 26, (0.50, 0.09, 0.03))
    brown = props.mushroom_texture(253, (0.30, 0.16, 0.06), 0, (0.20, 0.09, 0.03))
    return {
        "fly agaric": [(plants.mushrooms(250, 4, 2.6, 3.0, 0.62), Paint("fly agaric", red, jpeg=True))],
        "brown mushroom": [
            (plants.mushrooms(252, 5, 2.0, 2.2, 0.35), Paint("brown mushroom", brown, jpeg=True))
        ],
    }


def _terrain():
    return {"terrain": [(terrain(), Paint("forest floor", terrain_texture(), jpeg=True))]}


def _cat():
    surface, pixels = sitting_cat()
    return {"cat": [(surface, Paint("cat coat", pixels, jpeg=True))]}


def _planets():
    skins = {
        "gas giant": giants.gas_giant(500),
        "ringed planet": giants.ringed_planet(510),
        "ocean planet": worlds.ocean_planet(521),
        "rocky planet": worlds.rocky_planet(531),
        "moon": worlds.moon(540),
    }
    ball = cube_sphere(14)
    parts = {name: [(ball, Paint(name, opaque(skin), jpeg=True))] for name, skin in skins.items()}
    parts["ringed planet"].append((giants.ring(), Paint("ring", giants.ring_texture(511))))
    return parts


def _plinth():
    return {"plinth": [(furniture.plinth(), Paint("stone slabs", furniture.slabs(550), jpeg=True))]}


def _bulb():
    return {"bulb": [(furniture.bulb(), Paint("bulb", furniture.plain_texture()))]}


MODELS = {
    "oak": _oak,
    "birch": _birch,
    "spruce": _spruce,
    "pine": _pine,
    "dead_tree": _dead_tree,
    "bushes": _bushes,
    "fern": _fern,
    "grass": _grass,
    "stump": _stump,
    "fallen_trunk": _fallen_trunk,
    "rocks": _rocks,
    "mushrooms": _mushrooms,
    "terrain": _terrain,
    "cat": _cat,
    "planets": _planets,
    "plinth": _plinth,
    "bulb": _bulb,
}
"""File name without its ending -> function that makes its parts: what the scenes are made of."""
SHOWPIECES = {"lantern": lantern, "orrery": orrery, "bonsai": bonsai, "walker": walker}
"""File name without its ending -> function that makes the whole file: models to look at by themselves."""
