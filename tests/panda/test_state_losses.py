"""What of a state a surface lacks: each thing is named once, and nothing else."""

from __future__ import annotations

import pytest
from panda3d import core

from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.states import StateReader
from tests.panda.setups import (
    BLENDING,
    RED,
    alpha_test,
    both,
    has_material,
    has_stages,
    put,
    read,
    see_through,
    stage,
    texture,
)

BLEND = core.ColorBlendAttrib
USUAL_BLEND = BLEND.make(BLEND.M_add, BLEND.O_incoming_alpha, BLEND.O_one_minus_incoming_alpha)


def attribute(made):
    return lambda card: card.set_attrib(made)


def clip(card):
    card.set_clip_plane(card.attach_new_node(core.PlaneNode("plane")))


def generated(card):
    own = stage("modulate")
    card.set_texture(own, texture(1, 2, 3, 4))
    card.set_tex_gen(own, core.TexGenAttrib.M_eye_sphere_map)


def three_texcoords(card):
    for index in range(3):
        own = stage("modulate" if index < 2 else "glow", f"stage {index}", index)
        own.set_texcoord_name(f"set {index}")
        card.set_texture(own, texture(1, 2, 3, 4))


NAMED = {
    "antialiasing is a setting of the renderer (Settings.supersample), not of nodes": lambda card: (
        card.set_antialias(core.AntialiasAttrib.M_auto)
    ),
    "alpha tests that let through what is below a limit cut nothing out": alpha_test("less", 0.4),
    "the attribute AuxBitplaneAttrib is not followed": attribute(core.AuxBitplaneAttrib.make(1)),
    "bins do not order blended surfaces": both(
        lambda card: card.set_bin("fixed", 3), lambda card: card.set_transparency(BLENDING.M_alpha)
    ),
    "channels of colour that are not to be written are written": attribute(core.ColorWriteAttrib.make(1)),
    "clip planes cut nothing off": clip,
    "surfaces that are added to what is behind, or blended in ways of their own, are left out": both(
        attribute(core.ColorBlendAttrib.make(core.ColorBlendAttrib.M_add)),
        lambda card: card.set_depth_write(False),  # which does not matter then
    ),
    "colours that are multiplied by alpha already are multiplied again": see_through(
        "premultiplied_alpha", 0.5
    ),
    "depth tests of their own are drawn as the usual one": lambda card: card.set_depth_test(False),
    "flat shading is drawn smooth": attribute(core.ShadeModelAttrib.make(core.ShadeModelAttrib.M_flat)),
    "fog is not drawn": lambda card: card.set_fog(core.Fog("fog")),
    "instances that a shader would place are drawn once": lambda card: card.set_instance_count(3),
    "light ramps are not drawn": attribute(core.LightRampAttrib.make_hdr0()),
    "logical operations on colours are not drawn": attribute(
        core.LogicOpAttrib.make(core.LogicOpAttrib.O_xor)
    ),
    "numbers of colours and materials outside 0..1 are cut off": has_material(diffuse=(2, -1, 0, 1)),
    "only two textures multiply each other: others are left out": has_stages(*["modulate"] * 3),
    "ranges of depths (DepthOffsetAttrib) are not followed": attribute(
        core.DepthOffsetAttrib.make(0, 0.5, 1.0)
    ),
    "scissor regions cut nothing off": attribute(core.ScissorAttrib.make(0, 0.5, 0, 0.5)),
    "shader inputs of nodes are not used": lambda card: card.set_shader_input("input", 3),
    "shaders of nodes are not used": lambda card: card.set_shader(
        core.Shader.make(core.Shader.SL_GLSL, "void main() {}", "void main() {}")
    ),
    "stencil tests are not made": attribute(
        core.StencilAttrib.make(True, core.StencilAttrib.SCF_equal, *[core.StencilAttrib.SO_keep] * 3, 1, 1)
    ),
    "surfaces that write no colour are left out": attribute(core.ColorWriteAttrib.make(0)),
    "surfaces that write no depths write them": lambda card: card.set_depth_write(False),
    "surfaces whose texture replaces their colour have no highlights": has_stages("replace", specular=RED),
    "triangles whose vertices are to be points are filled": attribute(
        core.RenderModeAttrib.make(core.RenderModeAttrib.M_point)
    ),
    "triangles with wires of another colour are drawn without them": lambda card: (
        card.set_render_mode_filled_wireframe(RED)
    ),
    "maps of heights do not shift texture coordinates": has_stages("height"),
    "maps of gloss do not multiply highlights": has_stages("gloss"),
    "normal maps lie along texture coordinates, not along tangents of vertices": has_stages("normal"),
    "texture stages with a third kind of texture coordinates are left out": three_texcoords,
    "texture stages with generated texture coordinates (TexGenAttrib) are left out": generated,
    **{
        f"texture stages of the mode {mode} are left out": has_stages(mode)
        for mode in ("add", "blend", "blend_color_scale", "combine", "decal")
    },
}


