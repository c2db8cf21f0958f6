"""Draw many damaged model files: each must give a picture or one clear line.

    python -m tests.model.mutate_files --count 500 --seed 1

Every file is loaded, planned and drawn twice, as ``firefly capture`` does, in a worker process with 2 GiB of
address space and 20 seconds of processor time for each file. The table says what became of them.
``--keep FOLDER`` keeps the files that failed, and ``--only NUMBER`` repeats one of them.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import select
import shutil
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

MEMORY = 2 * 2**30
SECONDS = 20.0
"""Of processor time, with that of the processes that readers start."""
PATIENCE = 120.0
"""Seconds after which a file hangs, whatever else the machine does."""
LONGEST_LINE = 500
FILES_OF_A_WORKER = 150
PARTS = ("node '", "geom '", "light '", "texture '", "camera ")
"""What a line may begin with that names a part of the model, in place of its file."""


class Outcome(NamedTuple):
    """What became of a file: "picture", "line" or a kind of failure."""

    kind: str
    text: str = ""
    seconds: float = 0.0
    peak: int = 0
    """The most bytes of memory that the worker held so far."""


class Worker:
    """A process that draws one file after another; it is started anew after a failure."""

    def __init__(self, folder: Path) -> None:
        self._errors = (folder / "stderr").open("w+b")
        self._drawn = 0
        environment = {**os.environ, "FIREFLY_MODEL_CACHE": str(folder / "cache"), "PYTHONWARNINGS": "always"}
        self._process = subprocess.Popen(
            [sys.executable, "-c", "from tests.model.mutate_files import work; work()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            env=environment,
            bufsize=0,
        )
        self._read(120.0)  # until it is ready

    @property
    def is_spent(self) -> bool:
        return self._process.poll() is not None or self._drawn >= FILES_OF_A_WORKER

    def draw(self, path: Path) -> Outcome:
        assert self._process.stdin is not None
        self._drawn += 1
        self._process.stdin.write(json.dumps(str(path)).encode() + b"\n")
        line = self._read(PATIENCE)
        if line is None:
            self.stop()
            return Outcome("hang", f"more than {PATIENCE:g} seconds", PATIENCE)
        if not line:
            code = self._process.wait()
            self._errors.seek(0)
            return Outcome("crash", f"exit {code}: {self._errors.read()[-1500:].decode(errors='replace')}")
        found = Outcome(*json.loads(line))
        if found.kind in ("picture", "line") and found.seconds > SECONDS:
            return found._replace(kind="slow", text=f"{found.seconds:.1f} s: {found.text}")
        return found

    def _read(self, seconds: float) -> bytes | None:
        """Return a line, b"" at the end, None if none comes in time."""
        assert self._process.stdout is not None
        line = b""
        end = time.monotonic() + seconds
        while not line.endswith(b"\n"):
            ready, _, _ = select.select([self._process.stdout], [], [], max(end - time.monotonic(), 0.0))
            if not ready:
                return None
            part = self._process.stdout.read(65536)
            if not part:
                return b""
            line += part
        return line

    def stop(self) -> None:
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout, self._errors):
            assert stream is not None
            stream.close()


def draw_all(paths: Iterator[Path]) -> Iterator[Outcome]:
    """Give the outcome of each file."""
    with tempfile.TemporaryDirectory(prefix="firefly-mutations-") as folder:
        worker: Worker | None = None
        try:
            for path in paths:
                if worker is None or worker.is_spent:
                    if worker is not None:
                        worker.stop()
                    worker = Worker(Path(folder))
                yield worker.draw(path)
        finally:
            if worker is not None:
                worker.stop()


def work() -> None:
    """Read names of files from standard input, and write the outcome of each on standard output."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print is no answer
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    from firefly_sample import Renderer, Settings

    with Renderer((64, 48), Settings(supersample=2)) as renderer:
        print("ready", file=answers, flush=True)
        for line in sys.stdin:
            start = processor_time()
            kind, text = outcome(json.loads(line), renderer)
            took = processor_time() - start
            peak = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            print(json.dumps([kind, text, took, peak]), file=answers, flush=True)


