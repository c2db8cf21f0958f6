"""What the passes of lights share: each light shades the pixels that it can reach, and blends them together.

Volumes are drawn as back faces with depth test greater-equal, so that the camera may stand inside and what
lies before a volume costs nothing, and with depth clamp, so that no plane cuts a volume open.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import moderngl
import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.cluster_rows import cluster_lists
from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.images import BoundImages
from firefly_sample.gpu.light_rows import light_rows, light_texels
from firefly_sample.gpu.programs import Program
from firefly_sample.gpu.proxies import proxy_mesh
from firefly_sample.gpu.records import RECORD_OF_KIND, record_dtype
from firefly_sample.passes.base import Pass, textures_of
from firefly_sample.plan.frame_plan import FramePlan, PassPlan
from firefly_sample.plan.lights.clusters import Clusters
from firefly_sample.plan.lights.light_set import LightKind, LightSet
from firefly_sample.plan.variants import (
    DrawMethod,
    ForwardVariant,
    LightVariant,
    ParticleLightVariant,
    Variant,
    defines,
)

_OUTPUTS = {"half_light": "light", "half_shine": "radiance"}
"""What a shader calls its targets at half resolution."""
BEHIND = 4.0
"""Steps of depth by which a volume's back faces are moved away from the eye. Volume and surface are rounded
each by itself: where few steps are left, a back face could come out before a surface that it lies behind."""


Shines = TypeVar("Shines", LightVariant, ForwardVariant, ParticleLightVariant)


class LightPass(Pass):
    """Draws the light sets of one kind."""

    kind: LightKind

    def draw(self, gpu: Gpu, plan: FramePlan, step: PassPlan, images: BoundImages) -> None:
        """Draw `step` of `plan`."""
        assert isinstance(step.variant, LightVariant)
        images.draw_into()
        gpu.ctx.blend_func = moderngl.ONE, moderngl.ONE
        by_cells = step.variant.method == "clustered"
        drawn = [cells.lights for cells in plan.clusters] if by_cells else plan.lights
        for index, lights in enumerate(drawn):
            if lights.kind != self.kind:
                continue
            variant = variant_for(step.variant, lights)
            key = f"{self.name} {index}"
            outputs = tuple(_OUTPUTS.get(name, name) for name in images.color_names())
            program = gpu.programs.get(self.name, variant, outputs)
            needless = set() if variant.taps else {"shadow_atlas"}
            needless |= set() if variant.particle_shadow else {"particle_shadow_atlas"}
            if not (variant.taps or variant.particle_shadow or lights.kind != "directional"):
                needless |= {"distance", "position", "depth", "depth_copy"}
            textures = textures_of(images, (name for name in step.reads if name not in needless))
            if variant.taps:
                textures["u_shadow_maps"] = gpu.shadow_table(plan)
            if variant.method == "loop":
                _draw_loop(gpu, plan, program, textures, lights, variant, key)
            elif variant.method == "clustered":
                gpu.ctx.enable_only(moderngl.BLEND)
                # a record for each bit: to look the light's number up first would cost a tenth of the pass
                cells = plan.clusters[index]
                table = light_table(gpu, plan, lights, variant, key, cells.members)
                draw_clustered(gpu, plan, program, textures | {"u_lights": table}, cells, key)
            else:
                program.use(None, textures)
                tested = bool({"depth", "half_depth"} & set(step.updates))
                draw_volumes(gpu, plan, program, lights, variant, key, tested)
            gpu.lights_drawn += len(lights)


def method_for(chosen: DrawMethod, lights: LightSet) -> DrawMethod:
    """How a set is drawn by what was chosen: volumes are spheres, cones, or the full screen."""
    return lights.proxy if chosen == "sphere" else chosen


def variant_for(frame: LightVariant, lights: LightSet) -> LightVariant:
    """The frame's variant, with what is the set's own."""
    placed = lights.kind != "directional" or lights.shadowed or lights.particle_shadowed
    return replace(
        shining(frame, lights),
        method=method_for(frame.method, lights),
        position=frame.position if placed else "distance",
    )


def shining(frame: Shines, lights: LightSet) -> Shines:
    """A frame's variant with how a set's lights fade, and what shadows they have."""
    fades = lights.kind != "directional"
    return replace(
        frame,
        falloff=lights.falloff.value if fades else "ramp_squared",
        range_falloff=frame.range_falloff if fades and lights.falloff.value == "attenuation" else "karis",
        taps=frame.taps if lights.shadowed else 0,
        particle_shadow=frame.particle_shadow and lights.particle_shadowed,
    )


def draw_volumes(
    gpu: Gpu,
    plan: FramePlan,
    program: Program,
    lights: LightSet,
    variant: LightVariant | Variant,
    key: str,
    tested: bool,
    lines: bool = False,
) -> None:
    """One instanced draw: a volume, or a full-screen triangle, for each light; `program` is in use.

    Parameters
    ----------
    variant : Variant
        Has the field ``method``.
    key : str
        Names the buffer of the lights' records.
    tested : bool
        Draw only where a volume's back faces lie behind the surface.
    lines : bool
        Draw the edges of all faces instead, tested for being before the surface.
    """
    method: DrawMethod = variant.method  # type: ignore[union-attr]
    if lines and method == "fullscreen":
        return  # no particle_shadow: it has no edges
    record, given = RECORD_OF_KIND[lights.kind], defines(variant)
    rows = light_rows(record, given, lights, plan.view)
    buffer = gpu.stream(key, rows)
    content = program.attributes_of(buffer, record_dtype(record, given), per_instance=True)
    if method == "fullscreen":
        gpu.ctx.enable_only(moderngl.BLEND)
        gpu.render(gpu.array(key, program, content), moderngl.TRIANGLES, vertices=3, instances=len(lights))
        return
    name = plan.settings.volume_proxy if method == "sphere" else "cone"
    mesh = proxy_mesh(name)
    corners = gpu.fixed(f"unit {name}", mesh)
    enabled = moderngl.BLEND | (moderngl.DEPTH_TEST if tested else moderngl.NOTHING)
    gpu.ctx.enable_only(enabled if lines else enabled | moderngl.CULL_FACE)
    gpu.ctx.cull_face = "front"
    gpu.ctx.wireframe = lines
    gpu.ctx.depth_func = ">=" if plan.view.reverse is lines else "<="
    if not lines:
        gpu.ctx.polygon_offset = 0.0, -BEHIND if plan.view.reverse else BEHIND
    gpu.device.set_depth_clamp(True)
    array = gpu.array(key, program, (corners, "3f", "in_position"), content)
    gpu.render(array, moderngl.TRIANGLES, vertices=len(mesh), instances=len(lights))
    gpu.device.set_depth_clamp(False)
    gpu.ctx.polygon_offset = 0.0, 0.0
    gpu.ctx.wireframe = False
    gpu.ctx.cull_face = "back"
    gpu.ctx.depth_func = "<"


def draw_clustered(
    gpu: Gpu,
    plan: FramePlan,
    program: Program,
    textures: dict[str, moderngl.Texture],
    clusters: Clusters,
    key: str,
) -> None:
    """One full-screen triangle whose shader walks the lights of each pixel's cell; `key` names the lists."""
    lists = cluster_lists(clusters, plan.view.lens.perspective)
    tables = {
        "u_slices": gpu.tables.write(f"slices {key}", lists.slices),
        "u_words": gpu.tables.write(f"words {key}", lists.words),
    }
    uniforms = {
        "u_slice_count": lists.number,
        "u_slicing": lists.slicing,
        "u_tiling": lists.tiling,
        "u_places": lists.places,
    }
    program.use(uniforms, textures | tables)
    gpu.render(gpu.array("fullscreen", program), moderngl.TRIANGLES, vertices=3)


