"""The OpenGL context, which EGL makes without a window, or which belongs to a window."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from ctypes.util import find_library
from functools import cache
from typing import Any

import moderngl

from firefly_sample.errors import GpuError, NoGpuError
from firefly_sample.gpu.current import (
    CurrentContext,
    current_context,
    is_supported,
    make_current,
    restore_current,
    thread_without_context,
)
from firefly_sample.gpu.driver_checks import (
    check_not_forked,
    check_threads,
    check_vector_width,
    note_opened,
    variables_set,
)
from firefly_sample.gpu.raw import DEPTH_CLAMP, FRAMEBUFFER_SRGB, RawGL
from firefly_sample.plan.frame_plan import Capabilities

_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader", "software", "basic render")


class Device:
    """An OpenGL 3.3 core context and its capabilities.

    Enter it (``with device:``) around GL calls. This makes its context current in this thread; leaving it
    makes the earlier one current again, another library's or none. Other threads that enter it wait.

    Parameters
    ----------
    index : int, optional
        EGL device; when absent, the environment variable GLCONTEXT_DEVICE_INDEX or else 0.
    window : bool
        Use the window's context that is current in this thread instead of making one.

    Raises
    ------
    NoGpuError
        If there is no OpenGL 3.3 or no such device, or if this process was forked after the driver was used.
    GpuError
        If the environment makes the driver overwrite memory.
    """

    def __init__(self, index: int | None = None, window: bool = False) -> None:
        check_not_forked(current_context() if window else None)
        self._process = os.getpid()
        self._lock = threading.RLock()
        self._before: list[CurrentContext | None] = []
        self._window = window
        with nullcontext() if window else thread_without_context():
            self._backend = _window_backend() if window else _egl_backend(index)
            try:
                self._own = _made_context()
                self._learn()
            except BaseException:
                self._backend.release()
                raise
        self._open = True

    def _learn(self) -> None:
        """Ask the driver for its name and capabilities."""
        with _default_context_kept():
            try:
                self.ctx = moderngl.create_context(context=self._backend)
            except Exception as error:
                raise NoGpuError(
                    f"OpenGL 3.3 core is needed, but the driver reports: {_one_line(error)}: install a newer "
                    "driver or Mesa's llvmpipe"
                ) from error
        info = self.ctx.info  # asks the driver for all of it, each time
        self.raw = RawGL(self._backend)
        self.renderer: str = info["GL_RENDERER"]
        check_vector_width(self.renderer)
        self.software = any(name in self.renderer.lower() for name in _SOFTWARE)
        check_threads(self.renderer)
        note_opened(self._own, self.renderer, self.software)
        self.version: str = info["GL_VERSION"]
        self.vendor: str = info["GL_VENDOR"]
        self.max_size: int = min(info["GL_MAX_TEXTURE_SIZE"], *info["GL_MAX_VIEWPORT_DIMS"])
        extensions = self.ctx.extensions
        self.capabilities = Capabilities(
            clip_control="GL_ARB_clip_control" in extensions or self.ctx.version_code >= 450,
            snorm_targets="GL_EXT_render_snorm" in extensions or self._can_render(0x8F99),
            float64="GL_ARB_gpu_shader_fp64" in extensions,
        )
        self._idle = self.ctx.simple_framebuffer((1, 1))

    def unbind(self) -> None:
        """Bind the device's own framebuffer and no program, so that those in use can be released."""
        self._idle.use()
        self.raw.call("glUseProgram", 0)

    def require_gpu(self) -> None:
        """Raise `NoGpuError` if the driver is a software rasteriser."""
        if self.software:
            raise NoGpuError(
                f"a GPU is required, but the driver is a software rasteriser ({self.renderer}): "
                "install the GPU's driver, or leave require_gpu out"
            )

    def check_size(self, size: tuple[int, int], samples: int = 1) -> None:
        """Raise `GpuError` if a picture with `samples` per pixel across and down is too large."""
        if max(size) * samples > self.max_size:
            scaled = f" at supersample {samples}" if samples > 1 else ""
            raise GpuError(
                f"size {size[0]}x{size[1]}{scaled} is above this driver's limit of {self.max_size} pixels a "
                "side: choose a smaller one"
            )

    def _can_render(self, internal_format: int) -> bool:
        """Return True if pairs of 16-bit signed normalised numbers can be drawn to, an option of 3.3."""
        with ExitStack() as made:
            try:
                texture = self.ctx.texture((1, 1), 2, dtype="ni2", internal_format=internal_format)
                made.callback(texture.release)
                self.ctx.framebuffer([texture]).release()
            except Exception:  # noqa: BLE001  moderngl has one class for every refusal
                return False
        return self.ctx.error == "GL_NO_ERROR"

    def set_depth_clamp(self, on: bool) -> None:
        """Clamp depth to the near and far planes instead of clipping there."""
        (self.ctx.enable_direct if on else self.ctx.disable_direct)(DEPTH_CLAMP)

    def set_srgb_encoding(self, on: bool) -> None:
        """Encode colours that are drawn into sRGB targets, or write them unchanged."""
        (self.ctx.enable_direct if on else self.ctx.disable_direct)(FRAMEBUFFER_SRGB)

    def flush(self) -> None:
        """Let the driver begin with the commands so far."""
        self.raw.call("glFlush")

    def check(self, where: str) -> None:
        """Raise `GpuError`, which names `where`, if the driver noted an error since the last check."""
        error = self.ctx.error
        if error != "GL_NO_ERROR":
            raise GpuError(f"the driver reported {error} in {where} ({self.renderer})")

    @property
    def inherited(self) -> bool:
        """True if this process was forked from the one that made the device."""
        return os.getpid() != self._process

    def exclusively(self) -> AbstractContextManager[Any]:
        """Return a context manager that keeps other threads out; raise `GpuError` in a forked process."""
        if self.inherited:  # in a fork, the lock may be held by a thread that only the parent has
            check_not_forked(self._own)
            raise GpuError("this renderer was made before this process was forked: make a new one here")
        return self._lock

    def __enter__(self) -> Device:
        self.exclusively().__enter__()
        try:
            if not self._open:  # a different thread may have closed it meanwhile
                raise GpuError("this renderer is closed: make a new one")
            self._before.append(self._make_current())
        except BaseException:
            self._lock.release()
            raise
        return self

    def _make_current(self) -> CurrentContext | None:
        """Make the context current and return the one before."""
        if self._own is None:  # neither EGL nor GLX: the backend restores the one before by itself
            self._backend.__enter__()
            return None
        before = current_context()
        if not self._own.is_same(before):
            try:
                make_current(self._own, before)
            except GpuError:
                restore_current(before)
                raise
        return before

    def __exit__(self, *_: object) -> None:
        try:
            before = self._before.pop()
            if self._own is None:
                self._backend.__exit__()
            elif not self._own.is_same(before):
                restore_current(before)
        finally:
            self._lock.release()

    def is_gone(self) -> bool:
        """Return True if another library has destroyed the context, and with it every object.

        A GLX context counts as gone if it cannot be made current, because its window is closed.
        """
        if not self._window:
            return self._own is not None and self._own.is_gone()
        try:
            with self:
                return False
        except GpuError:
            return True

    def release(self) -> None:
        """Free the context itself. Objects must have been released before."""
        if self._window:
            with self:
                for attachment in self._idle.color_attachments:
                    attachment.release()
                self._idle.depth_attachment.release()
                self._idle.release()
        self.abandon()

    def abandon(self) -> None:
        """Free the context without making it current, and with it every object that no window shares.

        This does nothing if the context is gone, or if this process was forked from the one that made it.
        """
        if self._open:
            self._open = False
            gone = self._own is not None and self._own.is_gone()
            if not (self.inherited or gone):
                self.ctx.release()

    def __del__(self) -> None:
        if getattr(self, "_open", False) and not sys.is_finalizing():
            self.abandon()