def processor_time() -> float:
    """Seconds of this process and of those that it waited for."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def outcome(path: str, renderer: Any) -> tuple[str, str]:
    """Draw a file, and say what became of it."""
    import traceback

    from firefly_sample.errors import FireflyError

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            lines = draw(path, renderer)
        except FireflyError as error:
            return judged(str(error), path)
        except Exception as error:  # noqa: BLE001 - any other is what is looked for
            last = traceback.extract_tb(error.__traceback__)[-6:]
            places = " < ".join(f"{Path(at.filename).name}:{at.lineno} {at.name}" for at in reversed(last))
            return "traceback", f"{type(error).__name__}: {str(error)[:300]} at {places}"
    for warning in caught:
        if not issubclass(warning.category, UserWarning):
            where = f"{Path(warning.filename).name}:{warning.lineno}"
            return "warning", f"{warning.category.__name__}: {warning.message} at {where}"
    for line in lines:
        if len(line) > 2000 or not is_one_line(line):
            return "warning", f"{len(line)} characters: {line[:300]!r}"
    return "picture", ""


def draw(path: str, renderer: Any) -> tuple[str, ...]:
    """Load, plan and draw a file twice, as ``firefly capture`` does; return its warnings."""
    import numpy as np

    from firefly_sample import Settings, load_model
    from firefly_sample.plan.exposure import with_exposure_at
    from firefly_sample.scenes import build_scene, find_scene

    load_model(path)  # and once more, from the cache
    scene = build_scene(find_scene(path))
    renderer.settings = with_exposure_at(scene, Settings(exposure="auto", supersample=2), 0.0)
    for moment in (0.0, 0.4):
        frame = renderer.render(scene, moment)
        assert frame.color.dtype == np.uint8
        assert frame.color.shape == (48, 64, 3)
    return tuple(frame.warnings)


def judged(text: str, path: str) -> tuple[str, str]:
    """Return whether an error's text is one clear line that names the file."""
    name = Path(path).name
    if not is_one_line(text.replace(path, name)):
        return "not one line", text[:300]
    if len(text.replace(path, name)) > LONGEST_LINE:
        return "long line", f"{len(text)}: {text[:300]}"
    if "build() failed" in text:
        return "traceback", text[:300]
    if name not in text and not text.startswith(PARTS):
        return "no name", text[:300]
    return "line", text


def is_one_line(text: str) -> bool:
    return len(text.splitlines()) <= 1 and text.isprintable()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--seed", default="1")
    parser.add_argument("--only", type=int, help="the number of one file")
    parser.add_argument("--keep", type=Path, help="a folder for the files that failed")
    parser.add_argument("--lines", action="store_true", help="print every line of error")
    given = parser.parse_args()
    numbers = range(given.count) if given.only is None else [given.only]
    failed, table = run(given.seed, numbers, given.keep, given.lines)
    for (way, kind), count in sorted(table.items()):
        print(f"{count:6} {kind:12} {way}")
    totals = Counter[str]()
    for (_, kind), count in table.items():
        totals[kind] += count
    print("; ".join(f"{count} {kind}" for kind, count in sorted(totals.items())))
    sys.exit(1 if failed else 0)


def run(
    seed: str, numbers: Any, keep: Path | None = None, lines: bool = False
) -> tuple[list[str], Counter[tuple[str, str]]]:
    """Draw the files of some numbers; return a line for each failure, and counts of (damage, outcome)."""
    from tests.model.damage import make

    table, failed = Counter[tuple[str, str]](), []
    with tempfile.TemporaryDirectory(prefix="firefly-mutations-") as root:
        made: list[tuple[int, Path, str]] = []

        def paths() -> Iterator[Path]:
            for number in numbers:
                folder = Path(root) / str(number)
                folder.mkdir()
                path, what = make(folder, random.Random(f"{seed}-{number}"))
                made.append((number, path, what))
                yield path

        slowest = Outcome("picture")
        for found in draw_all(paths()):
            number, path, what = made[-1]
            table[what.partition(": ")[2].split(" ")[0], found.kind] += 1
            said = f"{seed}-{number} {what}: {found.kind}: {found.text}"
            if found.kind not in ("picture", "line"):
                failed.append(said)
                print(said, flush=True)
                if keep is not None:
                    shutil.copytree(path.parent, keep / f"{seed}-{number}", symlinks=True)
            elif lines and found.text:
                print(said)
            if found.seconds > slowest.seconds:
                slowest = found._replace(text=said)
            shutil.rmtree(path.parent)
        print(f"slowest {slowest.seconds:.1f} s: {slowest.text[:200]}; at most {found.peak >> 20} MiB")
    return failed, table


if __name__ == "__main__":
    main()
