"""Two textures of one surface, and depth offsets, beside Panda3D's pictures."""

from __future__ import annotations

import numpy as np
import pytest
from panda3d import core

from firefly_sample import Material, PerspectiveLens, Renderer, Scene, Settings, Texture
from firefly_sample.scene.geom import Geom
from tests.panda.scenes import card
from tests.passes.test_emission_textures import card_scene
from tests.scenes import geom_node

SIZE = (32, 32)
FIRST, SECOND = np.random.default_rng(7).integers(0, 256, (2, 4, 4, 4), dtype=np.uint8)
FIRST[..., 3], SECOND[..., 3] = 255, 255


def watched(root: core.NodePath) -> tuple[core.NodePath, core.NodePath]:
    """A graph and a camera that sees -1 to 1 across and up."""
    lens = core.OrthographicLens()
    lens.set_film_size(2, 2)
    lens.set_near_far(1, 20)
    camera = root.attach_new_node(core.Camera("camera", lens))
    camera.set_y(-5)
    return root, camera


def two_stages(first, second):
    """A card with two texture stages of the default mode."""
    root = core.NodePath("render")
    path = card()
    path.reparent_to(root)
    for sort, pixels in enumerate((first, second)):
        stage = core.TextureStage(f"stage {sort}")
        stage.set_sort(sort)
        image = core.Texture(f"image {sort}")
        image.setup_2d_texture(4, 4, core.Texture.T_unsigned_byte, core.Texture.F_rgba8)
        image.set_ram_image_as(pixels[::-1].tobytes(), "RGBA")
        image.set_magfilter(core.SamplerState.FT_nearest)
        path.set_texture(stage, image)
    return watched(root)


def test_a_second_stage_is_our_modulating_texture(by_panda):
    theirs = by_panda(two_stages, FIRST, SECOND, size=SIZE).color[..., :3]
    textures = [Texture(pixels, magfilter="nearest") for pixels in (FIRST, SECOND)]
    material = Material("card", texture=textures[0], modulate_texture=textures[1])
    with Renderer(SIZE, Settings(look="flat")) as renderer:
        ours = renderer.render(card_scene(material)).color
    assert np.abs(theirs.astype(int) - ours).max() <= 1


COLORS = [(0, 0, 1, 1), (1, 1, 0, 1), (1, 0, 0, 1), (0, 1, 0, 1), (1, 1, 1, 1), (0, 1, 1, 1), (1, 0, 1, 1)]
OFFSETS = [0, 1, 2, 5, 9, 14, 20]
PLACES = [
    (-9, 0, 0),
    (-3, 0.07, 1.5),
    (-0.7, 0.13, 1.5),
    (1.6, 0.33, 1.5),
    (-3, 0.55, -1),
    (-0.7, 0.9, -1),
    (1.6, 1.3, -1),
]
"""Of a wall and of cards behind it: each the farther the more its offset is."""
SIDES = [18.0] + [1.6] * 6
TURN = (20, -40, 5)


def stand(cards, turned):
    """Place a wall and its cards, of Panda3D's or of ours, below a turned node."""
    turned.set_pos(0, 14, 0)
    turned.set_hpr(*TURN)
    for path, place, offset in zip(cards, PLACES, OFFSETS, strict=True):
        path.reparent_to(turned)
        path.set_pos(*place)
        if offset:
            path.set_depth_offset(offset)


def pressed_cards():
    """Cards behind a tilted wall, of which offsets show parts."""
    root = core.NodePath("render")
    cards = [card(f"card {number}", (0, side, -side / 2, side / 2)) for number, side in enumerate(SIDES)]
    for path, color in zip(cards, COLORS, strict=True):
        path.set_color(*color)
    stand(cards, root.attach_new_node("turned"))
    node = core.Camera("camera")
    node.get_lens().set_fov(40, 40)
    node.get_lens().set_near_far(1, 60)
    return root, root.attach_new_node(node)


def our_pressed_cards():
    """The same of ours."""
    scene, cards = Scene(), []
    for number, (side, color) in enumerate(zip(SIDES, COLORS, strict=True)):
        corners = [(x * side, 0, (z - 0.5) * side) for x, z in ((0, 0), (1, 0), (1, 1), (0, 1))]
        geom = Geom(corners, [(0, 1, 2), (0, 2, 3)], [(0, -1, 0)] * 4)
        cards.append(scene.root.attach_new_node(geom_node(f"card {number}", geom, Material("card", color))))
    stand(cards, scene.root.attach_new_node("turned"))
    scene.camera.node().lens = PerspectiveLens(fov=40, near=1, far=60)
    return scene


@pytest.mark.parametrize("position_method", ["linear32f", "depth24"])
def test_as_much_of_a_surface_comes_forward_as_in_panda3d(by_panda, position_method):
    """Of both directions of our depth buffer."""
    theirs = by_panda(pressed_cards, size=(96, 96)).color[..., :3]
    with Renderer((96, 96), Settings(look="flat", position_method=position_method)) as renderer:
        ours = renderer.render(our_pressed_cards()).color
    differ = np.argwhere((theirs != ours).any(axis=-1))
    assert len(differ) <= 5  # of the 250 pixels beside an edge
    for row, column in differ:
        around = theirs[row - 1 : row + 2, column - 1 : column + 2]
        assert (around == ours[row, column]).all(axis=-1).any()
    for color in COLORS:
        shown = (theirs == 255 * np.array(color[:3])).all(axis=-1).sum()
        assert shown >= 20
