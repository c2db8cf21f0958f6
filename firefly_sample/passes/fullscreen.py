"""Passes over whole pictures: copies of depth, ambient light, upsampling, and the final picture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from firefly_sample.gpu.drawing import draw_fullscreen
from firefly_sample.passes.base import FullscreenPass, Pass, combinations, encodings
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.needs import Needs, asked
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import (
    AlbedoFormat,
    Look,
    NormalFormat,
    PositionSource,
    Tone,
    Transparency,
    Variant,
)

if TYPE_CHECKING:
    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages

_REASON = ["geometry hides what is behind it"]


class DepthCopyPass(Pass):
    """Copy the depth buffer: in OpenGL 3.3 one that is tested against must not be sampled."""

    name = "depth_copy"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if lighting passes both sample and test depth."""
        copied = needs.tested_source == "depth_copy"
        beside_particles = needs.squares_among_blended and needs.particle_source == "depth_copy"
        if not needs.drawn or not (copied or beside_particles):
            return None
        method = needs.settings.light_method if needs.forward else needs.settings.position_method
        setting = "light_method" if needs.forward else "position_method"
        because = f"{setting}={method}: a depth buffer cannot be tested and sampled at once"
        return Declaration(because, reads={"depth": _REASON}, writes=["depth_copy"])

    def shader_stems(self, variant: Variant) -> list[tuple[str, str]]:
        """Return nothing: it has no shader."""
        return []

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        source, copy = images.framebuffer_of("depth"), images.framebuffer_of("depth_copy")
        gpu.device.raw.copy_depth(source.glo, copy.glo, plan.view.size)


class HalfDepthPass(FullscreenPass):
    """Take the depth of every second pixel, not a mean, which would be the depth of no surface."""

    name = "half_depth"
    colors = ()

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if light volumes are drawn at half the resolution."""
        if not (needs.half and needs.tests_volumes and set(needs.lights) != {"directional"}):
            return None
        because = "light_resolution=half: the depth of every second pixel, to test volumes against"
        keeps = {"half_depth": ["light_resolution=half tests volumes at its own"]}
        return Declaration(because, reads={"depth": _REASON}, writes=["half_depth"], keeps=keeps)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        gpu.ctx.depth_func = "1"  # always: without the test, nothing is written either
        draw_fullscreen(gpu, step, images, gpu.ctx.DEPTH_TEST)


@dataclass(frozen=True)
class AmbientVariant(Variant):
    """The parts of the first light of a pixel, and the targets `radiance` and `light`.

    `lit` adds ambient light, `own` takes its reflectance from a target of its own, `tint` multiplies it by a
    colour of the surface, `emission` adds emission.
    """

    lit: bool = True
    own: bool = False
    emission: bool = False
    albedo_format: AlbedoFormat = "sqrt10"
    radiance: bool = True
    light: bool = False
    tint: bool = False


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
            reads["ambient_albedo"] = [f"ambient colours of {needs.own_ambient}"]
        if needs.tints and needs.ambient_lit:
            reads["tint"] = [f"vertex colours and occlusion of {needs.looks.tinted}"]
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
            tint=needs.tints and needs.ambient_lit,
            **encodings(targets, "albedo"),
        )

    def legal_variants(self) -> Iterator[Variant]:
        """Yield the variants that write a target."""
        for made in combinations(AmbientVariant):
            # emission does not fall on a surface, an ambient colour is for ambient light, a tint for radiance
            lit = made.lit and (made.radiance or made.light)
            glows = made.emission and made.radiance and not made.own
            if (lit or glows) and (not made.tint or (made.lit and made.radiance)):
                yield made


@dataclass(frozen=True)
class UpsampleVariant(Variant):
    """The targets `radiance` and `light`, highlights or not (`shine`), and the formats that surfaces are
    recognised by: those of their positions and normals.
    """

    position_source: PositionSource = "distance"
    normal_format: NormalFormat = "oct16"
    albedo_format: AlbedoFormat = "sqrt10"
    orthographic: bool = False
    radiance: bool = True
    light: bool = False
    shine: bool = False
    metallic_roughness: bool = False


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
        if needs.metals:
            metallic = [f"metalness and roughness of {needs.looks.metallic}"]
            reads["half_shine"] = [
                *reads.get("half_shine", []),
                f"highlights of {needs.looks.metallic}{half}",
            ]
            reads["metallic_roughness"] = metallic
        if needs.picture:
            reads["albedo"] = lights
        reads["normal"] = lights
        reads[needs.position_target_name] = ["light_resolution=half finds neighbours on the same surface"]
        because = "light_resolution=half: each pixel takes light from neighbours on its surface"
        return Declaration(because, reads=reads, fills=["radiance", "light"])

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the frame's variant."""
        return UpsampleVariant(
            position_source=needs.position_source,
            orthographic=needs.orthographic,
            radiance="radiance" in targets,
            light="light" in targets,
            shine="half_shine" in targets,
            metallic_roughness=needs.metals,
            **encodings(targets, "normal", "albedo"),
        )

    def legal_variants(self) -> Iterator[Variant]:
        """Yield the variants that write a target: highlights are for radiance alone."""
        for made in combinations(UpsampleVariant):
            shown = made.radiance and (made.shine or not made.metallic_roughness)
            plain = made.light and not (made.shine or made.metallic_roughness)
            if (shown or plain) and made.normal_format != "classic":
                yield made


