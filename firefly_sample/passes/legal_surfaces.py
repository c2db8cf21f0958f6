"""The legal variants of passes that draw surfaces: targets of the G-buffer, looks and features."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any, get_args

from firefly_sample.passes.base import BOTH
from firefly_sample.passes.legal import choices
from firefly_sample.plan.variants import (
    AlbedoFormat,
    Interpolation,
    MapCoordinates,
    NormalFormat,
    PositionTarget,
)

MOST_TARGETS = 8
"""Colour targets that a draw may write: what every driver of OpenGL 3.3 offers."""


def legal_surfaces(emission: bool) -> list[list[dict[str, Any]]]:
    """Return parts of what a draw of surfaces can ask for, in a pass that writes emission or not.

    Alpha of vertex colours needs these, and cuts out; second texture coordinates need an emission texture.
    """
    maps = get_args(MapCoordinates)
    plain = choices(
        textured=BOTH,
        vertex_color=BOTH,
        cutout=BOTH,
        double_sided=BOTH,
        vertex_alpha=BOTH,
        emission_textured=BOTH if emission else (False,),
        second_texcoords=BOTH if emission else (False,),
    )
    return [
        [
            each
            for each in plain
            if ((each["vertex_color"] and each["cutout"]) or not each["vertex_alpha"])
            and (each["emission_textured"] or not each["second_texcoords"])
        ],
        [{}, {"unlit": True}, *({"metallic": True, "metallic_map": each} for each in maps)],
        choices(normal_map=maps),
        choices(occlusion_map=maps),
        choices(modulate_map=maps),
    ]


def _targets() -> Iterator[dict[str, Any]]:
    """Yield the targets of the G-buffer that a frame can have together, their formats and interpolations."""
    for albedo, normal, distance in product(BOTH, repeat=3):
        # what a frame has beside the albedo for light, no frame has without it
        extras = BOTH if albedo else (False,)
        for chosen in choices(
            albedo=[albedo],
            normal=[normal],
            distance=[distance],
            ambient_albedo=extras,
            specular=extras,
            emission=extras,
            id=BOTH,
            visibility=BOTH,
            position_target=("none",) if distance else get_args(PositionTarget),
            # without a target, nothing is encoded
            normal_format=get_args(NormalFormat) if normal else ("oct16",),
            albedo_format=get_args(AlbedoFormat) if albedo else ("sqrt10",),
            interpolation=get_args(Interpolation),
        ):
            beside = chosen["ambient_albedo"] or chosen["specular"] or chosen["emission"]
            linear = not albedo or chosen["albedo_format"] == "linear"
            if chosen["normal_format"] == "classic" and (beside or not linear):
                continue
            interpolated = normal or distance or chosen["position_target"] != "none"
            if chosen["interpolation"] == "rasterizer" or (interpolated and chosen["visibility"]):
                yield chosen


def _legal_looks(chosen: Mapping[str, Any], panda3d: bool) -> list[dict[str, Any]]:
    """Return what a look adds to a choice of targets: "panda3d", or any other."""
    others: list[dict[str, Any]] = [] if panda3d else [{}]
    if chosen["interpolation"] != "rasterizer" or chosen["normal_format"] == "classic":
        return others
    looks: list[dict[str, Any]] = [{"pyrender": True}]
    if panda3d:
        looks = [{"panda3d": True} | viewer for viewer in _legal_viewers(chosen["specular"])]
    tinted = [look | {"tint": True} for look in looks] if chosen["albedo"] else []
    return [*others, *looks, *tinted]


def _legal_viewers(specular: bool) -> list[dict[str, Any]]:
    """Return what a draw may say of the eye that highlights see, if there are any."""
    some = {"local_viewers": True}
    return [{}, some, some | {"local_viewer": True}] if specular else [{}]


def _count_targets(chosen: Mapping[str, Any]) -> int:
    """Return the number of colour targets of a choice."""
    names = "albedo", "normal", "distance", "ambient_albedo", "specular", "emission", "id", "visibility"
    return len([name for name in names if chosen[name]]) + int(chosen["position_target"] != "none")


def legal_targets(emission: bool, metals: bool, panda3d: bool) -> list[dict[str, Any]]:
    """Return targets that a frame can have together, with its look.

    That is in a frame with emission and metallic-roughness surfaces or not, of the look "panda3d" or another.
    """
    return [
        chosen | look
        for chosen in _targets()
        for look in _legal_looks(chosen, panda3d)
        if chosen["emission"] == emission
        if _count_targets(chosen) + metals + ("tint" in look) <= MOST_TARGETS
    ]
