"""The processes that `firefly_sample.lab.captures` times: each captures frames, and says how it went."""

from __future__ import annotations

import json
import os
import sys
import warnings
from collections.abc import Collection
from time import monotonic
from typing import Any


class Watch:
    """The progress of a capture, with times, processor seconds and memory at some frames.

    Parameters
    ----------
    began : float
        When the process was started, on the clock of `time.monotonic`.
    warm : int
        The rate is taken from this frame to the last one.
    sampled : collection of int
        Memory is sampled when so many frames are on the disk.
    """

    def __init__(self, began: float, warm: int, sampled: Collection[int]) -> None:
        self._began, self._warm, self._sampled = began, warm, sampled
        self._first = self._warm_at = self._rate = self._cpu = self._cpu_at = 0.0
        self._samples: list[dict[str, Any]] = []
        self._memory: dict[str, Any] = {}

    def __call__(self, done: int, total: int) -> None:
        """Note that `done` frames are on the disk."""
        from firefly_sample.lab.process_tree import tree_seconds

        now = monotonic()
        if done == 1:
            self._first = now - self._began
        if done == total:
            self._rate = (total - self._warm) / (now - self._warm_at)
            self._cpu = (tree_seconds() - self._cpu_at) / (total - self._warm)
            self._memory = _memory()
        if done in self._sampled:
            self._samples.append({"frame": done, **_memory()})
        if done == self._warm:
            self._cpu_at, self._warm_at = tree_seconds(), monotonic()

    def answer(self) -> dict[str, Any]:
        """Return what was noted; the capture ends now."""
        return {
            "first": self._first,
            "rate": self._rate,
            "cpu": self._cpu,
            "seconds": monotonic() - self._began,
            "memory": self._memory,
            "samples": self._samples,
            "finished": _memory(),
        }


def _memory() -> dict[str, Any]:
    from firefly_sample.lab.process_tree import memory, memory_of_descendants

    return {"parent": memory(), "others": memory_of_descendants()}


def capture(job: dict[str, Any]) -> dict[str, Any]:
    """Capture the frames of a job, and return what was measured, the driver, and a hash of all files."""
    import hashlib

    from firefly_sample.capture.manifest import Manifest
    from firefly_sample.capture.sequence import capture_frames
    from firefly_sample.errors import SoftwareDriverWarning

    warnings.simplefilter("ignore", SoftwareDriverWarning)
    watch = Watch(job["began"], job["warm"], frozenset(job["sampled"]))
    manifest = capture_frames(
        job["scene"],
        job["folder"],
        frames=f"0:{job['frames']}",
        time=job["time"],
        size=tuple(job["size"]),
        workers=job["workers"],
        cluster=job["cluster"],
        device=job["device"],
        progress=watch,
    )
    answer = watch.answer()
    assert isinstance(manifest, Manifest)  # there are no shards
    digest = hashlib.sha256()
    for frame in manifest["frames"]:
        digest.update(frame["file_sha256"]["color"].encode())
    return answer | {"driver": manifest["driver"], "sha256": digest.hexdigest()}


def main() -> int:
    """Do the job in the only argument, which is JSON, and answer in one line of JSON."""
    from firefly_sample.errors import FireflyError

    # only the answer goes to stdout, whatever a scene prints here or in a process that is started
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    sys.stdout = sys.stderr
    try:
        answer = capture(json.loads(sys.argv[1]))
    except FireflyError as error:
        answer = {"error": str(error)}
    print(json.dumps(answer), file=answers, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
