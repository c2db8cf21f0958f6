"""Find the OpenGL context that is current in this thread, and make it or another one current.

A thread has at most one current context. EGL makes some of them (ours without a window, pyrender's), GLX
the others (those of X11 windows: Panda3D's, pyglet's, glfw's). While a GLX context is current, EGL refuses to
make one of its own current, and OpenGL's functions draw into the GLX context. The library that made the
current context must therefore release it first.

Only libraries that the process has loaded already are used. On systems without EGL and GLX nothing is found.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

from firefly_sample.errors import GpuError

_EGL_DRAW, _EGL_READ, _EGL_CONFIG_ID, _EGL_BAD_ACCESS = 0x3059, 0x305A, 0x3028, 0x3002
_EGL_OPENGL_ES_API = 0x30A0
_HANDLE, _XID = ctypes.c_void_p, ctypes.c_ulong

_FILES = {"EGL": ("libEGL.so.1",), "GLX": ("libGL.so.1", "libGLX.so.0"), "X11": ("libX11.so.6",)}
_SIGNATURES: dict[str, dict[str, tuple[Any, ...]]] = {  # name: (type of result, types of arguments...)
    "EGL": {
        "eglGetCurrentContext": (_HANDLE,),
        "eglGetCurrentDisplay": (_HANDLE,),
        "eglGetCurrentSurface": (_HANDLE, ctypes.c_int),
        "eglMakeCurrent": (ctypes.c_uint, _HANDLE, _HANDLE, _HANDLE, _HANDLE),
        "eglQueryContext": (ctypes.c_uint, _HANDLE, _HANDLE, ctypes.c_int, _HANDLE),
        "eglGetError": (ctypes.c_int,),
        "eglQueryAPI": (ctypes.c_uint,),
        "eglBindAPI": (ctypes.c_uint, ctypes.c_uint),
    },
    "GLX": {
        "glXGetCurrentContext": (_HANDLE,),
        "glXGetCurrentDisplay": (_HANDLE,),
        "glXGetCurrentDrawable": (_XID,),
        "glXGetCurrentReadDrawable": (_XID,),
        "glXMakeContextCurrent": (ctypes.c_int, _HANDLE, _XID, _XID, _HANDLE),
    },
    "X11": {
        "XConnectionNumber": (ctypes.c_int, _HANDLE),
        "XSetErrorHandler": (_HANDLE, _HANDLE),
    },
}
_loaded: dict[str, ctypes.CDLL] = {}

_GONE = {
    "EGL": "this renderer's OpenGL context is gone: another library has shut down the EGL display that both "
    "use (pyrender's OffscreenRenderer.delete() does); close the Renderer before that, or make another",
    "GLX": "this renderer's OpenGL context is gone with its window: close the Renderer before the window",
}


_ignore_x_error = ctypes.CFUNCTYPE(ctypes.c_int, _HANDLE, _HANDLE)(lambda display, event: 0)


class CurrentContext(NamedTuple):
    """A context that is or was current in a thread, and the surfaces that it draws to and reads from.

    `api`, "EGL" or "GLX", is the library that made it. The numbers are handles, 0 is none; `connection` is
    noted by `with_connection`.
    """

    api: str
    display: int
    context: int
    draw: int = 0
    read: int = 0
    connection: tuple[int, int] | None = None

    def is_same(self, other: CurrentContext | None) -> bool:
        """Return True if `other` is the same context, whatever surfaces either has."""
        return other is not None and self[:3] == other[:3]

    def with_connection(self) -> CurrentContext:
        """Return the same context with a note of its connection to the X server, to be made current later.

        Its GLX window may be closed by then. Xlib must not be called for a closed connection, whose memory is
        freed: therefore the connection's file number and inode are noted and compared.
        """
        xlib = _library("X11") if self.api == "GLX" else None
        if xlib is None:
            return self
        number = xlib.XConnectionNumber(self.display)
        return self._replace(connection=(number, os.fstat(number).st_ino))

    def is_gone(self) -> bool:
        """Return True if the display on which the context was made has been shut down."""
        if self.api == "GLX":
            return self.lost_connection()
        value = ctypes.c_int()
        return not _loaded["EGL"].eglQueryContext(
            self.display, self.context, _EGL_CONFIG_ID, ctypes.byref(value)
        )

    def lost_connection(self) -> bool:
        """Return True if the connection that `with_connection` has noted was closed."""
        if self.connection is None:
            return False
        number, inode = self.connection
        try:
            return os.fstat(number).st_ino != inode
        except OSError:
            return True


def current_context() -> CurrentContext | None:
    """Return the context that is current in this thread, or None."""
    egl = _library("EGL")
    if egl is not None and (context := egl.eglGetCurrentContext()):
        draw, read = (egl.eglGetCurrentSurface(which) or 0 for which in (_EGL_DRAW, _EGL_READ))
        return CurrentContext("EGL", egl.eglGetCurrentDisplay() or 0, context, draw, read)
    glx = _library("GLX")
    if glx is not None and (context := glx.glXGetCurrentContext()):
        draw, read = glx.glXGetCurrentDrawable(), glx.glXGetCurrentReadDrawable()
        return CurrentContext("GLX", glx.glXGetCurrentDisplay() or 0, context, draw, read)
    return None


def is_supported() -> bool:
    """Return True if EGL or GLX is loaded, without which `current_context` finds nothing."""
    return _library("EGL") is not None or _library("GLX") is not None


def make_current(wanted: CurrentContext | None, present: CurrentContext | None) -> None:
    """Make a context current in this thread, or none, in place of the present one, or raise `GpuError`."""
    if present is not None and (wanted is None or wanted.api != present.api):
        _set(CurrentContext(present.api, present.display, 0))
    if wanted is None:
        return
    if wanted.lost_connection():
        raise GpuError(_GONE["GLX"])
    error = _set(wanted)
    name = "eglGetCurrentContext" if wanted.api == "EGL" else "glXGetCurrentContext"
    if getattr(_loaded[wanted.api], name)() != wanted.context:
        raise GpuError(_refusal(wanted, error))


def restore_current(before: CurrentContext | None) -> None:
    """Make the earlier context current again, or none if that is no longer possible.

    It is not if its library has destroyed the context meanwhile, or made it current in a different thread.
    """
    try:
        make_current(before, current_context())
    except GpuError:
        make_current(None, current_context())


@contextmanager
def thread_without_context() -> Iterator[None]:
    """Release the context that is current in this thread, and make it current again at the end.

    The API that is bound in EGL, which decides the kind of its next context, is restored as well.
    """
    before, egl = current_context(), _library("EGL")
    api = _EGL_OPENGL_ES_API if egl is None else egl.eglQueryAPI()  # EGL's default
    make_current(None, before)
    try:
        yield
    finally:
        if (egl := _library("EGL")) is not None:
            egl.eglBindAPI(api)
        restore_current(before)


def _set(wanted: CurrentContext) -> int:
    """Make a context current by its own library; return EGL's error or 0, and for GLX always 0."""
    api, display, context, draw, read, _ = wanted
    if api == "EGL":
        egl = _loaded["EGL"]
        return 0 if egl.eglMakeCurrent(display, draw, read, context) else int(egl.eglGetError())
    with _without_x_errors():
        _loaded["GLX"].glXMakeContextCurrent(display, draw, read, context)
    return 0


