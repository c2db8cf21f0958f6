"""Cameras of a glTF file (glTF 2.0, section 3.10), and its lights (KHR_lights_punctual)."""

from __future__ import annotations

import math
from typing import Literal

from firefly_sample.losses import Losses
from firefly_sample.model.data import CameraData, LightData
from firefly_sample.model.gltf.document import Document
from firefly_sample.model.gltf.json_object import JsonObject, shown

_KINDS: dict[str, Literal["point", "spot", "directional"]] = {
    "point": "point",
    "spot": "spot",
    "directional": "directional",
}


def read_camera(document: Document, index: int, losses: Losses) -> CameraData:
    """Return a camera; raise ModelError if a number of it is impossible."""
    camera = document.item("cameras", index, "camera")
    name, kind = camera.text("name", "") or f"camera {index}", camera.text("type")
    if kind == "perspective":
        return _perspective(name, camera.required_object("perspective"))
    if kind == "orthographic":
        return _orthographic(name, camera.required_object("orthographic"), losses)
    raise camera.error("type", f"must be perspective or orthographic, got {shown(kind)}")


def _perspective(name: str, lens: JsonObject) -> CameraData:
    near, far = lens.number("znear"), lens.number("zfar", math.inf)
    if not 0.0 < near < far:
        raise lens.error("", f"znear must be above 0 and below zfar, got {near:g} and {far:g}")
    angle, aspect = lens.number("yfov"), lens.number("aspectRatio", None)
    if not 0.0 < angle < math.pi:
        raise lens.error("yfov", f"must be above 0 and below pi, got {angle:g}")
    if aspect is not None and not aspect > 0.0:
        raise lens.error("aspectRatio", f"must be above 0, got {aspect:g}")
    return CameraData(name, near, far, fov=math.degrees(angle), aspect=aspect)


def _orthographic(name: str, lens: JsonObject, losses: Losses) -> CameraData:
    """Return a camera; a negative magnification, which mirrors the picture, counts as a positive one."""
    near, far = lens.number("znear"), lens.number("zfar")
    if not 0.0 <= near < far:
        raise lens.error("", f"znear must be 0 or more and below zfar, got {near:g} and {far:g}")
    halves = lens.number("xmag"), lens.number("ymag")
    for key, half in zip(("xmag", "ymag"), halves, strict=True):
        if half == 0.0:
            raise lens.error(key, "must not be 0")
    if min(halves) < 0.0:
        losses.add("a negative xmag or ymag does not mirror the picture, of cameras", name)
    return CameraData(name, near, far, film_size=(2.0 * abs(halves[0]), 2.0 * abs(halves[1])))


def light_index(node: JsonObject) -> int | None:
    """Return the index of a node's light in the extension's list; None if it has none."""
    extension = node.extension("KHR_lights_punctual")
    if extension is None:
        return None
    index, count = extension.whole("light"), len(_lights(node.document))
    if index >= count:
        raise extension.error("light", f"is {shown(index)}, but the file has {count} lights")
    return index


def read_light(document: Document, index: int) -> LightData:
    """Return a light; raise ModelError if a number of it is impossible."""
    light = _lights(document)[index]
    kind = light.text("type")
    if kind not in _KINDS:
        raise light.error("type", f"must be one of {', '.join(_KINDS)}, got {shown(kind)}")
    r, g, b = light.numbers("color", 3, (1.0, 1.0, 1.0), least=0.0)
    reach = light.number("range", math.inf)
    if not reach > 0.0:
        raise light.error("range", f"must be above 0, got {reach:g}")
    made = LightData(
        light.text("name", "") or f"light {index}",
        _KINDS[kind],
        (r, g, b),
        light.number("intensity", 1.0, least=0.0),
        reach,
    )
    if kind == "spot":
        made.inner, made.outer = _cone(light)
    return made


def _cone(light: JsonObject) -> tuple[float, float]:
    """Return a spotlight's half-angles in degrees."""
    spot = light.required_object("spot")
    inner, outer = spot.number("innerConeAngle", 0.0), spot.number("outerConeAngle", math.pi / 4.0)
    if not 0.0 <= inner < outer <= math.pi / 2.0 + 1e-6:
        raise spot.error(
            "", f"needs 0 <= innerConeAngle < outerConeAngle <= pi/2, got {inner:g} and {outer:g}"
        )
    return math.degrees(inner), min(math.degrees(outer), 90.0)


def _lights(document: Document) -> list[JsonObject]:
    extension = document.root.extension("KHR_lights_punctual")
    return [] if extension is None else extension.objects("lights")
