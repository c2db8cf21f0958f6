"""Files that are written whole or not at all."""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from firefly_sample.errors import FireflyError

_UNFINISHED = re.compile(r"\..+\.\d+(-\d+)?\.part")
"""The names that `open_whole` gives until a file is complete."""
_numbers = itertools.count()


@contextmanager
def open_whole(path: Path, sync: bool = False) -> Iterator[IO[bytes]]:
    """Open a file for writing that gets its name only when it is complete; raise a FireflyError if it fails.

    It has a temporary name in the same folder until then, because renaming within a folder is atomic. With
    `sync` all of its content is on the disk before it gets its name, which is there after `sync_folder`.
    """
    # two threads may write the same file
    unfinished = path.with_name(f".{path.name}.{os.getpid()}-{next(_numbers)}.part")
    try:
        with unfinished.open("wb") as file:
            yield file
            if sync:
                file.flush()
                os.fsync(file.fileno())
        unfinished.replace(path)
    except BaseException as error:
        with suppress(OSError):
            unfinished.unlink()
        if isinstance(error, OSError):
            raise FireflyError(f"cannot write {path}: {error.strerror or error}") from error
        raise


def is_unfinished(name: str) -> bool:
    """Return whether a file has a name that `open_whole` gives until it is complete."""
    return _UNFINISHED.fullmatch(name) is not None
