"""Captures that die in each way at fixed moments; ``python -m tests.capture.deaths`` does it at random."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from random import Random

import pytest

from tests.capture import kinds_of_film as film
from tests.capture import kinds_of_harm as harm
from tests.capture import kinds_of_kill as kill
from tests.capture.deaths import KINDS, missing
from tests.capture.launch import Launcher
from tests.capture.stage import ROLLING, Stage

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="it has other signals")
KILL, TERM, INT, HUP = signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stage]:
    folder = tmp_path_factory.mktemp("deaths")
    with Launcher(folder) as launcher:
        yield Stage(launcher, folder, ROLLING)


@pytest.fixture(autouse=True)
def _forget_deaths(stage: Stage) -> None:
    stage.deaths.clear()


def test_signals_one_after_the_other(stage: Stage) -> None:
    """While the first frame, later ones and the manifest are written, and while it resumes."""
    moments = [
        ((r"os.rename \.color", 1), KILL),
        ((r"os.rename \.depth", 3), TERM),
        ((r"open journal", 2), HUP),
        ((r"open \.manifest", 1), INT),
        ((r"os.rename \.manifest", 1), KILL),
        ((r"os.remove journal", 1), KILL),
    ]
    kill.at_operations(stage, moments)
    assert [death.parts > 0 for death in stage.deaths] == [True, False, False, False, True, False]
    assert [death.whole for death in stage.deaths][3:] == [8, 8, 8]


def test_a_signal_while_the_journal_is_removed(stage: Stage) -> None:
    """All frames are whole, and the message counts them although the capture has ended."""
    kill.at_operations(stage, [((r"os.remove journal", 1), HUP)])
    assert [death.whole for death in stage.deaths] == [8]


def test_another_capture_is_overwritten(stage: Stage) -> None:
    moments = [((r"os.remove color", 4), KILL), ((r"os.rename \.color", 2), TERM)]
    kill.at_operations(stage, moments, over=True)
    assert len(stage.deaths) == 2


def test_files_are_damaged(stage: Stage) -> None:
    harm.of_damaged_files(stage, Random(1))
    harm.of_damaged_finished(stage, Random(2))
    harm.during_a_run(stage, Random(3))


def test_the_last_line_of_the_journal_is_cut_off(stage: Stage) -> None:
    harm.of_a_journal(stage, Random(4), "cut")


def test_the_manifest_is_damaged(stage: Stage) -> None:
    """The error says the ways out, and one of them is taken."""
    harm.of_a_manifest(stage, Random(1))


def test_the_clock_is_set(stage: Stage) -> None:
    harm.of_a_clock(stage, Random(5))


def test_a_film(stage: Stage) -> None:
    """While it is bound, between it and its manifest, and while the frames are removed."""
    moments = [
        (r"open \.clip\.apng\..*part", 1, TERM),
        (r"open \.clip\.apng\.json\..*part", 1, KILL),
        (r"os.remove clip.apng.frames/color", 3, KILL),
    ]
    film.at_operations(film.films_of(stage, ".apng"), moments)
    assert [death.whole for death in stage.deaths] == [8, 8, 6]


def test_two_at_once(stage: Stage) -> None:
    kill.of_the_other(stage, Random(6))
    kill.of_a_stopped_one(stage, Random(7))


def test_folders_become_read_only_or_vanish(stage: Stage) -> None:
    harm.of_a_read_only_folder(stage, Random(8))
    harm.of_a_removed_folder(stage, Random(9))


def test_the_journal_may_not_grow(stage: Stage) -> None:
    harm.of_a_largest_size(stage, Random(0), len(stage.unfinished["journal.jsonl"]) - 100)
    assert stage.deaths[0].whole > 0


@pytest.mark.parametrize("room", [3, None], ids=["a picture", "the manifest"])
def test_the_disk_is_full(stage: Stage, room: int | None) -> None:
    if lack := missing("disk", stage.new("trial")):
        pytest.skip(lack)
    pages = sum(-(-len(content) // harm.PAGE) for content in stage.unfinished.values())
    harm.of_a_full_disk(stage, Random(0), room or pages)
    assert (stage.deaths[0].whole == len(stage.frames)) == (room is None)


def test_shards(stage: Stage) -> None:
    kill.of_shards(stage, Random(0), 2)


def test_workers(stage: Stage) -> None:
    KINDS["worker"][1](stage, Random(3))
