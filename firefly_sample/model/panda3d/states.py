"""Panda3D's states: surfaces as we draw them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np

from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.attributes import note_attributes
from firefly_sample.model.panda3d.materials import material_numbers, read_colors
from firefly_sample.model.panda3d.stages import Layer, read_layers
from firefly_sample.model.panda3d.textures import ReadTexture, TextureReader
from firefly_sample.model.panda3d.vertices import VertexUse
from firefly_sample.scene.material import AlphaMode, Material
from firefly_sample.scene.render_mode import LARGEST_THICKNESS, PLAIN, RenderMode
from firefly_sample.scene.texture import Texture

_WHITE = (1.0, 1.0, 1.0, 1.0)


class Surface(NamedTuple):
    """The way in which a Geom is drawn.

    Attributes
    ----------
    material : Material
    use : VertexUse
        The columns of vertices that count.
    render_mode : RenderMode
    color_scale : (float, float, float, float)
    depth_offset : int
    half_size : float or None
        Of points in the scene's units: they are squares. None if they have a size in pixels.
    """

    material: Material
    use: VertexUse
    render_mode: RenderMode = PLAIN
    color_scale: tuple[float, float, float, float] = _WHITE
    depth_offset: int = 0
    half_size: float | None = None


class _Changing(Protocol):
    """A source of a surface that may change later."""

    def is_current(self) -> bool: ...


class _Material(NamedTuple):
    """A Material of Panda3D, and its numbers as they were."""

    source: Any
    numbers: tuple[Any, ...]

    def is_current(self) -> bool:
        return material_numbers(self.source) == self.numbers


class _Stage(NamedTuple):
    """A TextureStage of Panda3D, and its copy as it was."""

    source: Any
    copy: Any

    def is_current(self) -> bool:
        return bool(self.source.compare_to(self.copy) == 0)


@dataclass
class _Kept:
    """The surface of a state, which is held so that no other gets its address."""

    state: Any
    surface: Surface | None = None
    recipe: tuple[Any, ...] = ()
    changing: list[_Changing] = field(default_factory=list)
    losses: list[tuple[str, str]] = field(default_factory=list)
    named: set[str] = field(default_factory=set)
    used: bool = True


class StateReader:
    """Makes surfaces from Panda3D's net states, each once as long as nothing in it has changed."""

    def __init__(self, losses: Losses) -> None:
        self._losses = losses
        self._textures = TextureReader(losses)
        self._kept: dict[tuple[int, bool, bool], _Kept] = {}
        self._materials: dict[tuple[Any, ...], Material] = {}

    def surface(self, state: Any, lit: bool, has_colors: bool, name: str) -> Surface | None:
        """Return how a Geom with this net state is drawn; None if it is not drawn.

        The same object comes back as long as the state and what it refers to are the same. The images of
        changed textures are replaced in place.

        Parameters
        ----------
        state : panda3d.core.RenderState
            Of all nodes above the Geom, and its own.
        lit : bool
            False if the Geom shows its colours without light.
        has_colors : bool
            True if its vertices have colours.
        name : str
            The node's, for what is drawn differently.
        """
        key = (state.this, lit, has_colors)
        kept = self._kept.get(key)
        if kept is None or not all(each.is_current() for each in kept.changing):
            made = self._read(state, lit, has_colors)
            if kept is not None and made.surface == kept.surface:
                made.surface = kept.surface
            kept = self._kept[key] = made
        kept.used = True
        if name not in kept.named:
            kept.named.add(name)
            for loss, detail in kept.losses:
                self._losses.add(loss, f"{name}: {detail}" if detail else name)
        return kept.surface

    def sweep(self) -> None:
        """Forget what was not asked for since the last sweep."""
        self._kept = {key: kept for key, kept in self._kept.items() if kept.used}
        for kept in self._kept.values():
            kept.used = False
        recipes = {kept.recipe for kept in self._kept.values()}
        self._materials = {recipe: self._materials[recipe] for recipe in recipes if recipe in self._materials}
        self._textures.sweep(
            {
                each.texture
                for kept in self._kept.values()
                for each in kept.changing
                if isinstance(each, ReadTexture)
            }
        )

    def _read(self, state: Any, lit: bool, has_colors: bool) -> _Kept:
        """Return what is kept of a state."""
        from panda3d import core

        kept = _Kept(state)

        def note(loss: str, detail: str = "") -> None:
            kept.losses.append((loss, detail))

        def read(layer: Layer | None) -> Texture | None:
            if layer is None:
                return None
            texture = self._textures.read(layer.texture, layer.sampler, layer.kind)
            kept.changing.append(texture)
            return texture.texture

        alpha_mode, cutoff = _alpha_mode(state, note)
        blend = _blend(state)
        if blend == "own":
            note("surfaces that are added to what is behind, or blended in ways of their own, are left out")
            return kept
        alpha_mode = alpha_mode if blend is None else blend
        note_attributes(state, alpha_mode == "blend", note)
        attrib = state.get_attrib(core.MaterialAttrib.get_class_slot())
        material = None if attrib is None else attrib.get_material()
        if material is not None:
            numbers = tuple(type(number)(number) for number in material_numbers(material))
            kept.changing.append(_Material(material, numbers))
        writes = state.get_attrib(core.ColorWriteAttrib.get_class_slot())
        if alpha_mode is None or (writes is not None and not writes.get_channels() & writes.C_rgb):
            return kept
        culls = _culling(state)
        layers = read_layers(state, lit, note)
        kept.changing += [_Stage(stage, core.TextureStage(stage)) for stage in layers.stages]
        colors = read_colors(state, lit, has_colors, layers.emission is not None, note)
        for stage in layers.gloss:
            note("maps of gloss do not multiply highlights", stage)
        if layers.replace and any(colors.specular):
            note("surfaces whose texture replaces their colour have no highlights", "")
        unlit = not lit or layers.replace
        given: dict[str, Any] = {
            "name": "material" if material is None else material.get_name() or "material",
            "alpha_mode": alpha_mode,
            "alpha_cutoff": cutoff,
            "double_sided": culls == core.CullFaceAttrib.M_cull_none,
            "unlit": unlit,
            "local_viewer": not unlit
            and material is not None
            and material.get_local()
            and any(colors.specular),
        }
        color_scale = _color_scale(state)
        if layers.replace:
            colors, color_scale = type(colors)(), _WHITE
        given |= colors._asdict()
        use_colors = given.pop("uses_vertices")
        textures = [read(layer) for layer in layers.colors]
        given |= dict(zip(("texture", "modulate_texture"), textures, strict=False))
        if len(layers.colors) > 1:
            given["modulate_texcoord"] = layers.colors[1].texcoord
        for which, layer in (("emission", layers.emission), ("normal", layers.normal)):
            if layer is not None:
                given |= {f"{which}_texture": read(layer), f"{which}_texcoord": layer.texcoord}
        (first, matrix), (second, matrix_1) = (*layers.columns, (None, None), (None, None))[:2]
        kept.recipe = tuple(given.items())
        made = self._materials.get(kept.recipe)
        if made is None:
            made = self._materials[kept.recipe] = Material(**given)
        kept.surface = Surface(
            made,
            VertexUse(
                first,
                second,
                matrix,
                matrix_1,
                use_colors,
                lit=not unlit,
                backs=culls == core.CullFaceAttrib.M_cull_counter_clockwise,
            ),
            _render_mode(state, note),
            color_scale,
            _depth_offset(state, note),
            _half_size(state),
        )
        return kept