def _refusal(wanted: CurrentContext, error: int) -> str:
    """Say why a context could not be made current."""
    if wanted.is_gone():
        return _GONE[wanted.api]
    if (now := current_context()) is not None:
        return (
            f"this {wanted.api} context cannot be made current: another library's {now.api} context is "
            "current in this thread and could not be released; release it first, or draw in another thread"
        )
    if wanted.api == "GLX":
        return (
            "the window's OpenGL context cannot be made current: the window is closed, or the context is "
            "current in another thread; close the Renderer before its window, and draw in the window's thread"
        )
    if error == _EGL_BAD_ACCESS:
        return (
            "this EGL context cannot be made current: it is current in another thread; release it there first"
        )
    return f"this EGL context cannot be made current: the driver reports EGL error 0x{error:x}"


@contextmanager
def _without_x_errors() -> Iterator[None]:
    """Keep Xlib from ending the process if GLX refuses; the caller compares the current context instead."""
    xlib = _library("X11")
    if xlib is None:
        yield
        return
    before = xlib.XSetErrorHandler(ctypes.cast(_ignore_x_error, _HANDLE))
    try:
        yield
    finally:
        xlib.XSetErrorHandler(before)


def _library(api: str) -> ctypes.CDLL | None:
    """Return a library if this process has loaded it."""
    library = _loaded.get(api)
    if library is None and sys.platform.startswith(("linux", "freebsd")):
        for file in _FILES[api]:
            try:
                library = ctypes.CDLL(file, mode=os.RTLD_NOLOAD | os.RTLD_LAZY)
            except OSError:
                continue
            for name, (returns, *takes) in _SIGNATURES[api].items():
                function = getattr(library, name)
                function.restype, function.argtypes = returns, takes
            _loaded[api] = library
            break
    return library
