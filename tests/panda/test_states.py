"""Surfaces of states: their numbers in Panda3D's formula give Panda3D's picture, and so do our pictures."""

from __future__ import annotations

import numpy as np
import pytest

from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.states import StateReader
from firefly_sample.scene.render_mode import RenderMode
from tests.panda.cards import AMBIENT, PIXELS, SUN, VERTEX_COLOR, cut_out, quad, size_of, wall
from tests.panda.compare import draw_ours
from tests.panda.setups import (
    ALONE,
    GREY,
    RED,
    STAGE,
    has_material,
    has_stages,
    material,
    put,
    read,
    setups,
    shown,
    stage,
    texture,
)


def expected(surface, lit, colored):
    """The colour by Panda3D's formula of a surface before black, lit at right angles."""
    if surface is None:
        return np.zeros(3)
    found, scale = surface.material, np.array(surface.color_scale)
    vertex = np.array(VERTEX_COLOR if colored and surface.use.colors else (1, 1, 1, 1))
    texels = np.ones(4)
    for each in (found.texture, getattr(found, "modulate_texture", None)):
        if each is not None:
            texels = texels * each.pixels[0, 0] / 255
    base = found.base_color * vertex
    if found.unlit:
        color = base[:3]
    else:
        map_ = found.emission_texture
        emission = found.emission if map_ is None else found.emission * map_.pixels[0, 0, :3] / 255
        ambient = base[:3] if found.ambient is None else found.ambient * vertex[:3]
        color = np.clip(emission + AMBIENT * ambient + SUN * base[:3], 0, 1)
    color = color * scale[:3] * texels[:3]
    if not found.unlit:
        color = color + SUN * found.specular
    alpha = base[3] * scale[3] * texels[3]
    if found.alpha_mode == "mask":
        return color if alpha >= found.alpha_cutoff else np.zeros(3)
    return color * alpha if found.alpha_mode == "blend" else color


