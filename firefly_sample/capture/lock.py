"""Locks on a folder, which the system lets go of when the process that holds them ends, however it ends."""

from __future__ import annotations

import logging
import os
import socket
import warnings
from contextlib import suppress
from pathlib import Path

from firefly_sample.errors import OutputError

log = logging.getLogger(__name__)


class Lock:
    """A lock that is held from its making until `release`.

    Parameters
    ----------
    path : Path
        The lock's own file; it is removed at the end if nobody else holds it.
    busy : str
        The start of the error's message if somebody else holds the lock.
    shared : bool
        Several may hold it at once, if all of them share it. While one of them is the only one, by
        `become_exclusive`, this waits.

    Raises
    ------
    OutputError
        If it is held by another; it names the process.
    OSError
        If the file cannot be made.
    """

    def __init__(self, path: Path, busy: str, shared: bool = False) -> None:
        import fcntl

        self._path = path
        kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
        while True:
            self._handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
            try:
                try:
                    fcntl.flock(self._handle, kind | fcntl.LOCK_NB)
                except BlockingIOError:
                    if not shared or self._holder():
                        raise OutputError(f"{busy}{self._holder()}") from None
                    log.info("%s: wait until the one that shares it lets go of it", path)
                    fcntl.flock(self._handle, kind)
                except OSError as error:
                    warnings.warn(
                        f"{path} cannot be locked ({error.strerror}): see to it yourself that "
                        "no other capture writes into this folder",
                        stacklevel=2,
                    )
                if self._is_ours():
                    break
            except BaseException:
                os.close(self._handle)
                raise
            os.close(self._handle)  # its last holder has removed it meanwhile
        # of those that share it none is named, and nobody who was killed
        self._write_holder("" if shared else f"process {os.getpid()} on {socket.gethostname()}\n")

    def _is_ours(self) -> bool:
        """Return whether the path still leads to the file that was locked."""
        try:
            return os.path.samestat(os.fstat(self._handle), os.stat(self._path))
        except FileNotFoundError:
            return False

    def _holder(self) -> str:
        text = os.pread(self._handle, 200, 0).decode(errors="replace").strip()
        return f" ({text})" if text else ""

    def _write_holder(self, text: str) -> None:
        with suppress(OSError):  # a full disk: the lock holds all the same
            os.ftruncate(self._handle, 0)
            os.pwrite(self._handle, text.encode(), 0)

    def become_exclusive(self) -> bool:
        """Return whether nobody else holds a shared lock, which is exclusive then.

        If somebody else does, this lock is lost: release it.
        """
        import fcntl

        try:
            try:
                fcntl.flock(self._handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                # NFS keeps the shared lock: two that try at once would both fail, if each did not let go
                fcntl.flock(self._handle, fcntl.LOCK_UN)
                fcntl.flock(self._handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError:  # locks do not work here, of which was warned
            return True
        return self._is_ours()

    def release(self) -> None:
        """Let go of the lock, and remove its file if nobody else holds it."""
        if self.become_exclusive():
            with suppress(OSError):
                self._path.unlink()
        os.close(self._handle)
