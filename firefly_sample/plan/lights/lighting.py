"""Plan the lights of one frame, and choose the method by which lighting passes find their pixels.

`light_set` gathers them from the scene, `reach` limits how far each matters, `bounds` keeps those in view,
`firefly_sample.plan.shadows.planner` plans their shadow maps, and `bounds` chooses their proxies. For the
clustered method, `clusters` makes the lists of each cell.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from firefly_sample.plan.collect import Snapshot
from firefly_sample.plan.frame_plan import LightMethod
from firefly_sample.plan.lights.bounds import choose_proxies, in_view, meet_samples, screen_bounds
from firefly_sample.plan.lights.clusters import TILE, common_range
from firefly_sample.plan.lights.light_set import LightKind, LightSet, gather_lights
from firefly_sample.plan.lights.reach import limit_reaches
from firefly_sample.plan.shadows.maps import ShadowPlan
from firefly_sample.plan.shadows.planner import ShadowPlanner, no_maps
from firefly_sample.plan.shadows.views import Sight
from firefly_sample.plan.view import Eye, View
from firefly_sample.plan.visible import Visible
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.light import Light
from firefly_sample.settings import PositionMethod, Settings

OFF_RAY: frozenset[PositionMethod] = frozenset({"stored16f", "stored32f", "inverse_matrix"})
"""Methods whose positions may lie beside the line of sight: on a giant triangle, a rasterizer's interpolation
is some samples off. Forward shading interpolates its positions too."""
PROXY = 1.06
"""Area of a volume's outline over its light's."""
BEHIND = 2.0 / 3.0
"""Share of the reach by which a sphere's back lies behind its centre, averaged over its outline."""
COST = {"volumes": 1.0, "clustered": 0.5}
"""Cost per shaded pair: each fragment of a volume reads the G-buffer and blends, a clustered pixel once."""
ONCE = {"volumes": 0.0, "clustered": 2.0}
"""Fixed cost per pixel, in shaded pairs: to read the G-buffer and find a cell."""


@dataclass(frozen=True, eq=False)
class Lighting:
    """The lights of a frame."""

    in_scene: int  # lights that are attached and not hidden, except ambient ones
    sets: tuple[LightSet, ...]  # lights that can change the picture, in drawing order
    shadows: ShadowPlan

    def endless(self) -> dict[LightKind, int]:
        """Return how many lights of each kind cover the full screen because their reach is infinite."""
        total: Counter[LightKind] = Counter()
        for lights in self.sets:
            if lights.kind != "directional" and lights.proxy == "fullscreen":
                total[lights.kind] += int(np.isinf(lights.reaches).sum())
        return dict(total)

    def counts(self, shadowed: bool = False) -> dict[LightKind, int]:
        """Return how many lights, or only those with shadow maps, are drawn of each kind that has any."""
        total: Counter[LightKind] = Counter()
        for lights in self.sets:
            if lights.shadowed >= shadowed:
                total[lights.kind] += len(lights)
        return dict(total)

    @property
    def particle_shadowed_kind(self) -> LightKind | None:
        """The kind of the light that particles shadow, if there is one."""
        return next((lights.kind for lights in self.sets if lights.particle_shadowed), None)


