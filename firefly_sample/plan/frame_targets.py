"""The table of render targets: what each is like in a frame.

Which of them exist follows from who reads them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from firefly_sample.plan.needs import NORMAL_OUTPUTS, PLACE_OUTPUTS, Needs
from firefly_sample.plan.targets import (
    ACCUMULATION_FORMATS,
    ALBEDO_FORMATS,
    COARSE_DEPTH,
    PARTICLE_SHADOW_FORMATS,
    STORED_POSITIONS,
    Target,
    particle_texels,
)

Shape = dict[str, Any]


def make_target(name: str, needs: Needs, because: str, own: dict[str, Callable[[Needs], Shape]]) -> Target:
    """Return a target of `TARGETS`, or of a pass's `own`, with the reason why it exists."""
    shape = (own[name] if name in own else TARGETS[name])(needs)
    return Target(name, because=because, **shape)


def _shape(form: str, **rest: Any) -> Callable[[Needs], Shape]:
    return lambda _: {"format": form, **rest}


def _depth(needs: Needs) -> Shape:
    """The depth buffer, and its value where nothing is."""
    if needs.reverse:
        return {"format": "depth32f", "clear": (0.0, 0.0, 0.0, 0.0)}
    return {
        "format": COARSE_DEPTH.get(needs.settings.position_method, "depth24"),
        "clear": (1.0, 0.0, 0.0, 0.0),
    }


def _shadow_atlas(needs: Needs) -> Shape:
    lit = ">=" if needs.reverse else "<="
    shape = {"per_sample": False, "size": needs.atlas, "compare": lit}
    return _depth(needs) | shape | {"format": "depth32f" if needs.reverse else "depth24"}


def _normal(needs: Needs) -> Shape:
    form, encoding = needs.normal_format
    return {"format": form, "encoding": encoding}


def _colors(needs: Needs) -> Shape:
    form, encoding = ("rgba8", "linear") if needs.classic else ALBEDO_FORMATS[needs.settings.albedo_format]
    return {"format": form, "encoding": encoding}


def _radiance(needs: Needs) -> Shape:
    return {"format": "rgba8" if needs.classic else ACCUMULATION_FORMATS[needs.settings.accumulation_format]}


def _slices(needs: Needs) -> Shape:
    """The texture of all slices of the particle shadows."""
    shadow = needs.particle_shadow
    assert shadow is not None
    form = PARTICLE_SHADOW_FORMATS[needs.settings.particle_shadow_format][shadow.tinted]
    return {"format": form, "per_sample": False, "size": shadow.size}


def _one_slice(needs: Needs) -> Shape:
    assert needs.particle_shadow is not None
    tile = needs.particle_shadow.view.tile
    return _slices(needs) | {"size": (tile, tile)}


TARGETS: dict[str, Callable[[Needs], Shape]] = {
    "shadow_atlas": _shadow_atlas,
    "particle_shadow_atlas": _slices,
    "particle_shadow_scratch": _slices,
    "particle_shadow_sum": _one_slice,
    "depth": _depth,
    "coverage": _shape("r8"),
    "albedo": _colors,
    "normal": _normal,
    "distance": _shape("r32f"),
    "position": lambda needs: {"format": STORED_POSITIONS[needs.settings.position_method]},
    "ambient_albedo": _colors,
    "specular": _shape("rgba16"),
    "emission": _shape("rgba32f"),
    "id": _shape("r32ui"),
    "visibility": _shape("rg32ui"),
    "depth_copy": _depth,
    "half_depth": lambda needs: _depth(needs) | {"half": True},
    "half_light": lambda needs: _radiance(needs) | {"half": True},
    "half_shine": lambda needs: _radiance(needs) | {"half": True},
    "light": _shape("rgba32f"),
    "radiance": _radiance,
    "particle_light": lambda needs: {
        "format": "rgba32f",
        "per_sample": False,
        "size": particle_texels(needs.particles),
    },
    "particles": _shape("rgba32f"),
    "overdraw": _shape("r32f"),
    "volumes": _shape("rgba8"),
    "wireframe": _shape("rgba8"),
    "color": _shape("rgba8", per_sample=False),
    "final_radiance": _shape("rgba32f", per_sample=False),
}
"""Every target of the package's own passes by name, in the order in which plans list them."""


MASKED_OUTPUTS = (*PLACE_OUTPUTS, *NORMAL_OUTPUTS, "light")
"""Outputs with a value of their own where nothing was drawn, which the target itself does not show."""
_OWN_TARGETS = {"radiance": "final_radiance", "shininess": "specular", "normal_world": "normal"}


def output_target(needs: Needs, output: str) -> str:
    """Return the target that an output is decoded from."""
    return needs.position_target_name if output in PLACE_OUTPUTS else _OWN_TARGETS.get(output, output)


def output_reads(needs: Needs, output: str) -> dict[str, str]:
    """Return the targets that an output asks for, each with the reason."""
    reads = {output_target(needs, output): f"output {output}"}
    if output == "light":
        marked = needs.lit or needs.ambient_lit
    else:
        others = (*MASKED_OUTPUTS, "specular", "shininess", "emission")
        marked = output in others and not needs.distance_marks
    if marked:
        reads["albedo"] = f"output {output} (its alpha marks the background)"
    return reads


def output_sources(needs: Needs, output: str, targets: Mapping[str, Target]) -> tuple[str, ...]:
    """Return those of a frame's targets that an output is decoded from.

    None where the frame has nothing for it.
    """
    target = output_target(needs, output)
    if target not in targets:
        return ()
    mark = "albedo" if "albedo" in targets else "distance"
    return tuple(dict.fromkeys((target, mark))) if output in MASKED_OUTPUTS else (target,)
