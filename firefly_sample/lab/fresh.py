"""Jobs in fresh processes, each started with ``python -P -m``, that answer in lines of JSON."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Timer
from time import perf_counter
from typing import IO, Any

from firefly_sample.errors import FireflyError


class FreshProcess:
    """A process that `start_process` has started: its stdin takes jobs and its stdout gives answers."""

    def __init__(self, process: subprocess.Popen[str], errors: IO[str]) -> None:
        self._process, self._errors = process, errors
        self._late = ""

    @contextmanager
    def within(self, seconds: float) -> Iterator[None]:
        """Kill the process if it takes longer than this; `answer` then raises an error that says so."""

        def kill() -> None:
            self._late = f"a process was ended because it took longer than {seconds:g} s"
            self._process.kill()

        timer = Timer(seconds, kill)
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()

    def tell(self, job: dict[str, Any]) -> None:
        """Write a job to its stdin, as a line of JSON."""
        stdin = self._process.stdin
        assert stdin is not None
        with suppress(BrokenPipeError):  # it has ended: `answer` says why
            stdin.write(json.dumps(job) + "\n")
            stdin.flush()

    def answer(self) -> dict[str, Any]:
        """Wait for a line of its stdout and return it; see `answer_of` for errors."""
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            if self._late:
                raise FireflyError(self._late)
            self._errors.seek(0)
            said = self._errors.read().strip().splitlines()
            raise FireflyError(
                f"a process ended without an answer: {said[-1] if said else 'it printed no error'}"
            )
        answer: dict[str, Any] = json.loads(line)
        if "error" in answer:
            raise FireflyError(answer["error"])
        return answer


@contextmanager
def start_process(module: str, *arguments: str, **variables: str) -> Iterator[FreshProcess]:
    """Start a module's `main` with arguments and environment variables beside those of this process.

    When the context is left, its stdin is closed and its end is awaited; after an error, it is killed.
    """
    # it can import exactly what this process can: without -P, -m would add the working folder
    command = [sys.executable, "-P", "-m", module, *arguments]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **variables}
    pipe = subprocess.PIPE
    with (
        tempfile.TemporaryFile("w+") as errors,
        subprocess.Popen(
            command, env=environment, stdin=pipe, stdout=pipe, stderr=errors, text=True
        ) as process,
    ):
        try:
            yield FreshProcess(process, errors)
        except BaseException:
            process.kill()
            raise


def answer_of(module: str, job: dict[str, Any], **variables: str) -> tuple[float, dict[str, Any]]:
    """Return the seconds until a fresh process answers, and its answer.

    Parameters
    ----------
    module : str
        Its `main` does the job in its only argument, which is JSON.
    job : dict
    **variables : str
        Environment variables beside those of this process.

    Raises
    ------
    FireflyError
        If it ends without an answer, or the answer is {"error": text}.
    """
    start = perf_counter()
    with start_process(module, json.dumps(job), **variables) as process:
        answer = process.answer()
        seconds = perf_counter() - start
    return seconds, answer
