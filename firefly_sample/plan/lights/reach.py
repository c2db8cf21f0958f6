"""Limit how far lights reach: to where their contribution falls to a threshold, or to a share of a budget.

A light of intensity I (its largest channel) is below the threshold t from the distance R on, where

    Kq R^2 + Kl R + Kc = I / t.

With k = I/t - Kc, the textbook root (-Kl + sqrt(Kl^2 + 4 Kq k)) / (2 Kq) loses every digit where Kq is small.
Multiplied by its conjugate it keeps them all, also where Kq is 0: R = k / (Kl/2 + hypot(Kl/2, sqrt(Kq k))).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.plan.lights.light_set import LightSet, largest_channel
from firefly_sample.scene.arrays import Float64
from firefly_sample.scene.light import Falloff
from firefly_sample.settings import Settings

_SPLIT = 2.0**27 + 1.0


def light_reach(attenuation: ArrayLike, intensity: ArrayLike, threshold: ArrayLike) -> Float64:
    """Return the distance beyond which each light is below a threshold, in scene units, shape (n,).

    It is 0 if a light is below its threshold everywhere, infinity if it is nowhere; accurate to a few ulp.

    Parameters
    ----------
    attenuation : array_like, shape (n, 3)
        (constant, linear, quadratic), each 0 or more, not all 0.
    intensity : array_like, shape (n,)
        Largest channel of each light's colour, 0 or more.
    threshold : array_like, shape (n,) or ()
        Radiance, 0 or more; 0 limits nothing.
    """
    kc, kl, kq = np.asarray(attenuation, dtype=np.float64).reshape(-1, 3).T
    i, t = np.broadcast_arrays(
        np.asarray(intensity, dtype=np.float64), np.asarray(threshold, dtype=np.float64)
    )
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        rest = _rest(i, t, kc)
        k = np.where(np.isfinite(rest), rest / t, i / t - kc)
        half = 0.5 * kl
        below = half + np.hypot(half, np.sqrt(kq) * np.sqrt(np.maximum(k, 0.0)))
        reach = np.where(below > 0.0, k / below, np.inf)
    reach = np.where(t > 0.0, np.where(k > 0.0, reach, 0.0), np.inf)
    return np.asarray(np.where(i > 0.0, reach, 0.0))


def _rest(i: Float64, t: Float64, kc: Float64) -> Float64:
    """Return I - t*kc without the rounding of the product, which would dominate where the two nearly agree.

    The product's error comes from splitting both factors into halves whose products are exact (Dekker,
    "A floating-point technique for extending the available precision", Numerische Mathematik 18, 1971).
    """
    product = t * kc
    (t1, t2), (k1, k2) = _halves(t), _halves(kc)
    error = ((t1 * k1 - product) + t1 * k2 + t2 * k1) + t2 * k2
    return np.asarray((i - product) - error)


def _halves(value: Float64) -> tuple[Float64, Float64]:
    scaled = _SPLIT * value
    high = scaled - (scaled - value)
    return high, value - high


def budget_thresholds(intensity: ArrayLike, budget: float) -> Float64:
    """Return thresholds, shape (n,), that together drop at most `budget` of radiance at any point.

    Each light gets the share sqrt(I) / sum of sqrt(I), which minimises the sum of the volumes' areas for
    inverse-square lights (by a Lagrange multiplier). `intensity` is as in `light_reach`.
    """
    roots = np.sqrt(np.asarray(intensity, dtype=np.float64))
    total = roots.sum()
    if not total > 0.0:
        return np.zeros_like(roots)
    return np.asarray(budget * (roots / total))


def limit_reaches(
    sets: Sequence[LightSet],
    settings: Settings,
    exposure: Sequence[float],
    highlights: bool,
    gain: float = 0.0,
) -> list[LightSet]:
    """Return the sets with their reaches: each light's end, or the distance where it no longer matters.

    With a threshold, a light stops where the radiance that a white surface facing it reflects has fallen to
    the threshold, and so have its highlights if the scene has shiny materials (`highlights`). With a budget,
    all lights together drop no more than the budget at any pixel, light and highlights together, counted in
    exposed radiance, by default half a code of the display's 255 in the dark; `budget_thresholds` divides
    it among the lights. `gain` is the most by which metallic-roughness surfaces concentrate a light
    in their highlights, 0 without any; a threshold does not count it.
    """
    fading = [
        lights for lights in sets if lights.kind != "directional" and lights.falloff is Falloff.ATTENUATION
    ]
    colors = [(lights.colors, lights.specular_colors * highlights) for lights in fading]
    thresholds: Sequence[Float64 | float]
    if settings.cutoff_threshold is not None:
        thresholds = [settings.cutoff_threshold] * len(fading)
        intensities = [largest_channel(np.maximum(rgb, specular)) for rgb, specular in colors]
    else:
        intensities = [
            largest_channel((rgb * (1.0 + gain) + specular) * np.array(exposure)) for rgb, specular in colors
        ]
        # a light that never fades is not limited, so it takes no share
        counted = [
            i * lights.attenuations[:, 1:].any(axis=1) for i, lights in zip(intensities, fading, strict=True)
        ]
        shares = budget_thresholds(np.concatenate([*counted, np.zeros(0)]), settings.budget)
        thresholds = np.split(shares, np.cumsum([len(i) for i in intensities])[:-1]) if fading else []
    reaches = {
        id(lights): np.minimum(light_reach(lights.attenuations, i, t), lights.ends)
        for lights, i, t in zip(fading, intensities, thresholds, strict=True)
    }
    return [replace(lights, reaches=reaches.get(id(lights), lights.ends)) for lights in sets]
