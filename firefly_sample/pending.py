"""A frame that the GPU draws and that has not been read back yet."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from firefly_sample.camera import FrameCamera
from firefly_sample.frame import Frame
from firefly_sample.gpu.gpu import Gpu
from firefly_sample.gpu.pixel_buffers import Copies
from firefly_sample.gpu.timers import Measured
from firefly_sample.passes.lights import LIGHT_PASSES
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.plan.lights.clusters import list_lengths
from firefly_sample.readback import Surface, read_images, targets_read
from firefly_sample.scene.intrinsics import Intrinsics


@dataclass(eq=False)
class PendingFrame:
    """A frame that is being drawn, with the passes' own counts of lights and draw calls, and their times.

    `walked` is the result of `count_walked`; `copies` holds the targets behind the plan's outputs, once
    `copy` was called. The device must be entered around `copy` and `read`; `give_back` makes no OpenGL call.
    """

    plan: FramePlan
    lights_drawn: int
    draw_calls: int
    measured: Measured
    walked: int | None = None
    copies: Copies | None = None

    def copy(self, gpu: Gpu) -> None:
        """Start to copy the targets behind the outputs, which the next frame draws over, without waiting."""
        textures = {name: gpu.images.texture(self.plan, name) for name in targets_read(self.plan)}
        self.copies = gpu.pixels.copy(textures)

    def read(self, gpu: Gpu, images: bool = True) -> Frame:
        """Wait for the frame and read its outputs: the copies, or else the targets themselves."""
        plan = self.plan
        read = self.copies.read if self.copies is not None else _reader(plan, gpu)
        milliseconds, shaded = gpu.timers.collect(self.measured)
        if self.walked is not None:
            shaded = (shaded or 0) + self.walked
        counts = plan.counts
        if any(step.name in LIGHT_PASSES | {"forward"} for step in plan.passes):
            counts = replace(counts, dropped=counts.in_view - self.lights_drawn)
        return Frame(
            images=read_images(plan, read) if images else {},
            time=plan.time,
            size=plan.size,
            milliseconds=milliseconds,
            lights=counts,
            driver=gpu.device.renderer,
            software=gpu.device.software,
            camera=camera_of(plan),
            shaded=shaded,
            draw_calls=self.draw_calls,
            id_names=plan.id_names,
            warnings=plan.warnings,
        )

    def give_back(self, gpu: Gpu) -> None:
        """Let later frames have its buffer and its queries."""
        gpu.timers.give_back(self.measured)
        if self.copies is not None:
            gpu.pixels.give_back(self.copies)
            self.copies = None


def camera_of(plan: FramePlan) -> FrameCamera:
    """Return the camera of a plan, for the pixels of its picture, which may average several samples each."""
    view = plan.view
    return FrameCamera(Intrinsics.of(view.lens, plan.size, (view.near, view.far)), view.view_to_world)


def count_walked(plan: FramePlan, gpu: Gpu) -> int:
    """Return the sum of the lights in the lists of all pixels, which clustered light shades."""
    every = 2 if plan.settings.light_resolution == "half" else 1
    distance = Surface(plan, _reader(plan, gpu)).distance()
    height, width = distance.shape
    seen = distance[::-1][::every, ::every]
    row, column = np.mgrid[:height:every, :width:every]
    return sum(int(list_lengths(clusters, column, row, seen).sum()) for clusters in plan.clusters)


def _reader(plan: FramePlan, gpu: Gpu) -> Callable[[str], bytes]:
    """Return what reads targets of the plan that was drawn last, by name."""
    return lambda name: bytes(gpu.images.texture(plan, name).read())
