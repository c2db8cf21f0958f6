"""A cache of reference frames in files: a frame in float64 takes seconds, and is needed again and again.

The key is a digest of everything that a reference depends on, to the last bit: an equal frame of a different
scene is found, a frame in which a single vertex has moved is not. The folder may be deleted at any time; the
files used least recently are deleted to keep it small.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.disk_cache import drop_old, fingerprint, keep_whole, user_cache
from firefly_sample.lab.reference.chunks import Progress
from firefly_sample.lab.reference.frame import (
    VERSION,
    ReferenceFrame,
    finished,
    reference_settings,
    render_reference,
)
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.readback import Surface
from firefly_sample.renderer import Renderer
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.scene import Scene
from firefly_sample.scene.texture import Texture
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]

_KEPT = ("radiance", "light", "position")
_OWN = re.compile(r"reference-[0-9a-f]{40}\.npz")
"""Names of the files that may be deleted to make room."""
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
    """Return the float64 reference of a renderer's frame, from the cache or computed.

    It is made from the visibility that the renderer draws, and what it samples from textures.

    Parameters
    ----------
    renderer : Renderer
        It draws at its size; its settings are left as they were.
    settings : Settings, optional
        Those of the frame and of the albedo's format; the renderer's when absent. No light is cut off in any
        case: see `firefly_sample.lab.reference.frame.reference_settings`.
    time : float
        Seconds.
    progress : callable, optional
        Called with (done, total) while the reference is computed.
    folder : Path, optional
        `cache_folder` when absent.

    Raises
    ------
    SettingsError
        If the look is "classic".
    MissingPackageError
        If there are shadows, the reference is not in the cache, and embreex is not installed.
    """
    before, renderer.settings = renderer.settings, reference_settings(settings or renderer.settings)
    try:
        plan = renderer.plan(scene, time, ("visibility", "albedo"))
        if more := _sampled_outputs(plan):
            if "normal" in more:  # normals are sampled, but the rounding of their format is an error
                renderer.settings = renderer.settings.with_changes(normal_format="rgba32f")
            plan = renderer.plan(scene, time, (*plan.outputs, *more))
        plan = with_blended(renderer, scene, time, plan)
        frame = renderer.draw(plan)
        visibility = np.asarray(frame["visibility"], dtype=np.int32)
        sampled = _sampled(renderer.surface(plan), more) if plan.batches else {}
    finally:
        renderer.settings = before
    folder = folder or cache_folder()

    def render() -> ReferenceFrame:
        return render_reference(plan, visibility, **sampled, progress=progress)

    if folder is None:
        return render()
    key = fingerprint(*_parts(plan), visibility, *(part for item in sampled.items() for part in item))
    if kept := _load(folder, key, visibility.shape[:2]):
        return finished(plan, **kept)
    made = render()
    # a full disk or a read-only folder is no error: the reference is computed again next time
    with contextlib.suppress(OSError):
        _save(folder, key, made)
    return made


def with_blended(renderer: Renderer, scene: Scene, time: float, plan: FramePlan) -> FramePlan:
    """Return a renderer's plan for data outputs with the blended surfaces, which only pictures show."""
    return replace(plan, blended=renderer.plan(scene, time, ("color",)).blended)


def _sampled_outputs(plan: FramePlan) -> tuple[str, ...]:
    """Return the outputs, beside the albedo, that a GPU samples from textures of a plan."""
    if plan.settings.look == "flat":
        return ()
    found: dict[str, None] = {}
    for batch in plan.batches:
        maps, surface = batch.maps, batch.surface
        if maps.emission is not None or (surface.unlit and surface.textured):
            found["emission"] = None
        if maps.normal is not None:
            found["normal"] = None
        if maps.metallic is not None and surface.metallic:
            found |= {"metallic": None, "roughness": None}
    return tuple(found)


