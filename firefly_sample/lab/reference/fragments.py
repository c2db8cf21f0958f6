"""What triangles show where rays meet them, in float64: places, normals, texture coordinates, colours.

The float64 twin of ``shaders/geometry.vert`` and of what a rasteriser makes of its outputs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.rays import Rays
from firefly_sample.lab.reference.texture import Sampler, Samplers, level_of_detail
from firefly_sample.lab.reference.triangles import Beside, Meeting, meet
from firefly_sample.plan.frame_plan import Batch

Float64 = NDArray[np.float64]


def normal_matrices(model_to_view: Float64) -> Float64:
    """What takes normals along, up to a length: cofactors, which need no inverse, shape (n, 3, 3)."""
    linear = model_to_view[:, :3, :3]
    cofactors = np.cross(linear[:, [1, 2, 0]], linear[:, [2, 0, 1]])
    # a flat matrix has no sides: it keeps the sign of one that is not mirrored
    return np.asarray(cofactors * np.where(np.linalg.det(linear) < 0, -1.0, 1.0)[:, None, None])


class Fragments:
    """n rays and, for each, one triangle of one instance of a batch.

    Parameters
    ----------
    batch : Batch
    rays : Rays
    instance, triangle : ndarray of int, shape (n,)
        Of the batch, and of its Geom.
    samplers : Samplers

    Attributes
    ----------
    meeting : Meeting
        Where the rays meet the triangles' planes.
    position : ndarray of float64, shape (n, 3)
        View space: on the ray, or on the triangle where that is edge-on.
    """

    def __init__(
        self,
        batch: Batch,
        rays: Rays,
        instance: NDArray[np.integer],
        triangle: NDArray[np.integer],
        samplers: Samplers,
    ) -> None:
        self.batch = batch
        self.rays = rays
        self.instance = instance
        self._samplers = samplers
        self._corners = batch.geom.triangles[triangle]
        matrix = batch.model_to_view[instance]
        places = batch.geom.vertices[self._corners] @ matrix[:, :3, :3] + matrix[:, None, 3, :3]
        self._beside = Beside.of(places, rays.origin, rays.direction)
        self.meeting: Meeting = meet(self._beside)
        self.position: Float64 = self._place()

    def _place(self) -> Float64:
        place = self.rays.origin + self.meeting.along[:, None] * self.rays.direction
        lost = np.flatnonzero(~self.meeting.on_ray)
        if len(lost):
            shares, beside = self.meeting.shares[lost], self._beside
            place[lost, 0] += np.einsum("ni,ni->n", shares, beside.across[lost])
            place[lost, 2] += np.einsum("ni,ni->n", shares, beside.up[lost])
        return place

    def interpolated(self, values: Float64) -> Float64:
        """What vertices hold (m, k), at the pixels, shape (n, k)."""
        return np.asarray(np.einsum("ni,nik->nk", self.meeting.shares, values[self._corners]))

    def normal(self, turned: bool = True) -> Float64:
        """Unit normals in view space, shape (n, 3).

        Those of two-sided materials are turned to the eye where `turned`. One without a length faces the eye.
        """
        own = self.interpolated(self.batch.geom.normals)
        seen = np.einsum("ni,nij->nj", own, normal_matrices(self.batch.model_to_view)[self.instance])
        largest = np.abs(seen).max(axis=1, keepdims=True)
        seen = seen / np.where(largest > 0.0, largest, 1.0)
        length = np.linalg.norm(seen, axis=1, keepdims=True)
        away = self.position if self.rays.perspective else self.rays.direction
        unit = np.where(length > 0.0, seen / np.where(length > 0.0, length, 1.0), self.rays.to_eye())
        if turned and self.batch.surface.double_sided:
            unit = np.where((np.einsum("ni,ni->n", unit, away) > 0.0)[:, None], -unit, unit)
        return np.asarray(unit)

    def is_front(self) -> NDArray[np.bool_]:
        """Whether the pixels are on sides that are drawn."""
        if self.batch.surface.double_sided:
            return np.ones(len(self.rays), dtype=bool)
        return np.asarray(self.meeting.front != self.batch.mirrored)

    def texture(self) -> Float64:
        """Linear colour and alpha of the texture, shape (n, 4); ones without a texture."""
        sampler = self._sampler()
        if sampler is None:
            return np.ones((len(self.rays), 4))
        right, down = self._texcoord_slopes()
        return sampler.sample(
            self.interpolated(self.batch.geom.texcoords), level_of_detail(right, down, sampler.size)
        )

    def _sampler(self) -> Sampler | None:
        variant, texture = self.batch.surface, self.batch.texture
        if not variant.textured or texture is None:
            return None
        return self._samplers.of(texture, self.batch.alpha_cutoff if variant.cutout else None)

    def tint(self) -> Float64:
        """What multiplies a material's colours: texture times vertex colour, shape (n, 3)."""
        color = self.texture()[:, :3]
        if self.batch.surface.vertex_color and self.batch.geom.colors is not None:
            color = color * self.interpolated(self.batch.geom.colors)
        return color

    def is_there(self) -> NDArray[np.bool_]:
        """Whether alpha leaves the pixels, where the material is cut out."""
        if not self.batch.surface.cutout:
            return np.ones(len(self.rays), dtype=bool)
        alpha = self.batch.factors.base_colors[self.instance, 3] * self.texture()[:, 3]
        alphas = self.batch.geom.alphas
        if self.batch.surface.vertex_alpha and alphas is not None:
            alpha = alpha * self.interpolated(alphas[:, None])[:, 0]
        return np.asarray(alpha >= self.batch.alpha_cutoff)

    def _texcoord_slopes(self) -> tuple[Float64, Float64]:
        """Derivatives of the texture coordinates, a pixel right and a pixel down, shapes (n, 2).

        A corner's share is its area A over the sum of all three; the areas are products of what lies beside
        the ray, which a step to the side changes by the corner's distance (orthographic: by 1).
        """
        beside, values = self._beside, self.batch.geom.texcoords[self._corners]
        x, z = beside.across, beside.up
        weight = beside.along if self.rays.perspective else np.ones_like(x)
        after, before = [1, 2, 0], [2, 0, 1]
        whole = beside.areas().sum(axis=1, keepdims=True)
        whole = np.where(whole == 0.0, np.inf, whole)
        middle = np.einsum("ni,nik->nk", self.meeting.shares, values)
        slopes = []
        for by_area, step in (
            (z[:, after] * weight[:, before] - weight[:, after] * z[:, before], self.rays.pixel[0]),
            (weight[:, after] * x[:, before] - x[:, after] * weight[:, before], self.rays.pixel[1]),
        ):
            by_share = by_area * (step / whole)
            rise = np.einsum("ni,nik->nk", by_share, values)
            slopes.append(rise - by_share.sum(axis=1, keepdims=True) * middle)
        return slopes[0], slopes[1]
