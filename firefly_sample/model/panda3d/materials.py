"""The colours of one of Panda3D's states, as its shader generator takes them, for a material of ours."""

from __future__ import annotations

from typing import Any, NamedTuple

from firefly_sample.model.panda3d.stages import Note
from firefly_sample.scene.arrays import LARGEST
from firefly_sample.scene.material import LARGEST_SHININESS

Color = tuple[float, float, float]
WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
_LEAST_SHININESS = 2.0**-12
"""Stands for 0, which is a Material's first: in Panda3D's shaders the zeroth power of 0 is 0, not 1."""


class Colors(NamedTuple):
    """Colours and opacity of a surface; fields as of a `Material`.

    Attributes
    ----------
    uses_vertices : bool
        True if vertex colours multiply them.
    """

    base_color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    uses_vertices: bool = False
    ambient: Color | None = None
    emission: Color = BLACK
    specular: Color = BLACK
    shininess: float = 0.0


def read_colors(state: Any, lit: bool, has_vertex_colors: bool, glows: bool, note: Note) -> Colors:
    """Return the colours of a net state.

    Vertex or flat colours stand for what of ambient and diffuse a Panda3D Material does not set; opacity goes
    with diffuse. What is not lit shows them alone, whatever its Material is.

    Parameters
    ----------
    state : panda3d.core.RenderState
    lit : bool
    has_vertex_colors : bool
        True if vertices have a column of colours.
    glows : bool
        True if a texture multiplies the emission, which is white where no Material sets it.
    note : callable
        Takes each loss.
    """
    from panda3d import core

    flat = state.get_attrib(core.ColorAttrib.get_class_slot())
    by_vertices = has_vertex_colors and (flat is None or flat.get_color_type() == core.ColorAttrib.T_vertex)
    own, alpha = WHITE, 1.0
    if flat is not None and flat.get_color_type() == core.ColorAttrib.T_flat:
        color = flat.get_color()
        own, alpha = _color(color, note), _share(color[3], note)
    plain = Colors((*own, alpha), by_vertices, emission=WHITE if glows else BLACK)
    attrib = state.get_attrib(core.MaterialAttrib.get_class_slot())
    material = None if attrib is None else attrib.get_material()
    if not lit or material is None:
        return plain
    all_set = material.has_base_color()
    emission = plain.emission
    if material.has_emission():
        emission = _color(material.get_emission(), note, LARGEST)
    specular, shininess = BLACK, 0.0
    if all_set or material.has_specular():
        specular = _color(material.get_specular(), note)
        if any(specular):
            shininess = max(_share(material.get_shininess(), note, LARGEST_SHININESS), _LEAST_SHININESS)
    diffuse = _color(material.get_diffuse(), note) if all_set or material.has_diffuse() else None
    ambient = _color(material.get_ambient(), note) if all_set or material.has_ambient() else None
    if by_vertices and (diffuse is None) != (ambient is None):
        which = "ambient light" if ambient is None else "lights but ambient ones"
        note(f"vertex colours do not count for {which} alone, as their material has it", material.get_name())
    if diffuse is None:
        base = own
    else:
        base, by_vertices, alpha = diffuse, False, _share(material.get_diffuse()[3], note)
    ambient = own if ambient is None else ambient
    return Colors(
        (*base, alpha), by_vertices, None if ambient == base else ambient, emission, specular, shininess
    )


def material_numbers(material: Any) -> tuple[Any, ...]:
    """Return all that `read_colors` reads of a Material; vectors are those of the Material itself."""
    return (
        material.get_ambient(),
        material.get_diffuse(),
        material.get_specular(),
        material.get_emission(),
        material.get_shininess(),
        material.get_local(),
        material.has_ambient(),
        material.has_diffuse(),
        material.has_specular(),
        material.has_emission(),
        material.has_base_color(),
    )


def _color(color: Any, note: Note, largest: float = 1.0) -> Color:
    red, green, blue = (_share(color[channel], note, largest) for channel in range(3))
    return red, green, blue


def _share(number: float, note: Note, largest: float = 1.0) -> float:
    if 0.0 <= number <= largest:
        return float(number)
    note(f"numbers of colours and materials outside 0..{largest:g} are cut off", "")
    return largest if number > largest else 0.0
