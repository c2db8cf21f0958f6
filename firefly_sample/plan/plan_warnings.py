"""Warnings of a plan: one line for each thing that is drawn otherwise than the scene or the settings ask."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from firefly_sample.memo import Memo
from firefly_sample.plan.collect import LightNode, Snapshot
from firefly_sample.plan.geometry_warnings import (
    Clipped,
    Extent,
    clipping_warnings,
    extent_warnings,
    find_clipped,
    find_extent,
)
from firefly_sample.plan.instances import Group
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.lights.lighting import Lighting
from firefly_sample.plan.needs import NORMAL_OUTPUTS, PICTURES, POSITION_OUTPUTS, Needs, asked
from firefly_sample.plan.particles.cloud import Cloud
from firefly_sample.plan.position_error import position_warnings
from firefly_sample.plan.view import Eye, View
from firefly_sample.plan.visible import Visible
from firefly_sample.scene.lights import AmbientLight

LARGEST_RADIANCE = {"rgba16f": 65504.0, "r11g11b10f": 64512.0, "rgba8": 1.0}
"""The largest number of each setting `accumulation_format` but float32; of r11g11b10f, that of blue."""


class PlanWarnings:
    """Finds the warnings of plans, and keeps those about geometry while the view stays the same."""

    def __init__(self) -> None:
        self._clipped: Memo[Clipped] = Memo()
        self._extent: Memo[Extent] = Memo()

    def find(
        self,
        needs: Needs,
        snapshot: Snapshot,
        eye: Eye,
        view: View,
        seen: Visible,
        lighting: Lighting,
        cloud: Cloud | None,
        exposure: tuple[float, float, float],
    ) -> tuple[str, ...]:
        """Return the warnings of a plan.

        The snapshot holds the nodes that the camera sees, `seen` the geometry in view, `cloud` all particles.
        """
        others = bool(needs.sprites or needs.particles)
        clipped = self._clipped.get(
            (seen, others), lambda: find_clipped(snapshot.instances, eye, seen, others)
        )
        extent = self._extent.get(seen, lambda: find_extent(seen, eye.planes, view.lens, view.near))
        return (
            *snapshot.warnings,
            *_blended_warnings(needs, snapshot),
            *_mark_warnings(needs, snapshot),
            *_thickness_warnings(snapshot),
            *_driver_warnings(needs),
            *eye.warnings,
            *clipping_warnings(clipped, eye, snapshot.id_names),
            *extent_warnings(extent, lighting.sets, view, seen.farthest, lighting.shadows.maps),
            *position_warnings(needs, eye, seen, lighting.sets, max(exposure)),
            *_accumulation_warnings(needs, lighting.sets),
            *_particle_warnings(needs, snapshot, cloud),
            *_classic_warnings(needs, snapshot),
            *_left_out_warnings(needs, snapshot),
            *_darkness_warnings(needs, snapshot, lighting.in_scene),
        )


def _blended_warnings(needs: Needs, snapshot: Snapshot) -> Iterator[str]:
    """Yield a line about blended materials where they are not drawn as such."""
    blended = dict.fromkeys(
        material.name for group in snapshot.groups if group.blended for material in group.materials
    )
    if blended and needs.classic:
        yield (
            f"look 'classic' draws blended materials as cut-outs: {', '.join(blended)} (nothing is drawn "
            "where alpha is below alpha_cutoff, 0.5 by default)"
        )
    data = [name for name in needs.outputs if name not in PICTURES]
    if blended and not needs.classic and data:
        yield (
            f"outputs {', '.join(data)} show the nearest opaque surface: blended materials are not in them: "
            f"{', '.join(blended)}"
        )


def _mark_warnings(needs: Needs, snapshot: Snapshot) -> Iterator[str]:
    """Yield a line about lines and points that would let through what is behind them."""
    marks = dict.fromkeys(
        group.geom.name for group in snapshot.groups if group.geom.mode != "triangles" and group.clear
    )
    if marks and needs.picture:
        yield f"lines and points are drawn opaque, not blended: {', '.join(marks)}"


def _thickness_warnings(snapshot: Snapshot) -> Iterator[str]:
    """Yield a line about lines and wireframes that a render mode would make thicker or thinner."""
    names = dict.fromkeys(group.geom.name for group in snapshot.groups if _is_thick(group))
    if names:
        yield (
            f"lines are one pixel wide, whatever the thickness of their render mode: {', '.join(names)} (the "
            "core profile of OpenGL draws no others; give them the thickness 1)"
        )


def _is_thick(group: Group) -> bool:
    mode, thickness = group.render_mode
    has_lines = group.geom.mode == "lines" or (group.geom.mode == "triangles" and mode == "wireframe")
    return has_lines and thickness != 1.0


def _driver_warnings(needs: Needs) -> Iterator[str]:
    """Yield lines about settings that the driver cannot follow."""
    if needs.position_method == "depth32f" and not needs.capabilities.clip_control:
        yield (
            "position_method=depth32f: the driver lacks ARB_clip_control, so depth is a standard 24-bit "
            "buffer, as accurate as depth24; use position_method=linear32f, which is accurate here"
        )
    wanted = needs.lit or asked(needs.outputs, (*POSITION_OUTPUTS, *NORMAL_OUTPUTS))
    if needs.settings.interpolation == "float64" and not needs.capabilities.float64 and wanted:
        yield "interpolation=float64: the driver lacks ARB_gpu_shader_fp64, so the rasterizer interpolates"


def _accumulation_warnings(needs: Needs, sets: Sequence[LightSet]) -> Iterator[str]:
    """Yield a line if the brightest light alone exceeds the range of the accumulation format."""
    name = needs.settings.accumulation_format
    largest = LARGEST_RADIANCE.get(name)
    if largest is None or not needs.lit or needs.classic:
        return
    brightest = max((float(lights.colors.max()) for lights in sets if len(lights)), default=0.0)
    if brightest > largest:
        yield (
            f"accumulation_format={name}: it holds radiance up to {largest:g} and a light has {brightest:g}, "
            "so surfaces are clipped to that; use accumulation_format=rgba32f, which has no such limit"
        )


def _particle_warnings(needs: Needs, snapshot: Snapshot, cloud: Cloud | None) -> Iterator[str]:
    """Yield lines about particles whose shadows are wrong or missing."""
    if cloud is None:
        return
    if needs.particle_shadow is not None:
        for name, count, radius in cloud.outside:
            yield (
                f"particles {name!r}: {count:,} of them leave the bounding sphere that was given, and are "
                "shadowed as if they lay on its surface, or not at all: give a bounding radius of "
                f"{1.001 * radius:.4g}, or none, so that it is found"
            )
    shadow, nodes = cloud.shadow, snapshot.root.node().iter_descendants()
    # a hidden light needs no warning
    if shadow is not None and cloud.shadow_net is None and not any(node is shadow.light for node in nodes):
        yield (
            f"light {shadow.light.name!r}, which casts the shadows of particles, is not in the scene: "
            "attach it, or there are no such shadows"
        )


def _classic_warnings(needs: Needs, snapshot: Snapshot) -> Iterator[str]:
    if not (needs.classic and needs.picture):
        return
    features = {
        "highlights": needs.looks.shiny and needs.lights,
        "emission": needs.looks.emissive,
        "particles": snapshot.particles,
        "ambient colours of materials": needs.looks.own_ambient and needs.ambient,
        "shadows": any(node.is_shadow_caster() for node, _ in snapshot.lights),
    }
    left_out = [name for name, used in features.items() if used]
    if left_out:
        yield f"look 'classic' leaves out, as the original does: {', '.join(left_out)}"


def _left_out_warnings(needs: Needs, snapshot: Snapshot) -> Iterator[str]:
    """Yield a line about dots and particles in a look that has none."""
    names = dict.fromkeys(node.name for node, _ in (*snapshot.sprites, *snapshot.particles))
    if names and needs.picture and (needs.pyrender or needs.flat or needs.panda3d):
        yield f"look {needs.settings.look!r} leaves out dots and particles: {', '.join(names)}"


def _darkness_warnings(needs: Needs, snapshot: Snapshot, in_scene: int) -> Iterator[str]:
    """Yield a line about a scene without light, unless something in it emits light."""
    if in_scene or snapshot.ambient or needs.flat or not needs.picture:
        return
    if not (needs.geometry or needs.draws_particles):
        return
    materials = (material for group in snapshot.groups for material in group.materials)
    shown = (each.emission.any() or (each.unlit and not needs.classic) for each in materials)
    if snapshot.sprites or any(shown):
        return
    if not needs.draws_particles and not needs.classic and all(group.unlit for group in snapshot.groups):
        return
    nodes = snapshot.root.node().iter_descendants()
    # an empty PointLights that is not hidden is no light either
    hidden = not snapshot.lights and any(isinstance(node, LightNode | AmbientLight) for node in nodes)
    why = "every light of the scene is hidden" if hidden else "the scene has no light"
    how = "show one, or attach" if hidden else "attach"
    yield (
        f"{why}, so that its surfaces are black: {how} a PointLight, a DirectionalLight or an AmbientLight "
        "under its root"
    )
