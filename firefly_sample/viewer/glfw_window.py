"""A window with an OpenGL 3.3 context, and its events, by glfw."""

from __future__ import annotations

import os
import sys
import warnings
from types import ModuleType
from typing import TYPE_CHECKING, Any

from firefly_sample.errors import ViewerError
from firefly_sample.extras import install_command
from firefly_sample.viewer.controls import NAMED_KEYS

if TYPE_CHECKING:
    from firefly_sample.viewer.viewer import Viewer

LARGEST = 16384
"""The largest width or height of a window."""


def check_display() -> None:
    """Raise a ViewerError if there is no glfw or no display, before anything slow is done."""
    load_glfw()
    if _needs_x11() and not os.environ.get("DISPLAY"):
        wayland = os.environ.get("WAYLAND_DISPLAY")
        missing = "this Wayland session has no XWayland" if wayland else "no display"
        raise _no_window(f"{missing} (DISPLAY is not set)")


class Window:
    """An open window whose context is current in this thread; leaving it closes it.

    Raises a ViewerError without a display, glfw or OpenGL 3.3, or if `size` is above `LARGEST`.

    Parameters
    ----------
    size : (int, int)
        Width and height in the screen's coordinates, which are pixels on an ordinary screen.

    Attributes
    ----------
    uncovered : bool
        True if a part of the window was uncovered during the last `wait` and must be drawn again.
    """

    def __init__(self, title: str, size: tuple[int, int]) -> None:
        if max(size) > LARGEST:
            # X11 would end the process
            raise ViewerError(
                f"a window of {size[0]}x{size[1]} is above the limit of {LARGEST} pixels a side: "
                "choose a smaller size"
            )
        self._glfw: Any = load_glfw()
        self._button: str | None = None
        self._cursor = (0.0, 0.0)
        self._title = title
        self.uncovered = False
        # glfw reports errors as warnings as well: here they become one error
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self._handle = self._open(title, size)
        self._glfw.make_context_current(self._handle)
        self._waits = False
        self.wait_for_screen(True)

    def _open(self, title: str, size: tuple[int, int]) -> Any:
        glfw = self._glfw
        if not glfw.init():
            raise _no_window(self._complaint())
        for hint, value in (
            (glfw.CONTEXT_VERSION_MAJOR, 3),
            (glfw.CONTEXT_VERSION_MINOR, 3),
            (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
            (glfw.OPENGL_FORWARD_COMPAT, True),
            # the renderer draws into textures of its own, so the window needs no depth
            (glfw.DEPTH_BITS, 0),
            (glfw.STENCIL_BITS, 0),
        ):
            glfw.window_hint(hint, value)
        handle = glfw.create_window(*size, title, None, None)
        if not handle:
            complaint = self._complaint()
            glfw.terminate()
            raise _no_window(complaint)
        return handle

    def _complaint(self) -> str:
        text = self._glfw.get_error()[1]
        return f"glfw says {text.decode(errors='replace')!r}" if text else "glfw does not say why"

    def listen(self, viewer: Viewer) -> None:
        """Pass keys, drags and the wheel to `viewer` from now on; `wait` calls its methods."""
        glfw = self._glfw
        names = {getattr(glfw, f"KEY_{name.upper()}"): name for name in NAMED_KEYS}
        buttons = {
            getattr(glfw, f"MOUSE_BUTTON_{name.upper()}"): name for name in ("left", "right", "middle")
        }

        def key(_: Any, code: int, scancode: int, action: int, __: int) -> None:
            if action != glfw.RELEASE:
                viewer.key(names.get(code) or self._letter(code, scancode), action == glfw.REPEAT)

        def button(_: Any, code: int, action: int, __: int) -> None:
            name = buttons.get(code)
            if action == glfw.PRESS and self._button is None:
                self._button = name
            elif action == glfw.RELEASE and name == self._button:
                self._button = None

        def move(_: Any, x: float, y: float) -> None:
            # tracked, because glfw.get_cursor_pos is ahead of the events that are not yet handled
            right, down = x - self._cursor[0], y - self._cursor[1]
            self._cursor = x, y
            if self._button is not None:
                height = max(1, glfw.get_window_size(self._handle)[1])
                viewer.drag(self._button, right / height, down / height)

        def uncover(_: Any) -> None:
            self.uncovered = True

        glfw.set_key_callback(self._handle, key)
        glfw.set_mouse_button_callback(self._handle, button)
        glfw.set_cursor_pos_callback(self._handle, move)
        glfw.set_scroll_callback(self._handle, lambda _, __, steps: viewer.scroll(steps))
        glfw.set_window_refresh_callback(self._handle, uncover)

    def _letter(self, code: int, scancode: int) -> str:
        """Return the label of a key; if that is no Latin letter, the label on an American keyboard."""
        printed = (self._glfw.get_key_name(code, scancode) or "").lower()
        if printed and printed.isascii():
            return printed
        return chr(code).lower() if 32 < code < 127 else ""

    def set_title(self, title: str) -> None:
        """Change the title."""
        if title != self._title:
            self._title = title
            self._glfw.set_window_title(self._handle, title)

    @property
    def closed(self) -> bool:
        """True after the user has asked to close the window."""
        return bool(self._glfw.window_should_close(self._handle))

    @property
    def hidden(self) -> bool:
        """True if the window is minimised."""
        iconified = self._glfw.get_window_attrib(self._handle, self._glfw.ICONIFIED)
        return bool(iconified) or 0 in self.framebuffer_size

    @property
    def framebuffer_size(self) -> tuple[int, int]:
        """Width and height in pixels; on a high-density screen they are larger than the window's."""
        width, height = self._glfw.get_framebuffer_size(self._handle)
        return int(width), int(height)

    @property
    def scale(self) -> float:
        """Scale of text; 1 on an ordinary screen."""
        across, down = self._glfw.get_window_content_scale(self._handle)
        return max(1.0, float(across), float(down))

    def wait(self, seconds: float) -> None:
        """Handle the events so far; with `seconds` above 0, wait at most that long for one."""
        self.uncovered = False
        if seconds > 0:
            self._glfw.wait_events_timeout(seconds)
        else:
            self._glfw.poll_events()

    def wait_for_screen(self, wait: bool) -> None:
        """Let `swap` wait for the screen's next refresh, or not."""
        if wait != self._waits:
            self._waits = wait
            self._glfw.swap_interval(int(wait))

    def swap(self) -> None:
        """Show the drawn frame."""
        self._glfw.swap_buffers(self._handle)

    def __enter__(self) -> Window:
        return self

    def __exit__(self, *_: object) -> None:
        self._glfw.destroy_window(self._handle)
        self._glfw.terminate()


def _needs_x11() -> bool:
    return sys.platform.startswith(("linux", "freebsd"))


def load_glfw() -> ModuleType:
    """Import glfw, or raise a ViewerError; on Linux in its X11 variant, because our window contexts are GLX.

    During its import, glfw inspects libraries in child processes. PYTHONSAFEPATH keeps these from importing
    modules of the working folder.
    """
    wanted = {"PYTHONSAFEPATH": "1"} | ({"PYGLFW_LIBRARY_VARIANT": "x11"} if _needs_x11() else {})
    before = {name: os.environ.get(name) for name in wanted}
    os.environ.update(wanted)
    try:
        import glfw
    except ImportError as error:
        raise ViewerError(
            f"a window needs the package glfw ({error}): run {install_command('window')}, "
            "or use 'firefly capture', which needs no window"
        ) from None
    finally:
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value
    return glfw


def _no_window(reason: str) -> ViewerError:
    return ViewerError(
        f"no window can be opened: {reason}; use 'firefly capture' for pictures on disk, "
        "or 'xvfb-run -a firefly run' for a display that exists in memory only"
    )
