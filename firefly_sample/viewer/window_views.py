"""What V goes through: the picture, the picture with a strip of buffers, and each buffer alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.frame import Frame
from firefly_sample.gpu.presenter import Layer
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.viewer.atlas import atlas_picture, particle_shadow_picture
from firefly_sample.viewer.buffer_pictures import BUFFERS, buffer_picture, buffers_of
from firefly_sample.viewer.overlay import blend
from firefly_sample.viewer.strip import buffer_strip, thumbnail_grid

PICTURE, STRIP = "picture", "strip"


@dataclass(frozen=True, eq=False)
class Drawn:
    """A view that was drawn and can be presented.

    Attributes
    ----------
    plan, frame : FramePlan, Frame
        Of the picture, or of the one buffer.
    image : Layer or None
        What is shown over the plan's colour, or in its place.
    note : str
        How to read what is shown.
    milliseconds : float
        GPU time in all.
    """

    plan: FramePlan
    frame: Frame
    image: Layer | None
    note: str
    milliseconds: float

    def picture(self) -> NDArray[np.uint8]:
        """What is shown as an array, shape (height, width, 3); needs a view that was drawn with `read`."""
        if self.image is None:
            return np.asarray(self.frame["color"], dtype=np.uint8)
        if "color" not in self.plan.outputs:
            return self.image.pixels
        return blend(np.asarray(self.frame["color"], dtype=np.uint8), self.image.pixels, self.image.corner)


def views_of(look: str) -> tuple[str, ...]:
    """The views of a look, in the order of the key V; a buffer's view has its name in a `Frame`."""
    return (PICTURE, STRIP, *buffers_of(look))


def draw_view(
    renderer: Renderer, scene: Scene, time: float, view: str, scale: float = 1.0, read: bool = False
) -> Drawn:
    """Draw a view of a scene at `time` (seconds); only `Renderer.present` makes it visible.

    Parameters
    ----------
    view : str
        One of `views_of` the renderer's look.
    scale : float
        Of text.
    read : bool
        Whether `Drawn.picture` will be asked for.
    """
    if view in BUFFERS:
        plan, frame = _draw_buffers(renderer, scene, time, (view,), renderer.size)
        pixels, note = _buffer(plan, frame, view)
        return Drawn(plan, frame, Layer(pixels), note, _total(frame))
    strip, note, spent = _strip(renderer, scene, time, scale) if view == STRIP else (None, "", 0.0)
    plan = renderer.plan(scene, time)
    frame = renderer.draw(plan, read=read)
    return Drawn(plan, frame, strip, note, spent + _total(frame))


def _strip(renderer: Renderer, scene: Scene, time: float, scale: float) -> tuple[Layer | None, str, float]:
    """The strip along the lower edge, drawn anew at the thumbnails' size; a note; the GPU time it took."""
    buffers = buffers_of(renderer.settings.look)
    grid = thumbnail_grid(renderer.size, len(buffers), scale)
    if grid is None:
        return None, "no room for the buffers: make the window larger", 0.0
    plan, frame = _draw_buffers(renderer, scene, time, buffers, grid.size)
    band = buffer_strip({name: _buffer(plan, frame, name)[0] for name in buffers}, grid, scale)
    width, height = renderer.size
    return Layer(band, ((width - band.shape[1]) // 2, height - band.shape[0])), "", _total(frame)


def _draw_buffers(
    renderer: Renderer, scene: Scene, time: float, outputs: tuple[str, ...], size: tuple[int, int]
) -> tuple[FramePlan, Frame]:
    """Draw and read back buffers, with one sample a pixel, which is all that they can have.

    Forward shading has none: those that deferred shading would have are drawn.
    """
    settings, window = renderer.settings, renderer.size
    lights = "auto" if settings.light_method == "forward" else settings.light_method
    renderer.settings = settings.with_changes(supersample=1, light_method=lights)
    renderer.resize(size)
    try:
        plan = renderer.plan(scene, time, outputs)
        return plan, renderer.draw(plan)
    finally:
        renderer.settings = settings
        renderer.resize(window)


def _buffer(plan: FramePlan, frame: Frame, name: str) -> tuple[NDArray[np.uint8], str]:
    """A picture of one buffer, as large as the frame's picture, and how to read it."""
    image = frame[name]
    if name == "shadow_atlas":
        return atlas_picture(np.asarray(image, dtype=np.float32), plan, frame.size)
    if name == "particle_shadow_atlas":
        return particle_shadow_picture(np.asarray(image, dtype=np.float32), plan, frame.size)
    return buffer_picture(name, image, classic=plan.settings.look == "classic", exposure=plan.exposure)


def _total(frame: Frame) -> float:
    return sum(frame.milliseconds.values())
