"""Files in a cache folder: written whole or not at all, and the ones used least lately deleted."""

from __future__ import annotations

import contextlib
import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

__all__ = ["drop_old", "keep_whole"]

_ABANDONED = 86_400.0
"""Seconds after which the file of a writer that died is nobody's."""


@contextmanager
def keep_whole(path: Path) -> Iterator[IO[bytes]]:
    """A file to write beside the place, then moved: whoever reads finds all of it or nothing.

    Raises
    ------
    OSError
        If it cannot be written; nothing of it is left then.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            Path(temporary).unlink()
        raise


def drop_old(newest: Path, largest: int) -> None:
    """Delete what was used least lately of a folder's files of one kind, so that they fit; never the newest.

    Parameters
    ----------
    newest : Path
        The file that was written last; its suffix says which kind.
    largest : int
        Bytes of all of them together.
    """
    files = []
    for path in newest.parent.glob(f"*{newest.suffix}"):
        with contextlib.suppress(OSError):  # another process may delete, too
            stat = path.stat()
            files.append((path != newest, -stat.st_mtime_ns, stat.st_size, path))
    total = 0
    for _, _, size, path in sorted(files):
        total += size
        if total > largest and path != newest:
            with contextlib.suppress(OSError):
                path.unlink()
    for path in newest.parent.glob(".*.tmp"):
        with contextlib.suppress(OSError):
            if time.time() - path.stat().st_mtime > _ABANDONED:
                path.unlink()
