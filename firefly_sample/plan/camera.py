"""Find a scene's camera and the lens that a picture is drawn with."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import LensError, NodeError
from firefly_sample.plan.frustum import frustum_corners
from firefly_sample.scene.arrays import LARGEST
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.scene import Scene

Float64 = NDArray[np.float64]

PLANES = 1e-37, LARGEST
"""Smallest and largest near distance: float32 holds it, and keeps room for a product."""


class CameraMatrices(NamedTuple):
    """World to view and back: float64, shape (4, 4), for row vectors."""

    world_to_view: Float64
    view_to_world: Float64


class Eye:
    """A scene's camera for a picture's size, and what follows from it alone.

    Parameters
    ----------
    scene : Scene
    size : (int, int)
        Of the picture in pixels.
    window : bool
        Draw intrinsics, too, in a shape that they do not fit: a window may get any shape.

    Attributes
    ----------
    name : str
        The camera's path.
    lens : Lens
    warnings : tuple of str
        On the lens's shape.
    camera : CameraMatrices
    planes, corners : ndarray of float64
        See `Lens.frustum_planes` and `firefly_sample.plan.frustum.frustum_corners`.

    Raises
    ------
    LensError
        If the lens is one of intrinsics for pictures of another shape, or float32 does not hold its planes;
        it names the camera.
    """

    def __init__(self, scene: Scene, size: tuple[int, int], window: bool = False) -> None:
        self.name = str(scene.camera)
        lens, self.warnings = _lens_for(scene, size, window)
        self.lens = _checked(lens, self.name)
        self.camera = camera_matrices(scene)
        self.planes = self.lens.frustum_planes()
        self.corners = frustum_corners(self.lens.constants(), self.lens.get_near(), self.lens.get_far())


def _checked(lens: Lens, name: str) -> Lens:
    """Return the lens, if float32 holds its planes.

    Raises
    ------
    LensError
        If it does not; it names the camera.
    """
    near, far = lens.get_near(), lens.get_far()
    low, high = PLANES
    if lens.is_perspective() and not low <= near <= high:
        raise LensError(
            f"camera {name}: a frame is drawn in float32, which needs a perspective near plane of {low:g} to "
            f"{high:g} units, got {near:g}: give the scene another unit"
        )
    if lens.is_orthographic() and max(abs(near), abs(far)) > high:
        raise LensError(
            f"camera {name}: a frame is drawn in float32, which needs orthographic planes of at most "
            f"{high:g} units, got near {near:g} and far {far:g}: give the scene another unit"
        )
    return lens


def eye_state(scene: Scene, size: tuple[int, int]) -> tuple[Any, ...]:
    """Return what an `Eye` is made of: equal for those that are equal."""
    lens = scene.lens
    return lens, lens.revision, size, scene.camera.get_net_transform().get_mat().tobytes()


def lens_for_picture(lens: Lens, size: tuple[int, int]) -> tuple[Lens, str]:
    """Return the lens that a picture of a size is drawn with, and what contradicts the picture's shape.

    Where two numbers do, one of them stays, as in Panda3D's window. The words begin with "its", and are empty
    where nothing does.

    Raises
    ------
    LensError
        If the lens is one of intrinsics for pictures of another shape.
    """
    shape = lens.shape
    if not shape.fixed_by or shape.fits(*size):
        return lens.for_picture(*size), ""
    if shape.calibrated:
        raise LensError(shape.refusal(*size))
    return _shaped(lens, size), shape.refusal(*size)


def _lens_for(scene: Scene, size: tuple[int, int], window: bool) -> tuple[Lens, tuple[str, ...]]:
    """Return the camera's lens for a picture of a size, and warnings of its shape."""
    lens, shape = scene.lens, scene.lens.shape
    if window and shape.fixed_by and not shape.fits(*size):
        # without the window's size and the camera's name: one line is enough while the window or the view is
        # dragged
        warning = (
            f"the camera's {shape.fixed_by} fixes the picture's aspect ratio at {shape.picture:.5g} and the "
            "window has another, so it shows more or less than the lens says"
        )
        return _shaped(lens, size), (warning,)
    try:
        lens, contradiction = lens_for_picture(lens, size)
    except LensError as error:
        raise LensError(f"camera {scene.camera}: {error}") from None
    if not contradiction:
        return lens, ()
    return lens, (f"camera {scene.camera}: {contradiction}; it is drawn with the picture's aspect ratio",)


def _shaped(lens: Lens, size: tuple[int, int]) -> Lens:
    """Return a lens that takes the shape of a picture, whatever fixed its own."""
    lens = lens.make_copy()
    lens.set_aspect_ratio(None)
    return lens.for_picture(*size)


def camera_matrices(scene: Scene) -> CameraMatrices:
    """Return world to view and back, without the scale and the shear that a camera's parents may have.

    The way forward stays; right and up are made perpendicular to it.

    Raises
    ------
    NodeError
        If the camera's net transform is singular, mirrored or not finite.
    """
    net = np.array(scene.camera.get_net_transform().get_mat(), dtype=np.float64)
    if not np.isfinite(net).all() or not np.linalg.det(net[:3, :3]) > 0:
        raise NodeError(
            f"camera {scene.camera}: its net transform is singular, mirrored or not finite: "
            "give it and its parents scales above 0"
        )
    forward = net[1, :3] / np.linalg.norm(net[1, :3])
    right = net[0, :3] - (net[0, :3] @ forward) * forward
    right /= np.linalg.norm(right)
    view_to_world = np.eye(4)
    view_to_world[:3, :3] = right, forward, np.cross(right, forward)
    view_to_world[3, :3] = net[3, :3]
    return CameraMatrices(np.asarray(np.linalg.inv(view_to_world), dtype=np.float64), view_to_world)
