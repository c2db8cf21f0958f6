"""One frame of a scene, drawn with any settings: how long it takes, and how far it is from its reference."""

from __future__ import annotations

import statistics
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import OutputError
from firefly_sample.frame import Frame
from firefly_sample.lab.picture_errors import Errors, picture_errors
from firefly_sample.lab.reference.cache import reference_frame
from firefly_sample.lab.reference.chunks import Progress
from firefly_sample.lab.reference.frame import ReferenceFrame, reference_settings
from firefly_sample.lab.reference.raycast import cast_visibility
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

FINEST = {
    "position": "linear32f",
    "normals": "rgba32f",
    "albedo": "rgba32f",
    "interpolation": "float64",
    "particle_shadows": "optical_depth",
    "particle_shadow_format": "float32",
    "particle_shadow_reads": None,
    "particle_shadow_interpolation": True,
    "particle_order": "view",
    "particle_order_depths": None,
}
PICTURE = ("radiance", "color")
"""Outputs that are held against the reference; what is timed is "color" alone."""


@dataclass(frozen=True)
class Timing:
    """What pairs of draws took: of the settings, and of those that they are compared with.

    Attributes
    ----------
    milliseconds : float
        Median.
    ratio : float
        Median of the ratios of the pairs.
    spread : float
        Distance of the ratios' quartiles, over their median.
    pairs : int
    """

    milliseconds: float
    ratio: float
    spread: float
    pairs: int


@dataclass(frozen=True, eq=False)
class Drawn:
    """A picture, its errors and what it is made with."""

    plan: FramePlan
    frame: Frame
    errors: Errors


class Bench:
    """Draws one frame of a scene again and again.

    Parameters
    ----------
    renderer : Renderer
        Of the size to measure; its settings are this object's from now on, and it reuses nothing.
    scene : Scene
    time : float
        Seconds.
    base : Settings
        What the others are compared with. Their look, exposure and so on are those of the reference.
    progress : callable, optional
        Tells of the reference: (done, in all).
    samples : {1, 2}
        The setting "supersample" of what is timed; errors are of single samples.

    Attributes
    ----------
    reference : ReferenceFrame
        From the visibility that the GPU found, and the albedo that it sampled.
    agreed : ndarray of bool, shape (height, width)
        Where a rasteriser and rays see the same triangle: what is compared.

    Raises
    ------
    FireflyError
        If the scene or the driver is not as it must be, or embreex is missing.
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
        renderer.reuse = False  # a kept G-buffer has no time
        self._samples = samples
        finest = base.with_changes(**FINEST, light_method="volumes", light_resolution="full", supersample=1)
        self.reference: ReferenceFrame = reference_frame(renderer, scene, finest, time, progress)
        renderer.settings = reference_settings(finest)
        plan = renderer.plan(scene, time, ("visibility",))
        seen = renderer.draw(plan)["visibility"]
        self.agreed: NDArray[np.bool_] = (cast_visibility(plan) == seen).all(axis=-1)
        if not self.agreed.any():
            raise OutputError(
                "no pixel can be compared, for a rasteriser and rays see other triangles in all: "
                "choose a larger size"
            )
        self.covered: NDArray[np.bool_] = np.isfinite(self.reference.position[..., 0])

    @property
    def disagreed(self) -> float:
        """The share of pixels that are left out of comparisons."""
        return 1.0 - float(self.agreed.mean()) if self.agreed.size else 0.0

    def draw(self, settings: Settings, flip: bool = False) -> Drawn:
        """A frame by these settings, and its errors."""
        renderer = self.renderer
        renderer.settings = settings.with_changes(supersample=1)
        before, renderer.count_fragments = renderer.count_fragments, True
        try:
            plan = renderer.plan(self.scene, self.time, PICTURE)
            frame = renderer.draw(plan)
        finally:
            renderer.count_fragments = before
        covered = renderer.surface(plan).covered() if plan.batches else np.zeros_like(self.covered)
        return Drawn(plan, frame, self.errors(frame, covered, plan.exposure, flip))

    def errors(
        self,
        frame: Frame,
        covered: NDArray[np.bool_],
        exposure: tuple[float, float, float],
        flip: bool = False,
    ) -> Errors:
        """A picture's errors."""
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
        """What is timed."""
        self.renderer.settings = settings.with_changes(supersample=self._samples)
        return self.renderer.plan(self.scene, self.time, ("color",))

    def time_of(self, settings: Settings, seconds: float = 3.0, most: int = 9, least: int = 3) -> Timing:
        """Draw pairs of frames, by these settings and by the base, each first in turn.

        Parameters
        ----------
        seconds : float
            About how long; a first pair, which compiles, is not counted.
        most, least : int
            Pairs.
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


def quartile_spread(values: list[float]) -> float:
    """Distance of the quartiles over the median, 0 of fewer than two."""
    if len(values) < 2:
        return 0.0
    first, median, third = statistics.quantiles(values, n=4, method="inclusive")
    return (third - first) / median if median else 0.0
