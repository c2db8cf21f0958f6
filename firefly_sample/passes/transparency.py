"""Blended surfaces, and the particles and dots among them, by the method of the setting `transparency`.

Each fragment is shaded by all lights when it is drawn. "sorted" and "exact" make a layer of radiance, and of
the share of what is behind that it hides, which `resolve` puts over the other surfaces; "weighted" makes
sums.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from firefly_sample.errors import SceneError
from firefly_sample.gpu.drawing import Drawable, draw_surface, make_drawable, shadow_textures
from firefly_sample.gpu.instance_rows import PARTICLE_DTYPE, instance_texels, particle_rows
from firefly_sample.passes.base import BOTH, Pass
from firefly_sample.passes.geometry import surface_fields
from firefly_sample.passes.legal import Product, Products, choices
from firefly_sample.passes.legal_surfaces import legal_surfaces
from firefly_sample.passes.light_sets import LightSetVariant, bind_light_sets, legal_light_sets
from firefly_sample.passes.particles import ParticleVariant, particle_reads, particle_variant
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.frame_plan import Batch, Blended, FramePlan, PassPlan
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import (
    MapCoordinates,
    RangeFalloff,
    ShadowTaps,
    SpecularModel,
    Transparency,
    Variant,
)

if TYPE_CHECKING:
    import moderngl

    from firefly_sample.gpu.gpu import Gpu, Squares
    from firefly_sample.gpu.images import BoundImages
    from firefly_sample.gpu.programs import Program

LAYER = ("layer", "layer_place", "layer_number", "layer_depth")
PEELED = ("layer", "peeled_place", "peeled_number", "peeled_depth")
"""The targets of a layer, and those of the next one: they take turns."""
OUTPUTS_OF = {
    "sorted": ("transparency",),
    "weighted": ("transparency", "transparency_weight"),
    "exact": LAYER[:3],
}
"""The colour targets of each method's shader."""
_LAYERS = "transparency=exact keeps two layers at a time"


@dataclass(frozen=True)
class TransparencyVariant(Variant):
    """Surfaces as the geometry pass has them, shaded at once by several sets of lights, and blended.

    `sorted` draws mix instances; `numbered` ones know their triangles. `surfaces` says whether there are
    opaque ones, and `reverse` how their depth is kept. `particles` is of the particles among them.
    """

    transparency: Transparency = "sorted"
    light_sets: tuple[LightSetVariant, ...] = ()
    range_falloff: RangeFalloff = "karis"
    specular_model: SpecularModel = "none"
    clamp_light: bool = False
    shadow_taps: ShadowTaps = 0
    particle_shadow: bool = False
    ambient_albedo: bool = False
    specular: bool = False
    emission: bool = False
    orthographic: bool = False
    sorted: bool = False
    numbered: bool = False
    surfaces: bool = False
    reverse: bool = False
    textured: bool = False
    vertex_color: bool = False
    double_sided: bool = False
    vertex_alpha: bool = False
    emission_textured: bool = False
    second_texcoords: bool = False
    metallic: bool = False
    unlit: bool = False
    metallic_map: MapCoordinates = 0
    normal_map: MapCoordinates = 0
    occlusion_map: MapCoordinates = 0
    modulate_map: MapCoordinates = 0
    pyrender: bool = False
    panda3d: bool = False
    scaled: bool = False
    local_viewer: bool = False
    particles: ParticleVariant | None = None


