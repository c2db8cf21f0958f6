"""Plan the lights of one frame, step by step.

`gather` finds them in the scene, `reach` limits how far each matters, `bounds` keeps those in view,
`firefly_sample.plan.shadows.planner` plans their shadow maps, and `bounds` chooses their proxies. The planner
then chooses the lighting method (`method`) and, for the clustered one, the lists of each cell (`clusters`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

from firefly_sample.plan.collect import Snapshot
from firefly_sample.plan.lights.bounds import choose_proxies, in_view, meet_samples
from firefly_sample.plan.lights.gather import gather_lights
from firefly_sample.plan.lights.light_set import LightKind, LightSet
from firefly_sample.plan.lights.reach import limit_reaches
from firefly_sample.plan.shadows.maps import ShadowPlan
from firefly_sample.plan.shadows.planner import ShadowPlanner, no_maps
from firefly_sample.plan.shadows.views import Sight
from firefly_sample.plan.view import Eye, View
from firefly_sample.plan.visible import Visible
from firefly_sample.scene.light import Light
from firefly_sample.settings import PositionMethod, Settings

OFF_RAY: frozenset[PositionMethod] = frozenset({"stored16f", "stored32f", "inverse_matrix"})
"""Methods whose positions may lie beside the line of sight: on a giant triangle, a rasterizer's interpolation
is some samples off. Forward shading interpolates its positions too."""


@dataclass(frozen=True, eq=False)
class Lighting:
    """The lights of a frame.

    Attributes
    ----------
    in_scene : int
        Lights that are attached and not hidden, except ambient ones.
    sets : tuple of LightSet
        Lights that can change the picture, in drawing order.
    shadows : ShadowPlan
    """

    in_scene: int
    sets: tuple[LightSet, ...]
    shadows: ShadowPlan

    def endless(self) -> dict[LightKind, int]:
        """Return how many lights of each kind cover the full screen because their reach is infinite."""
        return _by_kind(
            (lights.kind, int(np.isinf(lights.reaches).sum()))
            for lights in self.sets
            if lights.kind != "directional" and lights.proxy == "fullscreen"
        )

    def counts(self, shadowed: bool = False, particle_shadowed: bool = False) -> dict[LightKind, int]:
        """Return how many lights of each kind are drawn, without kinds that have none.

        Parameters
        ----------
        shadowed : bool
            Count only lights with shadow maps.
        particle_shadowed : bool
            Count only lights that particles shadow.
        """
        return _by_kind(
            (lights.kind, len(lights))
            for lights in self.sets
            if lights.shadowed >= shadowed and lights.particle_shadowed >= particle_shadowed
        )


def _by_kind(counts: Iterable[tuple[LightKind, int]]) -> dict[LightKind, int]:
    total: dict[LightKind, int] = {}
    for kind, count in counts:
        total[kind] = total.get(kind, 0) + count
    return total


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
    particle_light: Light | None = None,
) -> Lighting:
    """Return the lights of a frame.

    Parameters
    ----------
    snapshot : Snapshot
        The nodes that the camera sees.
    snapshot_for : callable
        Returns the nodes that a camera with a mask sees.
    planner : ShadowPlanner
        Keeps shadow maps from frame to frame.
    eye : Eye
    seen : Visible
        The geometry in view.
    exposure : tuple of float
        Per channel.
    view : View
        The same camera, with the samples that it draws.
    particle_light : Light, optional
        The light that particles shadow.

    Raises
    ------
    LightError
        If a light's position or direction is not finite, or the shadow maps do not fit their atlas.
    """
    world, sources = gather_lights(snapshot, time, particle_light)
    shiny = bool(snapshot.instances.factors().speculars[:, :3].any())
    world = limit_reaches(world, settings, exposure, shiny)
    visible = [in_view(lights, eye.camera.world_to_view, eye.planes) for lights in world]
    on_ray = settings.position_method not in OFF_RAY and settings.light_method != "forward"
    if on_ray and not snapshot.particles:
        visible = [
            lights
            if lights.kind == "directional"
            else lights.take(np.flatnonzero(meet_samples(lights, view)))
            for lights in visible
        ]
    shadows, maps = ShadowPlan(), no_maps(len(sources))
    if sources and len(seen) and settings.look != "classic":
        sight = Sight(
            eye,
            nearest=max(eye.lens.get_near(), seen.nearest),
            farthest=min(eye.lens.get_far(), seen.farthest),
            receivers=snapshot.spheres,
        )
        shadows, maps = planner.plan(
            world,
            sources,
            {int(index) for lights in visible for index in lights.casters if index >= 0},
            sight,
            settings,
            view.reverse,
            snapshot_for,
        )
    sets: list[LightSet] = []
    for lights in visible:
        # the index -1, of lights that cast no shadow, finds the row that is appended
        casters, count = np.concatenate([maps, no_maps(1)])[lights.casters].T
        sets.extend(choose_proxies(replace(lights, casters=casters, maps=count), eye.corners))
    return Lighting(sum(map(len, world)), tuple(sets), shadows)
