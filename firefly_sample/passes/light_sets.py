"""Several sets of lights for one shader, which loops over them: ``#light_sets`` in `gpu.shader_source`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

from firefly_sample.gpu.drawing import cell_tables, light_table
from firefly_sample.passes.lights import FADES
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.plan.lights.clusters import Clusters
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.variants import (
    DrawMethod,
    FalloffChoice,
    LightKind,
    PositionSource,
    RangeFalloff,
    ShadowTaps,
    SpecularModel,
    Variant,
)

if TYPE_CHECKING:
    import moderngl

    from firefly_sample.gpu.gpu import Gpu


@dataclass(frozen=True)
class LightSetVariant(Variant):
    """One set of lights, which a shader loops over; all, or those of a cell."""

    light_kind: LightKind = "point"
    light_method: DrawMethod = "clustered"
    falloff: FalloffChoice = "ramp_squared"
    specular_model: SpecularModel = "none"
    shadow_taps: ShadowTaps = 0
    particle_shadow: bool = False
    position_source: PositionSource = "distance"


class BoundLights(NamedTuple):
    """Uniforms and textures of sets of lights; the names of set 0 end with ``_0``, and so on."""

    variants: tuple[LightSetVariant, ...]
    uniforms: dict[str, object]
    textures: dict[str, moderngl.Texture]


def bind_light_sets(
    gpu: Gpu,
    plan: FramePlan,
    cells: Sequence[Clusters],
    specular_model: SpecularModel,
    shadow_taps: ShadowTaps,
    particle_shadow: bool,
) -> BoundLights:
    """Bring all lights of a frame up to date for one shader: directional ones, then those of some cells.

    The last three are those of the frame; sets that cast no shadows look none up.
    """
    directional = [lights for lights in plan.lights if lights.kind == "directional"]
    sets: list[tuple[LightSet, Clusters | None]] = [
        *((lights, None) for lights in LightSet.joined_for_loops(directional)),
        *((clusters.lights, clusters) for clusters in cells),
    ]
    bound = BoundLights(
        tuple(
            LightSetVariant(
                light_kind=lights.kind,
                light_method="loop" if clusters is None else "clustered",
                falloff="ramp_squared" if clusters is None else lights.falloff.value,
                specular_model=specular_model,
                shadow_taps=shadow_taps if lights.shadowed else 0,
                particle_shadow=particle_shadow and lights.particle_shadowed,
            )
            for lights, clusters in sets
        ),
        {},
        {},
    )
    for index, (lights, clusters) in enumerate(sets):
        key = f"set {index}"
        uniforms: dict[str, object] = {"u_light_count": len(lights)}
        textures: dict[str, moderngl.Texture] = {}
        members = None
        if clusters is not None:
            uniforms, textures = cell_tables(gpu, plan, clusters, key)
            members = clusters.members
        textures["u_lights"] = light_table(gpu, plan, lights, bound.variants[index], key, members)
        bound.uniforms.update({f"{name}_{index}": value for name, value in uniforms.items()})
        bound.textures.update({f"{name}_{index}": value for name, value in textures.items()})
    return bound


def legal_light_sets() -> list[dict[str, Any]]:
    """Return the fields of sets of lights: none, each kind alone, all together with highlights and shadows.

    The lighting passes have every combination of highlights and shadows for each kind.
    """
    highlights_and_taps: list[Any] = [("none", 0), ("phong", 4), ("blinn_phong", 16)]
    alone, *together = highlights_and_taps
    found: list[dict[str, Any]] = [{"light_sets": ()}]
    for end in get_args(RangeFalloff):
        kinds = [(kind, falloff) for kind, falloff, ending in FADES if ending == end]
        found += [_legal_sets(end, [each], *alone) for each in kinds]
        found += [_legal_sets(end, kinds, *each) for each in together]
    return found


def _legal_sets(
    end: RangeFalloff,
    kinds: Sequence[tuple[Any, FalloffChoice]],
    model: SpecularModel,
    taps: ShadowTaps,
) -> dict[str, Any]:
    """Return the fields of some sets of lights; where they have shadows, those of particles as well."""
    clouds = taps > 0
    return {
        "range_falloff": end,
        "specular": model != "none",
        "specular_model": model,
        "shadow_taps": taps,
        "particle_shadow": clouds,
        "light_sets": tuple(
            LightSetVariant(
                kind,
                "loop" if kind == "directional" else "clustered",
                falloff,
                model,
                taps,
                clouds and kind != "point",
            )
            for kind, falloff in kinds
        ),
    }
