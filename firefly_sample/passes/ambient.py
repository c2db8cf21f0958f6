"""Ambient pass: albedo times the sum of the ambient lights, and emission: the first light in the radiance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from firefly_sample.passes.base import FullscreenPass, combinations, encodings
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import AlbedoFormat, Variant


@dataclass(frozen=True)
class AmbientVariant(Variant):
    """The parts of the first light of a pixel, and the targets `radiance` and `light`.

    `lit` adds ambient light, `own` takes its reflectance from a target of its own, `emission` adds emission.
    """

    lit: bool = True
    own: bool = False
    emission: bool = False
    albedo_format: AlbedoFormat = "sqrt10"
    radiance: bool = True
    light: bool = False


class AmbientPass(FullscreenPass):
    """Fill the radiance with ambient light and emission."""

    name = "ambient"
    colors = "radiance", "light"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if there is ambient light or emission."""
        if needs.forward or not (needs.ambient_lit or needs.emits):
            return None
        emission = [f"emission of {needs.looks.emissive}"] if needs.emits else []
        reads = {}
        if needs.ambient_lit and needs.picture and not needs.own_ambient_lit:
            reads["albedo"] = ["ambient light"]
        if needs.own_ambient_lit:
            reads["ambient_albedo"] = [f"ambient colours of {needs.looks.own_ambient}"]
        if emission:
            reads["emission"] = emission
        reasons = (["ambient light"] if needs.ambient_lit else []) + emission
        fills = ["radiance"] + (["light"] if needs.ambient_lit else [])
        return Declaration("; ".join(reasons), reads=reads, fills=fills)

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the frame's variant."""
        return AmbientVariant(
            lit=needs.ambient_lit,
            own=needs.own_ambient_lit,
            emission=needs.emits,
            radiance="radiance" in targets,
            light="light" in targets and needs.ambient_lit,
            **encodings(targets, "albedo"),
        )

    def legal_variants(self) -> Iterator[Variant]:
        """Yield the variants that write a target."""
        for made in combinations(AmbientVariant):
            # emission does not fall on a surface, and an ambient colour is for ambient light
            if (made.lit and (made.radiance or made.light)) or (
                made.emission and made.radiance and not made.own
            ):
                yield made
