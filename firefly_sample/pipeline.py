"""The passes in drawing order, and plans that are made of them."""

from __future__ import annotations

from firefly_sample.passes import (
    forward,
    fullscreen,
    geometry,
    light_views,
    lights,
    particle_shadows,
    particles,
    shadow_maps,
    transparency,
)
from firefly_sample.passes.base import Pass
from firefly_sample.plan.build import Planner
from firefly_sample.plan.frame_plan import Capabilities, FramePlan
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

PASSES: tuple[type[Pass], ...] = (
    shadow_maps.ShadowMapsPass,
    particle_shadows.ParticleShadowSlicesPass,
    particle_shadows.ParticleShadowSumsPass,
    particle_shadows.ParticleShadowBlurXPass,
    particle_shadows.ParticleShadowBlurYPass,
    geometry.GeometryPass,
    geometry.InterpolationPass,
    forward.ForwardPass,
    fullscreen.DepthCopyPass,
    fullscreen.HalfDepthPass,
    fullscreen.AmbientPass,
    lights.DirectionalLightsPass,
    lights.PointLightsPass,
    lights.SpotlightsPass,
    fullscreen.UpsamplePass,
    particles.ParticleLightPass,
    particles.ParticlesPass,
    particles.SpritesPass,
    transparency.TransparencyPass,
    light_views.OverdrawPass,
    light_views.VolumesPass,
    light_views.WireframePass,
    fullscreen.ResolvePass,
    particle_shadows.ParticleShadowTexturePass,
)
"""Every pass in drawing order; a plan holds those that its frame needs."""


def build_plan(
    scene: Scene,
    settings: Settings | None = None,
    size: tuple[int, int] = (800, 600),
    outputs: tuple[str, ...] = ("color",),
    time: float = 0.0,
    capabilities: Capabilities | None = None,
    passes: tuple[type[Pass], ...] = PASSES,
) -> FramePlan:
    """Return the plan of one frame; nothing is drawn, and no driver is needed.

    Parameters
    ----------
    scene : Scene
        It is updated to `time` first.
    settings : Settings, optional
    size : (int, int)
        Width and height of the picture in pixels.
    outputs : tuple of str
        Names from `firefly_sample.frame.OUTPUTS`.
    time : float
        Seconds.
    capabilities : Capabilities, optional
        What the driver can do; everything when absent.
    passes : tuple of Pass classes
        In drawing order.

    Raises
    ------
    FireflyError
        If the size, an output, a light, the camera or the lens is wrong; the message names it.
    """
    planner = Planner([kind() for kind in passes])
    return planner.plan(scene, settings or Settings(), size, outputs, time, capabilities or Capabilities())