def shadow_textures(
    gpu: Gpu, plan: FramePlan, images: BoundImages, variant: ForwardVariant | ParticleLightVariant
) -> dict[str, moderngl.Texture]:
    """What a shader looks shadows up in, of surfaces and of particles, as far as its variant does."""
    textures: dict[str, moderngl.Texture] = {}
    if variant.taps:
        textures["u_shadow_atlas"] = images.read("shadow_atlas")
        textures["u_shadow_maps"] = gpu.shadow_table(plan)
    if variant.particle_shadow:
        textures["u_particle_shadow_atlas"] = images.read("particle_shadow_atlas")
    return textures


def light_table(
    gpu: Gpu,
    plan: FramePlan,
    lights: LightSet,
    variant: Variant,
    key: str,
    order: NDArray[np.int32] | None = None,
) -> moderngl.Texture:
    """The records of lights as a texture, for shaders that fetch them by their number; `key` names it.

    With `order`, shape (n,), the number is a place in that, which has the light's own.
    """
    rows = light_rows(RECORD_OF_KIND[lights.kind], defines(variant), lights, plan.view)
    return gpu.tables.write(f"lights {key}", light_texels(rows if order is None else rows[order]))


def _draw_loop(
    gpu: Gpu,
    plan: FramePlan,
    program: Program,
    textures: dict[str, moderngl.Texture],
    lights: LightSet,
    variant: LightVariant,
    key: str,
) -> None:
    """One full-screen triangle whose shader walks all lights, read from a texture; several for very many."""
    gpu.ctx.enable_only(moderngl.BLEND)
    for index, part in enumerate(lights.parts()):
        table = light_table(gpu, plan, part, variant, f"{key} {index}")
        program.use({"u_light_count": len(part)}, textures | {"u_lights": table})
        gpu.render(gpu.array("fullscreen", program), moderngl.TRIANGLES, vertices=3)
