"""Draw on the window: a texture that fills it, and images over that."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.gpu import Gpu
from firefly_sample.plan.variants import Variant


@dataclass(frozen=True, eq=False)
class Layer:
    """An image on the window, pixel for pixel.

    Attributes
    ----------
    pixels : ndarray of uint8, shape (height, width, 3 or 4)
        Display codes, first row on top; colours are multiplied by alpha, if there is one. The array must not
        change while it is shown, because it is uploaded once.
    corner : (int, int)
        Pixels from the window's left and top edge to the image's, which is cut off at the window's edges.
    """

    pixels: NDArray[np.uint8]
    corner: tuple[int, int] = (0, 0)


class Presenter:
    """Draws on the window whose context `gpu` uses."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        # the array is kept with its texture, so that no other array gets its id
        self._uploaded: dict[int, tuple[NDArray[np.uint8], moderngl.Texture]] = {}

    def show(self, size: tuple[int, int], picture: moderngl.Texture | None, layers: Iterable[Layer]) -> None:
        """Fill the window of `size` with `picture`, or with black, and draw `layers` over it in turn."""
        ctx = self._gpu.ctx
        ctx.screen.use()
        ctx.screen.clear(0.0, 0.0, 0.0, 1.0)
        ctx.enable_only(moderngl.NOTHING)
        if picture is not None:
            self._draw(picture, (0, 0))
        ctx.enable_only(moderngl.BLEND)
        ctx.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        layers = tuple(layers)
        for key in self._uploaded.keys() - {id(layer.pixels) for layer in layers}:
            self._uploaded.pop(key)[1].release()
        for layer in layers:
            left, top = layer.corner
            self._draw(self._upload(layer.pixels), (left, size[1] - top - layer.pixels.shape[0]))
        ctx.enable_only(moderngl.NOTHING)

    def _draw(self, texture: moderngl.Texture, corner: tuple[int, int]) -> None:
        """Draw a whole texture; `corner` is its bottom left pixel, from the window's bottom left."""
        program = self._gpu.programs.get("present", Variant(), ("screen",), vertex="fullscreen")
        program.use({"u_corner": corner}, {"u_picture": texture})
        self._gpu.ctx.viewport = (*corner, *texture.size)
        self._gpu.draw_screen(program)

    def _upload(self, pixels: NDArray[np.uint8]) -> moderngl.Texture:
        if id(pixels) not in self._uploaded:
            height, width, channels = pixels.shape
            data = np.ascontiguousarray(pixels[::-1])
            self._uploaded[id(pixels)] = pixels, self._gpu.ctx.texture((width, height), channels, data)
        return self._uploaded[id(pixels)][1]

    def release(self) -> None:
        """Free the uploaded images."""
        for _, texture in self._uploaded.values():
            texture.release()
        self._uploaded.clear()
