"""The passes in drawing order, and plans that are made of them."""

from __future__ import annotations

from firefly_sample.passes.ambient import AmbientPass
from firefly_sample.passes.base import Pass
from firefly_sample.passes.depths import DepthCopyPass, HalfDepthPass
from firefly_sample.passes.forward import ForwardPass
from firefly_sample.passes.geometry import GeometryPass, InterpolationPass
from firefly_sample.passes.light_views import OverdrawPass, VolumesPass, WireframePass
from firefly_sample.passes.lights import DirectionalLightsPass, PointLightsPass, SpotlightsPass
from firefly_sample.passes.particle_light import ParticleLightPass
from firefly_sample.passes.particle_shadows import (
    ParticleShadowBlurXPass,
    ParticleShadowBlurYPass,
    ParticleShadowSlicesPass,
    ParticleShadowSumsPass,
    ParticleShadowTexturePass,
)
from firefly_sample.passes.particles import ParticlesPass, SpritesPass
from firefly_sample.passes.resolve import ResolvePass
from firefly_sample.passes.shadow_maps import ShadowMapsPass
from firefly_sample.passes.upsample import UpsamplePass
from firefly_sample.plan.build import Planner
from firefly_sample.plan.frame_plan import Capabilities, FramePlan
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

PASSES: tuple[type[Pass], ...] = (
    ShadowMapsPass,
    ParticleShadowSlicesPass,
    ParticleShadowSumsPass,
    ParticleShadowBlurXPass,
    ParticleShadowBlurYPass,
    GeometryPass,
    InterpolationPass,
    ForwardPass,
    DepthCopyPass,
    HalfDepthPass,
    AmbientPass,
    DirectionalLightsPass,
    PointLightsPass,
    SpotlightsPass,
    UpsamplePass,
    ParticleLightPass,
    ParticlesPass,
    SpritesPass,
    OverdrawPass,
    VolumesPass,
    WireframePass,
    ResolvePass,
    ParticleShadowTexturePass,
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
    """Return the plan of one frame; nothing is drawn and no driver is needed.

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
