"""Errors of a picture against its reference, by several measures.

The largest error and the bias show whether a method is correct; PSNR and FLIP estimate what people would
notice.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.measuring import require

Float64 = NDArray[np.float64]

RELATIVE_FLOOR = 1e-3
"""Share of the scale below which radiance is too dark for relative errors."""
RELMSE_FLOOR = 1e-2


@dataclass(frozen=True)
class PictureErrors:
    """Errors over the compared pixels.

    Attributes
    ----------
    largest : float
        Largest absolute difference of linear radiance in any channel, over the scale: the 99.9th percentile
        of the reference.
    percentile_99 : float
        The 99th percentile of the absolute differences, over the scale.
    largest_relative : float
        Largest difference over the reference, or over a thousandth of the scale if that is more.
    relmse : float
        Mean of (x - r)^2 / (r^2 + 0.01), both exposed, so that the units of the scene do not matter.
    bias : float
        Sum of the picture over sum of the reference, minus 1: light that is lost or gained.
    not_finite : int
        Number of values that are not finite.
    uncovered : int
        Number of pixels that show the background instead of a surface, or a surface instead of it.
    codes : int
        Largest difference of sRGB codes.
    psnr : float
        Peak signal-to-noise ratio of sRGB codes in decibels; infinite if all are equal.
    flip : float or None
        Mean FLIP error of the sRGB pictures, 0 to 1; None if not measured.
    """

    largest: float
    percentile_99: float
    largest_relative: float
    relmse: float
    bias: float
    not_finite: int
    uncovered: int
    codes: int
    psnr: float
    flip: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return plain JSON values; an infinite PSNR is null."""
        return {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in asdict(self).items()
        }


def scale_of(reference: Float64) -> float:
    """Return the unit of errors: the 99.9th percentile of a reference's values, or 1 if that is 0."""
    return float(np.percentile(reference, 99.9)) or 1.0 if reference.size else 1.0


def picture_errors(
    radiance: NDArray[Any],
    color: NDArray[np.uint8],
    covered: NDArray[np.bool_],
    reference: Float64,
    reference_color: NDArray[np.uint8],
    reference_covered: NDArray[np.bool_],
    chosen: NDArray[np.bool_],
    exposure: tuple[float, float, float] = (1.0, 1.0, 1.0),
    flip: bool = False,
) -> PictureErrors:
    """Compare a picture with a reference.

    Parameters
    ----------
    radiance, reference : ndarray, shape (height, width, 3)
        Linear.
    color, reference_color : ndarray of uint8, shape (height, width, 3)
        sRGB codes.
    covered, reference_covered, chosen : ndarray of bool, shape (height, width)
        Where something was drawn, and which pixels are compared. FLIP needs whole pictures: pixels that are
        not compared are replaced by the reference.
    exposure : tuple of 3 floats
        For `relmse`.
    flip : bool
        Measure FLIP as well.

    Raises
    ------
    MissingPackageError
        If FLIP is asked for and flip-evaluator is not installed.
    """
    given = np.asarray(radiance, dtype=np.float64)[chosen]
    truth = np.asarray(reference, dtype=np.float64)[chosen]
    if not given.size:
        return PictureErrors(0.0, 0.0, 0.0, 0.0, 0.0, 0, 0, 0, math.inf, 0.0 if flip else None)
    wrong = ~np.isfinite(given)
    given = np.where(wrong, 0.0, given)
    scale = scale_of(truth)
    off = np.abs(given - truth)
    x, r = given * exposure, truth * exposure
    total = float(truth.sum())
    codes = np.abs(color.astype(np.int16) - reference_color.astype(np.int16))[chosen]
    noise = float(np.mean(codes.astype(np.float64) ** 2))
    shown = np.where(chosen[..., None], color, reference_color)
    return PictureErrors(
        largest=float(off.max()) / scale,
        percentile_99=float(np.percentile(off, 99)) / scale,
        largest_relative=float((off / np.maximum(truth, RELATIVE_FLOOR * scale)).max()),
        relmse=float(np.mean((x - r) ** 2 / (r**2 + RELMSE_FLOOR))),
        bias=float(given.sum()) / total - 1.0 if total else 0.0,
        not_finite=int(np.count_nonzero(wrong)),
        uncovered=int(np.count_nonzero((covered != reference_covered)[chosen])),
        codes=int(codes.max()),
        psnr=10.0 * math.log10(255.0**2 / noise) if noise else math.inf,
        flip=mean_flip(shown, reference_color) if flip else None,
    )


def mean_flip(color: NDArray[np.uint8], reference: NDArray[np.uint8]) -> float:
    """Return the mean FLIP error of two sRGB pictures (Andersson et al., HPG 2020), at 67 pixels per degree.

    Raises
    ------
    MissingPackageError
        If flip-evaluator is not installed.
    """
    require("flip_evaluator")
    import flip_evaluator

    pictures = (
        np.ascontiguousarray(image, dtype=np.float32) / np.float32(255.0) for image in (reference, color)
    )
    _, mean, _ = flip_evaluator.evaluate(*pictures, "LDR")
    return float(mean)
