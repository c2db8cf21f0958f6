"""Draw the views of the key V: the picture, the picture with a strip of buffers, and each buffer alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from firefly_sample.frame import Frame
from firefly_sample.gpu.presenter import Layer
from firefly_sample.plan.frame_plan import FramePlan
from firefly_sample.renderer import Renderer
from firefly_sample.scene.scene import Scene
from firefly_sample.viewer.buffer_pictures import BUFFERS, Pixels, buffers_of, picture_of
from firefly_sample.viewer.overlay import blend, text_plate

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
    """A view that was drawn and can be presented."""

    plan: FramePlan
    """Of the picture, or of the one buffer."""
    frame: Frame
    image: Layer | None
    """The image over the plan's colour, or in its place."""
    note: str
    """An explanation of the view, for the person at the window."""
    milliseconds: float
    """GPU time in total."""

    def picture(self) -> Pixels:
        """Return the view as an array, shape (height, width, 3); it must have been drawn with `read`."""
        if self.image is not None and "color" not in self.plan.outputs:
            return self.image.pixels
        color = np.asarray(self.frame["color"], dtype=np.uint8)
        return color if self.image is None else blend(color, self.image.pixels, self.image.corner)


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
        pixels, note = picture_of(plan, frame, view)
        return DrawnView(plan, frame, Layer(pixels), note, sum(frame.milliseconds.values()))
    strip, note, spent = _draw_strip(renderer, scene, time, scale) if view == STRIP else (None, "", 0.0)
    plan = renderer.plan(scene, time)
    frame = renderer.draw(plan, read=read)
    return DrawnView(plan, frame, strip, note, spent + sum(frame.milliseconds.values()))


def _draw_strip(
    renderer: Renderer, scene: Scene, time: float, scale: float
) -> tuple[Layer | None, str, float]:
    """Draw the buffers as small as their thumbnails; return the strip, a note, and the GPU time it took."""
    buffers = buffers_of(renderer.settings.look)
    grid = thumbnail_grid(renderer.size, len(buffers), scale)
    if grid is None:
        return None, "no room for the buffers: make the window larger", 0.0
    plan, frame = _draw_buffers(renderer, scene, time, buffers, grid.size)
    band = buffer_strip({name: picture_of(plan, frame, name)[0] for name in buffers}, grid, scale)
    width, height = renderer.size
    layer = Layer(band, ((width - band.shape[1]) // 2, height - band.shape[0]))
    return layer, "", sum(frame.milliseconds.values())


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


class Grid(NamedTuple):
    """The layout of thumbnails: how many in a row, and the size of each."""

    columns: int
    size: tuple[int, int]


def thumbnail_grid(window: tuple[int, int], number: int, scale: float) -> Grid | None:
    """Return the largest thumbnails with the window's aspect ratio, or None if there is no room for them."""
    gap, best = round(GAP * scale), None
    for rows in range(1, number + 1):
        columns = math.ceil(number / rows)
        width = (window[0] - gap * (columns + 1)) // columns
        height = round(width * window[1] / window[0])
        if rows * (height + gap) + gap <= SHARE * window[1] and (best is None or width > best.size[0]):
            best = Grid(columns, (width, height))
    if best is None or best.size[0] < SMALLEST[0] * scale or best.size[1] < SMALLEST[1] * scale:
        return None
    return best


def buffer_strip(pictures: dict[str, Pixels], grid: Grid, scale: float) -> Pixels:
    """Return thumbnails on a dark band, shape (height, width, 4), colours multiplied by alpha.

    `pictures` are by label, in order, each of the grid's size.
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
