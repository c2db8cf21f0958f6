"""The camera of a frame: the lens that a picture is drawn with, and its matrices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from firefly_sample.errors import LensError, NodeError
from firefly_sample.plan.frustum import frustum_corners
from firefly_sample.scene.arrays import LARGEST, Float64
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.lens_constants import LensConstants
from firefly_sample.scene.lens_shape import lens_for_picture, reshaped
from firefly_sample.scene.scene import Scene

NEAREST = 1e-37
"""The smallest near distance, as `LARGEST` is the largest: float32 holds both, with room for a product."""


@dataclass(frozen=True, eq=False)
class View:
    """The camera of one frame, as a plan has it; matrices are for row vectors."""

    size: tuple[int, int]  # samples across and down: the picture's size times the supersampling
    lens: LensConstants  # for the clip range and depth direction that this frame is drawn with
    reverse: bool  # True if near is depth 1, far 0, in the [0, 1] clip range; False for OpenGL's own
    near: float  # scene units
    far: float  # may be infinite
    world_to_view: Float64  # (4, 4)
    view_to_world: Float64  # (4, 4)


class CameraMatrices(NamedTuple):
    """World to view and back: float64, shape (4, 4), for row vectors."""

    world_to_view: Float64
    view_to_world: Float64


class Eye:
    """A scene's camera, for pictures of a size in pixels.

    `window` accepts a lens of intrinsics for pictures of another shape: a window may get any shape.

    It has the camera's path as its name, warnings about the lens's shape, and the view's planes and corners:
    see `Lens.frustum_planes` and `frustum_corners`. A `LensError` names the camera if the lens is one of
    intrinsics for pictures of another shape, or if float32 does not hold its planes.
    """

    def __init__(self, scene: Scene, size: tuple[int, int], window: bool = False) -> None:
        self.name = str(scene.camera)
        self.lens, self.warnings = _lens_for(scene, size, window)
        near, far = self.lens.get_near(), self.lens.get_far()
        if self.lens.is_perspective():
            drawable = NEAREST <= near <= LARGEST
            needed = f"a perspective near plane of {NEAREST:g} to {LARGEST:g} units, got {near:g}"
        else:
            drawable = max(abs(near), abs(far)) <= LARGEST
            needed = f"orthographic planes of at most {LARGEST:g} units, got near {near:g} and far {far:g}"
        if not drawable:
            raise LensError(
                f"camera {self.name}: a frame is drawn in float32, which needs {needed}: give the scene "
                "another unit"
            )
        self.camera = camera_matrices(scene)
        self.planes = self.lens.frustum_planes()
        self.corners = frustum_corners(self.lens.constants(), near, far if far <= LARGEST else np.inf)


def eye_state(scene: Scene, size: tuple[int, int]) -> tuple[Any, ...]:
    """Return a key of everything that an `Eye` is made from."""
    lens = scene.lens
    return lens, lens.revision, size, scene.camera.get_net_transform().get_mat().tobytes()


def _lens_for(scene: Scene, size: tuple[int, int], window: bool) -> tuple[Lens, tuple[str, ...]]:
    """Return the camera's lens for a picture of a size, and warnings about its shape."""
    lens, shape = scene.lens, scene.lens.shape
    if window and shape.fixed_by and not shape.fits(*size):
        # without the window's size and the camera's name, so that dragging the window repeats no line
        warning = (
            f"the camera's {shape.fixed_by} fixes the picture's aspect ratio at {shape.picture:.5g} and the "
            "window has another, so it shows more or less than the lens says"
        )
        return reshaped(lens, size), (warning,)
    try:
        lens, contradiction = lens_for_picture(lens, size)
    except LensError as error:
        raise LensError(f"camera {scene.camera}: {error}") from None
    if not contradiction:
        return lens, ()
    return lens, (f"camera {scene.camera}: {contradiction}; it is drawn with the picture's aspect ratio",)


def camera_matrices(scene: Scene) -> CameraMatrices:
    """Return world to view and back, without the scale and shear that a camera's parents may have.

    The forward direction stays; right and up are made perpendicular to it. It is a `NodeError` if the
    camera's net transform is singular, mirrored or not finite, or it is too far away.
    """
    net = np.array(scene.camera.get_net_transform().get_mat(), dtype=np.float64)
    if not np.isfinite(net).all() or not np.linalg.det(net[:3, :3]) > 0:
        raise NodeError(
            f"camera {scene.camera}: its net transform is singular, mirrored or not finite: "
            "give it and its parents scales above 0"
        )
    if np.abs(net[3, :3]).max() > LARGEST:
        raise NodeError(
            f"camera {scene.camera}: its position in the world must be at most {LARGEST:g} units along each "
            "axis: give it and its parents positions and scales nearer to 1"
        )
    forward = net[1, :3] / np.linalg.norm(net[1, :3])
    right = net[0, :3] - (net[0, :3] @ forward) * forward
    right /= np.linalg.norm(right)
    view_to_world = np.eye(4)
    view_to_world[:3, :3] = right, forward, np.cross(right, forward)
    view_to_world[3, :3] = net[3, :3]
    return CameraMatrices(np.asarray(np.linalg.inv(view_to_world), dtype=np.float64), view_to_world)