@dataclass(frozen=True)
class ResolveVariant(Variant):
    """The targets that the pass reads and writes, and the formulas of the picture.

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
    transparency: Transparency = "none"
    color_alpha: bool = False
    tint: bool = False
    gloss: bool = False


class ResolvePass(FullscreenPass):
    """Make the picture of radiance, particles and background."""

    name = "resolve"
    colors = "color", "color_alpha", "final_radiance"

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if a picture is asked for."""
        if not needs.picture:
            return None
        radiance = needs.all_lights() if needs.lit else []
        radiance += ["ambient light"] if needs.ambient_lit else []
        radiance += [f"emission of {needs.looks.emissive}"] if needs.emits else []
        radiance += [f"{needs.sprites} sprites"] if needs.draws_sprites else []
        reads = {"radiance": radiance} if radiance else {}
        if needs.modulates and radiance:
            reads["tint"] = [f"textures and colour scales of {needs.looks.modulated}"]
        if needs.gloss:
            reads["gloss"] = [f"highlights of {needs.looks.shiny}, which these do not multiply"]
        if needs.blends:
            reads["transparency"] = [needs.blended_in_view]
            if needs.transparency == "weighted":
                reads["transparency_weight"] = reads["transparency"]
        elif needs.draws_particles:
            among = [f"{needs.sprites} sprites among them"] if needs.sprites else []
            reads["particles"] = [needs.particles_in_view, *among]
        if needs.drawn and needs.forward:
            reads["coverage"] = ["the background shows where nothing was drawn"]
        elif needs.drawn:
            shown = ["base colours"] if needs.flat else []
            reads["albedo"] = [*shown, "the background shows where its alpha is 0"]
        because = "; ".join(asked(needs.outputs, ("color", "color_alpha", "radiance")))
        return Declaration(because, reads=reads, writes=self.colors)

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
            transparency=needs.transparency,
            color_alpha="color_alpha" in targets,
            tint=needs.modulates and "tint" in targets and "radiance" in targets,
            gloss="gloss" in targets,
        )

    def legal_variants(self) -> Iterator[Variant]:
        """Yield the variants that make an output."""
        for made in combinations(ResolveVariant):
            if (
                (made.color or made.final_radiance or made.color_alpha)
                and not (made.particles and made.transparency != "none")
                and (made.gradient or not made.orthographic)
                and (made.masked or not (made.marked or made.packed))
                and not (made.marked and made.packed)
                and _fits_look(made)
            ):
                yield made


def _fits_look(made: ResolveVariant) -> bool:
    """Return whether a look has what a variant asks for."""
    covered = made.marked or made.packed
    layered = made.particles or made.transparency != "none" or made.color_alpha
    lacks = {
        "correct": False,
        "classic": covered or layered,
        "pyrender": made.particles,
        "flat": covered or made.particles or made.radiance or made.final_radiance,
        "panda3d": made.particles,
    }
    tinted = made.look == "panda3d" and made.radiance and made.masked
    if (made.tint and not tinted) or (made.gloss and not made.tint):
        return False
    return not lacks[made.look] and (made.tone == "none" or made.look == "correct")
