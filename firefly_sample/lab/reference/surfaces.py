"""Find everything that lighting needs of each pixel in float64, from the triangle that the pixel sees.

Fragments are the float64 twin of ``shaders/geometry.vert`` and of what a rasteriser makes of its outputs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import OutputError
from firefly_sample.lab.reference.chunks import chunks_of, run_all
from firefly_sample.lab.reference.metallic import ambient_reflectance
from firefly_sample.lab.reference.normal_map import mapped_normal, unit_or_zero
from firefly_sample.lab.reference.rays import Intersections, RayCorners, Rays, intersect, pixel_rays
from firefly_sample.lab.reference.texture import Sampler, Samplers, level_of_detail
from firefly_sample.plan.collect import Factors
from firefly_sample.plan.frame_plan import Batch, FramePlan
from firefly_sample.plan.surface_maps import Map
from firefly_sample.readback import GBuffer

Float64 = NDArray[np.float64]

CHUNK = 16384
NOTHING: Mapping[str, Float64] = {}


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
        self._samplers = samplers
        self._corners = batch.geom.triangles[triangle]
        matrix = batch.model_to_view[instance]
        corners = batch.geom.vertices[self._corners] @ matrix[:, :3, :3] + matrix[:, None, 3, :3]
        self._seen = RayCorners.of(corners, rays.origin, rays.direction)
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

    def normal(self, turned: bool = True, mapped: bool = True) -> Float64:
        """Return unit normals in view space, shape (n, 3), and with `mapped` with the material's normal map.

        With `turned`, those of two-sided materials face the eye: they are turned where the normal without
        the map does not. A normal of length 0 faces the eye.
        """
        own = self.interpolated(self.batch.geom.normals)
        seen, length = unit_or_zero(
            np.einsum("ni,nij->nj", own, normal_matrices(self.batch.model_to_view)[self.instance])
        )
        unit = np.where(length > 0.0, seen, self.rays.to_eye())
        found = self._mapped(unit) if mapped else unit
        if turned and self.batch.surface.double_sided:
            away = self.position if self.rays.perspective else self.rays.direction
            found = np.where((np.einsum("ni,ni->n", unit, away) > 0.0)[:, None], -found, found)
        return np.asarray(found)

    def _mapped(self, unit: Float64) -> Float64:
        """Return normals with the normal map, if there is one."""
        maps = self.batch.maps
        if maps.normal is None:
            return unit
        own = self.interpolated(self.batch.geom.tangents_or_made(maps.normal.coordinates - 1))
        linear = self.batch.model_to_view[self.instance, :3, :3]
        seen = np.concatenate([np.einsum("ni,nij->nj", own[:, :3], linear), own[:, 3:]], axis=1)
        texel = self._numbers(maps.normal)[:, :3]
        return mapped_normal(unit, seen, texel, maps.normal_scale, self.batch.mirrored)

    def is_front(self) -> NDArray[np.bool_]:
        """Return whether the pixels are on sides that are drawn."""
        if self.batch.surface.double_sided:
            return np.ones(len(self.rays), dtype=bool)
        return np.asarray(self.hits.front != self.batch.mirrored)

    def texture(self) -> Float64:
        """Return linear colour and alpha of the texture, shape (n, 4); ones without a texture."""
        surface, texture = self.batch.surface, self.batch.texture
        if not surface.textured or texture is None:
            return np.ones((len(self.rays), 4))
        sampler = self._samplers.of(texture, self.batch.alpha_cutoff if surface.cutout else None)
        return self._sampled(sampler, self.batch.geom.texcoords)

    def emission(self, factors: Factors) -> Float64:
        """Return the linear radiance that the surface emits, shape (n, 3), by the pixels' own factors."""
        found, geom = self.batch.maps.emission, self.batch.geom
        if found is None:
            return factors.emissions
        second = geom.texcoords_1 if self.batch.surface.second_texcoords else None
        sampler = self._samplers.of(found.texture, None)
        texel = self._sampled(sampler, geom.texcoords if second is None else second)
        return np.asarray(factors.emissions * texel[:, :3])

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
        geom = self.batch.geom
        second = geom.texcoords_1 if found.coordinates == 2 else None
        sampler = self._samplers.of(found.texture, None, stored=True)
        return self._sampled(sampler, geom.texcoords if second is None else second)

    def _sampled(self, sampler: Sampler, texcoords: Float64) -> Float64:
        """Sample a texture at texture coordinates of vertices (m, 2)."""
        level = level_of_detail(*self._texcoord_slopes(texcoords), sampler.size)
        return sampler.sample(self.interpolated(texcoords), level)

    def tint(self) -> Float64:
        """Return the factor of a material's colours: texture times vertex colour, shape (n, 3)."""
        color = self.texture()[:, :3]
        if self.batch.surface.vertex_color and self.batch.geom.colors is not None:
            color = color * self.interpolated(self.batch.geom.colors)
        return color

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


