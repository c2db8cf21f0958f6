"""The constants of a lens, and the conversion of a pixel's depth back to a point in view space.

The walkthrough with every algebraic step is ``docs/unprojection.md``. In short, with view space X right,
Y forward, Z up, and row vectors, a lens is::

    perspective               orthographic
    [ A   0   0   0 ]         [ A   0   0   0 ]      x_clip = A*x + x_offset*w_clip
    [ ox  oz  B   1 ]         [ 0   0   B   0 ]      y_clip = C*z + z_offset*w_clip
    [ 0   C   0   0 ]         [ 0   C   0   0 ]      z_clip = B*y + D
    [ 0   0   D   0 ]         [ ox  oz  D   1 ]      w_clip = y in perspective, else 1

    ndc = clip / w_clip,  depth = depth_scale * z_ndc + depth_offset
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.errors import LensError
from firefly_sample.planar import empty_planar
from firefly_sample.scene.arrays import Float64

Clip = Literal["gl", "zero_to_one"]
Pair = tuple[float, float]

_DEPTH_RANGE: dict[Clip, Pair] = {"gl": (0.5, 0.5), "zero_to_one": (1.0, 0.0)}


class Unprojection(NamedTuple):
    """Four constants: x = ndc_x*x_proj/w, y = y_proj/w and z = ndc_y*z_proj/w, with w = depth + w_proj."""

    x_proj: float
    y_proj: float
    z_proj: float
    w_proj: float


@dataclass(frozen=True)
class LensConstants:
    """A lens under one depth convention, in float64.

    Attributes
    ----------
    perspective : bool
        True if w_clip is the distance y; for an orthographic lens it is 1.
    a, b, c, d : float
        The entries A, B, C, D of the projection matrix.
    x_offset, z_offset : float
        NDC of the view axis: 0 unless the film is off centre.
    depth_scale, depth_offset : float
        From z_ndc to the depth buffer: (0.5, 0.5) for OpenGL's own clip range, (1, 0) for zero-to-one.
    y_fold, w_fold : float
        The depth mapping solved for the distance: y = y_fold / (depth + w_fold) in perspective and
        y = y_fold * (depth + w_fold) otherwise. In perspective they equal depth_scale*D and
        -depth_offset - depth_scale*B, but are computed from near and far directly: the difference
        has no correct digit left for a reversed depth with a distant far plane.
    """

    perspective: bool
    a: float
    b: float
    c: float
    d: float
    x_offset: float
    z_offset: float
    depth_scale: float
    depth_offset: float
    y_fold: float
    w_fold: float

    @classmethod
    def of(
        cls, perspective: bool, scales: Pair, offsets: Pair, planes: Pair, clip: Clip, reverse: bool
    ) -> LensConstants:
        """Return the constants for A, C, offsets in NDC, near and far; raise LensError if `clip` is wrong."""
        if not isinstance(clip, str) or clip not in _DEPTH_RANGE:
            raise LensError(f"clip must be one of {', '.join(map(repr, _DEPTH_RANGE))}; got {clip!r}")
        near, far = planes
        if perspective:
            # depth = far_share - near*far_share/y, or its complement near*far_share/y - near_share.
            far_share = 1.0 if math.isinf(far) else far / (far - near)
            near_share = 0.0 if math.isinf(far) else near / (far - near)
            y_fold = near * far_share if reverse else -near * far_share
            w_fold = near_share if reverse else -far_share
            slope = 1.0 + 2.0 * near_share
            in_gl = -slope if reverse else slope, 2.0 * y_fold
            in_zero_to_one = 0.0 - w_fold, y_fold  # +0, not -0, where the far plane is infinite
        else:
            span = far - near
            y_fold, w_fold = (-span, -far / span) if reverse else (span, near / span)
            in_gl = 2.0 / y_fold, -(far + near) / y_fold
            in_zero_to_one = 1.0 / y_fold, -w_fold
        b, d = in_gl if clip == "gl" else in_zero_to_one
        return cls(perspective, scales[0], b, scales[1], d, *offsets, *_DEPTH_RANGE[clip], y_fold, w_fold)

    def matrix(self) -> Float64:
        """Return the 4x4 projection matrix for row vectors, laid out as at the top of this module."""
        m = np.zeros((4, 4))
        m[0, 0], m[2, 1], m[1, 2], m[3, 2] = self.a, self.c, self.b, self.d
        w_row = 1 if self.perspective else 3
        m[w_row, 0], m[w_row, 1], m[w_row, 3] = self.x_offset, self.z_offset, 1.0
        return m

    def inverse_matrix(self) -> Float64:
        """Return the inverse of `matrix`, in closed form, which loses no digits to elimination."""
        m = np.zeros((4, 4))
        m[0, 0], m[1, 2] = 1.0 / self.a, 1.0 / self.c
        m[3, 0], m[3, 2] = -self.x_offset / self.a, -self.z_offset / self.c
        if self.perspective:
            m[2, 3], m[3, 1], m[3, 3] = 1.0 / self.d, 1.0, -self.b / self.d
        else:
            m[2, 1], m[3, 1], m[3, 3] = 1.0 / self.b, -self.d / self.b, 1.0
        return m

    def side_planes(self) -> list[Float64]:
        """Return the planes left, right, bottom and top of the view volume, as `Lens.frustum_planes` does."""
        planes = []
        # +-ndc <= 1 times w: w*(1 +- offset) +- scale*coordinate >= 0, with w = y or w = 1.
        w_column = 1 if self.perspective else 3
        for axis, scale, offset in ((0, self.a, self.x_offset), (2, self.c, self.z_offset)):
            for sign in (1.0, -1.0):
                plane = np.zeros(4)
                plane[axis] = sign * scale
                plane[w_column] = 1.0 + sign * offset
                planes.append(plane / math.hypot(*plane[:3]))
        return planes

    def unprojection(self) -> Unprojection:
        """Return the constants of the short form, or raise LensError where it does not hold."""
        if not self.perspective:
            reason = "an orthographic lens"
        elif self.x_offset != 0 or self.z_offset != 0:
            reason = "a film offset"
        elif self.depth_scale != 0.5:
            reason = 'clip "zero_to_one"'
        else:
            return Unprojection(self.y_fold / self.a, self.y_fold, self.y_fold / self.c, self.w_fold)
        raise LensError(
            f"x_proj, y_proj, z_proj and w_proj are not defined for {reason}: "
            "use the general form, LensConstants.view_from_depth"
        )

    def distance_from_depth(self, depth: ArrayLike) -> Float64:
        """Return distances along the view axis, in scene units, of depth-buffer values of any shape.

        The depth of an infinite far plane gives infinity.
        """
        shifted = np.asarray(depth, dtype=np.float64) + self.w_fold
        if not self.perspective:
            return np.asarray(self.y_fold * shifted)
        at_infinity = shifted == 0.0
        return np.asarray(np.where(at_infinity, np.inf, self.y_fold / np.where(at_infinity, 1.0, shifted)))

    def depth_from_distance(self, y: ArrayLike) -> Float64:
        """Return depth-buffer values of distances along the view axis, of any shape; nothing is clamped."""
        distance = np.asarray(y, dtype=np.float64)
        if self.perspective:
            return np.asarray(self.y_fold / distance - self.w_fold)
        return np.asarray(distance / self.y_fold - self.w_fold)

    def view_from_distance(self, ndc_x: ArrayLike, ndc_y: ArrayLike, y: ArrayLike) -> Float64:
        """Return view-space points, shape (..., 3), at NDC and distances, which broadcast."""
        right, up = np.asarray(ndc_x, dtype=np.float64), np.asarray(ndc_y, dtype=np.float64)
        y = np.asarray(y, dtype=np.float64)
        w = y if self.perspective else np.ones_like(y)
        points = empty_planar(np.broadcast_shapes(right.shape, up.shape, y.shape), 3)
        points[..., 0] = (right - self.x_offset) / self.a * w
        points[..., 1] = y
        points[..., 2] = (up - self.z_offset) / self.c * w
        return points

    def view_from_depth(self, ndc_x: ArrayLike, ndc_y: ArrayLike, depth: ArrayLike) -> Float64:
        """Return view-space points, shape (..., 3), at NDC in [-1, 1] and depth-buffer values in [0, 1].

        The general form: both clip ranges, both directions of depth, film offsets, both kinds of lens.
        """
        return self.view_from_distance(ndc_x, ndc_y, self.distance_from_depth(depth))

    def ndc_from_view(self, points: ArrayLike) -> Float64:
        """Return (ndc_x, ndc_y, depth), shape (..., 3), of view-space points, shape (..., 3), y != 0."""
        x, y, z = np.moveaxis(np.asarray(points, dtype=np.float64), -1, 0)
        w = y if self.perspective else np.ones_like(y)
        ndc_x = self.a * x / w + self.x_offset
        ndc_y = self.c * z / w + self.z_offset
        return np.stack((ndc_x, ndc_y, self.depth_from_distance(y)), axis=-1)
