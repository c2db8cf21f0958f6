"""Lenses of Panda3D as ours: any projection of a rigidly placed camera with perpendicular film axes.

Panda3D's lenses have a projection matrix P from their node's space, in which a lens may be turned, moved, of
other axes, or a matrix of the user's. With row vectors, and columns x, z (up), depth and w of P,

    perspective     w = f.p - f.e            f is the view axis and e the eye, where x, up and w are 0
    orthographic    w = 1                    f is across x and up

which gives the transform E of the lens in its node, and E P is the matrix of a lens, as
`firefly_sample.scene.lens_constants` has it, or else there is no such lens.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from firefly_sample.errors import LensError
from firefly_sample.losses import Losses
from firefly_sample.model.panda3d.transforms import affine_matrix
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lens_base import Lens

_ERROR = 2e-6
"""The most by which a lens's matrix may differ from Panda3D's, over the largest number of its column."""
_WAY_OUT = (
    "give the camera a PerspectiveLens, an OrthographicLens or a matrix whose film axes are perpendicular to "
    "each other and whose near and far planes are parallel to the film"
)


class _View(NamedTuple):
    """A projection and the place of its lens.

    Attributes
    ----------
    given : ndarray of shape (4, 4)
        The projection matrix from the node's space, w being the distance from the film's plane or 1, and near
        before far.
    placed : ndarray of shape (4, 4)
        From the lens's space to its node's; the identity, exactly, for most lenses.
    matrix : ndarray of shape (4, 4)
        The projection matrix from the lens's space.
    unit : float
        Length of a unit of Panda3D's lens in its node's space.
    """

    perspective: bool
    given: Float64
    placed: Float64
    matrix: Float64
    unit: float


def read_lens(lens: Any, name: str, losses: Losses) -> tuple[Lens, Float64 | None]:
    """Return a lens of Panda3D as one of ours, and its transform in its node's space.

    A lens with Panda3D's first aspect ratio, 1, takes that of the picture, as ShowBase lets it; one with
    another ratio keeps it. Which angle stays where the ratio changes is as in Panda3D.

    Parameters
    ----------
    lens : panda3d.core.Lens
    name : str
        The camera's, for messages.
    losses : Losses

    Returns
    -------
    lens : Lens
    placed : ndarray of shape (4, 4) or None
        From the lens's space to its node's, a rotation and a translation, for row vectors; None if they are
        the same.

    Raises
    ------
    LensError
        If no lens of ours has its projection; the message names the camera, the entry of the matrix that does
        not fit, and the way out.
    """
    if not lens.is_linear():
        kind = lens.get_type().get_name()
        raise LensError(f"camera {name!r}: a {kind} bends straight lines: {_WAY_OUT}")
    given = affine_matrix(lens.get_projection_mat())
    if not np.isfinite(given).all():
        row, column = np.argwhere(~np.isfinite(given))[0]
        raise LensError(
            f"camera {name!r}: {_entry(given, row, column)}, with near {lens.get_near():g} and far "
            f"{lens.get_far():g}: set finite numbers and two different planes"
        )
    view = _view(given, name)
    if _is_reversed(view):
        losses.add("cameras with near beyond far show what is nearest, as others do", name)
        given[:, 2] *= -1.0
        view = _view(given, name)
    made = _fitting(lens, view, name)
    if not np.array_equal(view.placed[:3, :3], np.eye(3)):
        losses.add(
            "highlights of materials that are not local turn with lenses that are turned in cameras", name
        )
    return made, None if np.array_equal(view.placed, np.eye(4)) else view.placed


def _view(given: Float64, name: str) -> _View:
    """Find the axes of a projection, and where it is 0."""
    x, up, _, w = given.T
    perspective = bool(w[:3].any())
    if not perspective and not w[3] > 0.0:
        raise LensError(f"camera {name!r}: {_entry(given, 3, 3)}, so that nothing is in front: {_WAY_OUT}")
    unit = 1.0 / float(np.linalg.norm(w[:3]) if perspective else w[3])
    if perspective:
        forward = w[:3] * unit
        right = _unit(x[:3] - (x[:3] @ forward) * forward)
    else:
        right = _unit(x[:3])
        forward = _unit(np.cross(up[:3], right))
    placed = np.eye(4)
    placed[:3, :3] = right, forward, np.cross(right, forward)
    planes = np.array([x[:3], up[:3], w[:3]])
    try:
        eye = np.linalg.solve(planes, (-x[3], -up[3], -w[3])) if perspective else np.zeros(3)
    except np.linalg.LinAlgError:
        eye = np.full(3, math.nan)
    placed[3, :3] = eye
    if not np.isfinite(placed).all():
        raise LensError(f"camera {name!r}: its projection matrix leaves the picture flat: {_WAY_OUT}")
    if up[:3] @ placed[2, :3] <= 0.0:
        raise LensError(f"camera {name!r}: its projection matrix mirrors the picture: {_WAY_OUT}")
    turned = np.abs(placed - np.eye(4)).max() > _ERROR
    if not turned:
        placed = np.eye(4)
    given = given * unit
    matrix = placed @ given
    if turned:
        offsets = matrix[1 if perspective else 3, :2]
        offsets[np.abs(offsets) <= _ERROR] = 0.0  # what is left of roundings
    return _View(perspective, given, placed, matrix, unit)


def _is_reversed(view: _View) -> bool:
    """Return True if the near plane is beyond the far one."""
    return bool(view.matrix[3, 2] > 0.0 if view.perspective else view.matrix[1, 2] < 0.0)


def _fitting(lens: Any, view: _View, name: str) -> Lens:
    """Return the lens of a view: with the planes of Panda3D's lens if they fit, else those of the matrix."""
    scale = np.abs(view.given).max(axis=0)
    own = sorted((lens.get_near() * view.unit, lens.get_far() * view.unit))
    misfit = ""
    for near, far in (own, _planes(view)):
        try:
            made = _made(lens, view, near, far)
        except LensError as error:
            misfit = str(error)
            continue
        excess = np.abs(np.linalg.inv(view.placed) @ made.get_projection_mat() - view.given) / scale
        if excess.max() <= _ERROR:
            return made
        row, column = divmod(int(excess.argmax()), 4)
        misfit = f"{_entry(view.given, row, column)}, which no lens has beside the others: {_WAY_OUT}"
    raise LensError(f"camera {name!r}: {misfit}")