def _alpha_mode(state: Any, note: Any) -> tuple[AlphaMode | None, float]:
    """Return the mode and the cutoff of alpha; the mode is None where alpha tests let nothing through."""
    from panda3d import core

    attrib = state.get_attrib(core.TransparencyAttrib.get_class_slot())
    mode = core.TransparencyAttrib.M_none if attrib is None else attrib.get_mode()
    if mode != core.TransparencyAttrib.M_none:  # an alpha test does not count beside it
        if mode == core.TransparencyAttrib.M_premultiplied_alpha:
            note("colours that are multiplied by alpha already are multiplied again")
        masks = (
            core.TransparencyAttrib.M_binary,
            core.TransparencyAttrib.M_multisample,
            core.TransparencyAttrib.M_multisample_mask,
        )
        return ("mask" if mode in masks else "blend"), 0.5
    test = state.get_attrib(core.AlphaTestAttrib.get_class_slot())
    if test is None or test.get_mode() in (test.M_none, test.M_always):
        return "opaque", 0.5
    least = test.get_reference_alpha()
    if test.get_mode() == test.M_greater:
        least = float(np.nextafter(np.float32(least), np.float32(2.0)))
    elif test.get_mode() != test.M_greater_equal:
        if test.get_mode() == test.M_never:
            return None, 0.5
        note("alpha tests that let through what is below a limit cut nothing out")
        return "opaque", 0.5
    return ("mask", max(least, 0.0)) if least <= 1.0 else (None, 0.5)


