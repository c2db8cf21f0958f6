"""Draws of lights: a volume for each light, or one full-screen triangle whose shader walks many.

Volumes are drawn as back faces with depth test greater-equal, so that the camera may stand inside and what
lies before a volume costs nothing, and with depth clamp, so that no plane cuts a volume open.
"""

from __future__ import annotations

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
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.plan.lights.clusters import Clusters
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.variants import DrawMethod, Variant, defines

BEHIND = 4.0
"""Steps of depth by which a volume's back faces are moved away from the eye. Volume and surface are rounded
each by itself: where few steps are left, a back face could come out before a surface that it lies behind."""


def draw_volumes(
    gpu: Gpu,
    plan: FramePlan,
    program: Program,
    lights: LightSet,
    variant: Variant,
    method: DrawMethod,
    key: str,
    tested: bool,
    lines: bool = False,
) -> None:
    """Draw a volume, or a full-screen triangle, for each light in one instanced draw; `program` is in use.

    Parameters
    ----------
    method : {"sphere", "cone", "fullscreen"}
    key : str
        Names the buffer of the lights' records.
    tested : bool
        Draw only where a volume's back faces lie behind the surface.
    lines : bool
        Draw the edges of all faces instead, as far as no surface hides them.
    """
    if lines and method == "fullscreen":
        return  # no volume: it has no edges
    record, given = RECORD_OF_KIND[lights.kind], defines(variant)
    buffer = gpu.stream(key, light_rows(record, given, lights, plan.view))
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
    """Draw a full-screen triangle whose shader walks the lights of each pixel's cell.

    `key` names the lists.
    """
    lists = cluster_lists(clusters, plan.view.lens.perspective)
    tables = {
        "u_slices": gpu.tables.write(f"slices {key}", lists.slices),
        "u_masks": gpu.tables.write(f"masks {key}", lists.masks),
    }
    uniforms = {
        "u_slice_count": lists.number,
        "u_slicing": lists.slicing,
        "u_tiling": lists.tiling,
        "u_first_lines": lists.first_lines,
    }
    program.use(uniforms, textures | tables)
    gpu.render(gpu.array("fullscreen", program), moderngl.TRIANGLES, vertices=3)


def draw_loop(
    gpu: Gpu,
    plan: FramePlan,
    program: Program,
    textures: dict[str, moderngl.Texture],
    lights: LightSet,
    variant: Variant,
    key: str,
) -> None:
    """Draw a full-screen triangle whose shader walks all lights, read from a texture.

    Very many lights take several draws.
    """
    gpu.ctx.enable_only(moderngl.BLEND)
    for index, part in enumerate(lights.parts()):
        table = light_table(gpu, plan, part, variant, f"{key} {index}")
        program.use({"u_light_count": len(part)}, textures | {"u_lights": table})
        gpu.render(gpu.array("fullscreen", program), moderngl.TRIANGLES, vertices=3)


def light_table(
    gpu: Gpu,
    plan: FramePlan,
    lights: LightSet,
    variant: Variant,
    key: str,
    order: NDArray[np.int32] | None = None,
) -> moderngl.Texture:
    """Return the records of lights as a texture, for shaders that fetch them by number; `key` names it.

    With `order`, shape (n,), the number is an index into that, which holds the light's own.
    """
    rows = light_rows(RECORD_OF_KIND[lights.kind], defines(variant), lights, plan.view)
    return gpu.tables.write(f"lights {key}", light_texels(rows if order is None else rows[order]))


def shadow_textures(
    gpu: Gpu, plan: FramePlan, images: BoundImages, taps: int, particle_shadow: bool
) -> dict[str, moderngl.Texture]:
    """Return what a shader looks shadows up in, of surfaces if it has `taps`, and of particles."""
    textures: dict[str, moderngl.Texture] = {}
    if taps:
        textures["u_shadow_atlas"] = images.read("shadow_atlas")
        textures["u_shadow_maps"] = gpu.shadow_table(plan)
    if particle_shadow:
        textures["u_particle_shadow_atlas"] = images.read("particle_shadow_atlas")
    return textures
