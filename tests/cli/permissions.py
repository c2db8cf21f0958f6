"""Permissions that count for root as they do for everybody, without becoming somebody else.

Another user may not even enter the folder that the checkout is in.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_VERSION_3 = 0x20080522
_WRITE, _SEARCH = 1 << 1, 1 << 2
"""CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH: see capabilities(7)."""


@contextmanager
def obeyed_permissions() -> Iterator[None]:
    """Take from this thread, and from those that it starts, what lets root ignore the modes of files."""
    if not sys.platform.startswith("linux"):
        assert os.geteuid() != 0
        yield
        return
    libc = ctypes.CDLL(None, use_errno=True)
    header = (ctypes.c_uint32 * 2)(_VERSION_3, 0)
    # effective, permitted and inheritable, twice: of capabilities 0 to 31, and of the others
    sets = (ctypes.c_uint32 * 6)()

    def call(function: str) -> None:
        if getattr(libc, function)(header, sets) != 0:
            raise OSError(ctypes.get_errno(), f"{function} failed")

    call("capget")
    before = sets[0]
    sets[0] = before & ~(_WRITE | _SEARCH)
    call("capset")
    try:
        yield
    finally:
        sets[0] = before
        call("capset")
