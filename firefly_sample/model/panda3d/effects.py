"""Effects of Panda3D's nodes: billboards and others that turn a node towards something."""

from __future__ import annotations

from typing import Any

from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.transforms import affine_matrix, node_transform
from firefly_sample.scene.arrays import Float64

_FOLLOWED = "BillboardEffect", "CompassEffect", "CharacterJointEffect", "DecalEffect"


def has_effects(node: Any) -> bool:
    """Return whether a node of Panda3D has an effect."""
    return not node.get_effects().is_empty()


def note_effects(node: Any, losses: Losses) -> None:
    """Name the effects that are not followed."""
    effects = node.get_effects()
    for index in range(effects.get_num_effects()):
        kind = effects.get_effect(index).get_type().get_name()
        if kind not in _FOLLOWED:
            losses.add(f"the effect {kind} is not drawn", node.get_name())


def state_below(node: Any, state: Any) -> Any:
    """Return the net state for what is below a node with effects: a decal comes before what it lies on.

    Panda3D draws the decals of a surface after it, and does not compare their depths with its own.

    Parameters
    ----------
    node : panda3d.core.PandaNode
    state : panda3d.core.RenderState
        The net state of the node.
    """
    from panda3d import core

    if not node.has_effect(core.DecalEffect.get_class_type()):
        return state
    return state.compose(core.RenderState.make(core.DepthOffsetAttrib.make(1)))


def adjusted_net(node: Any, above: Float64, eye: Float64 | None) -> Float64 | None:
    """Return the matrix from a node with effects to the world; None if they do not move it.

    Panda3D computes it, for a node of its own in the same place.

    Parameters
    ----------
    node : panda3d.core.PandaNode
    above, eye : ndarray of shape (4, 4)
        From the node's parent and from the camera to the world. Without a camera's, nothing turns towards it.
    """
    from panda3d import core

    billboard = node.get_effect(core.BillboardEffect.get_class_type())
    compass = node.get_effect(core.CompassEffect.get_class_type())
    if billboard is not None and eye is None and billboard.get_look_at().is_empty():
        billboard = None
    if billboard is None and compass is None:
        return None
    root = core.NodePath("root")

    def place(matrix: Float64) -> Any:
        path = root.attach_new_node("place")
        path.set_mat(core.LMatrix4(*matrix.ravel().tolist()))
        return path

    def target(path: Any) -> Any:
        return root if path.is_empty() else place(affine_matrix(path.get_net_transform().get_mat()))

    stand_in = place(above).attach_new_node("node")
    stand_in.set_transform(node_transform(node))
    if compass is not None:
        reference = target(compass.get_reference())
        stand_in.set_effect(core.CompassEffect.make(reference, compass.get_properties()))
    if billboard is not None and not billboard.is_off():
        look_at = billboard.get_look_at()
        stand_in.set_effect(
            core.BillboardEffect.make(
                billboard.get_up_vector(),
                billboard.get_eye_relative(),
                billboard.get_axial_rotate(),
                billboard.get_offset(),
                place(eye) if eye is not None and look_at.is_empty() else target(look_at),
                billboard.get_look_at_point(),
                billboard.get_fixed_depth(),
            )
        )
    return affine_matrix(stand_in.get_net_transform().get_mat())
