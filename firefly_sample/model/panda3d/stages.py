"""The texture stages of one of Panda3D's states: what of them a material of ours can have."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any, NamedTuple

from firefly_sample.model.panda3d.sprites import SPRITE
from firefly_sample.model.panda3d.texels import TextureKind
from firefly_sample.model.panda3d.vertices import Matrix

Note = Callable[[str, str], None]
"""Takes a loss and the name of a texture stage or the like; empty if it is the node's."""


class Layer(NamedTuple):
    """A texture of Panda3D, and how a surface uses it."""

    texture: Any  # panda3d.core.Texture
    sampler: Any  # panda3d.core.SamplerState
    kind: TextureKind
    texcoord: int  # 0 or 1


@dataclass
class Layers:
    """The textures of a surface.

    Attributes
    ----------
    colors : list of Layer
        At most two, which multiply each other.
    replace : bool
        True if they take the place of a surface's own colour, light and colour scale.
    emission : Layer or None
        Multiplies what a surface emits.
    normal : Layer or None
        A normal map.
    gloss : list of str
        Names of stages that Panda3D multiplies highlights with.
    columns : list of (str, Matrix or None)
        Columns of texture coordinates and their matrices, at most two.
    stages : list
        All of Panda3D's stages, which may change.
    """

    colors: list[Layer] = field(default_factory=list)
    replace: bool = False
    emission: Layer | None = None
    normal: Layer | None = None
    gloss: list[str] = field(default_factory=list)
    columns: list[tuple[str, Matrix | None]] = field(default_factory=list)
    stages: list[Any] = field(default_factory=list)


def read_layers(state: Any, lit: bool, note: Note) -> Layers:
    """Return the textures of a net state; name the stages that a material of ours lacks.

    Parameters
    ----------
    state : panda3d.core.RenderState
    lit : bool
        Panda3D draws maps of normals, glow and gloss only on what is lit.
    note : callable
        Takes each loss, with the stage's name.
    """
    from panda3d import core

    layers = Layers()
    attrib = state.get_attrib(core.TextureAttrib.get_class_slot())
    if attrib is None:
        return layers
    layers.stages = [attrib.get_on_stage(index) for index in range(attrib.get_num_on_stages())]
    wanted: list[tuple[Any, TextureKind]] = []
    emission: tuple[Any, TextureKind] | None = None
    normal = None
    for stage in layers.stages:
        mode = _mode_names()[stage.get_mode()]
        if not _is_sprite(state, stage) and _has_generated_texcoords(state, stage):
            note(
                "texture stages with generated texture coordinates (TexGenAttrib) are left out",
                stage.get_name(),
            )
            continue
        if mode in ("modulate", "modulate_glow", "modulate_gloss"):
            wanted.append((stage, "modulate" if mode == "modulate" else "opaque"))
        elif mode == "replace":
            wanted, layers.replace = [(stage, "sampled")], True
        elif mode in _LEFT_OUT:
            note(f"texture stages of the mode {mode} are left out", stage.get_name())
        if mode in ("normal_height", "height"):
            note("maps of heights do not shift texture coordinates", stage.get_name())
        if not lit:
            continue
        if mode in ("glow", "modulate_glow"):
            emission = stage, "glow"
        elif mode == "emission":
            emission = stage, "sampled"
        elif mode in ("normal", "normal_height", "normal_gloss"):
            normal = stage
            note(
                "normal maps lie along texture coordinates, not along tangents of vertices", stage.get_name()
            )
        if mode in ("gloss", "modulate_gloss", "normal_gloss"):
            layers.gloss.append(stage.get_name())
    for stage, kind in wanted[:2]:
        layer = _layer(state, attrib, stage, kind, layers, note)
        if layer is not None:
            layers.colors.append(layer)
    for stage, _ in wanted[2:]:
        note("only two textures multiply each other: others are left out", stage.get_name())
    if emission is not None and not layers.replace:
        layers.emission = _layer(state, attrib, *emission, layers, note)
    if normal is not None and not layers.replace:
        layers.normal = _layer(state, attrib, normal, "sampled", layers, note)
    return layers


_LEFT_OUT = "decal", "blend", "add", "combine", "blend_color_scale"


def _layer(
    state: Any, attrib: Any, stage: Any, kind: TextureKind, layers: Layers, note: Note
) -> Layer | None:
    """Return a stage's texture; None, named, if it needs a third kind of texture coordinates."""
    name = SPRITE if _is_sprite(state, stage) else stage.get_texcoord_name().get_name()
    column = name, _matrix(state, stage)
    if column not in layers.columns:
        if len(layers.columns) == 2:
            note("texture stages with a third kind of texture coordinates are left out", stage.get_name())
            return None
        layers.columns.append(column)
    texcoord = layers.columns.index(column)
    return Layer(attrib.get_on_texture(stage), attrib.get_on_sampler(stage), kind, texcoord)


def _matrix(state: Any, stage: Any) -> Matrix | None:
    """Return the matrix of a stage's texture coordinates; None if it is the identity."""
    from panda3d import core

    attrib = state.get_attrib(core.TexMatrixAttrib.get_class_slot())
    if attrib is None or not attrib.has_stage(stage):
        return None
    matrix = attrib.get_mat(stage)
    if matrix == core.LMatrix4.ident_mat():
        return None
    return tuple(float(number) for row in range(4) for number in matrix.get_row(row))


def _has_generated_texcoords(state: Any, stage: Any) -> bool:
    from panda3d import core

    attrib = state.get_attrib(core.TexGenAttrib.get_class_slot())
    return attrib is not None and attrib.has_stage(stage) and attrib.get_mode(stage) != attrib.M_off


def _is_sprite(state: Any, stage: Any) -> bool:
    """Return whether a stage covers each of the squares that points become."""
    from panda3d import core

    attrib = state.get_attrib(core.TexGenAttrib.get_class_slot())
    if attrib is None or not attrib.has_stage(stage) or attrib.get_mode(stage) != attrib.M_point_sprite:
        return False
    mode = state.get_attrib(core.RenderModeAttrib.get_class_slot())
    return mode is not None and bool(mode.get_perspective())


@cache
def _mode_names() -> dict[int, str]:
    """Return the names of the modes of stages by their numbers."""
    from panda3d import core

    kind = core.TextureStage
    return {getattr(kind, name): name[2:] for name in dir(kind) if name.startswith("M_")}
