"""The workers of a dask cluster that may draw a capture: each is asked for its driver first."""

from __future__ import annotations

import logging
import os
import time
import warnings
from collections import Counter
from collections.abc import Callable
from concurrent.futures import CancelledError
from contextlib import suppress
from pkgutil import resolve_name
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

from firefly_sample.capture.cluster_worker import VERSION, Answer, examine, other_driver
from firefly_sample.capture.job import Driver, Job
from firefly_sample.errors import FireflyError, GpuError

if TYPE_CHECKING:
    from distributed import Client, Future

POLL_SECONDS = 1.0
"""Seconds between two questions to the scheduler for its workers."""
ANSWER_SECONDS = 30.0
"""Workers that are busy for longer than this at the start have no part in choosing the capture's driver."""
REFUSED_SECONDS = 15.0
"""Seconds after which a capture ends whose workers are all refused; dask replaces a dead one in less."""

_log = logging.getLogger("firefly_sample")


class Roster:
    """The workers, by their address.

    Parameters
    ----------
    client : distributed.Client
    address : str
        The cluster's address, for messages.
    job : Job
        One of those that are going to be drawn.
    done : SimpleQueue of str
        Gets the key of a future when it is done.
    driver : Driver, optional
        The capture's driver. If absent, the most common one of the workers that are there at the start; of
        several, that of the first address.
    patience : float
        How many seconds to wait while no worker can draw.

    Attributes
    ----------
    accepted : dict of str to int
        The workers that may draw and that are alive: their numbers of threads.
    refused : dict of str to str
        The workers that may not draw and that are alive: why.
    driver : Driver or None
    """

    def __init__(
        self,
        client: Client,
        address: str,
        job: Job,
        done: SimpleQueue[str],
        driver: Driver | None,
        patience: float,
    ) -> None:
        self._client, self._cluster, self._done, self._patience = client, address, done, patience
        self._question = job, os.getcwd()
        self._live: dict[str, int] = {}
        self._asked: dict[
            str, tuple[str, Future[str | Answer]]
        ] = {}  # by the future's key: the worker's address
        self._fit: dict[str, Driver] = {}
        self._polled = -POLL_SECONDS
        self._alone_since: float | None = None
        self._waits = False
        self.refused: dict[str, str] = {}
        self.driver = driver

    @property
    def accepted(self) -> dict[str, int]:
        """The workers that may draw: their numbers of threads."""
        if self.driver is None:
            return {}
        return {address: threads for address, threads in self._live.items() if address in self._fit}

    def choose_driver(self) -> None:
        """Wait until there is a worker that can draw.

        Raises
        ------
        GpuError
            If all workers are refused because of their drivers.
        FireflyError
            If there is none in time.
        """
        start = time.monotonic()
        while not self.accepted:
            self.update()
            self.answer(self._next(POLL_SECONDS / 4))
            late = time.monotonic() - start > ANSWER_SECONDS
            if self.driver is None and self._fit and (late or not self._asked):
                common = Counter(self._fit[address] for address in sorted(self._fit))
                self.driver = common.most_common(1)[0][0]  # of equals, the first
                for address, driver in list(self._fit.items()):
                    self._judge(address, driver)
            if self._live and not self._asked and self._live.keys() <= self.refused.keys():
                raise self._nobody()

    def update(self) -> None:
        """Ask the scheduler for its workers, at most once in `POLL_SECONDS`, and new ones for their drivers.

        Raises
        ------
        FireflyError
            If the scheduler is gone, or if there has been no worker that can draw for too long.
        """
        if time.monotonic() - self._polled < POLL_SECONDS:
            return
        self._live = self._workers()
        self._polled = time.monotonic()
        for address in self._live:
            asked = any(address == one for one, _ in self._asked.values())
            if not asked and address not in self._fit and address not in self.refused:
                self._ask_version(address)
        for key, (address, future) in list(self._asked.items()):
            if address and address not in self._live:
                future.cancel()
                del self._asked[key]
        for known in (self._fit, self.refused):
            for address in known.keys() - self._live.keys():
                del known[address]
                if known is self._fit:
                    _log.info("worker %s is gone: its frames are drawn by others", address)
        if not self._live and not self._asked:
            self._ask_version("")  # a cluster that grows with its tasks starts a worker for it
        self._check_patience()

    def answer(self, key: str | None) -> bool:
        """Take the answer of a worker, if a future's key is that of one."""
        if key is None or key not in self._asked:
            return False
        address, future = self._asked.pop(key)
        self._polled = -POLL_SECONDS  # it may be a new worker
        if future.status == "error":
            error = future.exception()
            what = f"{type(error).__name__}: {' '.join(str(error).split())}"
            if address:
                self.refuse(address, f"cannot draw: {what}: is the same firefly_sample there?")
        elif future.status == "finished":
            # if the worker ended before this is read, it is asked again, should it live
            with suppress(TimeoutError, CancelledError, OSError):
                self._take(address, future.result(timeout=POLL_SECONDS))
        return True

    def _take(self, address: str, answer: str | Answer) -> None:
        """Take a worker's version, and ask for its driver next; or take its driver."""
        if not isinstance(answer, str):
            address, driver, said = answer
            for text in said:
                warnings.warn(f"worker {address}: {text}", stacklevel=2)
            self._judge(address, driver)
        elif address and answer != VERSION:
            self.refuse(address, f"has firefly_sample {answer}, and the capture {VERSION}")
        elif address:
            self._ask(address, examine, *self._question)

    def refuse(self, address: str, reason: str) -> None:
        """Give a worker no frames any more, and warn of it."""
        self._fit.pop(address, None)
        if address not in self.refused:
            self.refused[address] = reason
            warnings.warn(f"worker {address} {reason}: others draw its frames", stacklevel=2)

    def check_scheduler(self) -> None:
        """Raise a FireflyError if there is no connection with the scheduler any more."""
        if self._client.status != "running":
            raise FireflyError(f"cluster {self._cluster}: the connection with its scheduler is lost")

    def cancel(self) -> None:
        """Withdraw the questions that have no answer yet."""
        for _, future in self._asked.values():
            with suppress(Exception):
                future.cancel()
        self._asked.clear()

    def _ask_version(self, address: str) -> None:
        # a function of Python's own: another one would end a worker that cannot import it
        self._ask(address, resolve_name, f"{examine.__module__}:VERSION")

    def _ask(self, address: str, function: Callable[..., str | Answer], *arguments: object) -> None:
        future = self._client.submit(
            function,
            *arguments,
            key=f"firefly-driver-{os.urandom(16).hex()}",
            workers=[address] if address else None,
            allow_other_workers=False,
            pure=False,
            priority=10,
        )
        self._asked[future.key] = address, future
        future.add_done_callback(lambda done: self._done.put(done.key))

    def _judge(self, address: str, driver: Driver | str) -> None:
        """Accept or refuse a worker by its answer."""
        if isinstance(driver, str):
            self.refuse(address, driver)
        elif self.driver is not None and (reason := other_driver(driver, self.driver)):
            self.refuse(address, reason)
        else:
            self._fit[address] = driver

    def _workers(self) -> dict[str, int]:
        self.check_scheduler()
        try:
            return dict(self._client.nthreads())
        except Exception as error:
            raise FireflyError(
                f"cluster {self._cluster}: the connection with its scheduler is lost ({type(error).__name__})"
            ) from error

    def _check_patience(self) -> None:
        """Raise an error if nobody can draw for too long; say once that the capture waits."""
        if self._live.keys() & self._fit.keys():
            self._alone_since, self._waits = None, False
            return
        now = time.monotonic()
        if self._alone_since is None:
            self._alone_since = now
            return
        waited = now - self._alone_since
        if not self._waits and not self._asked_live():
            self._waits = True
            _log.info("cluster %s: waiting for workers", self._cluster)
        hopeless = self._live.keys() & self.refused.keys() and not self._asked
        if waited > (min(self._patience, REFUSED_SECONDS) if hopeless else self._patience):
            raise self._nobody()

    def _asked_live(self) -> bool:
        return any(address for address, _ in self._asked.values())

    def _nobody(self) -> FireflyError:
        """Return the error for a cluster without workers that can draw."""
        if not self.refused:
            return FireflyError(f"cluster {self._cluster}: there has been no worker for {self._patience:g} s")
        refused = list(self.refused.items())
        other = [(address, reason) for address, reason in refused if reason.startswith("draws with ")]
        address, reason = (other or refused)[-1]  # the last one came furthest
        more = f" (and {len(self.refused) - 1} more)" if len(self.refused) > 1 else ""
        kind = GpuError if other else FireflyError
        return kind(f"cluster {self._cluster}: no worker is left: worker {address} {reason}{more}")

    def _next(self, seconds: float) -> str | None:
        try:
            return self._done.get(timeout=seconds)
        except Empty:
            return None
