"""Attributes of Panda3D's states that are not followed: each is named."""

from __future__ import annotations

from typing import Any

from firefly_sample.model.panda3d.stages import Note

_READ_ELSEWHERE = frozenset(
    (
        "AlphaTestAttrib",
        "ColorBlendAttrib",
        "ColorAttrib",
        "ColorScaleAttrib",
        "CullFaceAttrib",
        "DepthOffsetAttrib",
        "LightAttrib",
        "MaterialAttrib",
        "RenderModeAttrib",
        "TexGenAttrib",
        "TexMatrixAttrib",
        "TextureAttrib",
        "TransparencyAttrib",
    )
)
_NOT_SEEN = frozenset(("AudioVolumeAttrib", "RescaleNormalAttrib"))
"""Attributes that change no picture: normals are unit vectors in any case."""

_LOSSES = {
    "AntialiasAttrib": "antialiasing is a setting of the renderer (Settings.supersample), not of nodes",
    "ClipPlaneAttrib": "clip planes cut nothing off",
    "DepthTestAttrib": "depth tests of their own are drawn as the usual one",
    "FogAttrib": "fog is not drawn",
    "LightRampAttrib": "light ramps are not drawn",
    "LogicOpAttrib": "logical operations on colours are not drawn",
    "ScissorAttrib": "scissor regions cut nothing off",
    "ShadeModelAttrib": "flat shading is drawn smooth",
    "StencilAttrib": "stencil tests are not made",
}


def note_attributes(state: Any, blended: bool, note: Note) -> None:
    """Name the attributes of a net state that are not followed.

    Parameters
    ----------
    state : panda3d.core.RenderState
    blended : bool
        True if the surface is: it writes no depths, and its place in the order of drawing matters.
    note : callable
        Takes each loss.
    """
    from panda3d import core

    registry = core.RenderAttribRegistry.get_global_ptr()
    for slot in range(1, registry.get_num_slots()):
        attrib = state.get_attrib(slot)
        if attrib is None or attrib == registry.get_slot_default(slot):
            continue
        kind = attrib.get_type().get_name()
        if kind in _READ_ELSEWHERE or kind in _NOT_SEEN:
            continue
        if kind == "ShaderAttrib":
            _note_shader(attrib, note)
        elif kind == "ColorWriteAttrib":
            _note_channels(attrib.get_channels() & attrib.C_rgb, attrib.C_rgb, note)
        elif kind == "DepthWriteAttrib":
            if not blended:
                note("surfaces that write no depths write them", "")
        elif kind == "CullBinAttrib":
            if blended and attrib.get_bin_name() not in ("", "default", "transparent"):
                note("bins do not order blended surfaces", "")
        elif kind != "ClipPlaneAttrib" or attrib.get_num_on_planes():
            note(_LOSSES.get(kind, f"the attribute {kind} is not followed"), "")


def _note_channels(written: int, colors: int, note: Note) -> None:
    """Name colours that are not written; no picture shows the frame buffer's alpha."""
    if not written:
        note("surfaces that write no colour are left out", "")
    elif written != colors:
        note("channels of colour that are not to be written are written", "")


def _note_shader(attrib: Any, note: Note) -> None:
    """Name a shader of its own, its inputs and its instances: what is matched is its shader generator."""
    if attrib.get_shader() is not None:
        note("shaders of nodes are not used", "")
    elif str(attrib).rstrip().endswith("inputs") and not str(attrib).rstrip().endswith(",0 inputs"):
        note("shader inputs of nodes are not used", "")
    if attrib.get_instance_count() > 1:
        note("instances that a shader would place are drawn once", "")
