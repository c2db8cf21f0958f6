"""Convert lenses to pyrender's cameras and back.

A lens without an offset is a PerspectiveCamera or an OrthographicCamera. One whose film is off centre is an
IntrinsicsCamera, which measures in pixels of the picture, width w and height h, from its upper left corner:

    A = 2 fx / w    x_offset = 2 cx / w - 1
    C = 2 fy / h    z_offset = 1 - 2 cy / h

with the lens's constants as in `firefly_sample.scene.lens_constants`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import LensError
from firefly_sample.interop.pyrender.projections import has_own_projection, lens_of_projection
from firefly_sample.losses import Losses
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.lens_shape import lens_for_picture

Float64 = NDArray[np.float64]
Size = tuple[int, int]

_ENDLESS = 1e9
"""Ratio of the far plane that stands for infinity to the near plane. In pyrender's
float32, the projection matrix is then the one of an infinite far plane, to the last bit."""


def camera_to_pyrender(
    name: str, lens: Lens, size: Size | None, losses: Losses, main: bool = True
) -> tuple[Any, Float64 | None]:
    """Return a lens as a pyrender camera, and a matrix from the camera's space to its node's.

    The lens takes the aspect ratio of the picture's size, as when the Renderer draws. If a camera that is not
    the main one has intrinsics for pictures of another aspect ratio, it keeps its view, which pyrender
    stretches to the picture, and that is noted as a loss; for the main camera it is an error.

    The matrix, shape (4, 4), is in our axes, for row vectors; None is the identity. An orthographic camera is
    moved if its film is off centre or its near plane is behind it, which does not change its picture.
    """
    import pyrender

    if size is not None:
        try:
            lens, contradiction = lens_for_picture(lens, size)
            if contradiction:
                losses.add(f"a camera takes the picture's aspect ratio: {contradiction}", name)
        except LensError as error:
            if main:
                raise LensError(f"camera {name!r}: {error}") from None
            losses.add(f"a camera that is not drawn would be stretched to the picture: {error}", name)
    lens = lens.near_first()
    k, near, far = lens.constants(), lens.get_near(), lens.get_far()
    if not k.perspective:
        # pyrender needs a near distance above 0; moving by the depth of the view suits every scale
        back = far - 2.0 * near if near <= 0.0 else 0.0
        matrix = None
        if back or k.x_offset or k.z_offset:
            matrix = np.eye(4)
            matrix[3, :3] = -k.x_offset / k.a, -back, -k.z_offset / k.c
        return pyrender.OrthographicCamera(1.0 / k.a, 1.0 / k.c, near + back, far + back, name), matrix
    if k.x_offset == 0.0 and k.z_offset == 0.0:
        zfar = far if far < math.inf else None
        yfov = 2.0 * math.atan2(1.0, k.c)
        return pyrender.PerspectiveCamera(yfov, near, zfar, k.c / k.a, name), None
    if size is None:
        raise LensError(
            f"camera {name!r}: its film is off centre, and pyrender measures such cameras in pixels: "
            "give the picture's size=(width, height)"
        )
    width, height = size
    if far == math.inf:
        losses.add(
            "off-centre cameras have no infinite far plane in pyrender, so that it is set to near * 1e9",
            name,
        )
        far = near * _ENDLESS
    camera = pyrender.IntrinsicsCamera(
        fx=0.5 * k.a * width,
        fy=0.5 * k.c * height,
        cx=0.5 * width * (1.0 + k.x_offset),
        cy=0.5 * height * (1.0 - k.z_offset),
        znear=near,
        zfar=far,
        name=name,
    )
    return camera, None


def camera_from_pyrender(camera: Any, name: str, size: Size | None, losses: Losses) -> Lens | None:
    """Return the lens of a pyrender camera, or None, with a loss, for one whose projection no lens has.

    A camera with a `get_projection_matrix` of its own has the lens of that matrix, if there is a `size`.
    As in pyrender, a PerspectiveCamera without an aspect ratio and an OrthographicCamera keep their height at
    every aspect ratio of the picture. Until it is drawn, the former has the aspect ratio of `size`, or 1.
    """
    import pyrender

    if has_own_projection(camera):
        own = None if size is None else lens_of_projection(camera, size)
        if own is None:
            without = " without the picture's size" if size is None else ""
            losses.add(f"cameras of the class {type(camera).__name__} are left out{without}", name)
        return own
    try:
        if isinstance(camera, pyrender.OrthographicCamera):
            film = (2.0 * camera.xmag, 2.0 * camera.ymag)
            parallel = OrthographicLens(film, near=camera.znear, far=camera.zfar)
            parallel.set_film_height(film[1])
            parallel.set_aspect_ratio(None)
            return parallel
        far = math.inf if camera.zfar is None else camera.zfar
        if isinstance(camera, pyrender.PerspectiveCamera):
            aspect = camera.aspectRatio
            ours = 1.0 if size is None else size[0] / size[1]
            if size is None or aspect is None or math.isclose(aspect, ours, rel_tol=1e-4):
                film = (ours if aspect is None else aspect, 1.0)
                focal = 0.5 / math.tan(0.5 * camera.yfov)
                lens = PerspectiveLens(near=camera.znear, far=far, film_size=film, focal_length=focal)
                if aspect is None:
                    lens.set_vfov(math.degrees(camera.yfov))
                    lens.set_aspect_ratio(None)
                return lens
            # pixels that are not square stretch the view to the picture, as pyrender draws it
            fy = 0.5 * size[1] / math.tan(0.5 * camera.yfov)
            fx = fy * ours / aspect
            cx, cy = 0.5 * size[0], 0.5 * size[1]
        else:
            if size is None:
                raise LensError("it measures in pixels: give the picture's size=(width, height)")
            fx, fy, cx, cy = camera.fx, camera.fy, camera.cx, camera.cy
        if not (fx > 0.0 and fy > 0.0):
            raise LensError(f"fx and fy must be above 0, got {fx:g} and {fy:g}")
        return PerspectiveLens.from_intrinsics(fx, fy, cx, cy, *size, camera.znear, far, pixel_center=0.5)
    except LensError as error:
        raise LensError(f"camera {name!r}: {error}") from None


def depth_shift(camera: Any, lens: Lens) -> float:
    """Return what is added to distances along the view axis so that all of a pyrender camera's are above 0.

    It is 0 unless parallel rays start at or behind the camera, as those of weak-perspective cameras do. Then
    the near plane is at the camera's `znear`.
    """
    near = lens.get_near()
    return camera.znear - near if lens.is_orthographic() and near <= 0.0 else 0.0
