"""Draws that passes share: a full-screen triangle, a batch of surfaces, and lights.

Lights are drawn as a volume each, or by one full-screen triangle whose shader walks many. Volumes are drawn
as back faces with depth test greater-equal, so that the camera may be inside and surfaces in front of a
volume cost nothing, and with depth clamp, so that no plane cuts a volume open.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.light_records import RECORD_OF_KIND, light_rows, light_texels, record_dtype
from firefly_sample.gpu.proxies import proxy_mesh
from firefly_sample.plan.frame_plan import Batch, FramePlan, PassPlan
from firefly_sample.plan.lights.clusters import MOST_SLICES, TEXEL, Clusters
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.variants import DrawMethod, Variant, defines

if TYPE_CHECKING:
    import moderngl

    from firefly_sample.gpu.gpu import Gpu
    from firefly_sample.gpu.images import BoundImages
    from firefly_sample.gpu.programs import Program
    from firefly_sample.gpu.uploads import TextureSource

BEHIND = 4.0
"""Steps of depth by which a volume's back faces are moved away from the eye. The depths of volume and surface
are rounded separately: where few steps are left, a back face could end up in front of a surface that it is
behind."""

COLORED = frozenset(("emission", "modulate"))
"""Maps whose texels are colours; those of the others are numbers."""


def draw_fullscreen(
    gpu: Gpu,
    step: PassPlan,
    images: BoundImages,
    flags: int = 0,
    textures: Mapping[str, moderngl.Texture] | None = None,
    folder: Path | None = None,
) -> None:
    """Run a pass's fragment shader once over every pixel, with the targets that it reads and `textures`.

    Parameters
    ----------
    flags : int
        moderngl's, for example moderngl.BLEND.
    folder : Path, optional
        Where the shader is, if not in the package.
    """
    images.draw_into()
    gpu.ctx.enable_only(flags)
    program = gpu.programs.get(step.name, step.variant, images.color_names(), "fullscreen", folder)
    program.use(None, images.samplers() | dict(textures or {}))
    gpu.draw_screen(program)


class Drawable(NamedTuple):
    """A batch that is on the GPU, and the objects that draw it."""

    batch: Batch
    program: Program
    textures: dict[str, moderngl.Texture]
    array: moderngl.VertexArray
    point_size: float  # samples across a point
    reverse: bool  # True if a nearer surface has the larger depth


def make_drawable(
    gpu: Gpu, plan: FramePlan, batch: Batch, program: Program, array: moderngl.VertexArray | None = None
) -> Drawable:
    """Bring a batch's mesh, instances and those textures that the program samples up to date.

    With `array`, mesh and instances are in that.
    """
    textures = {}
    if batch.texture is not None:
        cutoff = batch.alpha_cutoff if batch.surface.cutout else None
        textures["u_texture"] = texture_of(gpu, plan, batch.texture, cutoff)
    for name, found in batch.maps.named():
        sampler = f"u_{name}_texture"
        if program.samples(sampler):
            textures[sampler] = texture_of(gpu, plan, found.texture, None, name in COLORED)
    point_size = batch.render_mode.thickness * plan.settings.supersample
    vertices = array or gpu.uploads.drawable(batch, program)
    return Drawable(batch, program, textures, vertices, point_size, plan.view.reverse)


def texture_of(
    gpu: Gpu, plan: FramePlan, texture: TextureSource, cutoff: float | None, colors: bool = True
) -> moderngl.Texture:
    """Return a texture as a plan's look samples it; `cutoff` is the limit of an alpha test, if there is one.

    `colors` says whether its texels are colours, which the look "correct" decodes before they are filtered.
    """
    look = plan.settings.look
    if look in ("pyrender", "flat", "panda3d") and cutoff is None:
        return gpu.uploads.byte_texture(texture)
    return gpu.uploads.texture(texture, cutoff, not colors or look != "correct")


def surface_uniforms(drawable: Drawable) -> dict[str, object]:
    """Return the uniforms of a batch's own."""
    batch, uniforms = drawable.batch, dict[str, object]()
    if batch.surface.cutout:
        uniforms["u_alpha_cutoff"] = batch.alpha_cutoff
    if "u_normal_texture" in drawable.textures:
        uniforms["u_normal_scale"] = batch.maps.normal_scale
        uniforms["u_handedness"] = -1.0 if batch.mirrored else 1.0
    if "u_occlusion_texture" in drawable.textures:
        uniforms["u_occlusion_strength"] = batch.maps.occlusion_strength
    return uniforms