@dataclass(frozen=True, eq=False)
class Surfaces:
    """All pixels of a frame, shapes (height, width[, 3]), the first row on top, or a list; view space.

    Attributes
    ----------
    ambient_albedo : ndarray of float64
        Reflectance of ambient light, times its occlusion.
    emission : ndarray of float64
        Linear radiance that surfaces give off.
    covered : ndarray of bool
        Where there is a surface; elsewhere positions are NaN and all else is 0.
    """

    gbuffer: GBuffer
    ambient_albedo: Float64
    emission: Float64
    covered: NDArray[np.bool_]

    @classmethod
    def none(cls, to_eye: Float64) -> Surfaces:
        """Return pixels without surfaces, to be filled; `to_eye` has their shape (..., 3)."""
        shape = to_eye.shape[:-1]
        normal, albedo, specular, ambient, emission = np.zeros((5, *to_eye.shape))
        position, shininess = np.full_like(to_eye, np.nan), np.zeros(shape)
        gbuffer = GBuffer(
            position, normal, to_eye, albedo, specular, shininess, np.full(shape, -1.0), np.ones(shape)
        )
        return cls(gbuffer, ambient, emission, np.zeros(shape, dtype=bool))

    def fill(
        self, at: Any, found: Fragments, sampled: Mapping[str, Float64] = NOTHING, classic: bool = False
    ) -> None:
        """Set the pixels at an index to n fragments, of which a GPU may have sampled something."""
        gbuffer, batch = self.gbuffer, found.batch
        factors = batch.factors.take(found.instance)
        self.covered[at] = True
        gbuffer.position[at] = found.position
        if classic:
            gbuffer.normal[at] = found.normal(turned=False, mapped=False)
        else:
            gbuffer.normal[at] = _of_map(batch.maps.normal, sampled.get("normal"), found.normal)
        if batch.surface.unlit and not classic:
            texture = batch.texture if batch.surface.textured else None
            self.emission[at] = _of_map(texture, sampled.get("emission"), lambda: _shown(found, factors))
            return
        self.emission[at] = _of_map(
            batch.maps.emission, sampled.get("emission"), lambda: found.emission(factors)
        )
        if batch.surface.metallic and not classic:
            gbuffer.metallic[at], gbuffer.roughness[at] = _of_map(
                batch.maps.metallic,
                sampled.get("metallic and roughness"),
                lambda: found.metallic_roughness(factors),
            ).T
        elif not (batch.surface.metallic or batch.surface.unlit):
            gbuffer.specular[at] = factors.speculars[:, :3]
            gbuffer.shininess[at] = factors.speculars[:, 3]
        gbuffer.albedo[at], self.ambient_albedo[at] = _reflectances(
            found, factors, gbuffer.metallic[at], sampled.get("albedo"), sampled.get("ambient albedo")
        )


def numbered_batches(plan: FramePlan) -> Iterator[tuple[int, Batch]]:
    """Yield each batch with the number of its first instance among all of the frame's."""
    first = 0
    for batch in plan.batches:
        yield first, batch
        first += len(batch.ids)


