"""Find everything that lighting needs of each pixel in float64, from the triangle that the pixel sees."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import OutputError
from firefly_sample.lab.reference import panda3d
from firefly_sample.lab.reference.chunks import chunks_of, run_all
from firefly_sample.lab.reference.fragments import Fragments
from firefly_sample.lab.reference.metallic import ambient_reflectance
from firefly_sample.lab.reference.rays import pixel_rays
from firefly_sample.lab.reference.texture import Samplers
from firefly_sample.plan.factors import Factors
from firefly_sample.plan.frame_plan import Batch, FramePlan
from firefly_sample.readback import GBuffer

Float64 = NDArray[np.float64]

CHUNK = 16384
NOTHING: Mapping[str, Float64] = {}


@dataclass(frozen=True, eq=False)
class Surfaces:
    """All pixels of a frame, shapes (height, width[, 3]), the first row on top, or a list; view space.

    Attributes
    ----------
    ambient_albedo : ndarray of float64
        Reflectance of ambient light, times its occlusion.
    tint : ndarray of float64
        Multiplies all light that is reflected, or in the look "panda3d" what is shown of it; mostly ones.
    emission : ndarray of float64
        Linear radiance that surfaces give off.
    covered : ndarray of bool
        Where there is a surface; elsewhere positions are NaN and all else is 0.
    """

    gbuffer: GBuffer
    ambient_albedo: Float64
    tint: Float64
    emission: Float64
    covered: NDArray[np.bool_]

    @classmethod
    def none(cls, to_eye: Float64) -> Surfaces:
        """Return pixels without surfaces, to be filled; `to_eye` has their shape (..., 3)."""
        shape = to_eye.shape[:-1]
        normal, albedo, specular, ambient, emission = np.zeros((5, *to_eye.shape))
        position, shininess = np.full_like(to_eye, np.nan), np.zeros(shape)
        gbuffer = GBuffer(
            position, normal, to_eye.copy(), albedo, specular, shininess, np.full(shape, -1.0), np.ones(shape)
        )
        return cls(gbuffer, ambient, np.ones_like(ambient), emission, np.zeros(shape, dtype=bool))

    def radiance(self, matt: Float64, gloss: Float64, ambient: Float64, look: str) -> Float64:
        """Return radiance in ambient light, by what lights alone add, before their tint.

        That is without Phong highlights, and these. In the look "panda3d", it is display values.
        """
        if look == "panda3d":
            return panda3d.shown(matt + self.ambient_albedo * ambient + self.emission, self.tint, gloss)
        return np.asarray((matt + gloss + self.ambient_albedo * ambient) * self.tint + self.emission)

    def fill(
        self, at: Any, found: Fragments, sampled: Mapping[str, Float64] = NOTHING, look: str = "correct"
    ) -> None:
        """Set the pixels at an index to n fragments, of which a GPU may have sampled something."""
        gbuffer, batch, classic = self.gbuffer, found.batch, look == "classic"
        factors = batch.factors.take(found.instance)
        if not found.by_panda3d:
            factors = factors.scaled()
        self.covered[at] = True
        gbuffer.position[at] = found.position
        if found.by_pyrender or found.by_panda3d:
            gbuffer.to_eye[at] = found.to_eye()
        if found.by_panda3d:
            self.tint[at] = _of_map(
                batch.texture or batch.maps.modulate, sampled.get("tint"), lambda: found.light_tint(factors)
            )
        if classic:
            gbuffer.normal[at] = found.normal(turned=False, mapped=False)
        else:
            gbuffer.normal[at] = _of_map(batch.maps.normal, sampled.get("normal"), found.normal)
        if (batch.surface.unlit and not classic) or look == "flat":
            texture = (batch.texture if batch.surface.textured else None) or batch.maps.modulate
            if found.by_panda3d:
                texture = None  # it is in the tint
            given = sampled.get("albedo" if look == "flat" else "emission")
            self.emission[at] = _of_map(texture, given, lambda: _shown(found, factors))
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
        if found.by_pyrender:
            self.tint[at] = found.light_tint(factors)
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
    tint: Float64 | None = None,
    threads: int | None = None,
) -> Surfaces:
    """Return the surfaces seen through the pixels' centres.

    In the classic look textures are sampled as stored, normals of two-sided materials are not turned, and
    there are no normal maps, no metallic-roughness surfaces and no unlit ones. In the look "flat" textures
    are sampled as stored, and every surface emits its base colour.

    Parameters
    ----------
    visibility : ndarray of int32, shape (height, width, 2)
        As `firefly_sample.lab.reference.raycast.cast_visibility` returns it.
    albedo, ambient_albedo : ndarray, shape (height, width, 3), optional
        Linear reflectances as a GPU sampled them, which leaves its filtering out of a comparison; sampled
        here when absent. If only the first is given, the second is derived from it. In the look "panda3d"
        they count for metallic-roughness materials alone.
    emission, normal : ndarray, shape (height, width, 3), optional
        Linear emission, and normals in view space, as a GPU sampled them; taken where they have a texture,
        and sampled here when absent. An unlit surface emits the texture of its base colour.
    metallic_roughness : ndarray, shape (height, width, 2), optional
        The same of metallic and roughness.
    tint : ndarray, shape (height, width, 3), optional
        The same of the colours of textures, times colour scales, in the look "panda3d".

    Raises
    ------
    OutputError
        If a shape is wrong or the plan has no such triangle.
    """
    width, height = plan.view.size
    shape, look = (height, width), plan.settings.look
    seen = _checked("visibility", np.asarray(visibility), (height, width, 2)).reshape(-1, 2)
    _check_numbers(plan, seen)
    rays, samplers = pixel_rays(plan.view), Samplers(look)
    images = {
        "albedo": albedo,
        "ambient albedo": ambient_albedo,
        "emission": emission,
        "normal": normal,
        "tint": tint,
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
        surfaces.fill(at, found, {name: image[at] for name, image in given.items()}, look)

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
    if found.by_panda3d:  # nothing of it is sampled
        albedo = ambient = None
    base, metals = factors.base_colors[:, :3], found.batch.surface.metallic
    derived = ambient is None and not (base.all() or metals)
    tint = found.tint() if albedo is None or derived else np.ones(3)
    if albedo is not None:
        tint = np.where(base > 0.0, albedo / np.where(base > 0.0, base, 1.0), tint)
    # products of colours may exceed 1, but a surface reflects no more light than it gets
    own = np.clip(base * tint if albedo is None else albedo, 0.0, 1.0)
    if ambient is not None:
        other = ambient
    elif found.by_pyrender:
        other = own
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
