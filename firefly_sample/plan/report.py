"""A plan in words: the JSON of ``firefly plan``, a Graphviz graph, and a table for people."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

from firefly_sample.columns import align
from firefly_sample.plan.frame_plan import FramePlan


def plan_as_dict(plan: FramePlan) -> dict[str, Any]:
    """The plan as plain JSON values.

    Returns
    -------
    dict
        ``passes`` (name, reads, writes, updates, because) in drawing order, ``targets`` (name, format,
        bytes_per_pixel, because, and size if it is not the picture's), ``lights`` (in_scene, in_view,
        dropped), ``light_method`` and ``warnings``. What the frame does not have is left out. With
        supersampling a target's bytes are those of one sample. ``light_method`` has ``method``, ``because``,
        ``estimated_pairs`` if the method was chosen (about how many pairs of a pixel and a light each method
        would shade), and for clusters ``tile``, ``tiles`` and ``slices``.
    """
    return {
        "passes": [
            {
                "name": step.name,
                "reads": list(step.reads),
                "writes": list(step.writes),
                "updates": list(step.updates),
                "because": step.because,
            }
            for step in plan.passes
        ],
        "targets": [
            {
                "name": target.name,
                "format": target.format,
                "bytes_per_pixel": target.bytes_per_pixel,
                "because": target.because,
            }
            | (
                {}
                if target.size is None and not target.half
                else {"size": list(plan.target_size(target.name))}
            )
            for target in plan.targets
        ],
        "lights": asdict(plan.counts),
        **({"light_method": _light_method(plan)} if plan.counts.in_view else {}),
        "warnings": list(plan.warnings),
    }


def _light_method(plan: FramePlan) -> dict[str, Any]:
    culling = plan.culling
    told: dict[str, Any] = {"method": culling.method, "because": culling.because}
    if culling.shaded:
        told["estimated_pairs"] = {name: round(pairs) for name, pairs in culling.shaded.items()}
    if plan.clusters:
        grid = plan.clusters[0].grid
        told |= {"tile": grid.tile, "tiles": list(grid.tiles), "slices": grid.slices}
    return told


def plan_as_dot(plan: FramePlan) -> str:
    """The plan as a Graphviz graph: boxes are passes, rounded shapes targets, a dashed edge an update."""
    lines = ["digraph frame {", "    rankdir=LR;", '    node [fontname="sans-serif"];']
    for target in plan.targets:
        label = _quote(f"{target.name}\n{target.format}, {target.bytes_per_pixel} B")
        about = _quote(target.because)
        lines.append(f"    {_quote('target ' + target.name)} [shape=oval, label={label}, tooltip={about}];")
    for step in plan.passes:
        name = _quote(f"pass {step.name}")
        lines.append(f"    {name} [shape=box, label={_quote(step.name)}, tooltip={_quote(step.because)}];")
        lines += [f"    {_quote('target ' + target)} -> {name};" for target in step.reads]
        lines += [f"    {name} -> {_quote('target ' + target)};" for target in step.writes]
        lines += [
            f"    {name} -> {_quote('target ' + target)} [style=dashed, dir=both];" for target in step.updates
        ]
    return "\n".join([*lines, "}", ""])


def plan_as_text(plan: FramePlan) -> str:
    """The plan as two aligned tables and a line of sums."""
    passes = [
        (step.name, _names(step.reads), _names(step.writes), _names(step.updates), step.because)
        for step in plan.passes
    ]
    targets = [
        (
            target.name,
            target.format + (", half" if target.half else ""),
            str(target.bytes_per_pixel),
            target.because,
        )
        for target in plan.targets
    ]
    width, height = plan.size
    total = plan.bytes_per_pixel
    own = [
        f", {target.name} {target.bytes_per_pixel * math.prod(target.size) / 2**20:.1f} MiB "
        f"at {target.size[0]}x{target.size[1]}"
        for target in plan.targets
        if target.size is not None
    ]
    counts = plan.counts
    unit = "pixel" if plan.settings.supersample == 1 else "sample"
    parts = [
        align([("PASS", "READS", "WRITES", "UPDATES", "BECAUSE"), *passes]),
        align([("TARGET", "FORMAT", f"BYTES A {unit.upper()}", "BECAUSE"), *targets]),
        f"{total:g} bytes a pixel, {total * width * height / 2**20:.1f} MiB at {width}x{height}"
        f"{'' if unit == 'pixel' else f', supersample {plan.settings.supersample}'}{''.join(own)}; "
        f"lights: {counts.in_view} in view of {counts.in_scene}{_in_words(plan)}",
        *(f"warning: {warning}" for warning in plan.warnings),
    ]
    return "\n\n".join(parts) + "\n"


def _in_words(plan: FramePlan) -> str:
    """How lights find their pixels."""
    if not plan.counts.in_view:
        return ""
    method = plan.culling.method
    if plan.clusters:
        grid = plan.clusters[0].grid
        method += f" in {grid.tiles[0]}x{grid.tiles[1]} tiles of {grid.tile} by {grid.slices} slices"
    return f"; {method} ({plan.culling.because})"


def _names(names: Iterable[str]) -> str:
    return ", ".join(names) or "-"


def _quote(text: str) -> str:
    """A quoted string of the dot language, whose escapes of quotes and line breaks are those of JSON."""
    return json.dumps(text, ensure_ascii=False)