def _sampled(surface: Surface, outputs: tuple[str, ...]) -> dict[str, Any]:
    """Return arguments of `render_reference`: the albedo, and these outputs, in float64."""
    sampled = {"albedo": surface.albedo()}
    if surface.has_modulation():
        sampled["tint"] = surface.tint()
    if "emission" in outputs:
        sampled["emission"] = np.asarray(surface.image("emission"), dtype=np.float64)
    if "normal" in outputs:
        sampled["normal"] = surface.unit_normal()
    if "metallic" in outputs:
        sampled["metallic_roughness"] = np.stack([surface.metallic(), surface.roughness()], axis=-1)
    return sampled


def _parts(plan: FramePlan) -> Iterator[object]:
    """Yield everything that a reference depends on, apart from visibility and albedo."""
    view, slices = plan.view, plan.particle_shadow
    yield from (VERSION, plan.size, view.size, view.lens, view.near, view.far, view.world_to_view)
    yield from (plan.settings, plan.ambient, plan.exposure, plan.background)
    yield from (plan.sprites.positions, plan.sprites.colors, plan.sprites.radii)
    blended = plan.blended.batches if plan.blended is not None else ()
    for batch in (*plan.batches, *blended):
        yield from _model_parts(batch.geom, batch.texture)
        for name, found in batch.maps.named():
            yield from (name, found.coordinates)
            yield from _texture_parts(found.texture)
        yield from (batch.maps.normal_scale, batch.maps.occlusion_strength)
        yield from (batch.alpha_cutoff, batch.mirrored, batch.model_to_view, batch.surface)
        yield batch.depth_offset
        yield from _columns(batch.factors)
    yield len(blended)
    for lights in plan.lights:
        yield from _columns(lights)
    yield from _columns(plan.particles)
    if slices is not None:
        yield from (slices.view.world_to_slices, slices.view.scale, slices.view.first, slices.view.per_unit)
        yield from (slices.method, slices.positions, slices.radii, slices.strengths)
    for shadow in plan.shadows.maps:
        yield from (shadow.lens, shadow.world_to_light)
        for caster in shadow.casters or ():
            yield from _model_parts(caster.geom, caster.texture)
            if caster.modulate is not None:
                yield from ("modulate", caster.modulate.coordinates)
                yield from _texture_parts(caster.modulate.texture)
            yield from (caster.cutoff, caster.alphas, caster.vertex_alpha, caster.model_to_world)


def _columns(record: Any) -> Iterator[object]:
    return (getattr(record, field.name) for field in fields(record))


def _model_parts(geom: Geom, texture: Texture | None) -> Iterator[object]:
    yield from (geom.vertices, geom.triangles, geom.normals, geom.texcoords, geom.colors, geom.alphas)
    yield from (geom.texcoords_1, geom.tangents)
    yield from _texture_parts(texture)


def _texture_parts(texture: Texture | None) -> Iterator[object]:
    yield from (None, None) if texture is None else (texture.pixels, texture.sampling)


def _load(folder: Path, key: str, shape: tuple[int, ...]) -> dict[str, Float64] | None:
    """Return the images under a key, or None if the file is missing or damaged."""
    path = folder / f"reference-{key}.npz"
    if not path.is_file():  # opening a pipe would block
        return None
    with contextlib.suppress(Exception):  # a damaged file may raise anything
        # np.load would leave a damaged file open
        with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            kept = {name: stored[name] for name in _KEPT}
            whole = str(stored["key"]) == key
        with contextlib.suppress(OSError):
            os.utime(path)  # mark as recently used
        whole &= all(image.shape == (*shape, 3) and image.dtype == np.float64 for image in kept.values())
        return kept if whole else None
    return None


def _save(folder: Path, key: str, frame: ReferenceFrame) -> None:
    """Write a frame, and delete old files if there are too many."""
    path = folder / f"reference-{key}.npz"
    with keep_whole(path) as file:
        np.savez(file, key=np.array(key), **{name: getattr(frame, name) for name in _KEPT})
    drop_old(path, _OWN, LARGEST_CACHE)
