"""A frame between its drawing and its being read: what is known of it, and where the rest will be."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from firefly_sample.frame import Frame, Image, LightCounts
from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.pixel_buffers import Copies
from firefly_sample.gpu.timers import Measured
from firefly_sample.lab.reference.clusters import list_lengths
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.plan.lights.light_set import PASS_OF_KIND
from firefly_sample.readback import Surface, read_images, targets_read

LIGHT_PASSES = frozenset(PASS_OF_KIND.values())


@dataclass(eq=False)
class Drawn:
    """A plan that the GPU has been told to draw.

    The device must be entered around `copy` and `read`; `give_back` asks nothing of OpenGL.

    Attributes
    ----------
    plan : FramePlan
    lights_drawn : int
        By the passes themselves.
    draw_calls : int
    measured : Measured
        Of the passes.
    walked : int or None
        See `count_walked`.
    copies : Copies or None
        The bytes of the targets behind the plan's outputs, when `copy` was called.
    """

    plan: FramePlan
    lights_drawn: int
    draw_calls: int
    measured: Measured
    walked: int | None = None
    copies: Copies | None = None

    def copy(self, gpu: Gpu) -> None:
        """Start to copy what the outputs need, which the next frame draws over; nobody waits.

        Raises
        ------
        GpuError
            If the driver has no room for it.
        """
        textures = {name: gpu.images.texture(self.plan, name) for name in targets_read(self.plan)}
        self.copies = gpu.pixels.copy(textures)

    def read(self, gpu: Gpu, images: bool = True) -> Frame:
        """Wait for the frame and read its outputs: the copies, or else the targets themselves."""
        plan = self.plan
        read = self.copies.read if self.copies is not None else _reader(plan, gpu)
        milliseconds, shaded = gpu.timers.collect(self.measured)
        if self.walked is not None:
            shaded = (shaded or 0) + self.walked
        found: dict[str, Image] = read_images(plan, read) if images else {}
        return Frame(
            images=found,
            time=plan.time,
            size=plan.size,
            milliseconds=milliseconds,
            lights=self._lights(),
            driver=gpu.device.renderer,
            software=gpu.device.software,
            shaded=shaded,
            draw_calls=self.draw_calls,
            id_names=plan.id_names,
            warnings=plan.warnings,
        )

    def _lights(self) -> LightCounts:
        """The plan's counts, with what the passes of light really drew."""
        if not any(step.name in LIGHT_PASSES | {"forward"} for step in self.plan.passes):
            return self.plan.counts
        return replace(self.plan.counts, dropped=self.plan.counts.in_view - self.lights_drawn)

    def give_back(self, gpu: Gpu) -> None:
        """Let later frames have its buffer and its queries."""
        gpu.timers.give_back(self.measured)
        if self.copies is not None:
            gpu.pixels.give_back(self.copies)
            self.copies = None


def count_walked(plan: FramePlan, gpu: Gpu) -> int:
    """How many lights the pixels' cells hold: what one fragment of clusters shades. It reads the G-buffer."""
    every = 2 if plan.settings.light_resolution == "half" else 1
    distance = Surface(plan, _reader(plan, gpu)).distance()
    height, width = distance.shape
    seen = distance[::-1][::every, ::every]
    row, column = np.mgrid[:height:every, :width:every]
    return sum(int(list_lengths(clusters, column, row, seen).sum()) for clusters in plan.clusters)


def _reader(plan: FramePlan, gpu: Gpu) -> Callable[[str], bytes]:
    """Reads targets of the plan that was drawn last, by name."""
    return lambda name: bytes(gpu.images.texture(plan, name).read())
