"""Resolve pass: background, average of the samples, exposure, tone curve and sRGB make the picture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from firefly_sample.passes.base import FullscreenPass, combinations
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.needs import Needs, asked
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import Look, Tone, Variant


@dataclass(frozen=True)
class ResolveVariant(Variant):
    """What the pass reads and writes.

    `masked` says that something may cover the background: the albedo shows where, as whole numbers if it is
    `packed`, or the target "coverage" does if there is one (`marked`).
    """

    radiance: bool = True
    masked: bool = True
    color: bool = True
    final_radiance: bool = False
    gradient: bool = False
    orthographic: bool = False
    look: Look = "correct"
    tone: Tone = "exponential"
    supersample: Literal[1, 2] = 1
    marked: bool = False
    particles: bool = False
    packed: bool = False


class ResolvePass(FullscreenPass):
    """Make the picture of radiance, particles and background."""

    name = "resolve"
    colors = "color", "final_radiance"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if a picture is asked for."""
        if not needs.picture:
            return None
        radiance = needs.all_lights() if needs.lit else []
        radiance += ["ambient light"] if needs.ambient_lit else []
        radiance += [f"emission of {needs.looks.emissive}"] if needs.emits else []
        radiance += [f"{needs.sprites} sprites"] if needs.dotted else []
        reads = {"radiance": radiance} if radiance else {}
        if needs.hazy:
            among = [f"{needs.sprites} sprites among them"] if needs.sprites else []
            reads["particles"] = [needs.particles_in_view, *among]
        if needs.drawn and needs.forward:
            reads["coverage"] = ["the background shows where nothing was drawn"]
        elif needs.drawn:
            reads["albedo"] = ["the background shows where its alpha is 0"]
        because = "; ".join(asked(needs.outputs, ("color", "radiance")))
        return Declaration(because, reads=reads, writes=["color", "final_radiance"])

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the frame's variant."""
        return ResolveVariant(
            radiance="radiance" in targets,
            masked="albedo" in targets or "coverage" in targets,
            marked="coverage" in targets,
            color="color" in targets,
            final_radiance="final_radiance" in targets,
            gradient=needs.gradient,
            orthographic=needs.orthographic and needs.gradient,
            look=needs.settings.look,
            tone=needs.settings.tone_curve,
            supersample=needs.settings.supersample,  # type: ignore[arg-type]
            particles="particles" in targets,
            packed="albedo" in targets and targets["albedo"].encoding == "sqrt10",
        )

    def legal_variants(self) -> Iterator[Variant]:
        """Yield the variants that make an output."""
        for made in combinations(ResolveVariant):
            covered = made.marked or made.packed
            if (
                (made.color or made.final_radiance)
                and (made.gradient or not made.orthographic)
                and (made.masked or not covered)
                and not (made.marked and made.packed)
                and (made.look == "correct" or not (made.tone != "none" or covered or made.particles))
            ):
                yield made