def _made_context() -> CurrentContext | None:
    """Return the context that was just made or taken over; None on systems without EGL and GLX."""
    context = current_context()
    if context is None and is_supported():
        raise NoGpuError("the driver has made an OpenGL context, but cannot make it current")
    return None if context is None else context.with_connection()


@contextmanager
def _default_context_kept() -> Iterator[None]:
    """Restore `moderngl.get_context()`, on which other parts of the program may rely."""
    store = getattr(moderngl, "_store", None)
    before = getattr(store, "default_context", None)
    try:
        yield
    finally:
        if store is not None:
            store.default_context = before


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__


@cache
def _library(name: str) -> str | None:
    """Return the file of a library: glcontext would start a process to look for it, for each context."""
    return find_library(name)


def _egl_backend(index: int | None) -> Any:
    import glcontext

    given = os.environ.get("GLCONTEXT_DEVICE_INDEX")
    if given is not None and not given.isdigit():
        raise NoGpuError(f"the environment's GLCONTEXT_DEVICE_INDEX must be a whole number, got {given!r}")
    if index is None:
        index = int(given or 0)
    if index < 0:
        raise NoGpuError(f"device must be 0 or more, got {index}")
    try:
        # glcontext would prefer the environment to the given index
        os.environ.pop("GLCONTEXT_DEVICE_INDEX", None)
        return glcontext.get_backend_by_name("egl")(
            mode="standalone",
            glversion=330,
            device_index=index,
            libgl=_library("GL"),
            libegl=_library("EGL"),
        )
    except Exception as error:
        raise NoGpuError(_explain(error, index)) from error
    finally:
        if given is not None:
            os.environ["GLCONTEXT_DEVICE_INDEX"] = given


def _window_backend() -> Any:
    import glcontext

    if (context := current_context()) is not None and context.api != "GLX":
        raise NoGpuError(
            f"window=True needs a window's GLX context, but one of {context.api} is current in this thread: "
            "make the window's context current first, and have its library create it with GLX"
        )
    try:
        return glcontext.default_backend()(mode="detect", glversion=330)
    except Exception as error:
        raise NoGpuError(
            "window=True needs a window's OpenGL context, but none is current in this thread "
            f"({_one_line(error)}): make it current first"
        ) from error


def _explain(error: BaseException, index: int) -> str:
    """Return the reason why EGL made no context, and the way out, in one line."""
    said = _one_line(error)
    if "0x3" in said and variables_set():  # an error of EGL itself
        given = " and ".join(f"{name}={value}" for name, value in variables_set().items())
        return f"no OpenGL 3.3 context could be made ({said}) with {given} in the environment: unset that"
    if "libEGL" in said or "libGL" in said:
        return (
            f"no OpenGL library ({said}): install Mesa, on Debian or Ubuntu with "
            "'apt-get install libegl1 libgl1 libgl1-mesa-dri'"
        )
    if "device" in said:
        return f"there is no EGL device {index} ({said}): leave the device out for the default, 0"
    if "0x3009" in said:
        return f"the driver has no OpenGL 3.3 core ({said}): install a newer driver or Mesa's llvmpipe"
    return f"no OpenGL context could be made ({said}): run 'firefly doctor'"
