"""A tree of our nodes that follows a Panda3D graph: each update changes only what has changed there."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from firefly_sample.errors import SceneError
from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.effects import adjusted_net, has_effects, note_effects, state_below
from firefly_sample.model.panda3d.followed import Followed
from firefly_sample.model.panda3d.geometry import FIRST, Drawn, Geometry, Lit, geom_states
from firefly_sample.model.panda3d.lenses import read_lens
from firefly_sample.model.panda3d.lights import light_state, read_light
from firefly_sample.model.panda3d.selection import selected_children
from firefly_sample.model.panda3d.transforms import (
    affine_matrix,
    local_transform,
    node_transform,
    read_transform,
)
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.node import ALL_CAMERAS, OVERALL_BIT, PandaNode
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.scene import Camera
from firefly_sample.scene.transform_state import TransformState

_SEEN = OVERALL_BIT | ALL_CAMERAS
"""The mask of a node that nothing hides."""
_LAST = 2**30
"""Sorts lights that are not below the root after the root's children, whose sorts count from 0."""


class _Waiting(NamedTuple):
    """A node that is yet to be visited."""

    followed: Followed
    state: Any  # Panda3D's RenderState, of all that is above
    net: Float64  # of all that is above
    mask: int  # the cameras that may see it, by all that is above


class _Lamp(NamedTuple):
    """A light of this update."""

    followed: Followed
    mask: int  # the cameras that see its node


