"""What each pixel shows, in float64: from which triangle it sees to all that light needs to know of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import OutputError
from firefly_sample.lab.reference.chunks import Progress, chunks_of, run_all
from firefly_sample.lab.reference.fragments import Fragments
from firefly_sample.lab.reference.rays import Rays, pixel_rays
from firefly_sample.lab.reference.texture import Samplers
from firefly_sample.plan.frame_plan import Batch, FramePlan
from firefly_sample.readback import GBuffer

Float64 = NDArray[np.float64]

CHUNK = 16384


@dataclass(frozen=True, eq=False)
class Surfaces:
    """All pixels of a frame, shapes (height, width, ...), the first row on top, view space.

    Attributes
    ----------
    gbuffer : GBuffer
    ambient_albedo : ndarray of float64, shape (..., 3)
        Reflectance of ambient light.
    emission : ndarray of float64, shape (..., 3)
        Linear radiance that surfaces give off.
    covered : ndarray of bool, shape (...)
        Where there is a surface; elsewhere positions are NaN and all else is 0.
    """

    gbuffer: GBuffer
    ambient_albedo: Float64
    emission: Float64
    covered: NDArray[np.bool_]


def numbered_batches(plan: FramePlan) -> Iterator[tuple[int, Batch]]:
    """Each batch with the number of its first instance, among all of the frame's."""
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
    threads: int | None = None,
    progress: Progress | None = None,
) -> Surfaces:
    """The surfaces behind the pixels' centres.

    In the classic look textures are sampled as stored, and normals of two-sided materials are not turned.

    Parameters
    ----------
    plan : FramePlan
    visibility : ndarray of int32, shape (height, width, 2)
        The output "visibility": instance, counted over the plan's batches in order, and triangle of its Geom;
        -1 where there is nothing.
    albedo, ambient_albedo : ndarray, shape (height, width, 3), optional
        Linear reflectances as a GPU sampled them, which leaves its filtering out of a comparison; sampled
        here when absent. Without the second, what was sampled is found from the first.
    threads, progress : optional
        As `firefly_sample.lab.reference.chunks.run_all` takes them.

    Raises
    ------
    OutputError
        If a shape is wrong or the plan has no such triangle.
    """
    width, height = plan.view.size
    seen = np.asarray(visibility)
    _check_shape("visibility", seen, (height, width, 2))
    seen = seen.reshape(-1, 2)
    _check_numbers(plan, seen)
    classic = plan.settings.look == "classic"
    made = _Columns(height * width, turned=not classic)
    rays, samplers = pixel_rays(plan.view), Samplers(stored=classic)
    given = [
        None if image is None else _flat_image(name, image, (height, width, 3))
        for name, image in (("albedo", albedo), ("ambient albedo", ambient_albedo))
    ]
    parts: list[tuple[int, Batch, NDArray[np.intp]]] = []
    for first, batch in numbered_batches(plan):
        chosen = np.flatnonzero((seen[:, 0] >= first) & (seen[:, 0] < first + len(batch.ids)))
        parts.extend((first, batch, chunk) for chunk in chunks_of(chosen, CHUNK))

    def work(part: tuple[int, Batch, NDArray[np.intp]]) -> None:
        first, batch, pixels = part
        numbers = seen[pixels]
        found = Fragments(batch, rays.take(pixels), numbers[:, 0] - first, numbers[:, 1], samplers)
        made.fill(found, pixels, *given)

    run_all(work, parts, threads, progress)
    return made.surfaces((height, width), rays)


class _Columns:
    """Columns of data of n pixels; normals are `turned` as `Fragments.normal` says."""

    def __init__(self, pixels: int, turned: bool) -> None:
        self._turned = turned
        self.covered = np.zeros(pixels, dtype=bool)
        self.position = np.full((pixels, 3), np.nan)
        self.normal, self.albedo, self.ambient, self.emission = np.zeros((4, pixels, 3))
        self.specular = np.zeros((pixels, 4))

    def fill(
        self, found: Fragments, pixels: NDArray[np.intp], albedo: Float64 | None, ambient: Float64 | None
    ) -> None:
        """Keep what was found at some pixels."""
        factors = found.batch.factors.take(found.instance)
        base = factors.base_colors[:, :3]
        self.covered[pixels] = True
        self.position[pixels] = found.position
        self.normal[pixels] = found.normal(self._turned)
        self.emission[pixels] = factors.emissions
        self.specular[pixels] = factors.speculars
        tint = found.tint() if albedo is None or (ambient is None and not base.all()) else np.ones(3)
        if albedo is not None:
            tint = np.where(base > 0.0, albedo[pixels] / np.where(base > 0.0, base, 1.0), tint)
        own = base * tint if albedo is None else albedo[pixels]
        other = factors.ambients * tint if ambient is None else ambient[pixels]
        # a surface reflects no more than all light, whatever colours are multiplied
        self.albedo[pixels] = np.clip(own, 0.0, 1.0)
        self.ambient[pixels] = np.clip(other, 0.0, 1.0)

    def surfaces(self, shape: tuple[int, int], rays: Rays) -> Surfaces:
        """All of it, as images."""
        gbuffer = GBuffer(
            position=self.position.reshape(*shape, 3),
            normal=self.normal.reshape(*shape, 3),
            to_eye=rays.to_eye().reshape(*shape, 3),
            albedo=self.albedo.reshape(*shape, 3),
            specular=self.specular[:, :3].reshape(*shape, 3),
            shininess=self.specular[:, 3].reshape(shape),
        )
        return Surfaces(
            gbuffer,
            self.ambient.reshape(*shape, 3),
            self.emission.reshape(*shape, 3),
            self.covered.reshape(shape),
        )


def _flat_image(name: str, image: Float64, shape: tuple[int, ...]) -> Float64:
    values = np.asarray(image, dtype=np.float64)
    _check_shape(name, values, shape)
    return values.reshape(-1, shape[2])


def _check_shape(name: str, image: NDArray[np.generic], shape: tuple[int, ...]) -> None:
    if image.shape != shape:
        raise OutputError(f"{name} must have the plan's shape {shape}, got {image.shape}")


def _check_numbers(plan: FramePlan, seen: NDArray[np.int32]) -> None:
    """That the plan has each triangle."""
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
            "give it what was drawn from this plan"
        )
