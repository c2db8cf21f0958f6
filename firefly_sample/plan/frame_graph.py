"""Choose a frame's passes and targets: a target exists because an output or a pass that is there reads it.

Passes declare their targets (`Declaration`) in drawing order. Going back from the outputs, a pass is chosen
if an output or a later pass reads its targets; the targets that it reads are then wanted from the passes
before it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from firefly_sample.errors import OutputError, PlanError
from firefly_sample.plan.frame_plan import PassPlan
from firefly_sample.plan.needs import NORMAL_OUTPUTS, POSITION_OUTPUTS, Needs
from firefly_sample.plan.targets import (
    ACCUMULATION_FORMATS,
    ALBEDO_FORMATS,
    COARSE_DEPTH,
    FORMATS,
    NORMAL_FORMATS,
    PARTICLE_SHADOW_FORMATS,
    STORED_POSITIONS,
    UNSIGNED,
    Target,
    mask_target,
    particle_texels,
)
from firefly_sample.plan.variants import Variant

MOST_COLORS = 8
"""Colour targets that one pass may draw into: OpenGL 3.3 promises no more."""

Reasons = Mapping[str, Sequence[str]]
Shape = dict[str, Any]
"""Arguments of `Target` but its name and reason."""


@dataclass(frozen=True)
class Declaration:
    """The targets that a pass reads and writes in a frame; it is left out if no pass or output reads them.

    Attributes
    ----------
    because : str
        The part of the scene that asks for it.
    reads : mapping of str to sequence of str
        Targets that it samples, and why.
    writes : sequence of str
        Targets that it clears and fills, as far as a pass or an output reads them.
    fills : sequence of str
        Targets that several passes add to, likewise; the first one clears them.
    updates : sequence of str
        Targets of passes before it that it draws over, likewise.
    tests : sequence of str
        Depth buffers that it tests against, as far as the frame has them.
    keeps : mapping of str to sequence of str
        Targets that it writes because it needs them itself, and why.
    targets : mapping of str to callable
        Targets that are not in `TARGETS`: a function of the `Needs` that returns the arguments of `Target`,
        for example ``{"format": "rgba8"}``.
    """

    because: str
    reads: Reasons = field(default_factory=dict)
    writes: Sequence[str] = ()
    fills: Sequence[str] = ()
    updates: Sequence[str] = ()
    tests: Sequence[str] = ()
    keeps: Reasons = field(default_factory=dict)
    targets: Mapping[str, Callable[[Needs], Shape]] = field(default_factory=dict)


class Declares(Protocol):
    """The part of a pass that planning uses."""

    name: str

    def declare(self, needs: Needs) -> Declaration | None:
        """Return the pass's targets, None if the scene has nothing for it."""

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the variant of its shader in a frame with some targets, by name."""


class FrameGraph(NamedTuple):
    """The targets and the passes of a frame, in order, and the targets that each output is decoded from."""

    targets: tuple[Target, ...]
    passes: tuple[PassPlan, ...]
    sources: dict[str, tuple[str, ...]]


def choose_passes(passes: Iterable[Declares], needs: Needs) -> FrameGraph:
    """Return the targets and the passes of a frame, each with its reason, checked by `check_passes`."""
    outputs: dict[str, dict[str, None]] = {}
    for output in needs.outputs:
        for name, reason in _output_reads(needs, output).items():
            outputs.setdefault(name, {})[reason] = None
    chosen = _wanted_passes(passes, needs, set(outputs))

    made: dict[str, dict[str, None]] = {}
    table = dict(TARGETS)
    for step, plan in chosen:
        table.update(plan.targets)
        unknown = {*plan.writes, *plan.fills, *plan.keeps} - table.keys()
        if unknown:
            raise PlanError(
                f"pass {step.name!r} makes target {min(unknown)!r}, which has no format: add it to the "
                "declaration's `targets`"
            )
        made.update((name, {}) for name in (*plan.writes, *plan.fills, *plan.keeps))
    for reads in (*(reads for _, plan in chosen for reads in (plan.keeps, plan.reads)), outputs):
        for name, reasons in reads.items():
            if name in made:
                made[name] |= dict.fromkeys(reasons)
    targets = {
        name: Target(name, because="; ".join(made[name]), **shape(needs))
        for name, shape in table.items()
        if made.get(name)
    }
    steps = _steps(chosen, needs, targets)
    check_passes(steps, targets.values())
    read = {name for _, plan in chosen for reads in (plan.reads, plan.keeps) for name in reads}
    shown = {output: _output_target(needs, output) for output in needs.outputs}
    _check_colors(steps, targets, {output: name for output, name in shown.items() if name not in read})
    sources = {output: _output_sources(needs, output, targets) for output in needs.outputs}
    return FrameGraph(tuple(targets.values()), steps, sources)


def _wanted_passes(
    passes: Iterable[Declares], needs: Needs, wanted: set[str]
) -> list[tuple[Declares, Declaration]]:
    """Return the passes that make what outputs, or passes after them, want, in drawing order."""
    declared = [(step, plan) for step in passes if (plan := step.declare(needs)) is not None]
    chosen = []
    for step, plan in reversed(declared):
        if wanted.intersection((*plan.writes, *plan.fills, *plan.updates)):
            chosen.append((step, plan))
            wanted.update(plan.reads, plan.tests, plan.keeps)
    return chosen[::-1]


def _steps(
    chosen: Iterable[tuple[Declares, Declaration]], needs: Needs, targets: Mapping[str, Target]
) -> tuple[PassPlan, ...]:
    filled: set[str] = set()
    steps = []
    for step, plan in chosen:
        writes = [name for name in (*plan.writes, *plan.fills) if name in targets and name not in filled]
        updates = [name for name in (*plan.fills, *plan.updates, *plan.tests) if name in targets]
        updates = [name for name in updates if name not in writes]
        filled.update(name for name in plan.fills if name in targets)
        variant = step.variant(needs, targets)
        steps.append(
            PassPlan(step.name, tuple(plan.reads), tuple(writes), tuple(updates), plan.because, variant)
        )
    return tuple(steps)


def check_passes(passes: Iterable[PassPlan], targets: Iterable[Target]) -> None:
    """Raise a PlanError if the passes do not fit each other.

    A pass must not touch a target that does not exist, read or update one that no pass wrote before it, or
    sample one that it also draws into. Every target must be written.
    """
    names = {target.name for target in targets}
    written: set[str] = set()
    for step in passes:
        for name in (*step.reads, *step.writes, *step.updates):
            if name not in names:
                raise PlanError(f"pass {step.name!r} uses target {name!r}, which this frame does not have")
        for name in (*step.reads, *step.updates):
            if name not in written:
                raise PlanError(f"pass {step.name!r} reads target {name!r}, which no pass wrote before it")
        for name in step.reads:
            if name in step.writes or name in step.updates:
                raise PlanError(f"pass {step.name!r} samples target {name!r} while it draws into it")
        written.update(step.writes)
    for name in sorted(names - written):
        raise PlanError(f"target {name!r} is never written by any pass")


def _check_colors(passes: Iterable[PassPlan], targets: Mapping[str, Target], own: Mapping[str, str]) -> None:
    """Raise an error if a pass draws into more than `MOST_COLORS` colour targets.

    `own` holds the target of each output that no pass reads as well: a frame without the output does without
    the target. The error is an OutputError, or a PlanError if no output would help.
    """
    for step in passes:
        drawn = (*step.writes, *step.updates)
        colors = [name for name in drawn if not FORMATS[targets[name].format].depth]
        if len(colors) <= MOST_COLORS:
            continue
        said = (
            f"pass {step.name!r} would draw into {len(colors)} targets at once ({', '.join(colors)}), and "
            f"OpenGL 3.3 has {MOST_COLORS}"
        )
        spare = [output for output, name in own.items() if name in colors]
        if len(set(colors) - {own[output] for output in spare}) > MOST_COLORS:
            raise PlanError(f"{said}: let another pass make some of them")
        raise OutputError(f"{said}: ask for some of the outputs {', '.join(spare)} in another frame")


def _shape(form: str, **rest: Any) -> Callable[[Needs], Shape]:
    return lambda _: {"format": form, **rest}


def _depth(needs: Needs) -> Shape:
    """Return the depth buffer's format, and its value where nothing is."""
    if needs.reverse:
        return {"format": "depth32f", "clear": (0.0, 0.0, 0.0, 0.0)}
    form = COARSE_DEPTH.get(needs.settings.position_method, "depth24")
    return {"format": form, "clear": (1.0, 0.0, 0.0, 0.0)}


