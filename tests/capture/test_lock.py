"""Locks between real processes: exclusive and shared, given up by death, and safe while files come and go."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading

import pytest

from firefly_sample.capture.lock import Lock
from firefly_sample.errors import OutputError
from tests.cli.command import environment
from tests.cli.permissions import obeyed_permissions

HOLD = """
import sys
from pathlib import Path
from firefly_sample.capture.lock import Lock

lock = Lock(Path(sys.argv[1]), "busy", shared=sys.argv[2] == "shared")
print("held", flush=True)
sys.stdin.read()
lock.release()
"""
COUNT = """
import sys, time
from pathlib import Path
from firefly_sample.capture.lock import Lock
from firefly_sample.errors import OutputError

def take():
    while True:
        try:
            return Lock(Path("l.lock"), "busy")
        except OutputError:
            time.sleep(0.001)

counter = Path("counter")
for _ in range(int(sys.argv[1])):
    lock = take()
    number = int(counter.read_text())
    counter.write_text("")  # who reads now reads nothing
    counter.write_text(str(number + 1))
    lock.release()
"""


@pytest.fixture
def hold(tmp_path):
    """``hold(kind)`` gives a process that holds the lock until its stdin ends."""
    holders = []

    def begin(kind="exclusive"):
        command = [sys.executable, "-c", HOLD, str(tmp_path / "l.lock"), kind]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        holder = subprocess.Popen(command, env=environment(), text=True, **pipes)
        holders.append(holder)
        assert holder.stdout.readline() == "held\n"
        return holder

    yield begin
    for holder in holders:
        holder.kill()
        holder.communicate()


def end(holder):
    holder.communicate(timeout=60)
    assert holder.returncode == 0


def test_the_second_is_refused_and_told_who_holds_it_until_the_first_ends(tmp_path, hold):
    path = tmp_path / "l.lock"
    holder = hold()
    for shared in (False, True):
        with pytest.raises(OutputError, match=rf"^busy here \(process {holder.pid} on \S+\)$"):
            Lock(path, "busy here", shared=shared)
    end(holder)
    assert not path.exists()
    Lock(path, "busy").release()
    assert not path.exists()


def test_a_dead_process_holds_nothing(tmp_path, hold):
    path = tmp_path / "l.lock"
    holder = hold()
    holder.send_signal(signal.SIGKILL)
    holder.wait(60)
    assert path.exists()  # what it has left is no lock
    lock = Lock(path, "busy")
    text = path.read_text()
    assert re.fullmatch(rf"process {os.getpid()} on \S+\n", text)
    lock.release()
    assert not path.exists()


def test_several_share_and_the_last_one_removes_the_file(tmp_path, hold):
    path = tmp_path / "l.lock"
    holder = hold("shared")
    lock = Lock(path, "busy", shared=True)
    with pytest.raises(OutputError, match="busy"):
        Lock(path, "busy")
    lock.release()
    assert path.exists()
    with pytest.raises(OutputError, match="busy"):
        Lock(path, "busy")
    end(holder)
    assert not path.exists()


def test_the_last_of_those_who_share_becomes_the_only_one(tmp_path, hold):
    path = tmp_path / "l.lock"
    holder = hold("shared")
    first = Lock(path, "busy", shared=True)
    assert not first.become_exclusive()
    first.release()
    second = Lock(path, "busy", shared=True)
    end(holder)
    assert second.become_exclusive()
    with pytest.raises(OutputError, match=r"^busy$"):
        Lock(path, "busy")
    second.release()


def test_a_share_waits_while_another_one_is_the_only_one(tmp_path, hold):
    """The only one is about to see what is left to do, and must not make the next share an error."""
    path = tmp_path / "l.lock"
    dead = hold()
    dead.send_signal(signal.SIGKILL)
    dead.wait(60)  # its name stays in the file
    lock = Lock(path, "busy", shared=True)
    assert lock.become_exclusive()
    holders = []
    waiting = threading.Thread(target=lambda: holders.append(hold("shared")))
    waiting.start()
    waiting.join(1.0)
    assert waiting.is_alive()
    assert not holders
    lock.release()
    waiting.join(60)
    end(holders[0])
    assert not path.exists()


def test_turns_are_never_lost_though_the_file_is_removed_after_each(tmp_path):
    """Who opened the file just before it was removed holds a lock on nothing, and must try again."""
    turns, many = 150, 4
    (tmp_path / "counter").write_text("0")
    command = [sys.executable, "-c", COUNT, str(turns)]
    takers = [subprocess.Popen(command, cwd=tmp_path, env=environment()) for _ in range(many)]
    assert [taker.wait(300) for taker in takers] == [0] * many
    assert (tmp_path / "counter").read_text() == str(turns * many)
    assert not (tmp_path / "l.lock").exists()


def test_a_folder_that_cannot_be_written_has_no_lock(tmp_path):
    folder = tmp_path / "kept"
    folder.mkdir()
    folder.chmod(0o555)
    with obeyed_permissions(), pytest.raises(PermissionError):
        Lock(folder / "l.lock", "busy")
    folder.chmod(0o755)
    assert list(folder.iterdir()) == []
    with pytest.raises(FileNotFoundError):
        Lock(folder / "none" / "l.lock", "busy")


def test_no_descriptor_is_left_open(tmp_path):
    def count():
        return len(os.listdir("/proc/self/fd"))

    path = tmp_path / "l.lock"
    before = count()
    lock = Lock(path, "busy")
    for _ in range(3):
        with pytest.raises(OutputError):
            Lock(path, "busy")
    lock.release()
    assert count() == before
