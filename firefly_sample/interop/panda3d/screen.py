"""The place in a window of Panda3D where one of our pictures is shown: a card over a display region."""

from __future__ import annotations

from typing import Any

import numpy as np

from firefly_sample.frame import Image


class Screen:
    """Shows pictures in place of a display region of Panda3D, which is not drawn until `close`.

    Parameters
    ----------
    region : panda3d.core.DisplayRegion
    """

    def __init__(self, region: Any) -> None:
        from panda3d import core

        self.window, self._hidden = region.get_window(), region
        self._texture = core.Texture("firefly")
        self._texture.set_compression(core.Texture.CM_off)
        self._texture.set_minfilter(core.SamplerState.FT_nearest)
        self._texture.set_magfilter(core.SamplerState.FT_nearest)
        # an sRGB window encodes what the texture then decodes
        self._format = core.Texture.F_srgb if self.is_srgb else core.Texture.F_rgb
        card = core.CardMaker("firefly")
        card.set_frame_fullscreen_quad()
        root = core.NodePath("firefly")
        path = root.attach_new_node(card.generate())
        path.set_texture(self._texture)
        path.set_depth_test(False)
        path.set_depth_write(False)
        camera = core.Camera("firefly", core.OrthographicLens())
        camera.get_lens().set_film_size(2, 2)
        camera.get_lens().set_near_far(-1000, 1000)
        self._region = self.window.make_display_region(*_corners(region))
        self._region.set_sort(region.get_sort())
        self._region.set_camera(root.attach_new_node(camera))
        self._region.set_active(False)  # until there is a picture

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the region in pixels; either may be 0."""
        return self._hidden.get_pixel_width(), self._hidden.get_pixel_height()

    @property
    def is_shown(self) -> bool:
        """True if the window is open and not minimised."""
        return bool(self.window.is_valid() and self.window.is_active())

    @property
    def is_srgb(self) -> bool:
        """True if Panda3D's colours are linear in this window (framebuffer-srgb)."""
        return bool(self.window.get_fb_properties().get_srgb_color())

    @property
    def background(self) -> tuple[float, float, float]:
        """The colour that Panda3D clears the region to; black if it does not clear it."""
        for cleared in (self._hidden, self.window):
            if cleared.get_clear_color_active():
                red, green, blue, _ = cleared.get_clear_color()
                return red, green, blue
        return 0.0, 0.0, 0.0

    def show(self, picture: Image) -> None:
        """Show a picture, shape (height, width, 3), dtype uint8, first row on top."""
        from panda3d import core

        height, width, _ = picture.shape
        texture = self._texture
        if (texture.get_x_size(), texture.get_y_size()) != (width, height):
            texture.setup_2d_texture(width, height, core.Texture.T_unsigned_byte, self._format)
        # Panda3D may still be reading the last one in another thread
        pixels = core.PTA_uchar.empty_array(picture.size)
        stored = np.asarray(memoryview(pixels)).reshape(picture.shape)
        for channel in range(3):  # several times faster than all at once
            stored[..., channel] = picture[::-1, :, 2 - channel]
        texture.set_ram_image(pixels)
        if _corners(self._region) != _corners(self._hidden):
            self._region.set_dimensions(*_corners(self._hidden))
        self._region.set_active(True)
        self._hidden.set_active(False)

    def close(self) -> None:
        """Let the region be drawn again."""
        self._region.set_active(False)
        self._hidden.set_active(True)
        self.window.remove_display_region(self._region)


def _corners(region: Any) -> tuple[float, float, float, float]:
    return region.get_left(), region.get_right(), region.get_bottom(), region.get_top()
