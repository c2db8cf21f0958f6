"""What a plan has to say to its user."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from firefly_sample.plan.collect import LightNode, Snapshot
from firefly_sample.plan.instances import Group
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.needs import NORMAL_OUTPUTS, PLACE_OUTPUTS, Needs, asked
from firefly_sample.plan.particles.cloud import Cloud
from firefly_sample.scene.lights import AmbientLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.node import PandaNode

LARGEST_RADIANCE = {"rgba16f": 65504.0, "r11g11b10f": 64512.0, "rgba8": 1.0}
"""The largest number of each setting `accumulation`, float32 apart; of the second, that of blue."""


def plan_warnings(
    needs: Needs,
    snapshot: Snapshot,
    in_scene: int,
    sets: Sequence[LightSet] = (),
    cloud: Cloud | None = None,
    found: Iterable[str] = (),
) -> tuple[str, ...]:
    """One line each for what is drawn otherwise than the scene or the settings ask.

    Parameters
    ----------
    in_scene : int
        Lights that are attached and not hidden, ambient ones apart.
    sets : sequence of LightSet
        The lights in view.
    cloud : Cloud, optional
        The particles.
    found : iterable of str
        Lines of other modules, on the lens and on positions, to be given with the rest.
    """
    warnings: list[str] = []
    blended = dict.fromkeys(
        material.name
        for group in snapshot.groups
        for material in group.materials
        if _is_blended(group, material)
    )
    if blended:
        warnings.append(
            f"blended materials are drawn as cut-outs: {', '.join(blended)} "
            "(deferred shading keeps one surface a pixel)"
        )
    if needs.settings.position == "depth32f" and not needs.capabilities.clip_control:
        warnings.append(
            "position=depth32f: the driver lacks ARB_clip_control, so depth is a standard 24-bit buffer, "
            "as accurate as depth24; use position=linear32f, which is accurate here"
        )
    wanted = needs.lit or asked(needs.outputs, (*PLACE_OUTPUTS, *NORMAL_OUTPUTS))
    if needs.settings.interpolation == "float64" and not needs.capabilities.float64 and wanted:
        warnings.append(
            "interpolation=float64: the driver lacks ARB_gpu_shader_fp64, so the rasterizer interpolates"
        )
    warnings.extend(found)
    if needs.lit and not needs.classic and (clipped := _accumulation_warning(needs, sets)):
        warnings.append(clipped)
    if cloud is not None:
        warnings.extend(_particle_warnings(needs, snapshot, cloud))
    if needs.classic and needs.picture:
        left_out = [
            what
            for what, there in (
                ("highlights", needs.shiny and needs.lights),
                ("emission", needs.emissive),
                ("particles", snapshot.particles),
                ("ambient colours of materials", needs.own_ambient and needs.ambient),
                ("shadows", any(node.is_shadow_caster() for node, _ in snapshot.lights)),
            )
            if there
        ]
        if left_out:
            warnings.append(f"look 'classic' leaves out, as the original does: {', '.join(left_out)}")
    if (needs.geometry or needs.hazy) and needs.picture and not (in_scene or snapshot.ambient):
        warnings.extend(_darkness(snapshot))
    return tuple(warnings)


def _is_blended(group: Group, material: Material) -> bool:
    """Return whether a material is marked for blending and some instance of it is not opaque."""
    if material.alpha_mode != "blend":
        return False
    if group.vertex_alpha or (group.texture is not None and group.texture.least_alpha() < 1.0):
        return True
    alphas = group.factors().base_colors[group.which == group.materials.index(material), 3]
    return bool((alphas < 1.0).any())


def _darkness(snapshot: Snapshot) -> Iterator[str]:
    """Yield a line on a scene that nothing lights, unless something in it shines by itself."""
    materials = (material for group in snapshot.groups for material in group.materials)
    if snapshot.sprites or any(any(material.emission) for material in materials):
        return
    nodes = snapshot.root.node().iter_descendants() if snapshot.root is not None else ()
    # an empty PointLights that is not hidden is no light either
    hidden = not snapshot.lights and any(isinstance(node, LightNode | AmbientLight) for node in nodes)
    why = "every light of the scene is hidden" if hidden else "the scene has no light"
    how = "show one, or attach" if hidden else "attach"
    yield (
        f"{why}, so that its surfaces are black: {how} a PointLight, a DirectionalLight or an AmbientLight "
        "under its root"
    )


def _particle_warnings(needs: Needs, snapshot: Snapshot, cloud: Cloud) -> Iterator[str]:
    """Lines on particles whose shadows are not as they should be."""
    if needs.particle_shadow is not None:
        for name, count, radius in cloud.outside:
            yield (
                f"particles {name!r}: {count:,} of them leave the bounding sphere that was given, and are "
                "shadowed as if they lay on its rim, or not at all: give a bounding radius of "
                f"{1.001 * radius:.4g}, or none, so that it is found"
            )
    shadow = cloud.shadow
    if shadow is not None and cloud.shadow_net is None and not _holds(snapshot, shadow.light):
        yield (
            f"light {shadow.light.name!r}, which particles take shadows from, is not in the scene: attach "
            "it, or they stay without"
        )


def _holds(snapshot: Snapshot, light: PandaNode) -> bool:
    """Whether a light is in the scene, hidden or not."""
    return snapshot.root is not None and any(
        node is light for node in snapshot.root.node().iter_descendants()
    )


def _accumulation_warning(needs: Needs, sets: Sequence[LightSet]) -> str | None:
    """A line if the brightest light alone is more than what light is added up in can hold."""
    name = needs.settings.accumulation
    largest = LARGEST_RADIANCE.get(name)
    brightest = max((float(lights.colors.max()) for lights in sets if len(lights)), default=0.0)
    if largest is None or brightest <= largest:
        return None
    return (
        f"accumulation={name}: it holds radiance up to {largest:g} and a light has {brightest:g}, "
        "so that surfaces are cut off there; accumulation=rgba32f does not"
    )
