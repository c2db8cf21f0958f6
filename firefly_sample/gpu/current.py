"""Find the OpenGL context that is current in this thread, and make it or another one current.

A thread has at most one current context. EGL makes some (ours without a window, pyrender's), GLX the others
(those of X11 windows: Panda3D's, pyglet's, glfw's). While a context of GLX is current, EGL refuses to make
one of its own current, and OpenGL's functions draw into that of GLX. The library that made the current
context must therefore release it first.

Only libraries that the process has loaded already are asked. On systems without EGL and GLX nothing is found.
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
_SIGNATURES: dict[str, dict[str, tuple[Any, ...]]] = {  # name: (what it returns, what it takes...)
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


class Holder(NamedTuple):
    """A context that is current in a thread, and what it draws to and reads from; numbers are handles.

    Attributes
    ----------
    api : str
        "EGL" or "GLX": the library that made it.
    display, context, draw, read : int
        0 is none.
    connection : (int, int) or None
        See `kept`.
    """

    api: str
    display: int
    context: int
    draw: int = 0
    read: int = 0
    connection: tuple[int, int] | None = None

    def holds(self, other: Holder | None) -> bool:
        """Return whether this is the same context as another one, whatever either draws to."""
        return other is not None and self[:3] == other[:3]

    def kept(self) -> Holder:
        """Return the same to be made current later, when a window of GLX may have been closed.

        Xlib must not be asked about a connection to the X server that was closed, since its memory is freed:
        the connection's file number and inode are noted to be compared.
        """
        xlib = _library("X11") if self.api == "GLX" else None
        if xlib is None:
            return self
        number = xlib.XConnectionNumber(self.display)
        return self._replace(connection=(number, os.fstat(number).st_ino))

    def is_gone(self) -> bool:
        """Return whether the display that the context was made on has been shut down."""
        if self.api == "GLX":
            return self.lost_connection()
        value = ctypes.c_int()
        return not _loaded["EGL"].eglQueryContext(
            self.display, self.context, _EGL_CONFIG_ID, ctypes.byref(value)
        )

    def lost_connection(self) -> bool:
        """Return whether the connection that `kept` has noted was closed."""
        if self.connection is None:
            return False
        number, inode = self.connection
        try:
            return os.fstat(number).st_ino != inode
        except OSError:
            return True


def current_holder() -> Holder | None:
    """Return the context that is current in this thread, or None."""
    egl = _library("EGL")
    if egl is not None and (context := egl.eglGetCurrentContext()):
        draw, read = (egl.eglGetCurrentSurface(which) or 0 for which in (_EGL_DRAW, _EGL_READ))
        return Holder("EGL", egl.eglGetCurrentDisplay() or 0, context, draw, read)
    glx = _library("GLX")
    if glx is not None and (context := glx.glXGetCurrentContext()):
        draw, read = glx.glXGetCurrentDrawable(), glx.glXGetCurrentReadDrawable()
        return Holder("GLX", glx.glXGetCurrentDisplay() or 0, context, draw, read)
    return None


def is_supported() -> bool:
    """Return whether EGL or GLX is loaded, so that `current_holder` can tell."""
    return _library("EGL") is not None or _library("GLX") is not None


def make_current(wanted: Holder | None, held: Holder | None) -> None:
    """Make a context current in this thread, or none; `held`, which is current now, is released.

    Raises
    ------
    GpuError
        If it cannot be made current; it names who holds the thread, or says that the context is gone.
    """
    if held is not None and (wanted is None or wanted.api != held.api):
        _set(Holder(held.api, held.display, 0))
    if wanted is None:
        return
    if wanted.lost_connection():
        raise GpuError(_GONE["GLX"])
    error = _set(wanted)
    current = (
        _loaded["EGL"].eglGetCurrentContext if wanted.api == "EGL" else _loaded["GLX"].glXGetCurrentContext
    )
    if current() != wanted.context:
        raise GpuError(_refusal(wanted, error))


def give_back(before: Holder | None) -> None:
    """Make current what was before, or nothing if it cannot be any more.

    A context that was current before, and cannot be made current again, was destroyed by its own library in
    the meantime, or moved to another thread.
    """
    try:
        make_current(before, current_holder())
    except GpuError:
        make_current(None, current_holder())


@contextmanager
def thread_without_context() -> Iterator[None]:
    """Release what is current in this thread, and make it current again at the end.

    The kind of context that EGL makes in this thread next is kept, too.
    """
    before, egl = current_holder(), _library("EGL")
    api = _EGL_OPENGL_ES_API if egl is None else egl.eglQueryAPI()  # what EGL begins with
    make_current(None, before)
    try:
        yield
    finally:
        if (egl := _library("EGL")) is not None:
            egl.eglBindAPI(api)
        give_back(before)


def _set(holder: Holder) -> int:
    """Ask the library of a holder to make it current; an error of EGL's or 0, and no word from GLX."""
    api, display, context, draw, read, _ = holder
    if api == "EGL":
        egl = _loaded["EGL"]
        return 0 if egl.eglMakeCurrent(display, draw, read, context) else int(egl.eglGetError())
    with _without_x_errors():
        _loaded["GLX"].glXMakeContextCurrent(display, draw, read, context)
    return 0


def _refusal(wanted: Holder, error: int) -> str:
    """Say why a context could not be made current."""
    if wanted.is_gone():
        return _GONE[wanted.api]
    if (now := current_holder()) is not None:
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
    """Keep Xlib from ending the process when GLX refuses, which is seen by what is current afterwards."""
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
    """A library, if this process has loaded it."""
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