def _planes(view: _View) -> tuple[float, float]:
    """Return the near and the far plane of a matrix: where clip z is -w and w."""
    b, d = float(view.matrix[1, 2]), float(view.matrix[3, 2])
    if not view.perspective:
        return (-1.0 - d) / b if b else math.nan, (1.0 - d) / b if b else math.nan
    endless = abs(1.0 - b) <= np.finfo(np.float32).eps
    return 0.0 - d / (b + 1.0) if b != -1.0 else math.nan, math.inf if endless else d / (1.0 - b)


def _made(lens: Any, view: _View, near: float, far: float) -> Lens:
    """Return the lens of a view with these planes."""
    from panda3d import core

    a, c = float(view.matrix[0, 0]), float(view.matrix[2, 1])
    x, up = view.matrix[1 if view.perspective else 3, :2].tolist()
    own = isinstance(lens, core.PerspectiveLens | core.OrthographicLens)
    ratio, width = c / a, 2.0 / a
    if own and (view.perspective or math.isclose(width, lens.get_film_size()[0], rel_tol=2e-7)):
        width = float(lens.get_film_size()[0])
    if math.isclose(ratio, lens.get_aspect_ratio(), rel_tol=_ERROR):
        ratio = lens.get_aspect_ratio()
    offset = 0.0 - 0.5 * x * width, 0.0 - 0.5 * up * width / ratio
    made: PerspectiveLens | OrthographicLens
    if view.perspective:
        made = PerspectiveLens(near=near, far=far, film_size=width, film_offset=offset)
        across, upright = (_angle(*pair) for pair in zip((a, c), lens.get_fov(), strict=True))
        kept = _kept_angle(lens)
        if kept == "fov":
            made.set_fov(across)
        elif kept == "vfov":
            made.set_vfov(upright)
        else:
            made.set_min_fov(min(across, upright))
    else:
        made = OrthographicLens(width, near=near, far=far, film_offset=offset)
    if ratio != 1.0:
        made.set_aspect_ratio(ratio)
    return made


def _angle(scale: float, given: float) -> float:
    """Return the field of view of a scale, in degrees: the given one, if they differ by rounding alone."""
    same = math.isclose(math.tan(0.5 * math.radians(given)) * scale, 1.0, rel_tol=2e-7)
    return given if same else 2.0 * math.degrees(math.atan2(1.0, scale))


def _kept_angle(lens: Any) -> str:
    """Return the angle that stays as a lens of Panda3D gets another aspect ratio."""
    copy = lens.make_copy()
    seen = []
    for ratio in (0.5, 2.0):
        copy.set_aspect_ratio(ratio)
        seen.append(tuple(copy.get_fov()))
    for index, name in enumerate(("fov", "vfov")):
        if math.isclose(seen[0][index], seen[1][index], rel_tol=1e-5):
            return name
    return "min_fov"


def _unit(vector: Float64) -> Float64:
    """Return a vector with the length 1, or NaN where it has none."""
    length = np.linalg.norm(vector)
    return vector / length if length > 0.0 else np.full(3, math.nan)


def _entry(matrix: Float64, row: int, column: int) -> str:
    return f"its projection matrix has {matrix[row, column]:g} in row {row}, column {column}"
