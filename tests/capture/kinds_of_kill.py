"""Deaths by signals: of a capture, of its workers, and of shards."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from random import Random

from tests.capture.launch import ENDINGS, Run, handles, is_running, wait_for
from tests.capture.stage import OTHER, Stage, contents

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
WORKER = "firefly_sample.capture.worker"
"""A part of the command line of a worker."""
_ORPHANS = 15.0
"""Seconds in which workers must notice that their parent is dead."""


def at_operations(stage: Stage, moments: Iterable[tuple[tuple[str, int], int]], over: bool = False) -> None:
    """Kill a capture at some moments one after the other, and go on after each."""
    folder = stage.put(stage.other) if over else stage.new()
    words: list[str] = ["--overwrite"] if over else []
    for at, number in moments:
        run = stage.start(*words, folder, at=at, number=number)
        wait_for(lambda run=run: run.poll() is not None, "the end")
        if run.poll() == 0:
            break  # it did not get as far as that, because there was less to do
        stage.check_dead(folder, run.die(number), over)
        if number != signal.SIGKILL:
            assert stage.deaths[-1].parts == 0, "a .part file is left after a signal that can be handled"
        words = ["--resume"]
    stage.finish(folder)


def at_an_operation(stage: Stage, rng: Random) -> None:
    """One to three deaths in a row at random file operations, by random signals."""
    count = len(stage.operations)
    moments = [((".", rng.randint(1, count)), rng.choice(SIGNALS)) for _ in range(rng.randint(1, 3))]
    at_operations(stage, moments)


def while_overwriting(stage: Stage, rng: Random) -> None:
    """As `at_an_operation`, while another capture in the folder is replaced."""
    count = len(stage.operations) + len(stage.other)
    moments = [((".", rng.randint(3, count)), rng.choice(SIGNALS)) for _ in range(rng.randint(1, 2))]
    at_operations(stage, moments, over=True)


def of_a_data_set(stage: Stage, rng: Random) -> None:
    """As `at_a_random_moment`, `at_an_operation`, or while the documents and the manifest are written."""
    rng.choice((at_a_random_moment, at_an_operation, at_the_documents))(stage, rng)


def at_the_documents(stage: Stage, rng: Random) -> None:
    """While the documents of a data set are written, or the manifest after them."""
    end = (
        r"(open|os\.rename) \.(scene_|objects)",
        r"open \.manifest",
        r"rename \.manifest",
        "remove journal",
    )
    at_operations(stage, [((rng.choice(end), rng.randint(1, 3)), rng.choice(SIGNALS)) for _ in range(2)])


def at_the_manifest(stage: Stage, rng: Random) -> None:
    """While the manifest is written, or what it replaces is removed."""
    end = ("open .manifest", "rename .manifest", "remove manifest.prev", "remove journal", r"remove \.fire")
    at_operations(stage, [((rng.choice(end), 1), rng.choice(SIGNALS)) for _ in range(2)])


def at_a_random_moment(stage: Stage, rng: Random) -> None:
    """One to three deaths of the command, by random signals, between its start and its end."""
    folder = stage.new()
    words: list[str] = []
    wanted = len(stage.deaths) + rng.choice((1, 1, 2, 3))
    while len(stage.deaths) < wanted:
        number = rng.choice(SIGNALS)
        run = stage.start_command(*words, folder)
        if number != signal.SIGKILL:
            # the interpreter has a handler of SIGINT from its start on, and none of SIGTERM
            wait_for(lambda run=run: run.poll() is not None or handles(run.pid, signal.SIGTERM), "handlers")
        _wait_for_a_moment(stage, rng, run, folder)
        if run.poll() is None:
            run.kill(number)
        code = wait_for(lambda run=run: (run.poll(),) if run.poll() is not None else None, "the end")[0]
        if code == 0 or (code == -number and number != signal.SIGKILL):
            stage.check_whole(folder)  # it was faster; or only the end of the process was left
            folder, words = stage.new(), []
            continue
        stage.check_dead(folder, run.die(number))
        words = ["--resume"]
    stage.finish(folder)


def _wait_for_a_moment(stage: Stage, rng: Random, run: Run, folder: Path) -> None:
    """Wait for a random number of frames and a little, or for a while at the start."""
    count = rng.randint(-5, len(stage.frames))
    seconds = rng.uniform(0.0, 1.0 if count < 0 else 0.03)

    def reached() -> bool:
        return run.poll() is not None or stage.count(folder) >= count

    wait_for(reached, "a number of frames")
    end = time.monotonic() + seconds
    while time.monotonic() < end and run.poll() is None:
        time.sleep(0.001)


def of_workers_by(words: tuple[str, ...], stage: Stage, rng: Random, is_worker: str = WORKER) -> None:
    """Kill one or two workers while frames are drawn: the capture goes on and loses nothing."""
    folder = stage.new()
    count = rng.randint(1, len(stage.frames))
    run = stage.start(*words, folder, at=(r"os.rename \.color", count), number=signal.SIGSTOP)
    run.wait_until_stopped()
    workers = workers_of(run, is_worker)
    assert workers, "there are no workers"
    for pid in rng.sample(workers, rng.randint(1, len(workers))):
        os.kill(pid, signal.SIGKILL)
    stage.check_dead(folder, [])
    run.go_on()
    run.end()
    stage.check_whole(folder)


def of_a_parent_by(words: tuple[str, ...], stage: Stage, rng: Random, is_worker: str = WORKER) -> None:
    """Kill the parent of workers: they end, and write nothing any more."""
    folder = stage.new()
    count = rng.randint(1, len(stage.frames))
    run = stage.start(*words, folder, at=(r"os.rename \.color", count), number=signal.SIGSTOP)
    run.wait_until_stopped()
    children = run.children()
    assert workers_of(run, is_worker), "there are no workers"
    run.kill()
    run.die(signal.SIGKILL)
    left = contents(folder)
    stage.check_dead(folder, [])
    try:
        wait_for(lambda: not any(map(is_running, children)), "the end of all workers", _ORPHANS)
    finally:
        for pid in children:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
    assert contents(folder) == left, "an orphan has written"
    stage.finish(folder)


def workers_of(run: Run, is_worker: str) -> list[int]:
    """The children of a run that draw, by a part of their command line."""
    return [pid for pid in run.children() if is_worker.encode() in Path(f"/proc/{pid}/cmdline").read_bytes()]


def of_shards(stage: Stage, rng: Random, count: int = 3) -> None:
    """Kill some of the shards that draw at once, then draw all again, by shards or by one process."""
    folder = stage.new()
    shards = [f"{number}/{count}" for number in range(1, count + 1)]
    dying = rng.sample(shards, rng.randint(1, count))
    each = max(len(stage.frames) // count, 1)
    runs = {}
    for shard in shards:
        at = (r"os.rename \.(color|depth)", rng.randint(1, each)) if shard in dying else None
        runs[shard] = stage.start("--shard", shard, folder, at=at)
    for shard, run in runs.items():
        if shard in dying:
            run.die(signal.SIGKILL)
        else:
            run.end()
    stage.check_dead(folder, [])
    assert not (folder / "manifest.json").exists()
    if rng.random() < 0.3:
        stage.finish(folder)  # by one process
        return
    again = [stage.start("--shard", shard, "--resume", folder) for shard in shards]
    for run in again:
        run.end()
    stage.check_whole(folder)


def of_the_other(stage: Stage, rng: Random) -> None:
    """Two captures into one folder: the second is refused by name, also while the first is stopped."""
    folder = stage.new()
    first = stage.start(folder, at=(r"os.rename \.color", rng.randint(1, 4)), number=signal.SIGSTOP)
    first.wait_until_stopped()
    stage.check_dead(folder, [])
    for way in rng.sample([[], ["--resume"], ["--overwrite"], [*OTHER, "--resume"]], 2):
        refused = f"another capture is writing into {folder} \\(process {first.pid} on "
        stage.start(*way, folder).end(1, refused)
    first.go_on()
    first.end()
    stage.check_whole(folder)


def of_a_stopped_one(stage: Stage, rng: Random) -> None:
    """Two that resume: the second is refused; when the first is stopped and killed, another goes on."""
    folder = stage.put(stage.unfinished)
    (folder / "color_000001.png").unlink()
    first = stage.start("--resume", folder, at=("color_000001.*part", 1), number=signal.SIGSTOP)
    first.wait_until_stopped()
    stage.start("--resume", folder).end(1, "another capture is writing into")
    first.kill()
    first.die(signal.SIGKILL)
    stage.finish(folder)


assert set(SIGNALS) == set(ENDINGS)
