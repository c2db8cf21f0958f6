"""Connections to dask clusters: to a scheduler that runs, or to a cluster of processes on this machine."""

from __future__ import annotations

import logging
import multiprocessing
import os
import re
import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from multiprocessing import resource_tracker
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Literal

from firefly_sample.capture.machine import usable_cores
from firefly_sample.errors import FireflyError, MissingPackageError
from firefly_sample.extras import install_command

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

log = logging.getLogger(__name__)
LOCAL = "local"
"""The address that stands for a cluster of processes on this machine."""
CONNECT_SECONDS = 10.0
"""The time in which a scheduler must answer."""
_CONFIG = {
    # a frame that ends its worker is drawn alone before it counts as failed: see ClusterEngine
    "distributed.scheduler.allowed-failures": 1,
    "distributed.deploy.lost-worker-timeout": "1 hour",  # on a busy machine, a new process takes a while
    "distributed.scheduler.active-memory-manager.start": False,
    "distributed.scheduler.http.routes": [],
    "distributed.worker.profile.enabled": False,
    "distributed.admin.system-monitor.gil.enabled": False,
    "distributed.admin.low-level-log-length": 100,
    "distributed.admin.log-length": 100,
    "distributed.admin.system-monitor.log-length": 100,
}
"""For clusters on this machine: no statistics, and short logs, because the scheduler is in this process."""
_ADDRESS = re.compile(r"(tcp|tls|ws|wss|ucx|ucxx)://.+:\d+")
_GUARD = "a script that captures with processes must do so below the line: if __name__ == '__main__':"
_GROUP_SIGNALS = (signal.SIGINT, signal.SIGHUP)
"""Signals that a terminal sends to all processes, and that only this one may follow."""


@contextmanager
def connected(address: str, workers: int | Literal["auto"] | None) -> Iterator[Client]:
    """Connect with a cluster, and close the connection and a cluster that was started for it.

    Parameters
    ----------
    address : str
        ``tcp://host:port`` or another address that dask knows, a scheduler's file, or "local".
    workers : int, "auto" or None
        Processes of a cluster on this machine; one for each core unless it is a number.

    Raises
    ------
    MissingPackageError
        If distributed is not installed.
    FireflyError
        If there is no scheduler, or no process can be started.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingPackageError(
            f"a cluster needs distributed ({error}): run {install_command('cluster')}"
        ) from error
    if address != LOCAL and isinstance(workers, int):
        raise FireflyError(
            f"a number of workers goes with the cluster {LOCAL!r} only: {address} has the workers that it has"
        )
    with ExitStack() as opened:
        opened.enter_context(_quiet())
        try:
            if address != LOCAL and not os.path.isfile(address) and not _ADDRESS.fullmatch(address):
                raise ValueError("it must be tcp://host:port, the file of a scheduler, or local")
            if address == LOCAL:
                cluster = opened.enter_context(_local_cluster(workers))
                client = Client(cluster, direct_to_workers=True, set_as_default=False)
            elif os.path.isfile(address):
                client = Client(scheduler_file=address, timeout=CONNECT_SECONDS, set_as_default=False)
            else:
                client = Client(address, timeout=CONNECT_SECONDS, set_as_default=False)
        except (OSError, ValueError, ImportError, RuntimeError) as error:
            hint = _GUARD if address == LOCAL else "is its scheduler running?"
            raise FireflyError(f"cluster {address}: {' '.join(str(error).split())}: {hint}") from error
        opened.callback(close, client)
        yield client


@contextmanager
def _local_cluster(workers: int | Literal["auto"] | None) -> Iterator[LocalCluster]:
    """Start processes on this machine; they end with this one, however it ends."""
    import dask
    from distributed import LocalCluster

    if getattr(multiprocessing.current_process(), "_inheriting", False):
        # this is such a process, which runs the script of its parent; the parent's error tells what to do
        raise SystemExit(1)
    cores = usable_cores()
    number = workers if isinstance(workers, int) else cores
    env = {} if "LP_NUM_THREADS" in os.environ else {"LP_NUM_THREADS": str(max(cores // number, 1))}
    with (
        dask.config.set(_CONFIG),
        TemporaryDirectory(prefix="firefly-", ignore_cleanup_errors=True) as scratch,
    ):
        # the threads that start processes get this mask, and the processes get theirs; to start the tracker,
        # which is done only once, would undo it
        resource_tracker.ensure_running()
        before = signal.pthread_sigmask(signal.SIG_BLOCK, _GROUP_SIGNALS)
        try:
            cluster = LocalCluster(
                n_workers=number,
                threads_per_worker=1,
                processes=True,
                memory_limit=0,
                dashboard_address="127.0.0.1:0",  # of the scheduler's server, which cannot be left out
                scheduler_kwargs={"dashboard": False},
                silence_logs=logging.CRITICAL,
                local_directory=scratch,  # dask would leave files in the user's own
                env=env,
            )
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        try:
            yield cluster
        finally:
            close(cluster)


def close(opened: Client | LocalCluster) -> None:
    """Close a connection or a cluster; if it takes long, go on: what was captured is whole.

    A cluster cannot be closed while it starts a process in place of one that died. Its processes end with
    this one.
    """
    try:
        opened.close(timeout=CONNECT_SECONDS)
    except OSError as error:  # TimeoutError is one
        log.info("%s is not closed after %g s (%s)", opened, CONNECT_SECONDS, error)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep dask's own log from stderr: what matters is raised as errors."""
    logging.getLogger("asyncio").addFilter(_is_not_dasks)  # for good, because tasks are collected later
    logger = logging.getLogger("distributed")
    before = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(before)


def _is_not_dasks(record: logging.LogRecord) -> bool:
    """Return False for errors inside of dask that asyncio complains of because nobody has waited for them."""
    error = record.exc_info[1] if record.exc_info else None
    return type(error).__module__.partition(".")[0] not in ("distributed", "tornado")
