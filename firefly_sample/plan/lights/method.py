"""Choose the method by which lighting passes find their pixels: the cheapest by estimated shaded pairs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.lights.bounds import screen_bounds
from firefly_sample.plan.lights.clusters import TILE, common_range
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.view import View
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]
Bounds = tuple[tuple[Float64, Float64], tuple[Float64, Float64]]

PROXY = 1.06
"""Area of a volume's outline over its light's."""
BEHIND = 2.0 / 3.0
"""Share of the reach by which a sphere's back lies behind its centre, averaged over its outline."""
COST = {"volumes": 1.0, "clustered": 0.5}
"""Cost per shaded pair: each fragment of a volume reads the G-buffer and blends, a clustered pixel once."""
ONCE = {"volumes": 0.0, "clustered": 2.0}
"""Fixed cost per pixel, in shaded pairs: to read the G-buffer and find a cell."""


@dataclass(frozen=True)
class Culling:
    """The method by which lighting passes find their pixels.

    Attributes
    ----------
    method : {"volumes", "clustered", "fullscreen", "loop", "forward"}
    shaded : dict of str to float
        About how many pairs of a pixel and a light each method would shade; empty if nothing was estimated
        because the settings name the method.
    because : str
        The reason for the method.
    """

    method: str
    shaded: dict[str, float] = field(default_factory=dict)
    because: str = ""


def choose_method(
    settings: Settings, sets: Sequence[LightSet], view: View, nearest: float, farthest: float
) -> Culling:
    """Return the method that the settings name or, for "auto", the one that costs least.

    A plan does not know the distances of the surfaces at each pixel. It takes them to be spread evenly
    between the distances that surfaces and lights share, over the whole picture: on the scenes of this
    package that is within a factor of three of the number of pairs shaded.

    Parameters
    ----------
    nearest, farthest : float
        Of the geometry in view, along the view axis.
    """
    if settings.light_method != "auto":
        return Culling(settings.light_method, because=f"light_method={settings.light_method}")
    if settings.look == "classic":
        return Culling("volumes", because="look=classic adds each light into 8 bits, as the original does")
    pixels = float(math.prod(view.size)) / (4.0 if settings.light_resolution == "half" else 1.0)
    fading = [lights for lights in sets if lights.kind != "directional"]
    count = sum(map(len, fading))
    if not count or not nearest <= farthest:
        because = "no geometry is in view" if count else "no point light or spotlight is in view"
        return Culling("volumes", because=because)
    shaded = {"volumes": 0.0, "clustered": 0.0, "fullscreen": count * pixels}
    share = pixels / math.prod(view.size)
    low, high = common_range(fading, view, nearest, farthest)
    for lights in fading:
        before, between = _surface_shares(lights, low, high)
        bounds = screen_bounds(lights, view)
        if not settings.volume_depth_test or lights.proxy == "fullscreen":
            before = np.ones(len(lights))
        shaded["volumes"] += share * PROXY * float(_areas(bounds, view, 0.0) @ before)
        shaded["clustered"] += share * float(_areas(bounds, view, TILE / 2.0) @ between)
    # as a volume, a light that reaches the whole view is a full-screen pass
    best = min(COST, key=lambda name: pixels * ONCE[name] + COST[name] * shaded[name])
    told = ", ".join(f"{name} {pairs / 1e6:.3g}" for name, pairs in shaded.items())
    return Culling(best, shaded, f"about {told} million shaded pairs")


def _surface_shares(lights: LightSet, low: float, high: float) -> tuple[Float64, Float64]:
    """Return the shares of surfaces before each light's back, and between its front and its back."""
    y, reach = lights.positions[:, 1], BEHIND * np.minimum(lights.reaches, 1e30)
    deep = max(high - low, 1e-30)
    back = np.clip((y + reach - low) / deep, 0.0, 1.0)
    return back, back - np.clip((y - reach - low) / deep, 0.0, 1.0)


def _areas(bounds: Bounds, view: View, wider: float) -> Float64:
    """Return the pixels within each light's outline, widened: an ellipse's share of its rectangle."""
    across, up = (
        np.maximum(np.clip(high + wider, 0.0, size) - np.clip(low - wider, 0.0, size), 0.0)
        for (low, high), size in zip(bounds, view.size, strict=True)
    )
    area = across * up
    return np.where(area >= 0.999 * math.prod(view.size), area, math.pi / 4.0 * area)