def light_scene(
    snapshot: Snapshot,
    snapshot_for: Callable[[int], Snapshot],
    planner: ShadowPlanner,
    settings: Settings,
    time: float,
    eye: Eye,
    seen: Visible,
    exposure: Sequence[float],
    view: View,
    particle_light: Light | None = None,
) -> Lighting:
    """Return the lights of a frame, which has none in the look "flat".

    The snapshot has the nodes that the camera sees, `snapshot_for` returns those that a camera with a mask
    sees, `seen` is the geometry in view, and particles shadow `particle_light`.
    """
    world, sources = gather_lights(snapshot, time, particle_light)
    if settings.look == "flat":
        return Lighting(sum(map(len, world)), (), ShadowPlan())
    world = limit_reaches(world, settings, exposure, *snapshot.instances.highlights())
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
            nearest=max(view.near, seen.nearest),
            farthest=min(view.far, seen.farthest),
            receivers=snapshot.instances,
        )
        casters = {int(index) for lights in visible for index in lights.casters if index >= 0}
        shadows, maps = planner.plan(world, sources, casters, sight, settings, view.reverse, snapshot_for)
    sets: list[LightSet] = []
    for lights in visible:
        # the index -1, of lights that cast no shadow, finds the row that is appended
        first, count = np.concatenate([maps, no_maps(1)])[lights.casters].T
        sets.extend(choose_proxies(replace(lights, casters=first, maps=count), eye.corners))
    return Lighting(sum(map(len, world)), tuple(sets), shadows)


def choose_method(
    settings: Settings, sets: Sequence[LightSet], view: View, nearest: float, farthest: float
) -> LightMethod:
    """Return the method that the settings name or, for "auto", the one that costs least.

    A plan does not know the distances of the surfaces at each pixel. It takes them to be spread evenly
    between the distances that surfaces and lights share, over the whole picture: on the scenes of this
    package that is within a factor of three of the number of pairs shaded. `nearest` and `farthest` bound
    the geometry in view along the view axis.
    """
    if settings.light_method != "auto":
        return LightMethod(settings.light_method, because=f"light_method={settings.light_method}")
    if settings.look == "classic":
        return LightMethod(
            "volumes", because="look=classic adds each light into 8 bits, as the original does"
        )
    pixels = float(math.prod(view.size)) / (4.0 if settings.light_resolution == "half" else 1.0)
    fading = [lights for lights in sets if lights.kind != "directional"]
    count = sum(map(len, fading))
    if not count or not nearest <= farthest:
        because = "no geometry is in view" if count else "no point light or spotlight is in view"
        return LightMethod("volumes", because=because)
    pairs = {"volumes": 0.0, "clustered": 0.0, "fullscreen": count * pixels}
    share = pixels / math.prod(view.size)
    low, high = common_range(fading, view, nearest, farthest)
    for lights in fading:
        before, between = _surface_shares(lights, low, high)
        bounds = screen_bounds(lights, view)
        if not settings.volume_depth_test or lights.proxy == "fullscreen":
            before = np.ones(len(lights))
        pairs["volumes"] += share * PROXY * float(_areas(bounds, view, 0.0) @ before)
        pairs["clustered"] += share * float(_areas(bounds, view, TILE / 2.0) @ between)
    # as a volume, a light that reaches the whole view is a full-screen pass
    best = min(COST, key=lambda name: pixels * ONCE[name] + COST[name] * pairs[name])
    listed = ", ".join(f"{name} {count / 1e6:.3g}" for name, count in pairs.items())
    return LightMethod(best, pairs, f"about {listed} million shaded pairs")


def _surface_shares(lights: LightSet, low: float, high: float) -> tuple[Float64, Float64]:
    """Return the shares of surfaces before each light's back, and between its front and its back."""
    y, reach = lights.positions[:, 1], BEHIND * np.minimum(lights.reaches, 1e30)
    deep = max(high - low, 1e-30)
    back = np.clip((y + reach - low) / deep, 0.0, 1.0)
    return back, back - np.clip((y - reach - low) / deep, 0.0, 1.0)


def _areas(bounds: Iterable[tuple[Float64, Float64]], view: View, wider: float) -> Float64:
    """Return the pixels within each light's outline, widened: an ellipse's share of its rectangle."""
    across, up = (
        np.maximum(np.clip(high + wider, 0.0, size) - np.clip(low - wider, 0.0, size), 0.0)
        for (low, high), size in zip(bounds, view.size, strict=True)
    )
    area = across * up
    return np.where(area >= 0.999 * math.prod(view.size), area, math.pi / 4.0 * area)
