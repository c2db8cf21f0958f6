"""Upsample pass: light of every second pixel spread to all, along surfaces."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from firefly_sample.passes.base import FullscreenPass, combinations, encodings
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import AlbedoFormat, NormalFormat, PositionMethod, Variant


@dataclass(frozen=True)
class UpsampleVariant(Variant):
    """The targets `radiance` and `light`, highlights or not (`shine`), and how surfaces are recognised: by
    their
    positions and normals.
    """

    position_method: PositionMethod = "distance"
    normal_format: NormalFormat = "oct16"
    albedo_format: AlbedoFormat = "sqrt10"
    orthographic: bool = False
    radiance: bool = True
    light: bool = False
    shine: bool = False


class UpsamplePass(FullscreenPass):
    """Add light of half the resolution to what ambient light left."""

    name = "upsample"
    adds = True
    colors = "radiance", "light"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if light is computed at half the resolution."""
        if not needs.half:
            return None
        half, lights = " (light_resolution=half)", needs.all_lights()
        reads = {"half_light": [light + half for light in lights]}
        if needs.highlights:
            reads["half_shine"] = [f"highlights of {needs.looks.shiny}{half}"]
        if needs.picture:
            reads["albedo"] = lights
        reads["normal"] = lights
        reads[needs.position_source] = ["light_resolution=half finds neighbours on the same surface"]
        because = "light_resolution=half: each pixel takes light from neighbours on its surface"
        return Declaration(because, reads=reads, fills=["radiance", "light"])

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the frame's variant."""
        return UpsampleVariant(
            position_method=needs.position_method,
            orthographic=needs.orthographic,
            radiance="radiance" in targets,
            light="light" in targets,
            shine="half_shine" in targets,
            **encodings(targets, "normal", "albedo"),
        )

    def legal_variants(self) -> Iterator[Variant]:
        """Yield the variants that write a target: highlights are for radiance alone."""
        for made in combinations(UpsampleVariant):
            if (made.radiance or (made.light and not made.shine)) and made.normal_format != "classic":
                yield made