def _shadow_atlas(needs: Needs) -> Shape:
    form, lit = ("depth32f", ">=") if needs.reverse else ("depth24", "<=")
    return _depth(needs) | {"format": form, "compare": lit, "per_sample": False, "size": needs.atlas}


def _normal(needs: Needs) -> Shape:
    form, encoding = NORMAL_FORMATS[needs.settings.normal_format]
    if needs.classic:
        form, encoding = "rgba8", "classic"
    elif form == "rg16_snorm" and not needs.capabilities.snorm_targets:
        form, encoding = UNSIGNED
    return {"format": form, "encoding": encoding}


def _colors(needs: Needs) -> Shape:
    codes = needs.classic or needs.flat  # as they are stored, in 8 bits
    form, encoding = ("rgba8", "linear") if codes else ALBEDO_FORMATS[needs.settings.albedo_format]
    return {"format": form, "encoding": encoding}


def _tint(needs: Needs) -> Shape:
    if needs.modulates:  # by scales above 1 as well
        return {"format": "rgba16f", "encoding": "linear"}
    return _colors(needs)


def _specular(needs: Needs) -> Shape:
    return {"format": "rgba16", "encoding": "local" if needs.local_viewers else ""}


def _radiance(needs: Needs) -> Shape:
    return {"format": "rgba8" if needs.classic else ACCUMULATION_FORMATS[needs.settings.accumulation_format]}