class TransparencyPass(Pass):
    """Draw blended surfaces, particles and dots over the others."""

    name = "transparency"
    colors = ("transparency",)

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if blended surfaces are in view."""
        if not needs.blends:
            return None
        reads: dict[str, list[str]] = {}
        if needs.shadow_maps and (needs.lights or needs.draws_particles):
            reads["shadow_atlas"] = needs.shadows()
        if needs.particle_shadowed:
            reads["particle_shadow_atlas"] = [needs.particle_shadow_reason]
        if needs.draws_particles:
            reads["particle_light"] = [needs.particles_in_view]
        if needs.squares_among_blended:
            reads |= particle_reads(needs)
        exact = needs.transparency == "exact"
        if exact and needs.drawn:
            reads["depth"] = [*reads.get("depth", []), "opaque surfaces hide what is behind them"]
        layers = {name: [_LAYERS] for name in (*LAYER, *PEELED)}
        weights = ["transparency_weight"] if needs.transparency == "weighted" else []
        return Declaration(
            needs.blended_in_view,
            reads=reads,
            writes=["transparency", *weights, *(layers if exact else ())],
            tests=[] if exact else ["depth"],
            keeps=layers if exact else {},
        )

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> TransparencyVariant:
        """Return the frame's variant; the lights and a draw's surfaces fill in the rest."""
        settings = needs.settings
        exact = needs.transparency == "exact"
        return TransparencyVariant(
            transparency=needs.transparency,
            range_falloff=settings.range_falloff,
            specular_model=needs.specular_model if needs.blended_looks.shiny and needs.lights else "none",
            clamp_light=settings.clamp_light,
            shadow_taps=settings.shadow_taps if needs.shadowed else 0,  # type: ignore[arg-type]
            particle_shadow=needs.particle_shadowed_kind is not None and needs.particle_shadowed,
            ambient_albedo=bool(needs.own_ambient_of(needs.blended_looks)) and needs.ambient,
            specular=bool(needs.blended_looks.shiny and needs.lights),
            emission=bool(needs.blended_looks.emissive) or needs.flat,
            orthographic=needs.orthographic,
            sorted=needs.transparency == "sorted",
            numbered=exact,
            surfaces=exact and needs.drawn,
            reverse=exact and needs.reverse,
            pyrender=needs.pyrender,
            panda3d=needs.panda3d,
            particles=particle_variant(needs, targets) if needs.squares_among_blended else None,
        )

    def legal_variants(self) -> Products:
        """Return every combination of a method, lights and surfaces; of sets of lights one, none or three."""
        methods = [
            *choices(transparency=["sorted"], sorted=[True]),
            *choices(transparency=["weighted"]),
            *choices(transparency=["exact"], numbered=[True], surfaces=BOTH, reverse=BOTH),
        ]
        products = []
        for emission in BOTH:
            plain, *others = legal_surfaces(emission)
            surfaces = [
                {name: value for name, value in each.items() if name != "cutout"}
                for each in plain
                if each["cutout"] == each["vertex_alpha"]
            ]
            frame = choices(emission=[emission]), choices(ambient_albedo=BOTH), choices(orthographic=BOTH)
            panda3d = choices(panda3d=[True], scaled=BOTH, local_viewer=BOTH)
            looks = [*choices(clamp_light=BOTH), {"pyrender": True}, *panda3d]
            parts = methods, *frame, legal_light_sets(), looks, surfaces, *others
            products.append(Product(TransparencyVariant, *parts))
        return Products(*products)

    def shader_stems(self, variant: Variant) -> list[tuple[str, str]]:
        """Return the shaders of blended surfaces; the particles among them have their own."""
        return [("transparent", "geometry")]

    def outputs(self, variant: Variant) -> tuple[str, ...]:
        """Return the colour targets of the variant's method."""
        assert isinstance(variant, TransparencyVariant)
        return OUTPUTS_OF[variant.transparency]

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        assert isinstance(step.variant, TransparencyVariant)
        assert plan.blended is not None
        drawing = _Drawing(gpu, plan, plan.blended, step.variant, images)
        {"sorted": drawing.sorted, "exact": drawing.exact, "weighted": drawing.weighted}[
            step.variant.transparency
        ]()


