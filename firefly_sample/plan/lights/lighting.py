"""The lights of one frame: which there are, which are in view, how each is drawn, and their shadow maps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from firefly_sample.plan.camera import Eye
from firefly_sample.plan.collect import Snapshot
from firefly_sample.plan.lights.bounds import meet_samples
from firefly_sample.plan.lights.gather import choose_proxies, cut_off, in_view, world_lights
from firefly_sample.plan.lights.light_set import LightKind, LightSet
from firefly_sample.plan.shadows.planner import ShadowPlan, ShadowPlanner, no_maps
from firefly_sample.plan.shadows.views import Sight
from firefly_sample.plan.view import View
from firefly_sample.plan.visible import Visible
from firefly_sample.scene.light import Light
from firefly_sample.settings import PositionMethod, Settings

OFF_RAY: frozenset[PositionMethod] = frozenset({"stored16f", "stored32f", "inverse_matrix"})
"""Methods that may find a surface beside the line of sight that it was seen on: of a giant triangle, what a
rasterizer interpolates is some samples off. Forward shading takes its places from there, too."""


@dataclass(frozen=True, eq=False)
class Lighting:
    """See the attributes' own classes.

    Attributes
    ----------
    in_scene : int
        Lights that are attached and not hidden, ambient ones apart.
    sets : tuple of LightSet
        Those that can change what is seen, in drawing order.
    shadows : ShadowPlan
    """

    in_scene: int
    sets: tuple[LightSet, ...]
    shadows: ShadowPlan

    def endless(self) -> dict[LightKind, int]:
        """How many lights of each kind are drawn over the full screen because they end nowhere."""
        counts: dict[LightKind, int] = {}
        for lights in self.sets:
            if lights.kind != "directional" and lights.proxy == "fullscreen":
                number = int(np.isinf(lights.reaches).sum())
                counts[lights.kind] = counts.get(lights.kind, 0) + number
        return counts

    def counts(self, shadowed: bool = False, clouded: bool = False) -> dict[LightKind, int]:
        """How many lights of each kind are drawn; kinds without any left out.

        With `shadowed`, of those that have shadow maps, with `clouded`, that particles take some of.
        """
        counts: dict[LightKind, int] = {}
        for lights in self.sets:
            if (lights.shadowed or not shadowed) and (lights.clouded or not clouded):
                counts[lights.kind] = counts.get(lights.kind, 0) + len(lights)
        return counts


def light_scene(
    snapshot: Snapshot,
    snapshot_for: Callable[[int], Snapshot],
    planner: ShadowPlanner,
    settings: Settings,
    time: float,
    eye: Eye,
    seen: Visible,
    exposure: tuple[float, float, float],
    view: View,
    dimmed: Light | None = None,
) -> Lighting:
    """Plan the lights of a frame.

    Parameters
    ----------
    snapshot : Snapshot
        What the camera's walk found.
    snapshot_for : callable
        Gives what a camera with a mask sees.
    planner : ShadowPlanner
        Keeps shadow maps from frame to frame.
    eye : Eye
        Of the camera.
    seen : Visible
        The geometry in view.
    view : View
        The same camera, with the samples that it draws.
    dimmed : Light, optional
        The one that particles take some of.

    Raises
    ------
    LightError
        If a light's place or direction is not finite, or the shadow maps do not fit their atlas.
    """
    world, sources = world_lights(snapshot, time, dimmed)
    shiny = bool(snapshot.instances.factors().speculars[:, :3].any())
    world = cut_off(world, settings, exposure, shiny)
    lens, camera = eye.lens, eye.camera
    visible = [in_view(lights, camera.world_to_view, eye.planes) for lights in world]
    on_ray = settings.position not in OFF_RAY and settings.light_method != "forward"
    if on_ray and not snapshot.particles:
        visible = [_met(lights, view) for lights in visible]
    shadows, maps = ShadowPlan(), no_maps(len(sources))
    if sources and len(seen) and settings.look != "classic":
        sight = Sight(
            view_to_world=camera.view_to_world,
            lens=lens,
            nearest=max(lens.get_near(), seen.nearest),
            farthest=min(lens.get_far(), seen.farthest),
            receivers=snapshot.spheres,
        )
        wanted = {int(index) for lights in visible for index in lights.casters if index >= 0}
        shadows, maps = planner.plan(
            world,
            sources,
            wanted,
            sight,
            settings.shadow_atlas,
            settings.shadow_resolution,
            view.reverse,
            snapshot_for,
        )
    sets: list[LightSet] = []
    for lights in visible:
        # the index -1, of lights that cast none, finds the row that is appended
        casters, count = np.concatenate([maps, no_maps(1)])[lights.casters].T
        sets.extend(choose_proxies(replace(lights, casters=casters, maps=count), eye.corners))
    return Lighting(sum(map(len, world)), tuple(sets), shadows)


def _met(lights: LightSet, view: View) -> LightSet:
    """Those of a set in view that a line of sight meets."""
    if lights.kind == "directional":
        return lights
    return lights.take(np.flatnonzero(meet_samples(lights, view)))
