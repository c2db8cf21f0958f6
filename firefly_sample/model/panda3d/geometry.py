"""The geometry of Panda3D's nodes: each node of ours gets the Geoms and materials of its counterpart."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, NamedTuple

import numpy as np

from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.followed import Followed
from firefly_sample.model.panda3d.parts import GeomCache, Part
from firefly_sample.model.panda3d.sprites import facing
from firefly_sample.model.panda3d.states import StateReader
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.render_mode import PLAIN

Lit = Literal["nothing", "everything", "as set"]
"""Which Geoms are lit: none; all without `set_light_off`; or those that `set_light` gives a light."""
_WHITE = (1.0, 1.0, 1.0, 1.0)
FIRST = -1
"""Sorts nodes that Panda3D does not have before its own, so that the order is the same after any change."""


class Drawn(NamedTuple):
    """A node with geometry of this update."""

    followed: Followed
    states: list[Any]  # Panda3D's net RenderStates, one for each Geom
    net: Float64
    source: Any  # Panda3D's GeomNode


def geom_states(source: Any, state: Any) -> list[Any]:
    """Return the net states of a GeomNode's Geoms, from that of the node itself."""
    owns = [source.get_geom_state(index) for index in range(source.get_num_geoms())]
    return [state if own.is_empty() else state.compose(own) for own in owns]


class Geometry:
    """Gives nodes of ours the Geoms and materials of Panda3D's, and keeps what has not changed.

    Parameters
    ----------
    losses : Losses
        Gets all that is not drawn, or drawn differently.
    """

    def __init__(self, losses: Losses) -> None:
        self._states = StateReader(losses)
        self._geoms = GeomCache(losses)

    def draw(self, drawn: Iterable[Drawn], lit: Lit, eye: Float64 | None) -> None:
        """Bring the nodes up to date; `eye` is the matrix from the camera to the world."""
        from panda3d import core

        slot = core.LightAttrib.get_class_type()
        for followed, states, matrix, source in drawn:
            parts: list[Part] = []
            mirrored = float(np.linalg.det(matrix[:3, :3])) < 0.0
            name = _name(followed)
            for index, net in enumerate(states):
                is_lit = _is_lit(net.get_attrib(slot), lit)
                geom = source.get_geom(index)
                surface = self._states.surface(net, is_lit, geom.get_vertex_data().has_column("color"), name)
                if surface is None:
                    continue
                # the sides of triangles change places in a mirror in Panda3D, and not in our renderer
                use = surface.use._replace(backs=surface.use.backs != mirrored)
                if surface.half_size is None:
                    made = self._geoms.of(geom, use, name)
                else:
                    how = facing(matrix, eye, surface.half_size)
                    made = self._geoms.of(geom, use, name, how, followed)
                parts += [Part(each, surface) for each in made]
            content = tuple(parts)
            if len(content) != len(followed.content) or any(
                new.geom is not old.geom or new.surface is not old.surface
                for new, old in zip(content, followed.content, strict=True)
            ):
                _fill(followed, content)
                followed.content = content
        self._geoms.sweep()
        self._states.sweep()


def _is_lit(attrib: Any, lit: Lit) -> bool:
    """Return whether a Geom with this LightAttrib, or None, is lit."""
    if lit == "nothing":
        return False
    is_on = attrib is not None and attrib.get_num_on_lights() > 0
    return is_on or (lit == "everything" and not (attrib is not None and attrib.has_all_off()))


def _name(followed: Followed) -> str:
    """Return the name of a node; without one, that of the nearest node above it that has one."""
    path = followed.path
    while not path.node().name and path.has_parent():
        path = path.get_parent()
    return path.node().name


def _fill(followed: Followed, parts: Iterable[Part]) -> None:
    """Make a node draw other parts: those with attributes of their own by nodes below it."""
    node = followed.path.node()
    assert isinstance(node, GeomNode)
    for path in followed.aside:
        path.remove_node()
    followed.aside.clear()
    node.remove_all_geoms()
    for geom, surface in parts:
        if surface.render_mode == PLAIN and surface.color_scale == _WHITE and not surface.depth_offset:
            node.add_geom(geom, surface.material)
            continue
        made = GeomNode(node.name)
        made.add_geom(geom, surface.material)
        made.render_mode = surface.render_mode
        path = followed.path.attach_new_node(made, FIRST)
        if surface.color_scale != _WHITE:
            path.set_color_scale(surface.color_scale)
        if surface.depth_offset:
            path.set_depth_offset(surface.depth_offset)
        followed.aside.append(path)