def _slices(needs: Needs, one: bool = False) -> Shape:
    """Return the shape of the texture of all slices of the particle shadows, or of one slice."""
    shadow = needs.particle_shadow
    assert shadow is not None
    form = PARTICLE_SHADOW_FORMATS[needs.settings.particle_shadow_format][shadow.tinted]
    size = (shadow.view.tile, shadow.view.tile) if one else shadow.size
    return {"format": form, "per_sample": False, "size": size}


TARGETS: dict[str, Callable[[Needs], Shape]] = {
    "shadow_atlas": _shadow_atlas,
    "particle_shadow_atlas": _slices,
    "particle_shadow_scratch": _slices,
    "particle_shadow_sum": lambda needs: _slices(needs, one=True),
    "depth": _depth,
    "coverage": _shape("r8"),
    "albedo": _colors,
    "normal": _normal,
    "distance": _shape("r32f"),
    "position": lambda needs: {"format": STORED_POSITIONS[needs.settings.position_method]},
    "ambient_albedo": _colors,
    "specular": _specular,
    "metallic_roughness": _shape("rg16"),
    "tint": _tint,
    "emission": _shape("rgba32f"),
    "id": _shape("r32ui"),
    "visibility": _shape("rg32ui"),
    "depth_copy": _depth,
    "half_depth": lambda needs: _depth(needs) | {"half": True},
    "half_light": lambda needs: _radiance(needs) | {"half": True},
    "half_shine": lambda needs: _radiance(needs) | {"half": True},
    "light": _shape("rgba32f"),
    "radiance": _radiance,
    "gloss": _radiance,
    "particle_light": lambda needs: {
        "format": "rgba32f",
        "per_sample": False,
        "size": particle_texels(needs.particles),
    },
    "particles": _shape("rgba32f"),
    "transparency": _shape("rgba32f"),
    "transparency_weight": _shape("r32f"),
    "layer": _shape("rgba32f"),
    "layer_depth": _shape("depth32f"),  # no other holds what it is compared with, a fragment's depth
    "layer_place": _shape("rg32f"),
    "layer_number": _shape("rg32ui"),
    "peeled_depth": _shape("depth32f"),
    "peeled_place": _shape("rg32f"),
    "peeled_number": _shape("rg32ui"),
    "overdraw": _shape("r32f"),
    "volumes": _shape("rgba8"),
    "wireframe": _shape("rgba8"),
    "color": _shape("rgba8", per_sample=False),
    "color_alpha": _shape("rgba8", per_sample=False),
    "final_radiance": _shape("rgba32f", per_sample=False),
}
"""Every target of the package's own passes by name, in the order in which plans list them."""

MASKED_OUTPUTS = (*POSITION_OUTPUTS, *NORMAL_OUTPUTS, "light")
"""Outputs with a value of their own where nothing was drawn, which the target itself does not show."""
_OWN_TARGETS = {
    "radiance": "final_radiance",
    "shininess": "specular",
    "normal_world": "normal",
    "metallic": "metallic_roughness",
    "roughness": "metallic_roughness",
}


def _output_target(needs: Needs, output: str) -> str:
    """Return the target that an output is decoded from."""
    return needs.position_target_name if output in POSITION_OUTPUTS else _OWN_TARGETS.get(output, output)


def _output_reads(needs: Needs, output: str) -> dict[str, str]:
    """Return the targets that an output asks for, each with the reason."""
    if output in ("metallic", "roughness") and not needs.looks.metallic:
        return {}  # nothing has any
    reads = {_output_target(needs, output): f"output {output}"}
    if output == "albedo" and needs.modulates:
        reads["tint"] = "output albedo (its textures and colour scales)"
    # a distance marks the background as well: see `mask_target`
    distance = needs.position_target_name == "distance" and not needs.orthographic
    if output == "light":
        masked = needs.lit or needs.ambient_lit
    elif distance and not set(POSITION_OUTPUTS).isdisjoint(needs.outputs):
        masked = False
    else:
        masked = output in (*MASKED_OUTPUTS, "specular", "shininess", "emission")
    if masked:
        reads["albedo"] = f"output {output} (its alpha marks the background)"
    return reads


def _output_sources(needs: Needs, output: str, targets: Mapping[str, Target]) -> tuple[str, ...]:
    """Return those of a frame's targets that an output is decoded from, none if it has nothing for it."""
    target = _output_target(needs, output)
    if target not in targets:
        return ()
    if output == "albedo" and needs.modulates:
        return target, "tint"
    mask = mask_target(targets, not needs.orthographic)
    return tuple(dict.fromkeys((target, mask))) if output in MASKED_OUTPUTS else (target,)
