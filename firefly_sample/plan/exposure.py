"""Automatic exposure: measured on the scene's surfaces as an incident-light meter does, not in the picture.

The meter stands on up to `MOST_POINTS` points of all surfaces and measures the light that reaches white matt
paper there: ambient light and the diffuse share of every light. Shadows are left out, as is light that other
surfaces block or reflect. The exposure then puts the paper at a bright point, the `PERCENTILE` of all points
in the light, at `TARGET` of the display's white. It depends neither on the camera nor on materials, so a
turntable does not flicker, and a black cat stays black.
"""

from __future__ import annotations

import math

import numpy as np

from firefly_sample.memo import Memo
from firefly_sample.plan.collect import Snapshot, collect
from firefly_sample.plan.lights.incident import count_pairs, incident_light
from firefly_sample.plan.lights.light_set import gather_lights, largest_channel
from firefly_sample.plan.surface_points import SurfacePoints, sample_surfaces
from firefly_sample.scene.arrays import LARGEST, Float64
from firefly_sample.scene.lights import PointLights
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings, Tone

TARGET = 0.8
"""Share of the display's white, in linear light, that white paper at a bright point has: sRGB code 231."""
PERCENTILE = 0.98
"""Share of the lit area that is no brighter than the bright point. A higher one would follow every hot spot
beside a lamp."""
DARK = 0.02
"""Share of the bright point's light below which a point is not in the light. Otherwise a lamp over a large
ground would be overexposed, because most of the ground is far from it."""
MOST_POINTS, LEAST_POINTS = 2048, 64
"""Points on surfaces; among very many lights there are fewer."""
MOST_PAIRS = 2**19
"""Pairs of a point and a light that are computed: they take some 20 ms."""


class ExposureMeter:
    """Measures exposures, and keeps points and result until something changes that they depend on."""

    def __init__(self) -> None:
        self._points: Memo[SurfacePoints] = Memo()
        self._settings: Memo[Settings] = Memo()

    def with_number(self, snapshot: Snapshot, settings: Settings, time: float) -> Settings:
        """Return the settings with the exposure as a number: as it is, or measured if it is "auto"."""
        if not isinstance(settings.exposure, str):
            return settings
        nodes = [node for node, _ in snapshot.lights if isinstance(node, PointLights)]
        functions = tuple(node.function for node in nodes if node.function is not None)
        moment = time if functions else None
        key = snapshot, snapshot.instances.revisions(), settings, functions, moment
        return self._settings.get(
            key, lambda: settings.with_changes(exposure=self._measure(snapshot, settings, time))
        )

    def _measure(self, snapshot: Snapshot, settings: Settings, time: float) -> float:
        instances = snapshot.instances
        points = self._points.get(instances, lambda: sample_surfaces(instances, MOST_POINTS))
        level = _bright(largest_channel(_light(snapshot, points, settings, time)), points.areas)
        if level == 0.0:
            emissions = instances.factors().scaled().emissions[points.instances]
            level = _bright(largest_channel(emissions), points.areas)
        if level == 0.0:
            return 1.0
        exposure = _radiance_of(TARGET, settings.tone_curve) / level
        # to six digits: the last ones of a product of matrices differ from processor to processor
        return float(f"{min(max(exposure, 1.0 / LARGEST), LARGEST):.6g}")


def with_exposure_at(scene: Scene, settings: Settings, time: float) -> Settings:
    """Return the settings with the exposure as a number: as it is, or measured at a time if it is "auto".

    Frames that are drawn with the returned settings share one exposure, whatever moves from one to the next.
    It has six digits. `time` is in seconds; the scene is updated to it.
    """
    if not isinstance(settings.exposure, str):
        return settings
    scene.update(time)
    snapshot = collect(scene.root, scene.camera_node.camera_mask)
    return ExposureMeter().with_number(snapshot, settings, time)


def _light(snapshot: Snapshot, points: SurfacePoints, settings: Settings, time: float) -> Float64:
    """Return the light on white matt paper at points, shape (n, 3).

    The number of points is divided by a whole number where there are too many lights for all of them. The
    others then have the light of the one before.
    """
    sets, _ = gather_lights(snapshot, time)
    step = math.ceil(count_pairs(points.positions, sets) / MOST_PAIRS)
    step = min(max(step, 1), max(len(points) // LEAST_POINTS, 1))
    chosen = points.take(slice(None, None, step))
    light = snapshot.ambient_color() + incident_light(chosen.positions, chosen.normals, sets, settings)
    return np.repeat(light, step, axis=0)[: len(points)]


def _bright(levels: Float64, areas: Float64) -> float:
    """Return the `PERCENTILE` of levels, shape (n,), by their areas; 0 if all are 0.

    Levels below `DARK` of the result do not count. To leave them out raises the percentile, and thus the
    level that counts as dark, until nothing more is left out.
    """
    lit = np.flatnonzero((levels > 0.0) & (areas > 0.0))
    if not len(lit):
        return 0.0
    order = lit[np.argsort(levels[lit], kind="stable")]
    rising, ends = levels[order], np.cumsum(areas[order])
    first, found = 0, -1
    while first > found:
        found = first
        below = ends[first - 1] if first else 0.0
        bright = rising[np.searchsorted(ends, below + PERCENTILE * (ends[-1] - below))]
        first = int(np.searchsorted(rising, DARK * bright))
    return float(bright)


def _radiance_of(display: float, tone: Tone) -> float:
    """Return the exposed radiance that a tone curve maps to `display`, a share of the display's white."""
    return -math.log1p(-display) if tone == "exponential" else display
