"""The table of deaths: ``python -m tests.capture.deaths`` lets captures die, resumes them, and compares.

The exit code is 1 if any capture did not end as one that nothing happened to.
"""

from __future__ import annotations

import argparse
import importlib.util
import shutil
import sys
import tempfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from random import Random

from tests.capture import kinds_of_film as film
from tests.capture import kinds_of_harm as harm
from tests.capture import kinds_of_kill as kill
from tests.capture import power
from tests.capture.launch import Launcher
from tests.capture.stage import BOP, GLADE, Kind, Stage

_TWO = ("--workers", "2")
_CLUSTER = ("--cluster", "local", "--workers", "2")
_DASK = "multiprocessing.spawn"

KINDS: dict[str, tuple[str, Kind]] = {
    "parent": ("a signal at a random moment, up to three in a row", kill.at_a_random_moment),
    "operation": ("a signal at a random file operation, up to three in a row", kill.at_an_operation),
    "manifest": ("a signal while the manifest is written", kill.at_the_manifest),
    "overwrite": ("a signal while another capture is overwritten", kill.while_overwriting),
    "bop": ("a signal while a data set is drawn from several views", kill.of_a_data_set),
    "worker": ("SIGKILL of workers (`--workers 2`)", partial(kill.of_workers_by, _TWO)),
    "worker-parent": ("SIGKILL of the parent of workers", partial(kill.of_a_parent_by, _TWO)),
    "dask": (
        "SIGKILL of dask workers (`--cluster local`)",
        partial(kill.of_workers_by, _CLUSTER, is_worker=_DASK),
    ),
    "dask-parent": (
        "SIGKILL of the parent of dask workers",
        partial(kill.of_a_parent_by, _CLUSTER, is_worker=_DASK),
    ),
    "shards": ("SIGKILL of one to three of three shards", kill.of_shards),
    "two": ("two captures at once: the second is refused", kill.of_the_other),
    "stopped": ("two resumes at once, the first stopped and killed", kill.of_a_stopped_one),
    "disk": ("a full disk (a small tmpfs)", harm.of_a_full_disk),
    "quota": ("a largest size of files (RLIMIT_FSIZE)", harm.of_a_largest_size),
    "read-only": ("the folder becomes read-only", harm.of_a_read_only_folder),
    "removed": ("the folder is removed", harm.of_a_removed_folder),
    "renamed": ("the folder is renamed", harm.of_a_renamed_folder),
    "damaged": (
        "files truncated, emptied, appended to, flipped, replaced, swapped, deleted",
        harm.of_damaged_files,
    ),
    "damaged-finished": ("the same after the manifest", harm.of_damaged_finished),
    "during": ("files truncated and deleted during the run", harm.during_a_run),
    "journal": ("the journal removed, emptied, cut off, or nonsense in it", harm.of_a_journal),
    "no-manifest": ("the manifest removed or truncated", harm.of_a_manifest),
    "film": ("a signal while a film is captured, bound or overwritten, up to three in a row", film.of_films),
    "clock": ("the clock set back and forward", harm.of_a_clock),
    "power": ("the order of fsync, rename and journal (strace)", power.order_of_writing),
}


@dataclass
class Row:
    """One line of the table: a kind of death, how often it was tried, what it left, and what went wrong."""

    title: str
    tried: int
    stage: Stage
    faults: list[str]

    def __str__(self) -> str:
        deaths = self.stage.deaths
        whole = [death.whole for death in deaths]
        parts = sum(death.parts for death in deaths)
        least = f"{min(whole)}, {max(whole)}" if whole else "-"
        equal = f"no: {len(self.faults)} of {self.tried}" if self.faults else "yes"
        return f"| {self.title} | {self.tried} | {len(deaths)} | {least} | {parts} | {equal} |"


HEAD = (
    "| death | captures | deaths checked | whole frames at death (least, most) | .part files at death "
    "| equal after --resume, nothing else left |\n|---|---|---|---|---|---|"
)


def run_kind(kind: str, stage: Stage, count: int, seed: int) -> Row:
    """Let captures die in one way, each with its own seed."""
    title, die = KINDS[kind]
    row = Row(title, count, stage, [])
    for number in range(count):
        try:
            die(stage, Random(f"{kind} {seed + number}"))
        except (AssertionError, OSError) as error:
            row.faults.append(f"{kind} --seed {seed + number}: {error}")
    return row


def missing(kind: str, folder: Path) -> str:
    """What this machine lacks for a kind of death; "" if nothing."""
    if kind.startswith("dask") and importlib.util.find_spec("distributed") is None:
        return "distributed is not installed"
    if kind == "power" and not power.has_strace():
        return "strace is not installed"
    if kind == "disk":
        with harm.small_disk(folder / "try", 4) as is_small:
            return "" if is_small else "mounting is not allowed"
    return ""


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.capture.deaths", description=__doc__)
    parser.add_argument("--count", type=int, default=20, help="captures of each kind")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS), metavar="KIND")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="deaths-"))
    faults: list[str] = []
    try:
        print(HEAD)
        for kind in asked.kinds:
            place = folder / kind
            place.mkdir()
            if lack := missing(kind, place):
                print(f"| {KINDS[kind][0]} | 0: {lack} | | | | |", flush=True)
                continue
            with Launcher(place) as launcher:
                words = (BOP, "bop") if kind == "bop" else (GLADE, None)
                row = run_kind(
                    kind, Stage(launcher, place, *words), 1 if kind == "power" else asked.count, asked.seed
                )
            print(row, flush=True)
            faults += row.faults
            shutil.rmtree(place)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
