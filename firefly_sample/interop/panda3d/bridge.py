"""Convert a Panda3D scene graph, once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from firefly_sample.errors import SceneError
from firefly_sample.interop.panda3d.mirror import GraphMirror
from firefly_sample.model.panda3d.package import import_panda3d
from firefly_sample.scene.scene import Scene

if TYPE_CHECKING:
    from panda3d import core


def from_panda3d(
    root: core.NodePath,
    camera: core.NodePath | None = None,
    *,
    background: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Scene:
    """Return a Panda3D scene graph, as it is now, as a new Scene.

    Numbers stay as they are. Draw the scene with ``Settings(look="panda3d")`` for a picture like that of
    Panda3D's shader generator, which multiplies colours and textures as they are stored. The other looks take
    colours as linear and decode textures from sRGB, as Panda3D does where its frame buffer and its textures
    are sRGB.

    Every path of the graph gets a node with its name, transform, tags and masks. Instances are a node for
    each path, and share their Geoms. Levels of detail, billboards and characters are as the camera sees them
    now. Every light lights everything, whether `set_light` was called for it or not, except what
    `set_light_off` was called for. If `set_light` was called for every light, what it was not called for is
    unlit. Where there is no light at all, surfaces show their colours without light, as in Panda3D.

    Parameters
    ----------
    root : panda3d.core.NodePath
        What is drawn: this node and all that is below it. Transforms and states above it count.
    camera : panda3d.core.NodePath, optional
        A path to a Camera, anywhere. When absent, the first one below the root, or else one at the origin.
    background : (float, float, float)
        The colour where nothing is drawn.

    Raises
    ------
    MissingPackageError
        If Panda3D is not installed.
    SceneError
        If an argument has the wrong type, no lens of ours has the projection of the camera's lens, or a
        number is not finite.

    Warns
    -----
    ConversionWarning
        Once for each kind of thing that is not drawn, or is drawn differently, with the names of the nodes.
    """
    check_paths("from_panda3d", root, camera)
    mirror = GraphMirror(root, camera, background=background)
    scene = mirror.update()
    mirror.losses.warn(stacklevel=2)
    return scene


def check_paths(function: str, root: Any, camera: Any) -> None:
    """Raise SceneError if what a function was given are not paths of Panda3D to a node and to a Camera."""
    core = import_panda3d()
    if not isinstance(root, core.NodePath) or root.is_empty():
        raise SceneError(f"{function} takes a panda3d.core.NodePath that is not empty, got {root!r}")
    if camera is None:
        return
    if (
        not isinstance(camera, core.NodePath)
        or camera.is_empty()
        or not isinstance(camera.node(), core.Camera)
    ):
        hint = ""
        if (
            isinstance(camera, core.NodePath)
            and not camera.is_empty()
            and not camera.find("**/+Camera").is_empty()
        ):
            hint = ": the Camera is below it (base.cam, not base.camera)"
        raise SceneError(f"{function} takes a panda3d.core.NodePath to a Camera, got {camera!r}{hint}")
