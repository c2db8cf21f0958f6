"""Draw one frame of a scene with any settings: its time, and its error against the reference."""

from __future__ import annotations

import statistics
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import OutputError
from firefly_sample.frame import Frame
from firefly_sample.lab.measuring import quartile_spread
from firefly_sample.lab.picture_errors import PictureErrors, picture_errors
from firefly_sample.lab.reference.cache import reference_frame
from firefly_sample.lab.reference.chunks import Progress
from firefly_sample.lab.reference.frame import ReferenceFrame, reference_settings
from firefly_sample.lab.reference.raycast import cast_visibility
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

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
}
"""The most accurate value of each setting."""
PICTURE = ("radiance", "color")
"""Outputs that are compared with the reference; only "color" is timed."""


@dataclass(frozen=True)
class Timing:
    """Times of pairs of draws: one by the settings, one by the base that they are compared with.

    Attributes
    ----------
    milliseconds : float
        Median of the settings' times.
    ratio : float
        Median of the ratios of the pairs.
    spread : float
        Interquartile range of the ratios over their median.
    pairs : int
    """

    milliseconds: float
    ratio: float
    spread: float
    pairs: int


@dataclass(frozen=True, eq=False)
class DrawnPicture:
    """A picture with its plan and its errors."""

    plan: FramePlan
    frame: Frame
    errors: PictureErrors


class TradeBench:
    """Draws one frame of a scene with different settings, and measures its error and time.

    Parameters
    ----------
    renderer : Renderer
        Of the size to measure. This object changes its settings and turns off reuse.
    scene : Scene
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
        Where a rasteriser and rays see the same triangle; only these pixels are compared.

    Raises
    ------
    FireflyError
        If the scene or the driver is not usable, or embreex is missing.
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
        seen = renderer.draw(plan)["visibility"]
        self.agreed: NDArray[np.bool_] = (cast_visibility(plan) == seen).all(axis=-1)
        if not self.agreed.any():
            raise OutputError(
                "no pixel can be compared: the rasteriser and rays see different triangles in every pixel; "
                "choose a larger size"
            )
        self.covered: NDArray[np.bool_] = np.isfinite(self.reference.position[..., 0])

    @property
    def disagreed(self) -> float:
        """The share of pixels that are not compared."""
        return 1.0 - float(self.agreed.mean()) if self.agreed.size else 0.0

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
        return DrawnPicture(plan, frame, self.errors(frame, covered, plan.exposure, flip))

    def errors(
        self,
        frame: Frame,
        covered: NDArray[np.bool_],
        exposure: tuple[float, float, float],
        flip: bool = False,
    ) -> PictureErrors:
        """Return a picture's errors."""
        reference = self.reference
        return picture_errors(
            frame["radiance"],
            np.asarray(frame["color"], dtype=np.uint8),
            covered,
            reference.radiance,
            reference.color,
            self.covered,
            self.agreed,
            exposure,
            flip,
        )

    def plan(self, settings: Settings) -> FramePlan:
        """Plan the frame that is timed."""
        self.renderer.settings = settings.with_changes(supersample=self._samples)
        return self.renderer.plan(self.scene, self.time, ("color",))

    def time_of(self, settings: Settings, seconds: float = 3.0, most: int = 9, least: int = 3) -> Timing:
        """Time pairs of frames, with these settings and with the base, which take turns to be first.

        Parameters
        ----------
        seconds : float
            About how long to draw; a first pair, which compiles shaders, does not count.
        most, least : int
            Numbers of pairs.
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
        times = [self._milliseconds(plan) for plan in ((base, own) if base_first else (own, base))]
        return (times[1], times[0]) if base_first else (times[0], times[1])

    def _milliseconds(self, plan: FramePlan) -> float:
        return sum(self.renderer.draw(plan, read=False).milliseconds.values())
