"""A plan in words: the JSON of ``firefly plan``, a Graphviz graph, and a table for people."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

from firefly_sample.columns import align
from firefly_sample.plan.frame_plan import FramePlan


def plan_as_dict(plan: FramePlan) -> dict[str, Any]:
    """Return the plan as plain JSON values.

    Returns
    -------
    dict
        ``passes`` (name, reads, writes, updates, because) in drawing order, ``targets`` (name, format,
        bytes_per_pixel, because, and size if it is not the picture's), ``lights`` (in_scene, in_view,
        dropped), ``light_method``, ``exposure`` (the setting as a number, which is measured if it is "auto")
        and ``warnings``. Entries that the frame does not have are left out. With
        supersampling a target's bytes are those of one sample. ``light_method`` has ``method``, ``because``,
        ``estimated_pairs`` if the method was chosen (about how many pairs of a pixel and a light each method
        would shade), and for clusters ``tile``, ``tiles`` and ``slices``.
    """
    targets = []
    for target in plan.targets:
        names = "name", "format", "bytes_per_pixel", "because"
        found = {name: getattr(target, name) for name in names}
        if target.size is not None or target.half:
            found["size"] = list(plan.target_size(target.name))
        targets.append(found)
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
        "targets": targets,
        "lights": asdict(plan.counts),
        **({"light_method": _light_method(plan)} if plan.counts.in_view else {}),
        "exposure": plan.settings.exposure,
        "warnings": list(plan.warnings),
    }


def _light_method(plan: FramePlan) -> dict[str, Any]:
    found: dict[str, Any] = {"method": plan.light_method.name, "because": plan.light_method.because}
    if plan.light_method.estimated_pairs:
        pairs = plan.light_method.estimated_pairs
        found["estimated_pairs"] = {name: round(count) for name, count in pairs.items()}
    if plan.clusters:
        grid = plan.clusters[0].grid
        found |= {"tile": grid.tile, "tiles": list(grid.tiles), "slices": grid.slices}
    return found


def plan_as_dot(plan: FramePlan) -> str:
    """Return the plan as a Graphviz graph: passes are boxes, targets ovals, updates dashed edges."""
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
    """Return the plan as two aligned tables and a line of sums."""
    passes = [
        (
            step.name,
            *(", ".join(names) or "-" for names in (step.reads, step.writes, step.updates)),
            step.because,
        )
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
    total, supersample = plan.bytes_per_pixel, plan.settings.supersample
    sums = f"{total:g} bytes a pixel, {total * width * height / 2**20:.1f} MiB at {width}x{height}"
    if supersample > 1:
        sums += f", supersample {supersample}"
    for target in plan.targets:
        if target.size is not None:
            across, up = target.size
            sums += f", {target.name} {target.bytes_per_pixel * across * up / 2**20:.1f} MiB at {across}x{up}"
    sums += f"; lights: {plan.counts.in_view} in view of {plan.counts.in_scene}"
    if plan.counts.in_view:
        sums += f"; {plan.light_method.name}"
        if plan.clusters:
            grid = plan.clusters[0].grid
            sums += f" in {grid.tiles[0]}x{grid.tiles[1]} tiles of {grid.tile} by {grid.slices} slices"
        sums += f" ({plan.light_method.because})"
    if plan.settings.look not in ("classic", "flat", "panda3d"):
        sums += f"; exposure {plan.settings.exposure:g}"
    unit = "PIXEL" if supersample == 1 else "SAMPLE"
    parts = [
        align([("PASS", "READS", "WRITES", "UPDATES", "BECAUSE"), *passes]),
        align([("TARGET", "FORMAT", f"BYTES A {unit}", "BECAUSE"), *targets]),
        sums,
        *(f"warning: {warning}" for warning in plan.warnings),
    ]
    return "\n\n".join(parts) + "\n"


def _quote(text: str) -> str:
    """Return a quoted string of the dot language, which escapes quotes and line breaks as JSON does."""
    return json.dumps(text, ensure_ascii=False)
