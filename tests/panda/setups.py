"""States for cards: colours, materials, texture stages and alpha."""

from __future__ import annotations

from panda3d import core

from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.states import StateReader
from tests.panda.cards import quad, wall

STAGE, BLENDING, COMPARE = core.TextureStage, core.TransparencyAttrib, core.RenderAttrib


def texture(*rgba, name="texture"):
    """A texture of one colour."""
    made = core.Texture(name)
    made.setup_2d_texture(1, 1, core.Texture.T_unsigned_byte, core.Texture.F_rgba)
    made.set_ram_image_as(bytes(rgba), "RGBA")
    return made


def material(**numbers):
    made = core.Material("material")
    for name, number in numbers.items():
        getattr(made, f"set_{name}")(number)
    return made


def stage(mode, name="stage", sort=0):
    made = STAGE(name)
    made.set_mode(getattr(STAGE, f"M_{mode}"))
    made.set_sort(sort)
    return made


def has_material(**numbers):
    return lambda card: card.set_material(material(**numbers))


def has_stages(*modes, **numbers):
    """A texture for each mode, in this order, and a material."""

    def setup(card):
        for index, mode in enumerate(modes):
            texels = (200 - 30 * index, 100 + 50 * index, 50, 180 + 30 * index)
            card.set_texture(stage(mode, f"stage {index}", index), texture(*texels))
        if numbers:
            card.set_material(material(**numbers))

    return setup


def see_through(mode, alpha):
    def setup(card):
        card.set_color((0.9, 0.5, 0.2, alpha))
        card.set_transparency(getattr(BLENDING, f"M_{mode}"))

    return setup


def alpha_test(mode, alpha, reference=0.5):
    def setup(card):
        card.set_color((0.9, 0.5, 0.2, alpha))
        card.set_attrib(core.AlphaTestAttrib.make(getattr(COMPARE, f"M_{mode}"), reference))

    return setup


def both(*setups):
    return lambda card: [setup(card) for setup in setups]


GREY, RED = (0.5, 0.5, 0.5, 0.3), (0.8, 0.1, 0.2, 1.0)
SHOWN = {
    "plain": lambda card: None,
    "flat": lambda card: card.set_color((0.5, 0.25, 0.75, 0.5)),
    "off": lambda card: card.set_color_off(),
    "scaled": lambda card: card.set_color_scale((0.5, 0.25, 0.75, 0.5)),
    "all": has_material(ambient=RED, diffuse=GREY, emission=(0.1, 0.2, 0.3, 1), specular=RED, shininess=9),
    "diffuse and ambient": has_material(ambient=RED, diffuse=GREY),
    "emission": has_material(emission=(0.1, 0.2, 0.05, 1)),
    "specular": has_material(specular=(0.3, 0.2, 0.1, 1), shininess=20),
    "shininess 0": has_material(specular=(0.3, 0.2, 0.1, 1)),
    "roughness": has_material(roughness=0.4, specular=(0.3, 0.2, 0.1, 1)),
    "base colour": has_material(base_color=GREY),
    "metal": has_material(base_color=RED, metallic=0.7),
    "refractive": has_material(base_color=GREY, refractive_index=1.8),
    "flat and ambient": both(has_material(ambient=GREY), lambda card: card.set_color(RED)),
    "flat, base colour, alpha": both(
        has_material(base_color=GREY),
        lambda card: card.set_color((1, 1, 1, 0.6)),
        lambda card: card.set_transparency(BLENDING.M_alpha),
    ),
    "flat, material, alpha": both(
        has_material(diffuse=GREY, ambient=RED),
        lambda card: card.set_color((1, 1, 1, 0.6)),
        lambda card: card.set_transparency(BLENDING.M_alpha),
    ),
    "scaled alpha": both(
        lambda card: card.set_color_scale((0.5, 1, 1, 0.5)),
        lambda card: card.set_transparency(BLENDING.M_alpha),
    ),
    "textured alpha": both(has_stages("modulate"), lambda card: card.set_transparency(BLENDING.M_alpha)),
    "modulate": has_stages("modulate"),
    "modulate by two": has_stages("modulate", "modulate"),
    "modulate and material": has_stages("modulate", ambient=RED, diffuse=GREY, specular=GREY),
    "scaled and modulate": both(
        has_stages("modulate"), lambda card: card.set_color_scale((0.5, 0.7, 0.9, 1))
    ),
    "glow": has_stages("glow"),
    "glow by emission": has_stages("glow", emission=(0.3, 0.2, 0.1, 1)),
    "glow and modulate": has_stages("modulate_glow"),
    "emission map": has_stages("emission"),
    "emission map and colour": has_stages("emission", emission=(0.3, 0.2, 0.1, 1)),
    "replace": has_stages("replace", emission=(0.3, 0.2, 0.1, 1)),
    "modulate, replace": has_stages("modulate", "replace"),
    "replace, modulate": has_stages("replace", "modulate"),
    "replace, scaled": both(has_stages("replace"), lambda card: card.set_color_scale((0.5, 0.7, 0.9, 0.5))),
    "selector": has_stages("selector"),
    **{
        f"{mode} {alpha}": see_through(mode, alpha)
        for mode in ("none", "alpha", "dual", "binary", "multisample", "multisample_mask")
        for alpha in (0.4, 0.6)
    },
    **{
        f"test {mode} {alpha}": alpha_test(mode, alpha)
        for mode in ("greater", "greater_equal", "always", "never")
        for alpha in (0.4, 0.5, 0.6)
    },
    "test and alpha": both(alpha_test("greater", 0.4), lambda card: card.set_transparency(BLENDING.M_alpha)),
    "test and binary": both(
        alpha_test("greater", 0.6, 0.8), lambda card: card.set_transparency(BLENDING.M_binary)
    ),
    "test above 1": alpha_test("greater", 1.0, 1.0),
    "no colour written": lambda card: card.set_attrib(core.ColorWriteAttrib.make(0)),
}
"""States that are drawn as Panda3D draws them."""
ALONE = {"flat and ambient"}
"""Those in which a material sets one of diffuse and ambient: if vertices have colours, this is named."""
ONLY_LIT = {
    *("diffuse and ambient", "emission", "specular", "shininess 0", "roughness", "metal", "refractive"),
    *("flat and ambient", "flat, base colour, alpha", "flat, material, alpha", "modulate and material"),
    *("glow by emission", "emission map", "emission map and colour"),
}
"""Those whose materials do not matter without light; of their kind, others are drawn without it."""


def shown(lit, colored):
    """A wall of these states."""
    return wall(setups(lit), lit, colored)


def setups(lit):
    return SHOWN if lit else {name: setup for name, setup in SHOWN.items() if name not in ONLY_LIT}


def put(setup):
    card = quad("card", False)
    setup(card)
    return card


def read(path, lit=True, colored=False, losses=None):
    """The surface of a card."""
    return StateReader(losses or Losses()).surface(path.get_net_state(), lit, colored, path.get_name())
