"""Small graphs of Panda3D for the tests of how graphs are followed."""

from __future__ import annotations

from panda3d import core

from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.traversal import iter_visible
from tests.panda.scenes import ASPECT, card


def add_camera(root, y: float = -10.0):
    node = core.Camera("camera")
    node.get_lens().set_aspect_ratio(ASPECT)
    node.get_lens().set_near_far(1, 100)
    path = root.attach_new_node(node)
    path.set_pos(0, y, 0)
    return path


def tree():
    """Nodes that are instanced, sheared, tagged and hidden, below a root that has a parent."""
    above = core.NodePath("above")
    above.set_pos(0.5, 0, 0.25)
    root = above.attach_new_node("render")
    root.set_h(10)
    arm = root.attach_new_node("arm")
    arm.set_pos_hpr_scale(1, 2, 0, 20, 30, 40, 1, 2, 0.5)
    hand = card("hand")
    hand.reparent_to(arm)
    hand.set_hpr(15, 0, 30)
    hand.set_tag("category", "hands")
    hand.instance_to(root)
    hidden = card("hidden")
    hidden.reparent_to(root)
    hidden.hide()
    return root, add_camera(root)


def geom_nodes(scene):
    return [
        visit for visit in iter_visible(scene.root) if isinstance(visit.node, GeomNode) and visit.node.geoms
    ]


def words():
    """Two lines of coloured text, turned and scaled."""
    root = core.NodePath("render")
    text = core.TextNode("words")
    text.set_text("fire\nflies")
    text.set_align(core.TextNode.A_center)
    text.set_text_color(1, 0.5, 0.2, 1)
    text.set_transform(core.LMatrix4.scale_mat(1, 1, 1.5))  # of the letters
    root.attach_new_node(text).set_pos_hpr_scale(0, -3, 0, 10, 20, 30, 2, 2, 2)
    return root, add_camera(root)
