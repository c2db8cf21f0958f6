"""The points of triangles that pixels see, and what the triangles have there, in float64.

The twin of ``shaders/geometry.vert``, of what a rasteriser makes of its outputs, and of
``shaders/include/material.glsl``. In the look "pyrender", metallic-roughness surfaces are as pyrender has
them: unit normals are interpolated, backs keep the normals of their fronts, normal maps lie along the texture
coordinates, the emissive factor is squared, and vertex colours multiply all that is seen instead of the base
colour. In the look "panda3d", other surfaces are as Panda3D has them: the same of normals, but for normal
maps, and the texture multiplies all that is seen but highlights.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.reference.normal_map import mapped_normal, unit_or_zero
from firefly_sample.lab.reference.panda3d import BEHIND
from firefly_sample.lab.reference.rays import Intersections, RayCorners, Rays, intersect
from firefly_sample.lab.reference.texture import Sampler, Samplers, level_of_detail
from firefly_sample.plan.factors import Factors
from firefly_sample.plan.frame_plan import Batch
from firefly_sample.plan.surface_maps import Map

Float64 = NDArray[np.float64]


def normal_matrices(model_to_view: Float64) -> Float64:
    """Return cofactor matrices (n, 3, 3), which transform normals up to a length and need no inverse."""
    linear = model_to_view[:, :3, :3]
    cofactors = np.cross(linear[:, [1, 2, 0]], linear[:, [2, 0, 1]])
    # a flat matrix has determinant 0: it counts as not mirrored
    return np.asarray(cofactors * np.where(np.linalg.det(linear) < 0, -1.0, 1.0)[:, None, None])


class Fragments:
    """The points where n rays meet triangles of a batch: one triangle of one instance for each ray.

    Attributes
    ----------
    hits : Intersections
        Where the rays meet the triangles' planes.
    position : ndarray of float64, shape (n, 3)
        View space: on the ray, or on the triangle where that is edge-on.
    by_pyrender : bool
        True if the surfaces are as pyrender has them.
    by_panda3d : bool
        True if they are as Panda3D has them.
    """

    def __init__(
        self,
        batch: Batch,
        rays: Rays,
        instance: NDArray[np.integer],
        triangle: NDArray[np.integer],
        samplers: Samplers,
    ) -> None:
        self.batch, self.rays, self.instance = batch, rays, instance
        self.by_pyrender: bool = samplers.look == "pyrender" and batch.surface.metallic
        self.by_panda3d: bool = samplers.look == "panda3d" and not batch.surface.metallic
        self._samplers = samplers
        self._corners = batch.geom.triangles[triangle]
        matrix = batch.model_to_view[instance]
        self._placed = batch.geom.vertices[self._corners] @ matrix[:, :3, :3] + matrix[:, None, 3, :3]
        self._seen = RayCorners.of(self._placed, rays.origin, rays.direction)
        self.hits: Intersections = intersect(self._seen)
        self.position: Float64 = rays.origin + self.hits.along[:, None] * rays.direction
        lost = np.flatnonzero(~self.hits.on_ray)
        if len(lost):
            shares = self.hits.shares[lost]
            self.position[lost, 0] += np.einsum("ni,ni->n", shares, self._seen.across[lost])
            self.position[lost, 2] += np.einsum("ni,ni->n", shares, self._seen.up[lost])

    def interpolated(self, values: Float64) -> Float64:
        """Interpolate values of vertices (m, k) to the pixels, shape (n, k)."""
        return np.asarray(np.einsum("ni,nik->nk", self.hits.shares, values[self._corners]))

    def to_eye(self) -> Float64:
        """Return unit vectors to the eye that highlights see, shape (n, 3).

        For pyrender, and for Panda3D's local viewers, it is the camera, whatever its lens.
        """
        local = self.by_panda3d and self.batch.surface.local_viewer
        if (self.by_pyrender or local) and not self.rays.perspective:
            return -unit_or_zero(self.position)[0]
        if self.by_panda3d and not local:
            return np.broadcast_to(BEHIND, self.position.shape)
        return self.rays.to_eye()

    def normal(self, turned: bool = True, mapped: bool = True) -> Float64:
        """Return unit normals in view space, shape (n, 3), and with `mapped` with the material's normal map.

        With `turned`, those of two-sided materials face the eye: they are turned where the normal without
        the map does not. A normal of length 0 faces the eye.
        """
        matrices = normal_matrices(self.batch.model_to_view)[self.instance]
        if self.by_pyrender or self.by_panda3d:
            corners = np.einsum("nki,nij->nkj", self.batch.geom.normals[self._corners], matrices)
            units = unit_or_zero(corners.reshape(-1, 3))[0].reshape(corners.shape)
            seen, length = unit_or_zero(np.einsum("nk,nki->ni", self.hits.shares, units))
        else:
            own = self.interpolated(self.batch.geom.normals)
            seen, length = unit_or_zero(np.einsum("ni,nij->nj", own, matrices))
        unit = np.where(length > 0.0, seen, self.rays.to_eye() if self.by_panda3d else self.to_eye())
        found = self._mapped(unit) if mapped else unit
        as_they_are = self.by_pyrender or self.by_panda3d
        if turned and self.batch.surface.double_sided and not as_they_are:
            away = self.position if self.rays.perspective else self.rays.direction
            found = np.where((np.einsum("ni,ni->n", unit, away) > 0.0)[:, None], -found, found)
        return np.asarray(found)

    def _mapped(self, unit: Float64) -> Float64:
        """Return normals with the normal map, if there is one."""
        maps = self.batch.maps
        if maps.normal is None:
            return unit
        if self.by_pyrender:
            along = self._along(maps.normal)
            along -= unit * np.einsum("ni,ni->n", unit, along)[:, None]
            tangent = np.concatenate([along, np.ones((len(unit), 1))], axis=1)
            return mapped_normal(unit, tangent, self._numbers(maps.normal)[:, :3], 1.0, mirrored=False)
        own = self.interpolated(self.batch.geom.tangents_or_made(maps.normal.coordinates - 1))
        linear = self.batch.model_to_view[self.instance, :3, :3]
        seen = np.concatenate([np.einsum("ni,nij->nj", own[:, :3], linear), own[:, 3:]], axis=1)
        texel = self._numbers(maps.normal)[:, :3]
        return mapped_normal(unit, seen, texel, maps.normal_scale, self.batch.mirrored)

    def _along(self, found: Map) -> Float64:
        """Return the directions in which a map's first texture coordinate grows, shape (n, 3), view space."""
        values = self._texcoords_of(found)[self._corners]
        (right, up), (one, other) = (
            (each[:, 1] - each[:, 0], each[:, 2] - each[:, 0]) for each in (values, self._placed)
        )
        turn = np.sign(right[:, 0] * up[:, 1] - up[:, 0] * right[:, 1])
        return np.asarray((up[:, 1:] * one - right[:, 1:] * other) * turn[:, None])

    def is_front(self) -> NDArray[np.bool_]:
        """Return whether the pixels are on sides that are drawn."""
        if self.batch.surface.double_sided:
            return np.ones(len(self.rays), dtype=bool)
        return np.asarray(self.hits.front != self.batch.mirrored)

    def texture(self) -> Float64:
        """Return colour and alpha of the base colour's textures, shape (n, 4); ones without a texture."""
        surface, texture, modulate = self.batch.surface, self.batch.texture, self.batch.maps.modulate
        product = np.ones((len(self.rays), 4))
        if surface.textured and texture is not None:
            sampler = self._samplers.of(texture, self.batch.alpha_cutoff if surface.cutout else None)
            product *= self._decoded(self._sampled(sampler, self.batch.geom.texcoords))
        if modulate is not None:
            sampler = self._samplers.of(modulate.texture, None)
            product *= self._decoded(self._sampled(sampler, self._texcoords_of(modulate)))
        return product

    def _decoded(self, texel: Float64) -> Float64:
        """Return colours and alphas of texels, shape (n, 4)."""
        return np.concatenate([self._samplers.decoded(texel[:, :3]), texel[:, 3:]], axis=1)

    def emission(self, factors: Factors) -> Float64:
        """Return the linear radiance that the surface emits, shape (n, 3), by the pixels' own factors."""
        emission, found = factors.emissions, self.batch.maps.emission
        if self.by_pyrender:
            emission = emission**2 * self._vertex_color()
        if found is None:
            return emission
        texel = self._sampled(self._samplers.of(found.texture, None), self._texcoords_of(found))
        return np.asarray(emission * self._samplers.decoded(texel[:, :3]))

    def metallic_roughness(self, factors: Factors) -> Float64:
        """Return metallic and roughness, shape (n, 2), by the pixels' own factors; -1 and 1 without."""
        if not self.batch.surface.metallic:
            return np.tile([-1.0, 1.0], (len(self.rays), 1))
        own, found = factors.speculars[:, :2], self.batch.maps.metallic
        return own if found is None else np.asarray(own * self._numbers(found)[:, [2, 1]])

    def occlusion(self) -> Float64:
        """Return the share of ambient light that arrives, shape (n, 1)."""
        found = self.batch.maps.occlusion
        if found is None:
            return np.ones((len(self.rays), 1))
        return np.asarray(1.0 + self.batch.maps.occlusion_strength * (self._numbers(found)[:, :1] - 1.0))

    def _numbers(self, found: Map) -> Float64:
        """Sample a map whose texels are numbers, not colours, shape (n, 4)."""
        sampler = self._samplers.of(found.texture, None, stored=True)
        return self._sampled(sampler, self._texcoords_of(found))

    def _texcoords_of(self, found: Map) -> Float64:
        """Return the texture coordinates of vertices, shape (m, 2), at which a map is sampled."""
        geom = self.batch.geom
        second = geom.texcoords_1 if found.coordinates == 2 else None
        return geom.texcoords if second is None else second

    def _sampled(self, sampler: Sampler, texcoords: Float64) -> Float64:
        """Sample a texture at texture coordinates of vertices (m, 2)."""
        level = level_of_detail(*self._texcoord_slopes(texcoords), sampler.size)
        return sampler.sample(self.interpolated(texcoords), level)

    def tint(self) -> Float64:
        """Return the factor of a material's colours: texture times vertex colour, shape (n, 3); see above."""
        if self.by_panda3d:
            return self._vertex_color()
        color = self.texture()[:, :3]
        return color if self.by_pyrender else np.asarray(color * self._vertex_color())

    def light_tint(self, factors: Factors) -> Float64:
        """Return the colour that multiplies all reflected light, shape (n, 3): pyrender's, or Panda3D's."""
        if self.by_panda3d:
            color = self.texture()[:, :3]
            return color if factors.scales is None else np.asarray(color * factors.scales)
        return np.asarray(self._vertex_color() * self.occlusion())

    def _vertex_color(self) -> Float64:
        colors = self.batch.geom.colors
        if not self.batch.surface.vertex_color or colors is None:
            return np.ones((len(self.rays), 3))
        return self.interpolated(colors)

    def alpha(self) -> Float64:
        """Return the product of the alphas of base colour, texture and vertices, shape (n,)."""
        alpha = self.batch.factors.base_colors[self.instance, 3] * self.texture()[:, 3]
        alphas = self.batch.geom.alphas
        if self.batch.surface.vertex_alpha and alphas is not None:
            alpha = alpha * self.interpolated(alphas[:, None])[:, 0]
        return np.asarray(alpha)

    def is_there(self) -> NDArray[np.bool_]:
        """Return whether the material's alpha test keeps the pixels."""
        if not self.batch.surface.cutout:
            return np.ones(len(self.rays), dtype=bool)
        return np.asarray(self.alpha() >= self.batch.alpha_cutoff)

    def _texcoord_slopes(self, texcoords: Float64) -> tuple[Float64, Float64]:
        """Return the derivatives of the texture coordinates per pixel, right and down, shapes (n, 2).

        A corner's share is its area over the sum of all three. The areas are products of offsets from the
        ray, which a step to the side changes by the corner's distance (orthographic: by 1).
        """
        values, x, z = texcoords[self._corners], self._seen.across, self._seen.up
        weight = self._seen.along if self.rays.perspective else np.ones_like(x)
        after, before = [1, 2, 0], [2, 0, 1]
        whole = self._seen.areas().sum(axis=1, keepdims=True)
        whole = np.where(whole == 0.0, np.inf, whole)
        middle = np.einsum("ni,nik->nk", self.hits.shares, values)

        def slope(by_area: Float64, step: float) -> Float64:
            by_share = by_area * (step / whole)
            rise = np.einsum("ni,nik->nk", by_share, values)
            return np.asarray(rise - by_share.sum(axis=1, keepdims=True) * middle)

        right, down = self.rays.pixel
        return (
            slope(z[:, after] * weight[:, before] - weight[:, after] * z[:, before], right),
            slope(weight[:, after] * x[:, before] - x[:, after] * weight[:, before], down),
        )
