"""Which way to find the pixels that lights reach: what each would shade, and the cheapest of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from firefly_sample.plan.grid import TILE, common_range
from firefly_sample.plan.lights.bounds import screen_bounds
from firefly_sample.plan.lights.light_set import LightSet
from firefly_sample.plan.view import View
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]
Bounds = tuple[tuple[Float64, Float64], tuple[Float64, Float64]]

PROXY = 1.06
"""Area of a volume's outline over its light's."""
BEHIND = 2.0 / 3.0
"""Of the reach: how far a ball's back lies behind its centre, averaged over its outline."""
COST = {"volumes": 1.0, "clustered": 0.5}
"""Of one shaded pair: a volume's fragment reads the G-buffer and blends, a cluster's does so once for all."""
ONCE = {"volumes": 0.0, "clustered": 2.0}
"""What each pixel of the picture costs by itself, in shaded pairs: to read the G-buffer and find a cell."""


@dataclass(frozen=True)
class Culling:
    """How the passes of light find their pixels.

    Attributes
    ----------
    method : {"volumes", "clustered", "fullscreen", "loop", "forward"}
    shaded : dict of str to float
        How many pairs of a pixel and a light each method would shade, about; empty where nothing was
        estimated because the settings name the method.
    because : str
        Why this one.
    """

    method: str
    shaded: dict[str, float] = field(default_factory=dict)
    because: str = ""


def choose_culling(
    settings: Settings, sets: Sequence[LightSet], view: View, nearest: float, farthest: float
) -> Culling:
    """The method that the settings name or, for "auto", the one that costs least.

    A plan does not know where surfaces are behind each pixel. They are taken to be spread evenly, all over
    the picture, between the distances that both surfaces and lights have: on the scenes of this package that
    is within a factor of three of what is shaded.

    Parameters
    ----------
    nearest, farthest : float
        Of the geometry in view, along the view axis.
    """
    if settings.light_method != "auto":
        return Culling(settings.light_method, because=f"lights={settings.light_method}")
    if settings.look == "classic":
        return Culling("volumes", because="look=classic adds each light into 8 bits, as the original does")
    pixels = float(math.prod(view.size)) / (4.0 if settings.light_resolution == "half" else 1.0)
    fading = [lights for lights in sets if lights.kind != "directional"]
    count = sum(map(len, fading))
    if not count or not nearest <= farthest:
        return Culling("volumes", because="no light ends" if not count else "nothing to light is in view")
    shaded = {"volumes": 0.0, "clustered": 0.0, "fullscreen": count * pixels}
    share = pixels / math.prod(view.size)
    low, high = common_range(fading, view, nearest, farthest)
    for lights in fading:
        behind, between = _shares(lights, low, high)
        bounds = screen_bounds(lights, view)
        if not settings.volume_depth_test or lights.proxy == "fullscreen":
            behind = np.ones(len(lights))
        shaded["volumes"] += share * PROXY * float(_outlines(bounds, view, 0.0) @ behind)
        shaded["clustered"] += share * float(_outlines(bounds, view, TILE / 2.0) @ between)
    # a light that reaches everything is a full-screen pass as a volume, too
    best = min(COST, key=lambda name: pixels * ONCE[name] + COST[name] * shaded[name])
    told = ", ".join(f"{name} {pairs / 1e6:.3g}" for name, pairs in shaded.items())
    return Culling(best, shaded, f"about {told} million shaded pairs")


def _shares(lights: LightSet, low: float, high: float) -> tuple[Float64, Float64]:
    """The share of surfaces before each light's back, and of those between its front and its back."""
    y, reach = lights.positions[:, 1], BEHIND * np.minimum(lights.reaches, 1e30)
    deep = max(high - low, 1e-30)
    back = np.clip((y + reach - low) / deep, 0.0, 1.0)
    return back, back - np.clip((y - reach - low) / deep, 0.0, 1.0)


def _outlines(bounds: Bounds, view: View, wider: float) -> Float64:
    """Pixels within each light's outline, made wider by some; a round one's share of its rectangle."""
    across, up = (
        np.maximum(np.clip(high + wider, 0.0, size) - np.clip(low - wider, 0.0, size), 0.0)
        for (low, high), size in zip(bounds, view.size, strict=True)
    )
    area = across * up
    return np.where(area >= 0.999 * math.prod(view.size), area, math.pi / 4.0 * area)
