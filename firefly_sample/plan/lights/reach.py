"""How far a fading light matters: where its contribution falls to a threshold, or to its share of a budget.

A light of intensity I (its largest channel) is below the threshold t from the distance R on, where

    Kq R^2 + Kl R + Kc = I / t.

With k = I/t - Kc, the textbook root (-Kl + sqrt(Kl^2 + 4 Kq k)) / (2 Kq) loses every digit where Kq is small.
Multiplied by its conjugate it keeps them all, also where Kq is 0: R = k / (Kl/2 + hypot(Kl/2, sqrt(Kq k))).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Float64 = NDArray[np.float64]

_SPLIT = 2.0**27 + 1.0


def light_reach(attenuation: ArrayLike, intensity: ArrayLike, threshold: ArrayLike) -> Float64:
    """The distance from which on lights are below a threshold, in scene units.

    Parameters
    ----------
    attenuation : array_like, shape (n, 3)
        (constant, linear, quadratic), each 0 or more, not all 0.
    intensity : array_like, shape (n,)
        Largest channel of each light's colour, 0 or more.
    threshold : array_like, shape (n,) or ()
        Radiance, 0 or more; 0 cuts nothing off.

    Returns
    -------
    ndarray of float64, shape (n,)
        0 where a light is below its threshold everywhere, infinity where nowhere; to a few ulp.
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
    """I - t*kc without the rounding of the product, which would be all that is left where the two agree.

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
    """Thresholds that together drop at most `budget` of radiance anywhere, and light the least volume.

    Each light gets the share sqrt(I) / sum of sqrt(I): inverse-square lights of equal cost per unit of
    radiance, by a Lagrange multiplier on the sum of their volumes' areas.

    Parameters
    ----------
    intensity : array_like, shape (n,)
        As `light_reach` takes it.
    budget : float
        Radiance, 0 or more.

    Returns
    -------
    ndarray of float64, shape (n,)
    """
    roots = np.sqrt(np.asarray(intensity, dtype=np.float64))
    total = roots.sum()
    if not total > 0.0:
        return np.zeros_like(roots)
    return np.asarray(budget * (roots / total))
