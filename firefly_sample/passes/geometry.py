"""Geometry pass: every surface once, into the G-buffer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any, get_args

from firefly_sample.passes.base import Pass, encodings
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import (
    AlbedoFormat,
    Interpolation,
    NormalFormat,
    PositionTarget,
    SurfaceFeatures,
    Variant,
)

if TYPE_CHECKING:
    from firefly_sample.gpu.drawing import Drawable
    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages
    from firefly_sample.gpu.programs import Program
    from firefly_sample.plan.frame_plan import Batch, FramePlan, PassPlan

GBUFFER = {
    "albedo": "albedo",
    "normal": "normal",
    "distance": "distance",
    "ambient_albedo": "ambient",
    "specular": "specular",
    "emission": "emission",
    "id": "id",
    "visibility": "visibility",
}
"""Targets, and the field of the variant that says whether a frame has each.

"position" has `position_target`.
"""
INTERPOLATED = ("normal", "distance", "position")
"""Targets of values that are interpolated between corners, and not sampled."""
AT_ONCE = 32
"""Draws that a software driver is given before it begins with them: it then shades them on all cores while
the next ones' vertices are placed, which takes a tenth off a forest."""
_BOTH = (False, True)


@dataclass(frozen=True)
class GeometryVariant(Variant):
    """How the G-buffer is written: its targets, their formats, and what a draw's surfaces ask for.

    `interpolation` marks what the interpolation pass is to find again; the fields from `textured` on are
    those of `SurfaceFeatures`.
    """

    albedo: bool = True
    normal: bool = True
    distance: bool = True
    ambient: bool = False
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


def position_target_of(targets: Mapping[str, Target]) -> PositionTarget:
    """Return how positions are stored, if they are."""
    formats: dict[str, PositionTarget] = {"rgba32f": "float32", "rgba16f": "float16"}
    return formats[targets["position"].format] if "position" in targets else "none"


def legal_surfaces() -> list[SurfaceFeatures]:
    """Return what a draw of surfaces can ask for.

    The alpha of vertex colours cuts out where there are some.
    """
    return [
        SurfaceFeatures(textured, colored, cutout, double_sided, alpha)
        for textured, colored, cutout, double_sided, alpha in product(_BOTH, repeat=5)
        if (colored and cutout) or not alpha
    ]


