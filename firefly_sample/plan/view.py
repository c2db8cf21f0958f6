"""The camera of a frame: the lens that a picture is drawn with, and its matrices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import LensError, NodeError
from firefly_sample.plan.frustum import frustum_corners
from firefly_sample.scene.arrays import LARGEST
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.lens_constants import LensConstants
from firefly_sample.scene.scene import Scene

Float64 = NDArray[np.float64]

PLANES = 1e-37, LARGEST
"""Smallest and largest near distance: float32 holds it, with room for a product."""


@dataclass(frozen=True, eq=False)
class View:
    """The camera of one frame, as a plan has it.

    Attributes
    ----------
    size : (int, int)
        Samples across and down: the picture's size times the supersampling.
    lens : LensConstants
        For the clip range and depth direction that this frame is drawn with.
    reverse : bool
        True if near is depth 1, far 0, in the [0, 1] clip range; False for OpenGL's own.
    near, far : float
        Scene units; far may be infinite.
    world_to_view, view_to_world : ndarray of float64, shape (4, 4)
        For row vectors.
    """

    size: tuple[int, int]
    lens: LensConstants
    reverse: bool
    near: float
    far: float
    world_to_view: Float64
    view_to_world: Float64


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
        Accept a lens of intrinsics for pictures of another shape: a window may get any shape.

    Attributes
    ----------
    name : str
        The camera's path.
    lens : Lens
    warnings : tuple of str
        About the lens's shape.
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
        self.lens, self.warnings = _lens_for(scene, size, window)
        self._check_planes()
        self.camera = camera_matrices(scene)
        self.planes = self.lens.frustum_planes()
        self.corners = frustum_corners(self.lens.constants(), self.lens.get_near(), self.lens.get_far())

    def _check_planes(self) -> None:
        near, far = self.lens.get_near(), self.lens.get_far()
        low, high = PLANES
        if self.lens.is_perspective():
            if not low <= near <= high:
                raise LensError(
                    f"camera {self.name}: a frame is drawn in float32, which needs a perspective near plane "
                    f"of {low:g} to {high:g} units, got {near:g}: give the scene another unit"
                )
        elif max(abs(near), abs(far)) > high:
            raise LensError(
                f"camera {self.name}: a frame is drawn in float32, which needs orthographic planes of at "
                f"most {high:g} units, got near {near:g} and far {far:g}: give the scene another unit"
            )


def eye_state(scene: Scene, size: tuple[int, int]) -> tuple[Any, ...]:
    """Return a key of everything that an `Eye` is made from."""
    lens = scene.lens
    return lens, lens.revision, size, scene.camera.get_net_transform().get_mat().tobytes()


def lens_for_picture(lens: Lens, size: tuple[int, int]) -> tuple[Lens, str]:
    """Return the lens that a picture of a size is drawn with, and how it contradicts the picture's shape.

    Where two of the lens's numbers contradict it, one is kept, as in Panda3D's window. The text begins with
    "its"; it is empty if there is no contradiction.

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
    """Return the camera's lens for a picture of a size, and warnings about its shape."""
    lens, shape = scene.lens, scene.lens.shape
    if window and shape.fixed_by and not shape.fits(*size):
        # without the window's size and the camera's name, so that dragging the window repeats no line
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
    """Return a copy of a lens that takes a picture's shape, whatever fixed its own."""
    lens = lens.make_copy()
    lens.set_aspect_ratio(None)
    return lens.for_picture(*size)


def camera_matrices(scene: Scene) -> CameraMatrices:
    """Return world to view and back, without the scale and shear that a camera's parents may have.

    The forward direction stays; right and up are made perpendicular to it.

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
