"""Files in a cache folder: written whole or not at all, and the ones used least lately deleted.

Only what this package wrote is ever deleted, known by its name: the folder may hold other files as well.
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
"""Seconds after which the file of a writer that died is nobody's."""
_UNFINISHED = re.compile(r"\.firefly_sample-\w{8}\.tmp")
"""The names that `keep_whole` gives while it writes."""


def user_cache(kind: str) -> Path | None:
    """The folder ``firefly_sample/<kind>`` in the user's cache; None if nobody knows the user's home.

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
    """A file to write beside the place, then moved: whoever reads finds all of it or nothing.

    Raises
    ------
    OSError
        If it cannot be written; nothing of it is left then.
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
    """Delete what was used least lately of a folder's files of one kind, so that they fit; never the newest.

    Parameters
    ----------
    newest : Path
        The file that was written last.
    own : re.Pattern
        Matches the whole names of the files of its kind, and nobody else's.
    largest : int
        Bytes of all of them together.
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