@pytest.mark.parametrize("loss", NAMED)
def test_what_a_surface_lacks_is_named_once(loss):
    losses = Losses()
    read(put(NAMED[loss]), losses=losses)
    (line,) = losses.lines()
    assert line.startswith(f"{loss}: 'card")


@pytest.mark.parametrize(
    "setup",
    [
        lambda card: card.set_attrib(core.RescaleNormalAttrib.make(core.RescaleNormalAttrib.M_normalize)),
        lambda card: card.set_bin("fixed", 3),
        lambda card: card.set_shader_auto(),
        lambda card: card.set_shader_off(),
        lambda card: card.set_attrib(core.ColorWriteAttrib.make(core.ColorWriteAttrib.C_rgb)),
        lambda card: card.set_attrib(core.StencilAttrib.make_off()),
        lambda card: card.set_attrib(core.ColorBlendAttrib.make_off()),
        lambda card: card.set_attrib(BLEND.make(BLEND.M_add, BLEND.O_one, BLEND.O_zero)),
        lambda card: card.set_attrib(USUAL_BLEND),
        lambda card: card.set_fog_off(),
        lambda card: card.set_depth_test(True),
        lambda card: card.set_clip_plane_off(),
        lambda card: card.set_attrib(core.ShadeModelAttrib.make(core.ShadeModelAttrib.M_smooth)),
        both(lambda card: card.set_depth_write(False), see_through("alpha", 0.5)),
    ],
)
def test_what_changes_no_picture_is_not_named(setup):
    losses = Losses()
    assert read(put(setup), losses=losses) is not None
    assert losses.lines() == []


def test_what_is_added_to_what_is_behind_is_left_out():
    """Black adds nothing: it would hide what is behind."""
    assert read(put(attribute(BLEND.make(BLEND.M_add)))) is None
    assert read(put(attribute(USUAL_BLEND))).material.alpha_mode == "blend"
    assert (
        read(put(attribute(BLEND.make(BLEND.M_add, BLEND.O_one, BLEND.O_zero)))).material.alpha_mode
        == "opaque"
    )


def test_every_attribute_of_a_state_is_read_or_named():
    registry = core.RenderAttribRegistry.get_global_ptr()
    kinds = {registry.get_slot_type(slot).get_name() for slot in range(1, registry.get_num_slots())}
    named = {
        card.get_state().get_attrib(slot).get_type().get_name()
        for card in map(put, NAMED.values())
        for slot in range(1, registry.get_num_slots())
        if card.get_state().get_attrib(slot) is not None
    }
    followed = {"ColorAttrib", "ColorScaleAttrib", "CullFaceAttrib", "TexMatrixAttrib"}  # in the tests here
    no_picture = {"AudioVolumeAttrib", "RescaleNormalAttrib"}
    assert kinds == named | followed | no_picture | {"LightAttrib"}


def test_losses_are_named_for_every_node_of_a_state():
    losses = Losses()
    reader, card = StateReader(losses), put(lambda card: card.set_depth_write(False))
    for name in ("one", "two", "one"):
        reader.surface(card.get_net_state(), True, False, name)
    assert losses.lines() == ["surfaces that write no depths write them: 'one', 'two'"]