class GraphTree:
    """Follows the graph below one of Panda3D's NodePaths.

    Each path of Panda3D's graph has a node of ours with its name, transform, tags and masks; instances are
    one node for each path, and share their Geoms. What geometry inherits (colours, materials, textures,
    render modes) is composed by Panda3D and stands at the nodes with geometry.

    Parameters
    ----------
    root : panda3d.core.NodePath
        Nodes above it count for transforms and states, and are not drawn.
    losses : Losses
        Gets all that is not drawn, or drawn differently.

    Attributes
    ----------
    lit : bool or None
        Whether surfaces are lit that do not say otherwise; None: if the graph has a light. If `set_light` was
        called for every light, it decides what is lit.
    """

    def __init__(self, root: Any, losses: Losses) -> None:
        self._source, self._losses = root, losses
        self._geometry = Geometry(losses)
        self._clock: float | None = None
        self._top = Followed(root.node(), NodePath(self._made(root.node())))
        self._far_lights: dict[Any, Followed] = {}
        self._set_lights: set[Any] = set()  # what `set_light` was called for, as far as was seen
        self.lit: bool | None = None

    @property
    def path(self) -> NodePath:
        """Our node of the root."""
        return self._top.path

    def update(self, eye: Float64 | None, camera: Any = None) -> list[Followed]:
        """Bring the tree up to date, and return its cameras.

        Parameters
        ----------
        eye : ndarray of shape (4, 4) or None
            From the camera to the space of Panda3D's top node. Without it, what depends on the distance shows
            its nearest level, and nothing turns towards the camera.
        camera : panda3d.core.NodePath, optional
            Of a Camera, whose initial state and factor for levels of detail count.

        Raises
        ------
        SceneError
            If a transform has a number that is not finite.
        """
        drawn, cameras, lights = self._walk(eye, camera)
        self._geometry.draw(drawn, self._follow_lights(drawn, lights), eye)
        return cameras

    # --- the graph ---

    def _walk(self, eye: Float64 | None, camera: Any) -> tuple[list[Drawn], list[Followed], list[_Lamp]]:
        """Follow all nodes; return those with geometry, the cameras, and the lights."""
        from panda3d import core

        drawn: list[Drawn] = []
        cameras: list[Followed] = []
        lights: list[_Lamp] = []
        above = self._source.get_parent()
        state, net = above.get_net_state(), affine_matrix(above.get_net_transform().get_mat())
        if camera is not None:
            state = camera.node().get_initial_state().compose(state)
        now = core.ClockObject.get_global_clock().get_frame_time()
        stopped, self._clock = now == self._clock, now  # then `Character.update` would do nothing
        waiting = [_Waiting(self._top, state, net, _SEEN)]
        while waiting:
            followed, state, net, mask = waiting.pop()
            node = followed.source
            if not node.get_state().is_empty():
                state = state.compose(node.get_state())
            above_net = net
            net = self._move(followed, above_net, eye)
            control, show = self._mask(followed, node)
            mask = mask & ~control | show & control
            if isinstance(node, core.GeomNode):
                drawn.append(Drawn(followed, geom_states(node, state), net, node))
            elif node.as_light() is not None:  # most lights are Cameras, too
                lights.append(_Lamp(followed, mask))
            elif isinstance(node, core.Camera):
                cameras.append(followed)
                self.follow_lens(followed)
            elif isinstance(node, core.Character):
                node.force_update() if stopped else node.update()
            else:
                self._note_type(node)
            children = selected_children(node, net, eye, camera, self._losses)
            if isinstance(node, core.TextNode) and (text := node.get_internal_geom()) is not None:
                children = [*children, text]  # what Panda3D draws of it, which is new whenever it changes
            if has_effects(node):
                state = state_below(node, state)
            waiting.extend(_Waiting(below, state, net, mask) for below in self._children(followed, children))
        return drawn, cameras, lights

    def _children(self, followed: Followed, children: Sequence[Any]) -> Iterable[Followed]:
        """Return what follows the children of a node, in reverse; drop what follows those that are gone."""
        order = tuple(children)
        if order != followed.order:
            below = followed.below
            for gone in [node for node in below if node not in order]:
                below.pop(gone).path.remove_node()
            for index, child in enumerate(order):  # sums of lights depend on their order
                if child not in below:
                    below[child] = Followed(child, NodePath(self._made(child)))
                below[child].path.reparent_to(followed.path, index)
            followed.order = order
        return [followed.below[child] for child in reversed(order)]

    def _made(self, node: Any) -> PandaNode:
        """Return a node of ours for one of Panda3D's, without what `update` gives it."""
        from panda3d import core

        name = node.get_name()
        made: PandaNode
        if isinstance(node, core.GeomNode):
            made = GeomNode(name)
        elif isinstance(node, core.Camera) and node.as_light() is None:
            made = Camera(name)
        else:  # a light comes with the first update
            made = PandaNode(name)
        made.tags = {key: node.get_tag(key) for key in node.get_tag_keys()}
        return made

    def _move(self, followed: Followed, net: Float64, eye: Float64 | None) -> Float64:
        """Give a node its transform; return the matrix from it to the world, by that of its parent."""
        node = followed.source
        transform, path = node_transform(node), followed.path
        if has_effects(node):
            note_effects(node, self._losses)
            adjusted = adjusted_net(node, net, eye)
            if adjusted is not None:
                path.node().set_transform(local_transform(adjusted, net))
                followed.transform = None
                return adjusted
        if followed is self._top:  # what is above the root counts, too
            mat = read_transform(transform, str(path)).get_mat() @ net
            if not np.array_equal(mat, path.node().transform.get_mat()):
                path.node().set_transform(TransformState.make_mat(mat))
            return mat
        if transform != followed.transform:
            path.node().set_transform(read_transform(transform, str(path)))
            followed.transform = transform
        made = path.node().transform
        return net if made.is_identity() else made.get_mat() @ net

    def _mask(self, followed: Followed, node: Any) -> tuple[int, int]:
        """Give a node the masks by which it is hidden from cameras, and return them."""
        masks = node.get_draw_control_mask().get_word(), node.get_draw_show_mask().get_word()
        if masks != followed.masks:
            made = followed.path.node()
            made.draw_control, made.draw_show = masks
            made.mark_changed()
            followed.masks = masks
        return masks

    def _note_type(self, node: Any) -> None:
        """Name a node that Panda3D draws in a way of its own."""
        from panda3d import core

        drawn_by_itself = node.get_fancy_bits() & core.PandaNode.FB_cull_callback
        quiet = (
            core.TextNode,
            core.LODNode,
            core.SwitchNode,
            core.SequenceNode,
            core.RigidBodyCombiner,
            core.PortalNode,
        )
        terrain = isinstance(node, core.ShaderTerrainMesh)
        if terrain or (drawn_by_itself and not isinstance(node, quiet) and not node.is_overall_hidden()):
            self._losses.add(f"nodes of the type {node.get_type().get_name()} are not drawn", node.get_name())

    # --- cameras ---

    def follow_lens(self, followed: Followed) -> None:
        """Give a camera its lens; one with an offset of its own gets a node of its own."""
        node, path = followed.source, followed.path
        lens = node.get_lens()
        key = *_lens_key(lens), node.get_camera_mask().get_word()
        if key == followed.content:
            return
        followed.content = key
        if followed.lens is not None:
            followed.lens.remove_node()
            followed.lens = None
        try:
            made, extra = read_lens(lens, node.get_name(), self._losses)
        except SceneError as error:
            followed.fault = error
            return
        followed.fault = None
        if extra is not None:
            path = followed.lens = path.attach_new_node(Camera(node.get_name()))
            path.node().set_transform(TransformState.make_mat(extra))
        camera = path.node()
        assert isinstance(camera, Camera)
        camera.lens = made
        camera.camera_mask = node.get_camera_mask().get_word()

    # --- lights ---

    def _light(self, followed: Followed, node: Any, mask: int, is_off: bool = False) -> None:
        """Read a light anew if it has changed.

        In Panda3D a light that is hidden still lights. Ours is then a node of its own below the hidden one.
        """
        apart = mask != _SEEN or followed is self._top
        state = light_state(node), apart, is_off
        if state == followed.content:
            return
        for path in followed.aside:
            path.remove_node()
        followed.aside.clear()
        light = read_light(node, self._losses)
        if not apart and not is_off:
            self._replace(followed, light)
        elif followed is not self._top:
            self._replace(followed, PandaNode(light.name))
        if apart and not is_off:
            light.draw_control = light.draw_show = _SEEN
            followed.aside.append(followed.path.attach_new_node(light, FIRST))
        followed.content = state

    def _replace(self, followed: Followed, made: PandaNode) -> None:
        """Put another node of ours in the place of one."""
        old = followed.path
        made.set_transform(old.node().transform)
        made.tags = old.node().tags
        fresh = old.get_parent().attach_new_node(made, old.get_sort())
        for child in old.get_children():
            child.reparent_to(fresh, child.get_sort())
        old.remove_node()
        followed.path, followed.masks = fresh, None
        self._mask(followed, followed.source)

    def _follow_lights(self, drawn: Sequence[Drawn], lamps: Sequence[_Lamp]) -> Lit:
        """Follow lights, also those that are set but are not below the root, and return what is lit.

        Where `set_light` was called for every light, a Geom that it was not called for is unlit, and a light
        that is set on nothing any more is off. Lights that light more than they are set on are named.
        """
        from panda3d import core

        lights = {lamp.followed.source for lamp in lamps}
        slot = core.LightAttrib.get_class_type()
        attribs = {state.get_attrib(slot) for each in drawn for state in each.states}
        on = [
            set(attrib.get_on_lights()) if attrib is not None else set()
            for attrib in attribs
            if attrib is None or not attrib.has_all_off() or attrib.get_num_on_lights()
        ]
        wanted = set().union(*on)
        far = {path.node(): path for path in wanted if path.node() not in lights}
        self._set_lights = {node for node in self._set_lights if node in lights}
        self._set_lights.update(path.node() for path in wanted)
        any_light = bool(lights or far) if self.lit is None else self.lit
        lit: Lit = "everything" if any_light else "nothing"
        if self.lit is None and any_light and lights <= self._set_lights:
            lit, on = "as set", [each for each in on if each]
        set_now = {path.node() for path in wanted}
        for followed, mask in lamps:
            node = followed.source
            self._light(followed, node, mask, lit == "as set" and node not in set_now)
        everywhere = set.intersection(*on) if on else set()
        off = set().union(*(attrib.get_off_lights() for attrib in attribs if attrib is not None))
        for path in (wanted - everywhere) | off:
            self._losses.add("lights that are set on a part of the graph light all of it", path.get_name())
        for node in [node for node in self._far_lights if node not in far]:
            self._far_lights.pop(node).path.remove_node()
        top = self._top.path.node().transform.get_mat()
        for node, path in far.items():
            if node not in self._far_lights:
                made = self._top.path.attach_new_node(PandaNode(node.get_name()), _LAST + path.get_key())
                self._far_lights[node] = Followed(node, made)
            followed = self._far_lights[node]
            self._light(followed, node, 0)  # whatever hides it or the root
            net = affine_matrix(path.get_net_transform().get_mat())
            followed.path.node().set_transform(local_transform(net, top))
        return lit


def _lens_key(lens: Any) -> tuple[Any, ...]:
    kind, near, far = lens.get_type().get_name(), lens.get_near(), lens.get_far()
    return kind, *map(tuple, lens.get_projection_mat()), near, far
