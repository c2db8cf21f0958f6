"""Interpolation pass: normals and distances in float64, where a rasterizer's float32 is not enough."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, get_args

from firefly_sample.passes.base import FullscreenPass, encodings
from firefly_sample.passes.geometry import INTERPOLATED, position_target_of
from firefly_sample.plan.frame_graph import Declaration
from firefly_sample.plan.needs import Needs
from firefly_sample.plan.targets import Target
from firefly_sample.plan.variants import NormalFormat, PositionTarget, Variant

if TYPE_CHECKING:
    import moderngl

    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages
    from firefly_sample.plan.frame_plan import FramePlan, PassPlan


@dataclass(frozen=True)
class InterpolationVariant(Variant):
    """The targets of the geometry pass that are written again, and how: fields as there."""

    normal: bool = True
    distance: bool = True
    position_target: PositionTarget = "none"
    normal_format: NormalFormat = "oct16"
    orthographic: bool = False


class InterpolationPass(FullscreenPass):
    """Write again what the geometry pass marked; everything else keeps what it has."""

    name = "interpolation"

    def __init__(self) -> None:
        self._tables: dict[str, moderngl.Texture] = {}

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
        """Yield every combination of targets."""
        both = (False, True)
        stores: list[tuple[bool, PositionTarget]] = [
            *((distance, "none") for distance in both),
            *((False, stored) for stored in get_args(PositionTarget)[1:]),
        ]
        for normal, (distance, stored), flat in product(both, stores, both):
            for normals in get_args(NormalFormat)[:5] if normal else ("oct16",):
                if normal or distance or stored != "none":
                    yield InterpolationVariant(normal, distance, stored, normals, flat)

    def outputs(self, variant: Variant) -> tuple[str, ...]:
        """Return the targets that the variant writes."""
        assert isinstance(variant, InterpolationVariant)
        there = variant.normal, variant.distance, variant.position_target != "none"
        return tuple(name for name, written in zip(INTERPOLATED, there, strict=True) if written)

    def prepare(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Bring the tables of corners up to date."""
        self._tables = gpu.corners.of(plan)

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        from firefly_sample.gpu.drawing import draw_fullscreen

        draw_fullscreen(gpu, step, images, textures=self._tables)