def draw_surface(
    gpu: Gpu,
    drawable: Drawable,
    flags: int,
    uniforms: Mapping[str, object],
    textures: Mapping[str, moderngl.Texture],
    part: tuple[int, int] = (0, -1),
) -> None:
    """Draw a batch with its own uniforms and textures and these; `flags` are moderngl's, without culling.

    `part` is the first vertex, and the number of them; -1 for all.
    """
    batch, ctx = drawable.batch, gpu.ctx
    ctx.enable_only(flags | (ctx.NOTHING if batch.surface.double_sided else ctx.CULL_FACE))
    ctx.front_face = "cw" if batch.mirrored else "ccw"
    drawable.program.use({**uniforms, **surface_uniforms(drawable)}, {**drawable.textures, **textures})
    first, count = part
    if batch.geom.mode == "points":
        ctx.point_size = drawable.point_size
    modes = {"triangles": ctx.TRIANGLES, "lines": ctx.LINES, "points": ctx.POINTS}
    wireframe, offset = batch.render_mode.mode == "wireframe", batch.depth_offset
    try:
        if wireframe:
            ctx.wireframe = True
        if offset:
            steps = float(offset if drawable.reverse else -offset)
            ctx.polygon_offset = steps, steps
        gpu.render(drawable.array, modes[batch.geom.mode], vertices=count, first=first)
    finally:
        if wireframe:
            ctx.wireframe = False
        if offset:
            ctx.polygon_offset = 0.0, 0.0


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

    `key` names the buffer of the lights' records. If `tested`, draw only where a volume's back faces are
    behind the surface; with `lines`, draw the edges of all faces instead, as far as no surface hides them.
    """
    if lines and method == "fullscreen":
        return  # no volume: it has no edges
    record, given, ctx = RECORD_OF_KIND[lights.kind], defines(variant), gpu.ctx
    buffer = gpu.streams.buffer(key, light_rows(record, given, lights, plan.view))
    content = program.attributes_of(buffer, record_dtype(record, given), per_instance=True)
    if method == "fullscreen":
        ctx.enable_only(ctx.BLEND)
        gpu.render(gpu.array(key, program, content), ctx.TRIANGLES, vertices=3, instances=len(lights))
        return
    name = plan.settings.volume_proxy if method == "sphere" else "cone"
    mesh = proxy_mesh(name)
    corners = gpu.fixed(f"unit {name}", mesh), "3f", "in_position"
    enabled = ctx.BLEND | (ctx.DEPTH_TEST if tested else ctx.NOTHING)
    ctx.enable_only(enabled if lines else enabled | ctx.CULL_FACE)
    ctx.cull_face = "front"
    ctx.wireframe = lines
    ctx.depth_func = ">=" if plan.view.reverse is lines else "<="
    if not lines:
        ctx.polygon_offset = 0.0, -BEHIND if plan.view.reverse else BEHIND
    gpu.device.set_depth_clamp(True)
    array = gpu.array(key, program, corners, content)
    gpu.render(array, ctx.TRIANGLES, vertices=len(mesh), instances=len(lights))
    gpu.device.set_depth_clamp(False)


def draw_clustered(
    gpu: Gpu,
    plan: FramePlan,
    program: Program,
    textures: dict[str, moderngl.Texture],
    clusters: Clusters,
    key: str,
) -> None:
    """Draw a full-screen triangle whose shader loops over the lights of each pixel's cell.

    `key` names the textures of the lists.
    """
    uniforms, tables = cell_tables(gpu, plan, clusters, key)
    gpu.ctx.enable_only(gpu.ctx.BLEND)
    program.use(uniforms, textures | tables)
    gpu.draw_screen(program)


def cell_tables(
    gpu: Gpu, plan: FramePlan, clusters: Clusters, key: str
) -> tuple[dict[str, object], dict[str, moderngl.Texture]]:
    """Return the uniforms and the textures by which a shader finds the lights of a cell.

    `key` names the textures of the lists. A texel of "slices" is a slice: its nearer and its farther edge, as
    the bits of float32; the index of its first mask word, and that of the next slice. A row of "masks" is one
    line of tiles (a column, row or diagonal of the grid); a texel is four words of its bit masks.
    """
    grid = clusters.grid
    edges = grid.edges.astype(np.float32)
    bits, first = edges.view(np.uint32), clusters.first_words
    # as wide for every number of slices, so that the texture stays
    slices = np.zeros((1, MOST_SLICES, 4), dtype=np.uint32)
    slices[0, : grid.slices] = np.stack([bits[:-1], bits[1:], first[:-1], first[1:]], axis=1)
    masks = clusters.masks.reshape(len(clusters.masks), -1, TEXEL)
    low, high = (
        math.log2(edge) if plan.view.lens.perspective else edge for edge in (grid.edges[0], grid.edges[-1])
    )
    scale = grid.slices / (high - low)
    tables = {
        "u_slices": gpu.streams.texture(f"slices {key}", slices),
        "u_masks": gpu.streams.texture(f"masks {key}", masks),
    }
    uniforms: dict[str, object] = {
        "u_slice_count": grid.slices,
        # from log2 of the distance (orthographic: the distance) to a slice's number; first and last edge
        "u_slicing": (scale, -low * scale, float(edges[0]), float(edges[-1])),
        "u_tiling": (grid.tile, *grid.tiles),
        "u_first_lines": grid.first_lines,
    }
    return uniforms, tables


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
    gpu.ctx.enable_only(gpu.ctx.BLEND)
    for index, part in enumerate(lights.parts()):
        table = light_table(gpu, plan, part, variant, f"{key} {index}")
        program.use({"u_light_count": len(part)}, textures | {"u_lights": table})
        gpu.draw_screen(program)


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
    return gpu.streams.texture(f"lights {key}", light_texels(rows if order is None else rows[order]))


def shadow_textures(
    gpu: Gpu, plan: FramePlan, images: BoundImages, taps: int, particle_shadow: bool
) -> dict[str, moderngl.Texture]:
    """Return the textures in which a shader with these `taps` looks up shadows of surfaces and particles."""
    textures: dict[str, moderngl.Texture] = {}
    if taps:
        textures["u_shadow_atlas"] = images.read("shadow_atlas")
        textures["u_shadow_maps"] = gpu.shadow_table(plan)
    if particle_shadow:
        textures["u_particle_shadow_atlas"] = images.read("particle_shadow_atlas")
    return textures
