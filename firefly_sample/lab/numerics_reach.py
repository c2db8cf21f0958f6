"""How many digits two formulas keep of the distance at which a light has faded to a threshold."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.device import Device
from firefly_sample.lab.numerics_table import Table, Value
from firefly_sample.plan.lights.reach import light_reach

Float64 = NDArray[np.float64]

QUADRATICS = (1.0, 1e-6, 1e-12, 1e-18, 1e-24, 1e-30)
DIGITS = 120


def reach(device: Device | None = None, samples: int = 1000) -> Table:
    """Largest relative error of the root of Kq R^2 + Kl R + Kc = I/t in float64, against 120 digits.

    Parameters
    ----------
    samples : int
        Lights, whose other coefficients and intensity are log-uniform over six orders of magnitude.
    """
    rng = np.random.Generator(np.random.PCG64(11))
    constant, linear = 10.0 ** rng.uniform(-3.0, 3.0, (2, samples))
    intensity = 10.0 ** rng.uniform(1.0, 7.0, samples)
    threshold = 1e-3
    rows: list[tuple[Value, ...]] = []
    for quadratic in QUADRATICS:
        k = intensity / threshold - constant
        textbook = (-linear + np.sqrt(linear**2 + 4.0 * quadratic * k)) / (2.0 * quadratic)
        given = np.stack([constant, linear, np.full(samples, quadratic)], axis=1)
        ours = light_reach(given, intensity, threshold)
        exact = [
            exact_reach(kc, kl, quadratic, strength, threshold)
            for kc, kl, strength in zip(constant.tolist(), linear.tolist(), intensity.tolist(), strict=True)
        ]
        rows.append((f"{quadratic:g}", _largest(textbook, exact), _largest(ours, exact)))
    about = (
        "Largest relative error of a light's reach in float64, by its quadratic coefficient: by the "
        "textbook's formula, and by its conjugate, 2k / (Kl + sqrt(Kl^2 + 4 Kq k)) with k = I/t - Kc."
    )
    return Table("reach", about, ("quadratic", "textbook", "conjugate"), rows)


def exact_reach(
    constant: float, linear: float, quadratic: float, intensity: float, threshold: float
) -> Decimal:
    """Where a light fades to a threshold, in decimals of `DIGITS` digits, of the floats' exact values.

    0 where it is below the threshold everywhere, infinity where it does not fade.
    """
    with localcontext() as context:
        context.prec = DIGITS
        kc, kl, kq, i, t = (Decimal(value) for value in (constant, linear, quadratic, intensity, threshold))
        k = i / t - kc
        if i == 0 or k <= 0:
            return Decimal(0)
        below = kl + (kl * kl + 4 * kq * k).sqrt()
        return 2 * k / below if below else Decimal("Infinity")


def _largest(found: Float64, exact: list[Decimal]) -> float:
    with localcontext() as context:
        context.prec = DIGITS
        pairs = zip(found.tolist(), exact, strict=True)
        return max(abs(float(Decimal(value) / true - 1)) for value, true in pairs)
