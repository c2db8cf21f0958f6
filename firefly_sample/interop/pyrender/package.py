"""Import pyrender, for its scenes alone, also where its viewer and its renderer lack system libraries."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import Any

from firefly_sample.errors import MissingPackageError
from firefly_sample.extras import install_command

_PACKAGES = "pyrender", "pyglet", "OpenGL"
_PLATFORM = "PYOPENGL_PLATFORM"


def import_pyrender() -> Any:
    """Return the module pyrender.

    Raises
    ------
    MissingPackageError
        If it or a package that it needs is not installed, or cannot be imported; the message says which.
    """
    try:
        return import_module("pyrender")
    except Exception as error:
        if isinstance(error, ModuleNotFoundError):  # pyrender itself, or a package that it needs
            fix = f"run {install_command('pyrender')}"
            raise MissingPackageError(f"pyrender cannot be imported ({error}): {fix}") from error
    try:
        return _import_without_display()
    except Exception as error:
        raise MissingPackageError(
            f"pyrender cannot be imported ({error}): on Debian, run "
            "apt-get install --no-install-recommends libegl1 libgl1"
        ) from error


def _import_without_display() -> Any:
    """Import pyrender anew, with neither X11 nor OSMesa: its viewer is of no use then."""
    for name in [name for name in sys.modules if name.partition(".")[0] in _PACKAGES]:
        del sys.modules[name]
    platform = os.environ.get(_PLATFORM)
    os.environ[_PLATFORM] = "egl"  # PyOpenGL reads it when it is imported
    try:
        import_module("pyglet").options["headless"] = True
        return import_module("pyrender")
    finally:
        if platform is None:
            del os.environ[_PLATFORM]
        else:
            os.environ[_PLATFORM] = platform