def see_surfaces(
    plan: FramePlan,
    visibility: NDArray[np.int32],
    *,
    albedo: Float64 | None = None,
    ambient_albedo: Float64 | None = None,
    emission: Float64 | None = None,
    metallic_roughness: Float64 | None = None,
    normal: Float64 | None = None,
    threads: int | None = None,
) -> Surfaces:
    """Return the surfaces seen through the pixels' centres.

    In the classic look textures are sampled as stored, normals of two-sided materials are not turned, and
    there are no normal maps, no metallic-roughness surfaces and no unlit ones.

    Parameters
    ----------
    visibility : ndarray of int32, shape (height, width, 2)
        As `firefly_sample.lab.reference.raycast.cast_visibility` returns it.
    albedo, ambient_albedo : ndarray, shape (height, width, 3), optional
        Linear reflectances as a GPU sampled them, which leaves its filtering out of a comparison; sampled
        here when absent. If only the first is given, the second is derived from it.
    emission, normal : ndarray, shape (height, width, 3), optional
        Linear emission, and normals in view space, as a GPU sampled them; taken where they have a texture,
        and sampled here when absent. An unlit surface emits the texture of its base colour.
    metallic_roughness : ndarray, shape (height, width, 2), optional
        The same of metallic and roughness.

    Raises
    ------
    OutputError
        If a shape is wrong or the plan has no such triangle.
    """
    width, height = plan.view.size
    shape, classic = (height, width), plan.settings.look == "classic"
    seen = _checked("visibility", np.asarray(visibility), (height, width, 2)).reshape(-1, 2)
    _check_numbers(plan, seen)
    rays, samplers = pixel_rays(plan.view), Samplers(stored=classic)
    images = {
        "albedo": albedo,
        "ambient albedo": ambient_albedo,
        "emission": emission,
        "normal": normal,
        "metallic and roughness": metallic_roughness,
    }
    given = {
        name: _checked(
            name, np.asarray(image, dtype=np.float64), (*shape, 2 if name == "metallic and roughness" else 3)
        )
        for name, image in images.items()
        if image is not None
    }
    surfaces = Surfaces.none(rays.to_eye().reshape(*shape, 3))
    parts: list[tuple[int, Batch, NDArray[np.intp]]] = []
    for first, batch in numbered_batches(plan):
        chosen = np.flatnonzero((seen[:, 0] >= first) & (seen[:, 0] < first + len(batch.ids)))
        parts.extend((first, batch, chunk) for chunk in chunks_of(chosen, CHUNK))

    def work(part: tuple[int, Batch, NDArray[np.intp]]) -> None:
        first, batch, pixels = part
        numbers = seen[pixels]
        found = Fragments(batch, rays.take(pixels), numbers[:, 0] - first, numbers[:, 1], samplers)
        at = np.unravel_index(pixels, shape)
        surfaces.fill(at, found, {name: image[at] for name, image in given.items()}, classic)

    run_all(work, parts, threads)
    return surfaces


def _of_map(texture: object | None, sampled: Float64 | None, exact: Callable[[], Float64]) -> Float64:
    """Return what a GPU sampled from a texture; without a texture or such samples, what is exact."""
    return exact() if texture is None or sampled is None else sampled


def _shown(found: Fragments, factors: Factors) -> Float64:
    """Return the colours of unlit surfaces, shape (n, 3)."""
    return np.clip(factors.base_colors[:, :3] * found.tint(), 0.0, 1.0)


def _reflectances(
    found: Fragments, factors: Factors, metallic: Float64, albedo: Float64 | None, ambient: Float64 | None
) -> tuple[Float64, Float64]:
    """Return albedo and ambient albedo, shapes (n, 3), of which the given ones were sampled by a GPU."""
    base, metals = factors.base_colors[:, :3], found.batch.surface.metallic
    derived = ambient is None and not (base.all() or metals)
    tint = found.tint() if albedo is None or derived else np.ones(3)
    if albedo is not None:
        tint = np.where(base > 0.0, albedo / np.where(base > 0.0, base, 1.0), tint)
    # products of colours may exceed 1, but a surface reflects no more light than it gets
    own = np.clip(base * tint if albedo is None else albedo, 0.0, 1.0)
    if ambient is not None:
        other = ambient
    elif metals:
        other = ambient_reflectance(own, np.maximum(metallic, 0.0)) * found.occlusion()
    else:
        other = np.clip(factors.ambients * tint, 0.0, 1.0) * found.occlusion()
    return own, np.clip(other, 0.0, 1.0)


def _checked(name: str, image: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    if image.shape != shape:
        raise OutputError(f"{name} must have the plan's shape {shape}, got {image.shape}")
    return image


def _check_numbers(plan: FramePlan, seen: NDArray[np.int32]) -> None:
    """Raise an OutputError if the plan lacks one of the triangles."""
    counts = [len(batch.ids) for batch in plan.batches]
    triangles = np.repeat([len(batch.geom.triangles) for batch in plan.batches], counts)
    drawn = np.flatnonzero(seen[:, 0] >= 0)
    wrong = seen[drawn, 0] >= len(triangles)
    if not wrong.any():
        wrong = (seen[drawn, 1] < 0) | (seen[drawn, 1] >= triangles[seen[drawn, 0]])
    if wrong.any():
        instance, triangle = seen[drawn[np.argmax(wrong)]]
        raise OutputError(
            f"visibility names triangle {triangle} of instance {instance}, which the plan does not have: "
            "pass the visibility that was drawn from this plan"
        )