class GeometryPass(Pass):
    """Draw the batches in the plan's order: opaque before cut-out, front to back.

    What the last frame left is kept where the same would be drawn again: the same draws from the same place.
    """

    name = "geometry"

    def __init__(self) -> None:
        self._ready: list[Drawable] = []
        self._state: _State | None = None
        self._drawn: _State | None = None
        self._same = False

    def declare(self, needs: Needs) -> Declaration | None:
        """Return what it does if something is in view and a G-buffer is kept."""
        if not needs.drawn or needs.forward:
            return None
        return Declaration(
            f"{needs.geometry} geometry instances in view",
            writes=["depth", "albedo", "normal", "distance", "position", *list(GBUFFER)[3:]],
            keeps={"depth": ["geometry hides what is behind it"]},
        )

    def variant(self, needs: Needs, targets: Mapping[str, Target]) -> GeometryVariant:
        """Return the frame's variant; a draw fills in what its surfaces ask for."""
        written: dict[str, Any] = {field: name in targets for name, field in GBUFFER.items()}
        again = needs.float64 and any(name in targets for name in INTERPOLATED)
        return GeometryVariant(
            **written,
            **encodings(targets, "normal", "albedo"),
            position_target=position_target_of(targets),
            interpolation="float64" if again else "rasterizer",
            orthographic=needs.orthographic,
        )

    def legal_variants(self) -> Iterator[Variant]:
        """Yield every combination of targets, formats and surfaces that a frame can have."""
        surfaces = [asdict(surface) for surface in legal_surfaces()]
        for albedo, normal, distance in product(_BOTH, repeat=3):
            # what a frame has beside the albedo for light, no frame has without it
            extras = product(_BOTH, repeat=3) if albedo else [(False, False, False)]
            stores: tuple[PositionTarget, ...] = ("none",) if distance else get_args(PositionTarget)
            for extra, stored in product(extras, stores):
                for normals, colors in product(get_args(NormalFormat), get_args(AlbedoFormat)):
                    if (not normal and normals != "oct16") or (not albedo and colors != "sqrt10"):
                        continue  # nothing is encoded
                    if normals == "classic" and (any(extra) or (albedo and colors != "linear")):
                        continue
                    interpolated = normal or distance or stored != "none"
                    for ids, flat, surface in product(product(_BOTH, repeat=2), _BOTH, surfaces):
                        again = get_args(Interpolation) if interpolated and ids[1] else ("rasterizer",)
                        for how in again:
                            targets: Any = albedo, normal, distance, *extra, *ids, stored
                            formats: Any = normals, colors, how, flat
                            yield GeometryVariant(*targets, *formats, **surface)

    def outputs(self, variant: Variant) -> tuple[str, ...]:
        """Return the targets that the variant writes."""
        assert isinstance(variant, GeometryVariant)
        stored = ("position",) if variant.position_target != "none" else ()
        return (*(name for name, field in GBUFFER.items() if getattr(variant, field)), *stored)

    def prepare(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Bring meshes, instances and textures up to date, and keep them for `draw`."""
        from firefly_sample.gpu.drawing import make_drawable

        self._ready.clear()  # a frame before may have failed half-way
        self._state = _state_of(plan, step)
        self._same = gpu.reuse and self._state.same_as(self._drawn) and _untouched(step, images)
        if self._same:
            return
        assert isinstance(step.variant, GeometryVariant)
        outputs = images.color_names()
        gpu.uploads.prepare(plan.batches)
        programs: dict[SurfaceFeatures, Program] = {}  # hashing a whole variant takes longer than the rest
        for batch in plan.batches:
            program = programs.get(batch.surface)
            if program is None:
                variant = replace(step.variant, **asdict(batch.surface))
                program = programs[batch.surface] = gpu.programs.get(self.name, variant, outputs)
            self._ready.append(make_drawable(gpu, plan, batch, program))

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        import moderngl

        from firefly_sample.gpu.drawing import draw_surface

        if self._same:
            return
        self._drawn = None
        images.draw_into()
        # less-equal: strict less would drop geometry whose depth rounds to the clear value
        gpu.ctx.depth_func = ">=" if plan.view.reverse else "<="
        ready, self._ready = self._ready, []
        encoded = images.encodes_srgb()
        if encoded:
            gpu.device.set_srgb_encoding(True)
        first, counts = 0, "visibility" in step.writes
        try:
            for index, drawable in enumerate(ready):
                if gpu.device.software and index and index % AT_ONCE == 0:
                    gpu.device.flush()
                uniforms = {"u_first_instance": first} if counts else {}
                draw_surface(gpu, drawable, moderngl.DEPTH_TEST, uniforms, {})
                first += len(drawable.batch.ids)
        finally:
            if encoded:
                gpu.device.set_srgb_encoding(False)
        gpu.ctx.front_face = "ccw"
        gpu.ctx.depth_func = "<"
        self._drawn = self._state


@dataclass(frozen=True, eq=False)
class _State:
    """All that decides what the pass draws, beside the textures that it draws into.

    Batches are compared by identity, and kept so that nothing else takes their place.
    """

    batches: tuple[Batch, ...]
    rest: tuple[Any, ...]

    def same_as(self, other: _State | None) -> bool:
        return other is not None and self.batches is other.batches and self.rest == other.rest


def _state_of(plan: FramePlan, step: PassPlan) -> _State:
    images = tuple(batch.texture.revision for batch in plan.batches if batch.texture is not None)
    view = (plan.view.lens, plan.view.size, plan.view.reverse, plan.view.near)
    return _State(plan.batches, (images, view, plan.settings.look, step.variant))


def _untouched(step: PassPlan, images: BoundImages) -> bool:
    """Return True if no other pass has written since; interpolation writes the same each time."""
    return all(images.writer(name) in ("geometry", "interpolation") for name in step.writes)
