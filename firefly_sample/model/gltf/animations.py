"""Animations of a glTF file (glTF 2.0, section 3.11)."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from firefly_sample.losses import Losses
from firefly_sample.model.data import AnimationData, ChannelData, Interpolation
from firefly_sample.model.gltf.accessors import read_accessor
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.json_object import JsonObject, shown
from firefly_sample.model.gltf.meshes import count_targets
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.transforms import vectors_from_gltf

_Path = Literal["translation", "rotation", "scale", "morph_weights"]
_PATHS: dict[str, tuple[_Path, str]] = {
    "translation": ("translation", "VEC3"),
    "rotation": ("rotation", "VEC4"),
    "scale": ("scale", "VEC3"),
    "weights": ("morph_weights", "SCALAR"),
}
"""Our name, and the type of the accessor, for each name of the file."""


def read_animation(
    document: Document, index: int, places: dict[int, int], losses: Losses
) -> AnimationData | None:
    """Return an animation; None if it moves nothing that is drawn.

    `places` maps nodes of the file to those that are drawn; channels of other nodes are left out.
    """
    animation = document.item("animations", index, "animation")
    name = animation.text("name", "") or f"animation {index}"
    samplers = animation.objects("samplers")
    channels = []
    for channel in animation.objects("channels"):
        target = channel.required_object("target")
        path = target.text("path")
        if path not in _PATHS:
            pointer = target.extension("KHR_animation_pointer")
            what = "KHR_animation_pointer" if pointer is not None else f"the path {path!r}"
            losses.add(f"channels of {what} are not played, of animations", name)
            continue
        node, sampler = target.index("node", "nodes"), channel.whole("sampler")
        if sampler >= len(samplers):
            raise channel.error("sampler", f"is {shown(sampler)}, but there are {len(samplers)} samplers")
        if node in places:
            channels.append(_channel(samplers[sampler], target, node, path, places[node]))
    return AnimationData(name, channels) if channels else None


def _channel(sampler: JsonObject, target: JsonObject, node: int, path: str, place: int) -> ChannelData:
    document, (ours, kind) = sampler.document, _PATHS[path]
    found = document.item("nodes", node, target.place("node"))
    if "matrix" in found and path != "weights":
        raise target.error("node", f"nodes[{node}] has a matrix, so it cannot be animated")
    interpolation = _interpolation(sampler)
    times = _times(sampler)
    parts = 3 if interpolation == "CUBICSPLINE" else 1
    targets = _targets(found, target) if path == "weights" else 1
    where = sampler.place("output")
    if "output" not in sampler:
        raise sampler.error("output", "is missing")
    stored = read_accessor(document, sampler.json["output"], where, (kind,)).astype(np.float64)
    if len(stored) != len(times) * parts * targets:
        raise document.error(where, f"has {len(stored)} elements for {len(times)} times")
    values = stored.reshape(len(times), parts, -1)
    if path in ("translation", "scale"):
        values = vectors_from_gltf(values) if path == "translation" else values[..., (0, 2, 1)]
    elif path == "rotation":
        if not np.linalg.norm(values[:, parts // 2], axis=-1).all():
            raise document.error(where, "has a rotation without length")
        values = np.concatenate([values[..., 3:], vectors_from_gltf(values[..., :3])], axis=-1)
    return ChannelData(place, ours, times, values if parts == 3 else values[:, 0], interpolation)


def _interpolation(sampler: JsonObject) -> Interpolation:
    given = sampler.text("interpolation", "LINEAR")
    for known in get_args(Interpolation):
        if given == known:
            return given  # type: ignore[return-value]
    raise sampler.error(
        "interpolation", f"must be one of {', '.join(get_args(Interpolation))}, got {shown(given)}"
    )


def _times(sampler: JsonObject) -> Float64:
    """Return the times in seconds, which ascend strictly."""
    if "input" not in sampler:
        raise sampler.error("input", "is missing")
    times = read_accessor(sampler.document, sampler.json["input"], sampler.place("input"), ("SCALAR",))
    if times.dtype.kind != "f":
        raise sampler.error("input", "must be floats")
    if not len(times) or (np.diff(times) <= 0.0).any():
        raise sampler.error("input", "must be times that ascend strictly")
    return times


def _targets(node: JsonObject, target: JsonObject) -> int:
    """Return the number of morph targets of a node's mesh."""
    mesh = node.index("mesh", "meshes")
    count = 0 if mesh is None else count_targets(node.document.item("meshes", mesh, node.place("mesh")))
    if not count:
        raise target.error("node", "its mesh has no morph targets, so no weights can be animated")
    return count