class _Drawing:
    """One frame's blended surfaces on the GPU."""

    def __init__(
        self,
        gpu: Gpu,
        plan: FramePlan,
        blended: Blended,
        frame: TransparencyVariant,
        images: BoundImages,
    ) -> None:
        self._gpu, self._plan, self._blended, self._images = gpu, plan, blended, images
        shadows = frame.shadow_taps, frame.particle_shadow
        lights = bind_light_sets(gpu, plan, blended.clusters, frame.specular_model, *shadows)
        self._uniforms = lights.uniforms
        self._textures = shadow_textures(gpu, plan, images, *shadows) | lights.textures
        self._frame = replace(frame, light_sets=lights.variants, particles=None)
        self._particles = frame.particles
        if frame.transparency == "weighted":
            deep = max(blended.farthest - blended.nearest, 1e-30)
            self._uniforms["u_blended_range"] = (blended.nearest, 1.0 / deep)

    def _program(self, batch: Batch, outputs: tuple[str, ...]) -> Program:
        frame = self._frame
        lit, flat = bool(frame.light_sets), self._plan.settings.look == "flat"
        shows = frame.emission and not flat, lit, frame.ambient_albedo, lit
        fields = surface_fields(
            batch.surface, *shows, self._plan.settings.look, frame.pyrender, frame.specular
        )
        if flat:
            fields["unlit"] = True  # what an unlit surface emits is its base colour
        fields.pop("cutout")
        return self._gpu.programs.get("transparent", replace(frame, **fields), outputs, "geometry")

    def sorted(self) -> None:
        """Draw triangles, particles and dots from back to front."""
        gpu, plan, ctx, order = self._gpu, self._plan, self._gpu.ctx, self._blended.order
        assert order is not None
        self._images.draw_into()
        ctx.blend_func = ctx.ONE, ctx.ONE_MINUS_SRC_ALPHA
        table = gpu.streams.texture("blended instances", instance_texels(self._blended.batches))
        corners = gpu.streams.buffer("blended corners", order.corners)
        drawables, first = [], 0
        for batch in self._blended.batches:
            program = self._program(batch, self._images.color_names())
            made = make_drawable(gpu, plan, batch, program, gpu.uploads.sorted_array(batch, corners, program))
            drawables.append((made, {"u_first_instance": first}))
            first += len(batch.ids)
        squares = self._squares(self._images.color_names(), order.squares)
        textures = self._textures | {"u_instances": table}
        for run in order.runs:
            if run.batch >= 0:
                drawable, uniforms = drawables[run.batch]
                flags = ctx.BLEND | ctx.DEPTH_TEST
                part = 3 * run.first, 3 * run.count
                draw_surface(gpu, drawable, flags, self._uniforms | uniforms, textures, part)
            elif squares is not None:
                ctx.enable_only(ctx.BLEND)
                self._use_particles(squares.program)
                squares.draw(run.first, run.count)

    def weighted(self) -> None:
        """Add surfaces and particles in any order."""
        gpu, ctx = self._gpu, self._gpu.ctx
        self._images.draw_into()
        ctx.blend_func = ctx.ONE, ctx.ONE, ctx.ONE_MINUS_DST_ALPHA, ctx.ONE  # type: ignore[assignment]
        outputs = self._images.color_names()
        for drawable in self._instanced(outputs):
            draw_surface(gpu, drawable, ctx.BLEND | ctx.DEPTH_TEST, self._uniforms, self._textures)
        squares = self._squares(outputs, np.arange(len(self._plan.particles)))
        if squares is not None:
            ctx.enable_only(ctx.BLEND)
            self._use_particles(squares.program, u_blended_range=self._uniforms["u_blended_range"])
            squares.draw_all()

    def _instanced(self, outputs: tuple[str, ...]) -> list[Drawable]:
        """Return all batches, to be drawn as a whole."""
        gpu, plan, batches = self._gpu, self._plan, self._blended.batches
        gpu.uploads.prepare(batches)
        made = []
        for batch in batches:
            program = self._program(batch, outputs)
            made.append(make_drawable(gpu, plan, batch, program))
        return made

    def _squares(self, outputs: tuple[str, ...], order: np.ndarray[Any, Any]) -> Squares | None:
        """Return the squares of particles and dots in an order; None if there are none."""
        if self._particles is None or not len(order):
            return None
        plan, gpu = self._plan, self._gpu
        particles = replace(plan.particles, order=order)
        rows = particle_rows(particles, plan.sprites, plan.view)
        program = gpu.programs.get("particles", self._particles, outputs)
        return gpu.squares(program, rows, PARTICLE_DTYPE)

    def _use_particles(self, program: Program, **uniforms: object) -> None:
        program.use(uniforms, self._particle_textures(program))

    def _particle_textures(self, program: Program) -> dict[str, moderngl.Texture]:
        """Return the textures of particles: their light, and where surfaces are."""
        images = self._images
        textures = images.samplers(name for name in images.reads() if not name.endswith("shadow_atlas"))
        textures = {name: texture for name, texture in textures.items() if program.samples(name)}
        if not len(self._plan.particles):  # dots alone
            nothing = np.zeros((1, 1, 4), dtype=np.float32)
            textures["u_particle_light"] = self._gpu.streams.texture("no particle light", nothing)
        return textures

    def exact(self) -> None:
        """Draw layer after layer, the nearest first, and put each under those before it."""
        gpu, plan, ctx, images = self._gpu, self._plan, self._gpu.ctx, self._images
        reverse = plan.view.reverse
        result = images.framebuffer_of("transparency")
        result.clear()
        peeled, current = PEELED, LAYER
        before = images.framebuffer_of(*peeled)
        before.depth_mask = True
        before.clear(0.0, 0.0, 0.0, 0.0, depth=1.0 if reverse else 0.0)  # before everything
        drawables = self._instanced(LAYER[:3])
        starts = np.cumsum([0, *(len(drawable.batch.ids) for drawable in drawables)]).tolist()
        squares = self._squares(("transparency",), self._front_to_back())
        limit = plan.settings.transparency_layers
        for number in range(limit + 1):
            layer = images.framebuffer_of(*current)
            layer.use()
            layer.depth_mask = True
            layer.clear(0.0, 0.0, 0.0, 0.0, depth=0.0 if reverse else 1.0)
            ctx.depth_func = ">" if reverse else "<"  # of equal ones, the first
            uniforms, textures = self._peeling(peeled)
            with gpu.samples() as passed:
                for first, drawable in zip(starts, drawables, strict=False):
                    own = {"u_first_instance": first}
                    draw_surface(gpu, drawable, ctx.DEPTH_TEST, uniforms | own, textures)
            if passed.number and number == limit:
                raise SceneError(
                    f"a pixel has more than {limit} blended layers: raise transparency_layers, or choose "
                    "transparency=sorted"
                )
            result.use()
            ctx.enable_only(ctx.BLEND)
            ctx.blend_func = ctx.ONE_MINUS_DST_ALPHA, ctx.ONE
            if squares is not None:
                own_names = {"u_layer_place": current[1], "u_peeled_place": peeled[1]}
                self._use_segment(squares.program, number == 0, own_names)
                squares.draw_all()
            if not passed.number:
                break
            program = gpu.programs.get("layer", Variant(), ("transparency",), "fullscreen")
            program.use(None, {"u_layer": images.own("layer")})
            gpu.draw_screen(program)
            peeled, current = current, peeled

    def _front_to_back(self) -> np.ndarray[Any, Any]:
        plan = self._plan
        return plan.particles.order[::-1] if len(plan.particles) else np.arange(len(plan.sprites))

    def _peeling(self, peeled: tuple[str, ...]) -> tuple[dict[str, object], dict[str, moderngl.Texture]]:
        """Return the uniforms and textures by which a layer is found behind another."""
        images = self._images
        textures = {"u_peeled_depth": images.own(peeled[3]), "u_peeled_number": images.own(peeled[2])}
        uniforms = dict(self._uniforms)
        if self._frame.surfaces:
            textures["u_depth"] = images.read("depth")
            depth = self._plan.target("depth")
            assert depth is not None
            steps = {"depth16": 2.0**-17, "depth24": 2.0**-25, "depth32f": 0.0}
            uniforms["u_depth_step"] = steps[depth.format]
        return uniforms, self._textures | textures

    def _use_segment(self, program: Program, first: bool, places: Mapping[str, str]) -> None:
        textures = self._particle_textures(program)
        textures |= {name: self._images.own(target) for name, target in places.items()}
        program.use({"u_first_layer": first}, textures)
