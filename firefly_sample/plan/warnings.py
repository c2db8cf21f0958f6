"""What a plan has to say to its user."""

from __future__ import annotations

from firefly_sample.plan.collect import Snapshot
from firefly_sample.plan.needs import Needs

__all__ = ["plan_warnings"]


def plan_warnings(needs: Needs, snapshot: Snapshot) -> tuple[str, ...]:
    """One line each for what is drawn otherwise than the scene or the settings ask."""
    warnings = []
    blended = dict.fromkeys(
        material.name
        for group in snapshot.groups
        for material in group.materials
        if material.alpha_mode == "blend"
    )
    if blended:
        warnings.append(
            f"blended materials are drawn as cut-outs: {', '.join(blended)} "
            "(deferred shading keeps one surface a pixel)"
        )
    if needs.settings.position == "depth32f" and not needs.capabilities.clip_control:
        warnings.append(
            "position=depth32f: the driver lacks ARB_clip_control, so depth is a standard 24-bit buffer, "
            "as accurate as depth24; position=linear32f is accurate here"
        )
    if needs.classic and needs.picture:
        left_out = [
            what
            for what, there in (
                ("highlights", needs.shiny and needs.lights),
                ("emission", needs.emissive),
                ("ambient colours of materials", needs.own_ambient and needs.ambient),
                ("shadows", any(node.is_shadow_caster() for node, _ in snapshot.lights)),
            )
            if there
        ]
        if left_out:
            warnings.append(f"look 'classic' leaves out, as the original does: {', '.join(left_out)}")
    return tuple(warnings)
