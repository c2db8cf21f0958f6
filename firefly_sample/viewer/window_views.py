"""Draw the views of the key V: the picture, the picture with a strip of buffers, and each buffer alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from firefly_sample.frame import Frame
from firefly_sample.gpu.presenter import Layer
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.viewer.buffer_pictures import (
    BUFFERS,
    buffer_picture,
    buffers_of,
    particle_shadow_atlas_picture,
    shadow_atlas_picture,
)
from firefly_sample.viewer.overlay import blend, text_plate

Pixels = NDArray[np.uint8]

PICTURE, STRIP = "picture", "strip"

GAP = 6
"""Pixels between thumbnails, and around them, at scale 1."""
SMALLEST = 60, 24
"""The least width and height of a thumbnail in pixels at scale 1; on a smaller one no label can be read."""
SHARE = 0.45
"""The part of the window's height that the strip may cover."""
LABEL = 0.8
"""Size of the labels relative to other text, where there is room."""


def views_of(look: str) -> tuple[str, ...]:
    """Return the views of a look in the order of the key V; the view of a buffer has the buffer's name."""
    return (PICTURE, STRIP, *buffers_of(look))


@dataclass(frozen=True, eq=False)
class DrawnView:
    """A view that was drawn and can be presented.

    Attributes
    ----------
    plan, frame : FramePlan, Frame
        Of the picture, or of the one buffer.
    image : Layer or None
        The image over the plan's colour, or in its place.
    note : str
        How to read the view.
    milliseconds : float
        GPU time in total.
    """

    plan: FramePlan
    frame: Frame
    image: Layer | None
    note: str
    milliseconds: float

    def picture(self) -> Pixels:
        """Return the view as an array, shape (height, width, 3); it must have been drawn with `read`."""
        if self.image is None:
            return np.asarray(self.frame["color"], dtype=np.uint8)
        if "color" not in self.plan.outputs:
            return self.image.pixels
        return blend(np.asarray(self.frame["color"], dtype=np.uint8), self.image.pixels, self.image.corner)


def draw_view(
    renderer: Renderer, scene: Scene, time: float, view: str, scale: float = 1.0, read: bool = False
) -> DrawnView:
    """Draw a view of a scene at `time` (seconds); `Renderer.present` then shows it.

    Parameters
    ----------
    view : str
        One of `views_of` the renderer's look.
    scale : float
        Scale of text.
    read : bool
        True if `DrawnView.picture` will be called.
    """
    if view in BUFFERS:
        plan, frame = _draw_buffers(renderer, scene, time, (view,), renderer.size)
        pixels, note = _picture_of(plan, frame, view)
        return DrawnView(plan, frame, Layer(pixels), note, _total(frame))
    strip, note, spent = _draw_strip(renderer, scene, time, scale) if view == STRIP else (None, "", 0.0)
    plan = renderer.plan(scene, time)
    frame = renderer.draw(plan, read=read)
    return DrawnView(plan, frame, strip, note, spent + _total(frame))


def _draw_strip(
    renderer: Renderer, scene: Scene, time: float, scale: float
) -> tuple[Layer | None, str, float]:
    """Draw the buffers as small as their thumbnails; return the strip, a note, and the GPU time it took."""
    buffers = buffers_of(renderer.settings.look)
    grid = thumbnail_grid(renderer.size, len(buffers), scale)
    if grid is None:
        return None, "no room for the buffers: make the window larger", 0.0
    plan, frame = _draw_buffers(renderer, scene, time, buffers, grid.size)
    band = buffer_strip({name: _picture_of(plan, frame, name)[0] for name in buffers}, grid, scale)
    width, height = renderer.size
    return Layer(band, ((width - band.shape[1]) // 2, height - band.shape[0])), "", _total(frame)


def _draw_buffers(
    renderer: Renderer, scene: Scene, time: float, outputs: tuple[str, ...], size: tuple[int, int]
) -> tuple[FramePlan, Frame]:
    """Draw buffers with one sample per pixel, the only choice that they have, and read them back.

    Forward shading has no buffers: those of deferred shading are drawn.
    """
    settings, window = renderer.settings, renderer.size
    method = "auto" if settings.light_method == "forward" else settings.light_method
    renderer.settings = settings.with_changes(supersample=1, light_method=method)
    renderer.resize(size)
    try:
        plan = renderer.plan(scene, time, outputs)
        return plan, renderer.draw(plan)
    finally:
        renderer.settings = settings
        renderer.resize(window)


def _picture_of(plan: FramePlan, frame: Frame, name: str) -> tuple[Pixels, str]:
    """Return a picture of one buffer, as large as the frame's picture, and a note on how to read it."""
    image = frame[name]
    if name == "shadow_atlas":
        return shadow_atlas_picture(np.asarray(image, dtype=np.float32), plan, frame.size)
    if name == "particle_shadow_atlas":
        return particle_shadow_atlas_picture(np.asarray(image, dtype=np.float32), plan, frame.size)
    return buffer_picture(name, image, classic=plan.settings.look == "classic", exposure=plan.exposure)


def _total(frame: Frame) -> float:
    return sum(frame.milliseconds.values())


class Grid(NamedTuple):
    """The layout of thumbnails: how many in a row, and the size of each."""

    columns: int
    size: tuple[int, int]


def thumbnail_grid(window: tuple[int, int], count: int, scale: float) -> Grid | None:
    """Return the largest thumbnails with the window's aspect ratio, or None if there is no room for them."""
    gap, best = round(GAP * scale), None
    for rows in range(1, count + 1):
        columns = math.ceil(count / rows)
        width = (window[0] - gap * (columns + 1)) // columns
        height = round(width * window[1] / window[0])
        if rows * (height + gap) + gap <= SHARE * window[1] and (best is None or width > best.size[0]):
            best = Grid(columns, (width, height))
    if best is None or best.size[0] < SMALLEST[0] * scale or best.size[1] < SMALLEST[1] * scale:
        return None
    return best


def buffer_strip(pictures: dict[str, Pixels], grid: Grid, scale: float) -> Pixels:
    """Return labelled thumbnails on a dark band, shape (height, width, 4), colours multiplied by alpha.

    Parameters
    ----------
    pictures : dict of str to ndarray of uint8, shape (height, width, 3)
        By label, in order; each has the grid's size.
    """
    gap, (width, height) = round(GAP * scale), grid.size
    rows = math.ceil(len(pictures) / grid.columns)
    band = np.zeros((rows * (height + gap) + gap, grid.columns * (width + gap) + gap, 4), dtype=np.uint8)
    band[..., 3] = 150
    # all labels have the same text size, the largest at which the longest fits
    size = LABEL * scale
    longest = max(text_plate("", size, title=name).shape[1] for name in pictures)
    size *= min(1.0, (width - gap) / longest)
    for index, (name, picture) in enumerate(pictures.items()):
        row, column = divmod(index, grid.columns)
        top, left = gap + row * (height + gap), gap + column * (width + gap)
        thumbnail = band[top : top + height, left : left + width]
        thumbnail[..., :3] = blend(picture, text_plate("", size, title=name), (gap // 2, gap // 2))
        thumbnail[..., 3] = 255
    return band