def _blend(state: Any) -> Literal["opaque", "blend", "own"] | None:
    """Return how a ColorBlendAttrib mixes colours with those behind: "own" if in no way of ours."""
    from panda3d import core

    kind = core.ColorBlendAttrib
    attrib = state.get_attrib(kind.get_class_slot())
    if attrib is None or attrib.get_mode() == kind.M_none:
        return None
    operands = attrib.get_operand_a(), attrib.get_operand_b()
    if attrib.get_mode() == kind.M_add and operands == (kind.O_one, kind.O_zero):
        return "opaque"
    usual = kind.O_incoming_alpha, kind.O_one_minus_incoming_alpha
    return "blend" if attrib.get_mode() == kind.M_add and operands == usual else "own"


def _culling(state: Any) -> int:
    """Return a mode of CullFaceAttrib."""
    from panda3d import core

    kind = core.CullFaceAttrib
    attrib = state.get_attrib(kind.get_class_slot())
    return int(kind.M_cull_clockwise if attrib is None else attrib.get_effective_mode())


def _color_scale(state: Any) -> tuple[float, float, float, float]:
    from panda3d import core

    attrib = state.get_attrib(core.ColorScaleAttrib.get_class_slot())
    if attrib is None or attrib.is_off():
        return _WHITE
    red, green, blue, alpha = attrib.get_scale()
    return red, green, blue, alpha


def _depth_offset(state: Any, note: Any) -> int:
    from panda3d import core

    attrib = state.get_attrib(core.DepthOffsetAttrib.get_class_slot())
    if attrib is None:
        return 0
    if attrib.get_min_value() != 0.0 or attrib.get_max_value() != 1.0:
        note("ranges of depths (DepthOffsetAttrib) are not followed")
    return int(attrib.get_offset())


def _half_size(state: Any) -> float | None:
    """Return half the width of points in the scene's units; None if it is in pixels."""
    from panda3d import core

    attrib = state.get_attrib(core.RenderModeAttrib.get_class_slot())
    return None if attrib is None or not attrib.get_perspective() else float(attrib.get_thickness())


def _render_mode(state: Any, note: Any) -> RenderMode:
    from panda3d import core

    attrib = state.get_attrib(core.RenderModeAttrib.get_class_slot())
    if attrib is None:
        return PLAIN
    mode = attrib.get_mode()
    if mode == attrib.M_point:
        note("triangles whose vertices are to be points are filled")
    elif mode == attrib.M_filled_wireframe:
        note("triangles with wires of another colour are drawn without them")
    elif mode == attrib.M_filled_flat:
        note("flat shading is drawn smooth")
    wireframe = mode == attrib.M_wireframe
    thickness = 1.0 if attrib.get_perspective() else attrib.get_thickness()
    if wireframe and thickness != 1.0:
        note("lines are one pixel wide")
    if not 0.0 < thickness <= LARGEST_THICKNESS:
        note(f"sizes of points outside 0..{LARGEST_THICKNESS} are cut off")
        thickness = LARGEST_THICKNESS if thickness > 1.0 else 1.0
    return RenderMode("wireframe" if wireframe else "filled", float(thickness))
