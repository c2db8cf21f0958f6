"""Files in a cache folder: written completely or not at all; the least recently used are deleted.

Only files with this package's names are deleted: the folder may contain other files.
"""

from __future__ import annotations

import contextlib
import os
import re
import stat
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

_ABANDONED = 86_400.0
"""Seconds after which an unfinished file is deleted, because its writer has died."""
_UNFINISHED = re.compile(r"\.firefly_sample-\w{8}\.tmp")
"""The names that `keep_whole` gives while it writes."""


def user_cache(kind: str) -> Path | None:
    """Return the folder ``firefly_sample/<kind>`` in the user's cache; None if there is no home folder.

    The cache is $XDG_CACHE_HOME, or ~/.cache. A relative $XDG_CACHE_HOME does not count, as the XDG Base
    Directory Specification has it.
    """
    given = os.environ.get("XDG_CACHE_HOME", "")
    try:
        base = Path(given) if os.path.isabs(given) else Path.home() / ".cache"
    except RuntimeError:  # no home
        return None
    return base / "firefly_sample" / kind if base.is_absolute() else None


@contextmanager
def keep_whole(path: Path) -> Iterator[IO[bytes]]:
    """Open a temporary file that becomes `path` at the end: readers find all of it or nothing.

    Raises
    ------
    OSError
        If it cannot be written; the temporary file is removed.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".firefly_sample-", suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        os.replace(temporary, path)
    except BaseException:
        with contextlib.suppress(OSError):
            Path(temporary).unlink()
        raise


def drop_old(newest: Path, own: re.Pattern[str], largest: int) -> None:
    """Delete the least recently used files of one kind until the rest fits; never the newest.

    Parameters
    ----------
    newest : Path
        The file that was just written.
    own : re.Pattern
        Matches the names of the files of its kind, and no others.
    largest : int
        Bytes that all of them may take.
    """
    files, now = [], time.time()
    for path, status in _regular_files(newest.parent):
        if own.fullmatch(path.name):
            files.append((path != newest, -status.st_mtime_ns, status.st_size, path))
        elif _UNFINISHED.fullmatch(path.name) and now - status.st_mtime > _ABANDONED:
            _delete(path)
    total = 0
    for _, _, size, path in sorted(files):
        total += size
        if total > largest and path != newest:
            _delete(path)


def _regular_files(folder: Path) -> Iterator[tuple[Path, os.stat_result]]:
    for path in folder.iterdir():
        with contextlib.suppress(OSError):  # another process may delete, too
            status = path.lstat()
            if stat.S_ISREG(status.st_mode):
                yield path, status


def _delete(path: Path) -> None:
    with contextlib.suppress(OSError):
        path.unlink()
