"""Command lines that install packages which only a part of this one needs."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Iterable


def install_command(extra: str) -> str:
    """Return the command line that installs the packages of an extra, for example "measure".

    It calls this process's own Python, so that it needs no command ``pip``, and names each package.
    """
    from importlib.metadata import PackageNotFoundError, requires

    try:
        requirements = requires("firefly_sample") or []
    except PackageNotFoundError:  # run from a checkout that is not installed
        requirements = []
    specs = [
        spec.strip()
        for spec, _, marker in (requirement.partition(";") for requirement in requirements)
        if re.search(rf"extra == ['\"]{extra}['\"]", marker)
    ]
    return pip_install(specs or [f"firefly_sample[{extra}]"])


def pip_install(specs: Iterable[str]) -> str:
    """Return the command line that installs packages for this process's own Python."""
    return shlex.join([sys.executable, "-m", "pip", "install", *specs])
