"""How many digits two formulas keep of the distance at which a light has faded to a threshold."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.device import Device
from firefly_sample.measure.numerics_table import Table, Value
from firefly_sample.plan.reach import light_reach

__all__ = ["QUADRATICS", "reach"]

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
        exact = [_exact(row, i, threshold) for row, i in zip(given, intensity, strict=True)]
        rows.append((f"{quadratic:g}", _largest(textbook, exact), _largest(ours, exact)))
    about = (
        "Largest relative error of a light's reach in float64, by its quadratic coefficient: by the "
        "textbook's formula, and by its conjugate."
    )
    return Table("reach", about, ("quadratic", "textbook", "conjugate"), rows)


def _exact(attenuation: Float64, intensity: float, threshold: float) -> Decimal:
    with localcontext() as context:
        context.prec = DIGITS
        constant, linear, quadratic = (Decimal(float(value)) for value in attenuation)
        k = Decimal(float(intensity)) / Decimal(threshold) - constant
        return (-linear + (linear * linear + 4 * quadratic * k).sqrt()) / (2 * quadratic)


def _largest(found: Float64, exact: list[Decimal]) -> float:
    pairs = zip(found, exact, strict=True)
    return max(abs(float((Decimal(float(value)) - true) / true)) for value, true in pairs)
