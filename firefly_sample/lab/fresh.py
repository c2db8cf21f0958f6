"""Jobs in fresh processes, each started with ``python -P -m``, that answer in one line of JSON."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from time import perf_counter
from typing import Any

from firefly_sample.errors import FireflyError


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
    # it can import exactly what this process can: without -P, -m would add the working folder
    command = [sys.executable, "-P", "-m", module, json.dumps(job)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **variables}
    with tempfile.TemporaryFile("w+") as errors:
        start = perf_counter()
        with subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=errors, text=True
        ) as process:
            try:
                assert process.stdout is not None
                line = process.stdout.readline()
                seconds = perf_counter() - start
            except BaseException:
                process.kill()
                raise
        if not line:
            errors.seek(0)
            said = errors.read().strip().splitlines()
            raise FireflyError(
                f"a process ended without an answer: {said[-1] if said else 'it printed no error'}"
            )
    answer = json.loads(line)
    if "error" in answer:
        raise FireflyError(answer["error"])
    return seconds, answer
