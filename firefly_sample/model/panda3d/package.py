"""Import Panda3D late: it is an extra."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from firefly_sample.errors import MissingPackageError
from firefly_sample.extras import install_command


def import_panda3d() -> Any:
    """Return the module panda3d.core.

    Raises
    ------
    MissingPackageError
        If it is not installed.
    """
    try:
        return import_module("panda3d.core")
    except ImportError as error:
        raise MissingPackageError(
            f"Panda3D cannot be imported ({error}): run {install_command('panda3d')}"
        ) from error
