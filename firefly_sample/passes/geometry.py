"""Geometry pass: every surface once, into the G-buffer; interpolation pass: steep ones again, in float64."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any

from firefly_sample.gpu.drawing import Drawable, draw_surface, make_drawable
from firefly_sample.passes.base import BOTH, FullscreenPass, Pass, combinations, encodings
from firefly_sample.passes.legal import Product, Products, choices
from firefly_sample.passes.legal_surfaces import legal_surfaces, legal_targets
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.frame_plan import Batch, FramePlan, PassPlan
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import (
    AlbedoFormat,
    Interpolation,
    Look,
    MapCoordinates,
    NormalFormat,
    PositionTarget,
    SurfaceFeatures,
    Variant,
)

if TYPE_CHECKING:
    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages
    from firefly_sample.gpu.programs import Program

INTERPOLATED = ("normal", "distance", "position")
"""Targets of values that are interpolated between corners, and not sampled."""
AT_ONCE = 32
"""Draws that a software driver is given before it begins with them: it then shades them on all cores while it
transforms the next ones' vertices. This makes a forest's pass a tenth faster."""


@dataclass(frozen=True)
class GeometryVariant(Variant):
    """The targets of the G-buffer, their formats, and the features of the surfaces that a draw has.

    `interpolation` marks pixels for the interpolation pass. The fields from `textured` on are those of
    `SurfaceFeatures`.
    """

    albedo: bool = True
    normal: bool = True
    distance: bool = True
    ambient_albedo: bool = False
    specular: bool = False
    emission: bool = False
    id: bool = False
    visibility: bool = False
    position_target: PositionTarget = "none"
    normal_format: NormalFormat = "oct16"
    albedo_format: AlbedoFormat = "sqrt10"
    interpolation: Interpolation = "rasterizer"
    orthographic: bool = False
    textured: bool = False
    vertex_color: bool = False
    cutout: bool = False
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
    metallic_roughness: bool = False
    pyrender: bool = False
    tint: bool = False
    panda3d: bool = False
    scaled: bool = False
    local_viewer: bool = False
    local_viewers: bool = False

    @property
    def position(self) -> bool:
        """True if there is a target for positions."""
        return self.position_target != "none"


def position_target_of(targets: Mapping[str, Target]) -> PositionTarget:
    """Return how positions are stored, if they are."""
    formats: dict[str, PositionTarget] = {"rgba32f": "float32", "rgba16f": "float16"}
    return formats[targets["position"].format] if "position" in targets else "none"


def surface_fields(
    surface: SurfaceFeatures,
    emission: bool,
    normal: bool,
    ambient: bool,
    metals: bool,
    look: Look = "correct",
    tint: bool = False,
    viewer: bool = False,
) -> dict[str, Any]:
    """Return a draw's fields of a variant, without those that nothing needs.

    The others say whether the pass makes emission, normals, the reflectance of ambient light, metalness and
    roughness, a tint, by which pyrender's formula multiplies light, and highlights that may see the eye where
    it is.
    """
    classic, pyrender = look == "classic", look == "pyrender"
    absent: dict[str, Any] = {} if viewer else {"local_viewer": False}
    if not emission:
        absent |= {"emission_textured": False, "second_texcoords": False}
    if not normal or classic:
        absent["normal_map"] = 0
    if not (ambient or metals or look in ("pyrender", "panda3d")) or classic:
        absent["metallic"] = False
    if not (metals or (ambient and not pyrender)) or classic:
        absent["metallic_map"] = 0
    if not (tint if pyrender and surface.metallic else ambient) or classic:
        absent["occlusion_map"] = 0
    if classic:
        absent["unlit"] = False
    return asdict(replace(surface, **absent))


class GeometryPass(Pass):
    """Draw the batches in the plan's order: opaque before cut-out, front to back.

    It draws nothing if the last frame made the same draws from the same camera, into targets that are
    untouched.
    """

    name = "geometry"
    colors = (
        "albedo",
        "normal",
        "distance",
        "position",
        "ambient_albedo",
        "specular",
        "metallic_roughness",
        "tint",
        "emission",
        "id",
        "visibility",
    )

    def __init__(self) -> None:
        self._ready: list[Drawable] = []
        self._state: tuple[Any, ...] = ()
        self._drawn_state: tuple[Any, ...] | None = None
        self._drawn: tuple[Batch, ...] | None = None
        self._same = False

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if something is in view and a G-buffer is kept."""
        if not needs.drawn or needs.forward:
            return None
        return Declaration(
            f"{needs.geometry} geometry instances in view",
            writes=["depth", *self.colors],
            keeps={"depth": ["geometry hides what is behind it"]},
        )

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> GeometryVariant:
        """Return the frame's variant; a draw fills in what its surfaces ask for."""
        written: dict[str, Any] = {name: name in targets for name in self.colors if name != "position"}
        again = needs.float64 and any(name in targets for name in INTERPOLATED)
        return GeometryVariant(
            **written,
            **encodings(targets, "normal", "albedo"),
            position_target=position_target_of(targets),
            interpolation="float64" if again else "rasterizer",
            orthographic=needs.orthographic,
            pyrender=needs.pyrender,
            panda3d=needs.panda3d,
            local_viewers=needs.local_viewers and "specular" in targets,
        )

    def legal_variants(self) -> Products:
        """Return every combination of targets, formats and surfaces that a frame can have."""
        products = []
        for emission, metals, panda3d in product(BOTH, repeat=3):
            targets = legal_targets(emission, metals, panda3d)
            frame = choices(orthographic=BOTH), choices(metallic_roughness=[metals])
            scales = choices(scaled=BOTH if panda3d else (False,))
            surfaces = legal_surfaces(emission)
            products.append(Product(GeometryVariant, targets, *frame, scales, *surfaces))
        return Products(*products)

    def prepare(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Bring meshes, instances and textures up to date, and keep them for `draw`."""
        self._ready.clear()  # a frame before may have failed half-way
        self._state = _state_of(plan, step)
        # batches are compared by identity, and kept so that no other ones get their address
        same = plan.batches is self._drawn and self._state == self._drawn_state
        self._same = gpu.reuse and same and _untouched(step, images)
        if self._same:
            return
        assert isinstance(step.variant, GeometryVariant)
        gpu.uploads.prepare(plan.batches)
        # hashing a whole variant takes longer than the rest
        programs: dict[tuple[SurfaceFeatures, bool], Program] = {}
        for batch in plan.batches:
            key = batch.surface, batch.geom.mode == "triangles"
            program = programs.get(key)
            if program is None:
                variant = replace(step.variant, **self._fields(batch.surface, step.variant, plan))
                if not key[1]:  # lines and points have no corners to interpolate between
                    variant = replace(variant, interpolation="rasterizer")
                program = programs[key] = self.program(gpu, variant, images)
            self._ready.append(make_drawable(gpu, plan, batch, program))

    @staticmethod
    def _fields(surface: SurfaceFeatures, frame: GeometryVariant, plan: FramePlan) -> dict[str, Any]:
        wanted = frame.emission, frame.normal, frame.ambient_albedo, frame.metallic_roughness
        fields = surface_fields(surface, *wanted, plan.settings.look, frame.tint, frame.local_viewers)
        return fields | {"unlit": False} if plan.settings.look == "flat" else fields

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        if self._same:
            return
        self._drawn = None
        images.draw_into()
        ready, self._ready = self._ready, []
        gpu.device.set_srgb_encoding(images.encodes_srgb())
        first, counts = 0, "visibility" in step.writes
        try:
            for index, drawable in enumerate(ready):
                if gpu.device.software and index and index % AT_ONCE == 0:
                    gpu.device.flush()
                uniforms = {"u_first_instance": first} if counts else {}
                draw_surface(gpu, drawable, gpu.ctx.DEPTH_TEST, uniforms, {})
                first += len(drawable.batch.ids)
        finally:
            gpu.device.set_srgb_encoding(False)
        self._drawn, self._drawn_state = plan.batches, self._state


def _state_of(plan: FramePlan, step: PassPlan) -> tuple[Any, ...]:
    """Return all that decides what the pass draws, beside the batches, and which textures it draws into."""
    textures = [batch.texture for batch in plan.batches if batch.texture is not None]
    textures += [found.texture for batch in plan.batches for _, found in batch.maps.named()]
    images = tuple(texture.revision for texture in textures)
    # textures of the frame before the last one are kept: they may hold what was drawn then
    into = tuple((name, target.format) for name in step.writes if (target := plan.target(name)) is not None)
    view = plan.view
    return images, into, view.lens, view.size, view.reverse, view.near, plan.settings.look, step.variant


def _untouched(step: PassPlan, images: BoundImages) -> bool:
    """Return True if no other pass has written since; interpolation writes the same each time."""
    return all(images.writer(name) in ("geometry", "interpolation") for name in step.writes)


@dataclass(frozen=True)
class InterpolationVariant(Variant):
    """The targets of the geometry pass that are written again, and how: fields as there."""

    normal: bool = True
    distance: bool = True
    position_target: PositionTarget = "none"
    normal_format: NormalFormat = "oct16"
    orthographic: bool = False

    @property
    def position(self) -> bool:
        """True if there is a target for positions."""
        return self.position_target != "none"


class InterpolationPass(FullscreenPass):
    """Compute normals and distances in float64 where the geometry pass marked pixels."""

    name = "interpolation"
    colors = INTERPOLATED

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if the G-buffer is to be interpolated in float64."""
        if not needs.drawn or needs.forward or not needs.float64:
            return None
        return Declaration(
            "interpolation=float64: what is steep is found again from its triangle's corners",
            reads={"visibility": ["interpolation=float64 looks corners up"]},
            updates=sorted(INTERPOLATED),
        )

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> Variant:
        """Return the variant for the targets that there are."""
        return InterpolationVariant(
            normal="normal" in targets,
            distance="distance" in targets,
            position_target=position_target_of(targets),
            **encodings(targets, "normal"),
            orthographic=needs.orthographic,
        )

    def legal_variants(self) -> Iterator[Variant]:
        """Yield the variants that write a target; there is a distance or a position."""
        for made in combinations(InterpolationVariant):
            encoded = made.normal_format != "classic" if made.normal else made.normal_format == "oct16"
            placed = made.distance + made.position
            if encoded and placed < 2 and (made.normal or placed):
                yield made

    def prepare(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Bring the tables of corners up to date."""
        self.textures = gpu.corners.prepare(plan)
