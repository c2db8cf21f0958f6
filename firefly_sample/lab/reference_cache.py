"""References that were computed before: a frame in float64 takes seconds, and it is wanted again and again.

They are kept by what they depend on, to the last bit: the same frame of another scene that looks the same is
found, and one in which a single vertex has moved is not. The folder may be deleted at any time; what was used
least lately goes by itself.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firefly_sample.cache_files import drop_old, keep_whole, user_cache
from firefly_sample.lab.reference.chunks import Progress
from firefly_sample.lab.reference.frame import (
    VERSION,
    ReferenceFrame,
    finished,
    reference_settings,
    render_reference,
)
from firefly_sample.plan.frame_plan import Batch, FramePlan
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.particles.shadow import ParticleShadowPlan
from firefly_sample.plan.particles.visible import ParticleSet
from firefly_sample.plan.shadows.maps import ShadowMap
from firefly_sample.renderer import Renderer
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.material import Texture
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]

_KEPT = ("radiance", "light", "position")
_OWN = re.compile(r"reference-[0-9a-f]{40}\.npz")
"""Names of files that may be deleted to make room."""
LARGEST_CACHE = 2**30
"""Bytes: thirty frames of 800x600."""


def cache_folder() -> Path | None:
    """Return the folder of references, ``firefly_sample/reference`` in the user's cache; None without one."""
    return user_cache("reference")


def reference_frame(
    renderer: Renderer,
    scene: Scene,
    settings: Settings | None = None,
    time: float = 0.0,
    progress: Progress | None = None,
    *,
    folder: Path | None = None,
) -> ReferenceFrame:
    """A frame in float64 of what `renderer` sees: from its visibility and from the albedo that it samples.

    Parameters
    ----------
    renderer : Renderer
        Draws the visibility and the albedo, at its size; its settings stay as they are.
    scene : Scene
    settings : Settings, optional
        Of the frame, and of how its albedo is stored; the renderer's when absent. Nothing is cut off in any
        case: see `firefly_sample.lab.reference.frame.reference_settings`.
    time : float
        Seconds.
    progress : callable, optional
        Called with (done, total) while the reference is computed; never where it was kept.
    folder : Path, optional
        `cache_folder` when absent.

    Raises
    ------
    SettingsError
        If the look is "classic".
    MissingPackageError
        If there are shadows, the reference was not kept, and embreex is not installed.
    """
    before, renderer.settings = renderer.settings, reference_settings(settings or renderer.settings)
    try:
        plan = renderer.plan(scene, time, ("visibility", "albedo"))
        visibility = np.asarray(renderer.draw(plan)["visibility"], dtype=np.int32)
        albedo = renderer.surface(plan).albedo() if plan.batches else np.zeros((*visibility.shape[:2], 3))
    finally:
        renderer.settings = before
    folder = folder or cache_folder()
    if folder is None:
        return render_reference(plan, visibility, albedo=albedo, progress=progress)
    key = fingerprint(plan, visibility, albedo)
    kept = _load(folder, key, visibility.shape[:2])
    if kept is not None:
        return finished(plan, **kept)
    made = render_reference(plan, visibility, albedo=albedo, progress=progress)
    # a full disk, or a folder that cannot be written, costs time and nothing else
    with contextlib.suppress(OSError):
        _save(folder, key, made)
    return made


def fingerprint(plan: FramePlan, visibility: NDArray[np.int32], albedo: Float64) -> str:
    """Hexadecimal digits that change with anything that a reference depends on."""
    state = hashlib.blake2b(digest_size=20)
    for part in _parts(plan):
        _update(state, part)
    _update(state, visibility)
    _update(state, albedo)
    return state.hexdigest()


def _update(state: hashlib.blake2b, part: object) -> None:
    if isinstance(part, np.ndarray):
        state.update(repr((part.dtype.str, part.shape)).encode())
        state.update(np.ascontiguousarray(part).data)
    else:
        state.update(repr(part).encode())
    state.update(b"\0")


def _parts(plan: FramePlan) -> Iterator[object]:
    """What a reference depends on, one after the other."""
    view = plan.view
    yield from (VERSION, plan.size, view.size, view.lens, view.near, view.far)
    yield from (view.world_to_view, plan.settings, plan.ambient, plan.exposure, plan.background)
    yield from (plan.sprites.positions, plan.sprites.colors, plan.sprites.radii)
    for batch in plan.batches:
        yield from _batch_parts(batch)
    for lights in plan.lights:
        yield from (getattr(lights, field.name) for field in fields(LightSet))
    yield from (getattr(plan.particles, field.name) for field in fields(ParticleSet))
    yield from _particle_shadow_parts(plan.particle_shadow)
    for shadow in plan.shadows.maps:
        yield from _shadow_parts(shadow)


def _particle_shadow_parts(particle_shadow: ParticleShadowPlan | None) -> Iterator[object]:
    if particle_shadow is not None:
        yield from (
            particle_shadow.view.world_to_slices,
            particle_shadow.view.scale,
            particle_shadow.view.first,
            particle_shadow.view.per_unit,
        )
        yield from (
            particle_shadow.method,
            particle_shadow.places,
            particle_shadow.radii,
            particle_shadow.strengths,
        )


def _batch_parts(batch: Batch) -> Iterator[object]:
    yield from _geom_parts(batch.geom)
    yield from _texture_parts(batch.texture)
    yield from (batch.alpha_cutoff, batch.mirrored, batch.model_to_view, batch.variant)
    yield from (getattr(batch.factors, field.name) for field in fields(batch.factors))


def _shadow_parts(shadow: ShadowMap) -> Iterator[object]:
    yield from (shadow.lens, shadow.world_to_light)
    for batch in shadow.casters or ():
        yield from _geom_parts(batch.geom)
        yield from _texture_parts(batch.texture)
        yield from (batch.cutoff, batch.alphas, batch.model_to_world)


def _geom_parts(geom: Geom) -> Iterator[object]:
    yield from (geom.vertices, geom.triangles, geom.normals, geom.texcoords, geom.colors)


def _texture_parts(texture: Texture | None) -> Iterator[object]:
    yield None if texture is None else texture.pixels


def _load(folder: Path, key: str, shape: tuple[int, ...]) -> dict[str, Float64] | None:
    """Return what was kept under a key, or None if it is missing or damaged."""
    path = folder / _name(key)
    if not path.is_file():  # a pipe would be waited for
        return None
    with contextlib.suppress(Exception):  # there is no end to what a wrong file may raise
        # np.load would leave a damaged file open
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            kept = {name: stored[name] for name in _KEPT}
            whole = str(stored["key"]) == key
        with contextlib.suppress(OSError):
            os.utime(path)  # used lately
        whole &= all(image.shape == (*shape, 3) and image.dtype == np.float64 for image in kept.values())
        return kept if whole else None
    return None


def _save(folder: Path, key: str, frame: ReferenceFrame) -> None:
    """Write a frame whole, and make room for it."""
    path = folder / _name(key)
    with keep_whole(path) as file:
        np.savez(file, key=np.array(key), **{name: getattr(frame, name) for name in _KEPT})
    drop_old(path, _OWN, LARGEST_CACHE)


def _name(key: str) -> str:
    return f"reference-{key}.npz"
