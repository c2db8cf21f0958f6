"""Draw one frame of a scene with any settings: its time, and its errors against the reference."""

from __future__ import annotations

import math
import statistics
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import OutputError
from firefly_sample.frame import Frame
from firefly_sample.lab.measuring import quartile_spread
from firefly_sample.lab.reference.cache import reference_frame, with_blended
from firefly_sample.lab.reference.chunks import Progress
from firefly_sample.lab.reference.frame import ReferenceFrame, reference_settings
from firefly_sample.lab.reference.layer_rays import steady_layers
from firefly_sample.lab.reference.raycast import cast_visibility
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]

FINEST = {
    "position_method": "linear32f",
    "normal_format": "rgba32f",
    "albedo_format": "rgba32f",
    "interpolation": "float64",
    "particle_shadows": "optical_depth",
    "particle_shadow_format": "float32",
    "particle_shadow_reads": None,
    "particle_shadow_interpolation": True,
    "particle_order": "view",
    "particle_order_depths": None,
    "transparency": "exact",
}
"""The most accurate value of each setting."""
PICTURE = ("radiance", "color")
"""Outputs that are compared with the reference; only "color" is timed."""


RELATIVE_FLOOR = 1e-3
"""Share of the scale below which radiance is too dark for relative errors."""
RELMSE_FLOOR = 1e-2


@dataclass(frozen=True)
class PictureErrors:
    """Errors over the compared pixels.

    The largest error and the bias show whether a method is correct; PSNR and FLIP estimate what people would
    notice.

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
    """Compare a picture with a reference: linear radiance, and sRGB codes, shapes (height, width, 3).

    Parameters
    ----------
    covered, reference_covered, chosen : ndarray of bool, shape (height, width)
        Where something was drawn, and which pixels are compared. FLIP needs whole pictures: there, the
        others are replaced by the reference.
    exposure : tuple of 3 floats
        For `relmse`.
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

    It needs the package flip-evaluator.
    """
    import flip_evaluator

    pictures = (
        np.ascontiguousarray(image, dtype=np.float32) / np.float32(255.0) for image in (reference, color)
    )
    _, mean, _ = flip_evaluator.evaluate(*pictures, "LDR")
    return float(mean)


@dataclass(frozen=True)
class Timing:
    """Times of pairs of draws: one by the settings, one by the base that they are compared with.

    `milliseconds` is the median of the settings' times, `ratio` that of the pairs' ratios, and `spread` the
    interquartile range of these ratios over their median.
    """

    milliseconds: float
    ratio: float
    spread: float
    pairs: int


class DrawnPicture(NamedTuple):
    """A frame and its errors."""

    frame: Frame
    errors: PictureErrors


class TradeBench:
    """Draws one frame of a scene with different settings, and measures its error and time.

    Parameters
    ----------
    renderer : Renderer
        Of the size to measure. This object changes its settings and turns off reuse.
    time : float
        Seconds.
    base : Settings
        The settings that others are compared with; their look, exposure and so on are the reference's.
    progress : callable, optional
        Called with (done, total) while the reference is computed.
    samples : {1, 2}
        The setting "supersample" of timed frames; errors are those of single samples.

    Attributes
    ----------
    reference : ReferenceFrame
        From the visibility that the GPU drew and the albedo that it sampled.
    agreed : ndarray of bool, shape (height, width)
        Where a rasteriser and rays see the same opaque triangle, and rays beside the centre the same blended
        ones; only these pixels are compared.
    """

    def __init__(
        self,
        renderer: Renderer,
        scene: Scene,
        time: float,
        base: Settings,
        progress: Progress | None = None,
        samples: int = 1,
    ) -> None:
        self.renderer, self.scene, self.time, self.base = renderer, scene, time, base
        renderer.reuse = False  # a reused G-buffer would take no time
        self._samples = samples
        finest = base.with_changes(**FINEST, light_method="volumes", light_resolution="full", supersample=1)
        self.reference: ReferenceFrame = reference_frame(renderer, scene, finest, time, progress)
        renderer.settings = reference_settings(finest)
        plan = renderer.plan(scene, time, ("visibility",))
        seen = np.asarray(renderer.draw(plan)["visibility"], dtype=np.int32)
        self.agreed: NDArray[np.bool_] = (cast_visibility(plan) == seen).all(axis=-1)
        layered = with_blended(renderer, scene, time, plan)
        if layered.blended is not None:
            self.agreed &= steady_layers(layered, seen)
        if not self.agreed.any():
            raise OutputError(
                "no pixel can be compared: the rasteriser and rays see different triangles in every pixel; "
                "choose a larger size"
            )
        self.covered: NDArray[np.bool_] = np.isfinite(self.reference.position[..., 0])

    def draw(self, settings: Settings, flip: bool = False) -> DrawnPicture:
        """Draw the frame with these settings, and compare it with the reference."""
        renderer = self.renderer
        renderer.settings = settings.with_changes(supersample=1)
        before, renderer.count_fragments = renderer.count_fragments, True
        try:
            plan = renderer.plan(self.scene, self.time, PICTURE)
            frame = renderer.draw(plan)
        finally:
            renderer.count_fragments = before
        covered = renderer.surface(plan).covered() if plan.batches else np.zeros_like(self.covered)
        return DrawnPicture(frame, self.errors(frame["radiance"], frame["color"], covered, plan, flip))

    def errors(
        self,
        radiance: NDArray[Any],
        color: NDArray[Any],
        covered: NDArray[np.bool_],
        plan: FramePlan,
        flip: bool = False,
    ) -> PictureErrors:
        """Return the errors of a picture with the plan's exposure; see `picture_errors`."""
        known = self.reference
        reference = known.radiance, known.color, self.covered
        return picture_errors(radiance, color, covered, *reference, self.agreed, plan.exposure, flip)

    def plan(self, settings: Settings) -> FramePlan:
        """Plan the frame that is timed."""
        self.renderer.settings = settings.with_changes(supersample=self._samples)
        return self.renderer.plan(self.scene, self.time, ("color",))

    def time_of(self, settings: Settings, seconds: float = 3.0, most: int = 9, least: int = 3) -> Timing:
        """Time pairs of frames, with these settings and with the base, which take turns to be first.

        There are `least` to `most` pairs, as many as fit into the seconds. A first pair, which compiles
        shaders, does not count.
        """
        plans = self.plan(settings), self.plan(self.base)
        first = self._pair(*plans, base_first=False)
        pairs = int(np.clip(1e3 * seconds / max(sum(first), 1e-3), least, most))
        times = [self._pair(*plans, base_first=bool(index % 2)) for index in range(pairs)]
        ratios = [own / base for own, base in times if base]
        return Timing(
            statistics.median(own for own, _ in times),
            statistics.median(ratios) if ratios else 1.0,
            quartile_spread(ratios),
            pairs,
        )

    def _pair(self, own: FramePlan, base: FramePlan, base_first: bool) -> tuple[float, float]:
        """Return the milliseconds of a frame with the settings, and of one with the base."""
        first, second = (
            sum(self.renderer.draw(plan, read=False).milliseconds.values())
            for plan in ((base, own) if base_first else (own, base))
        )
        return (second, first) if base_first else (first, second)
