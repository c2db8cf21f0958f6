"""Panda3D's own renderer, in a process of its own with a display of its own.

Its context and ours do not share a thread, and its shader generator needs a GLX context. One process draws
all pictures: to start it takes longer than a hundred of them.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from firefly_sample.lab.x_display import start_display

SIZE = (160, 120)

CONFIGURATION = """
load-display pandagl
aux-display
textures-power-2 none
gl-check-errors true
audio-library-name null
notify-level-device fatal
hardware-animated-vertices false
"""
"""In Panda3D's own language; `notify-level-device` silences what it says of gamepads."""


class Picture(NamedTuple):
    """A picture of Panda3D, first row on top.

    Attributes
    ----------
    color : ndarray of uint8, shape (height, width, 4)
        Codes, alpha in the last channel.
    depth : ndarray of float32, shape (height, width)
        Of the depth buffer: 1 where nothing is.
    """

    color: np.ndarray
    depth: np.ndarray

    @property
    def covered(self) -> np.ndarray:
        """True where something was drawn."""
        return self.depth < 1.0


@contextmanager
def start_panda() -> Iterator[Callable[..., Picture]]:
    """A function that draws what another one builds: ``draw(build, *arguments, size=SIZE, auto=True)``.

    `build` is a function of a module, which returns the NodePaths of a root and of a camera. With `auto`,
    Panda3D shades by its shader generator, per pixel, else by OpenGL's fixed functions, per vertex.
    """
    spawn = multiprocessing.get_context("spawn")
    with (
        start_display() as display,
        ProcessPoolExecutor(1, mp_context=spawn, initializer=_use_display, initargs=(display,)) as pool,
    ):

        def draw(build: Callable[..., Any], *arguments: Any, size=SIZE, auto=True) -> Picture:
            return Picture(*pool.submit(_draw, build, arguments, size, auto).result())

        yield draw
        pool.submit(_close).result()


def _use_display(display: str) -> None:
    os.environ["DISPLAY"] = display
    from panda3d import core

    core.load_prc_file_data("tests", CONFIGURATION)


@cache
def _buffer(size):
    """A buffer with its textures of colour and depth; one for each size."""
    from panda3d import core

    engine = core.GraphicsEngine.get_global_ptr()
    wanted = core.FrameBufferProperties()
    wanted.set_rgba_bits(8, 8, 8, 8)
    wanted.set_depth_bits(32)
    wanted.set_float_depth(True)
    flags = core.GraphicsPipe.BF_refuse_window
    window = core.WindowProperties.size(*size)
    host = _host()
    buffer = engine.make_output(
        host.get_pipe(), f"buffer {size}", 0, wanted, window, flags, host.get_gsg(), host
    )
    assert buffer is not None, "Panda3D has no such buffer here"
    color, depth = core.Texture("color"), core.Texture("depth")
    color.set_format(core.Texture.F_rgba)
    depth.set_format(core.Texture.F_depth_component32)
    output = core.GraphicsOutput
    buffer.add_render_texture(color, output.RTM_copy_ram, output.RTP_color)
    buffer.add_render_texture(depth, output.RTM_copy_ram, output.RTP_depth)
    return buffer, color, depth


@cache
def _host():
    from panda3d import core

    engine = core.GraphicsEngine.get_global_ptr()
    pipe = core.GraphicsPipeSelection.get_global_ptr().make_default_pipe()
    plain = core.FrameBufferProperties.get_default()
    window = core.WindowProperties.size(16, 16)
    host = engine.make_output(pipe, "host", 0, plain, window, core.GraphicsPipe.BF_require_window)
    assert host is not None, "Panda3D opens no window here"
    engine.open_windows()
    return host


def _close() -> None:
    """Close all windows: at its exit, Panda3D would lock what is gone already."""
    from panda3d import core

    _buffer.cache_clear()
    _host.cache_clear()
    core.GraphicsEngine.get_global_ptr().remove_all_windows()


def _draw(build, arguments, size, auto):
    from panda3d import core

    root, camera = build(*arguments)
    if auto:
        root.set_shader_auto()
    buffer, color, depth = _buffer(size)
    buffer.set_clear_color((0, 0, 0, 0))
    region = buffer.make_display_region()
    region.set_camera(camera)
    engine = core.GraphicsEngine.get_global_ptr()
    buffer.set_active(True)
    for _ in range(2):  # textures and shadow maps are there from the second frame on
        engine.render_frame()
    buffer.remove_display_region(region)
    buffer.set_active(False)
    codes = np.frombuffer(color.get_ram_image_as("RGBA"), dtype=np.uint8)
    depths = np.frombuffer(depth.get_ram_image(), dtype=np.float32)
    width, height = size
    return codes.reshape(height, width, 4)[::-1].copy(), depths.reshape(height, width)[::-1].copy()