@pytest.mark.parametrize("colored", [False, True], ids=["plain", "colored"])
@pytest.mark.parametrize("lit", [False, True], ids=["unlit", "lit"])
def test_the_numbers_give_panda3ds_picture(by_panda, lit, colored):
    picture = by_panda(shown, lit, colored, size=size_of(setups(lit)))
    root, _ = shown(lit, colored)
    wrong = {}
    for index, name in enumerate(setups(lit)):
        losses = Losses()
        surface = read(root.find(name), lit, colored, losses)
        color = 255 * np.clip(expected(surface, lit, colored), 0, 1)
        theirs = cut_out(picture.color, index)[PIXELS // 2, PIXELS // 2, :3]
        if losses.lines():
            assert (lit and colored and name in ALONE) or name == "no colour written", losses.lines()
        elif np.abs(color - theirs).max() > 1.0:
            wrong[name] = color.round(1).tolist(), theirs.tolist()
    assert not wrong


def beside(lit, colored):
    """The same wall, with a two-sided card that is seen from behind."""

    def turned(card):
        card.set_two_sided(True)
        card.set_h(180)
        card.set_x(card.get_x() + 1)

    return wall(setups(lit) | {"behind": turned}, lit, colored)


@pytest.mark.parametrize("lit", [False, True], ids=["unlit", "lit"])
def test_our_picture_is_panda3ds(by_panda, lit):
    names = [*setups(lit), "behind"]
    theirs = by_panda(beside, lit, True, size=size_of(names)).color
    frame, _ = draw_ours(beside, lit, True, size=size_of(names))
    wrong = {}
    for index, name in enumerate(names):
        pair = [cut_out(each, index)[..., :3].astype(int) for each in (theirs, frame.color)]
        if np.abs(pair[0] - pair[1]).max() > 1 and name not in ALONE:
            wrong[name] = [each[PIXELS // 2, PIXELS // 2].tolist() for each in pair]
    assert not wrong


# --- what is followed ---


def test_sides_sizes_and_offsets_are_those_of_the_state():
    surface = read(put(lambda card: None))
    assert not surface.material.double_sided
    assert (surface.render_mode, surface.depth_offset) == (RenderMode(), 0)
    assert read(put(lambda card: card.set_two_sided(True))).material.double_sided
    assert read(put(lambda card: card.set_depth_offset(-3))).depth_offset == -3
    wires = read(put(lambda card: card.set_render_mode_wireframe()))
    assert wires.render_mode == RenderMode("wireframe")
    dots = read(put(lambda card: card.set_render_mode_thickness(5)))
    assert dots.render_mode == RenderMode("filled", 5.0)


def test_texture_coordinates_are_those_of_the_stages():
    first, second, third = stage("modulate", "a", 0), stage("modulate", "b", 1), stage("glow", "c", 2)
    card = quad("card", False)
    second.set_texcoord_name("lightmap")
    for each in (first, second, third):
        card.set_texture(each, texture(1, 2, 3, 4))
    card.set_tex_offset(second, 0.25, 0.5)
    use = read(card).use
    assert (use.texcoords, use.texcoords_1, use.matrix) == ("texcoord", "texcoord.lightmap", None)
    assert use.matrix_1 == (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.25, 0.5, 0, 1)
    made = read(card).material
    assert (made.modulate_texcoord, made.emission_texcoord) == (1, 0)


def test_stages_are_in_the_order_of_their_sort_numbers():
    card = quad("card", False)
    for name, sort in (("b", 2), ("a", 1)):
        card.set_texture(stage("modulate", name, sort), texture(1, 2, 3, 4, name=name))
    made = read(card).material
    assert (made.texture.name, made.modulate_texture.name) == ("a", "b")


def test_colours_out_of_range_are_cut_off():
    made = read(put(has_material(diffuse=(2, -1, 0.5, 1), emission=(7, 0, -1, 1), shininess=2e6))).material
    assert made.base_color.tolist() == [1, 0, 0.5, 1]
    assert made.emission.tolist() == [7, 0, 0]


# --- what changes ---


@pytest.fixture
def reader():
    return StateReader(Losses())


def test_the_same_state_is_the_same_surface(reader, monkeypatch):
    card, twin = put(has_stages("modulate", "glow", specular=RED, local=True)), quad("twin", False)
    twin.set_state(card.get_state())
    surface = reader.surface(card.get_net_state(), True, False, "card")
    monkeypatch.setattr(reader, "_read", None)  # it is not even read again
    assert reader.surface(twin.get_net_state(), True, False, "twin") is surface
    reader.sweep()
    assert reader.surface(card.get_net_state(), True, False, "card") is surface


def test_states_with_the_same_numbers_share_a_material(reader):
    card, other = put(has_stages("modulate")), quad("other", False)
    other.set_state(card.get_state())
    other.set_depth_offset(1)
    surfaces = [reader.surface(each.get_net_state(), True, False, "") for each in (card, other)]
    assert surfaces[0].material is surfaces[1].material
    assert [each.depth_offset for each in surfaces] == [0, 1]


def test_a_changed_material_makes_another_surface(reader):
    own = material(diffuse=GREY)
    card = put(lambda card: card.set_material(own))
    before = reader.surface(card.get_net_state(), True, False, "card")
    own.set_diffuse(RED)
    after = reader.surface(card.get_net_state(), True, False, "card")
    assert after.material.base_color.tolist() == np.float32(RED).tolist()
    assert before.material.base_color.tolist() == np.float32(GREY).tolist()
    assert reader.surface(card.get_net_state(), True, False, "card") is after


@pytest.mark.parametrize(
    "change",
    [
        {"ambient": RED},
        {"specular": GREY},
        {"emission": GREY},
        {"shininess": 7},
        {"local": True},
        {"base_color": RED},
        {"roughness": 0.1},
    ],
)
def test_each_number_of_a_material_that_counts_makes_another_surface(reader, change):
    own = material(diffuse=GREY, specular=RED, shininess=3)
    card = put(lambda card: card.set_material(own))
    before = reader.surface(card.get_net_state(), True, False, "card")
    ((name, number),) = change.items()
    getattr(own, f"set_{name}")(number)
    assert reader.surface(card.get_net_state(), True, False, "card") is not before


def test_a_changed_stage_makes_another_surface(reader):
    own = stage("modulate")
    card = put(lambda card: card.set_texture(own, texture(200, 100, 50, 180)))
    before = reader.surface(card.get_net_state(), True, False, "card")
    own.set_mode(STAGE.M_replace)
    assert reader.surface(card.get_net_state(), True, False, "card").material.unlit
    assert not before.material.unlit


def test_a_sweep_forgets_what_was_not_asked_for(reader):
    card, gone = put(has_stages("modulate")), put(has_stages("replace"))
    kept = reader.surface(card.get_net_state(), True, False, "card")
    first = reader.surface(gone.get_net_state(), True, False, "gone")
    reader.sweep()
    reader.surface(card.get_net_state(), True, False, "card")
    reader.sweep()
    assert reader.surface(card.get_net_state(), True, False, "card") is kept
    again = reader.surface(gone.get_net_state(), True, False, "gone")
    assert again.material is not first.material
    assert again.material.texture is not first.material.texture
