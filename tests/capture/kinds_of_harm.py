"""Deaths by disks and by other programs: full, read-only, removed, and files that somebody changed."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

from tests.capture.launch import Run
from tests.capture.stage import Stage, contents, is_whole

PAGE = 4096
_LONG_AGO, _FAR_OFF = 86_400.0, 4_102_444_800.0
"""Times of files: 1970 and 2100."""
Damage = Callable[[Path, Path], None]


def truncate(path: Path, _: Path) -> None:
    os.truncate(path, path.stat().st_size // 2)


def empty(path: Path, _: Path) -> None:
    os.truncate(path, 0)


def append(path: Path, _: Path) -> None:
    path.write_bytes(path.read_bytes() + b"\0")


def flip(path: Path, _: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def replace(path: Path, _: Path) -> None:
    path.write_bytes(b"x" * path.stat().st_size)


def swap(path: Path, other: Path) -> None:
    one, two = path.read_bytes(), other.read_bytes()
    path.write_bytes(two)
    other.write_bytes(one)


def delete(path: Path, _: Path) -> None:
    path.unlink()


DAMAGES: tuple[Damage, ...] = (truncate, empty, append, flip, replace, swap, delete)


def damage_files(stage: Stage, folder: Path, rng: Random, damages: tuple[Damage, ...] = DAMAGES) -> int:
    """Damage files of different frames, each in another way; return how many frames are not whole."""
    indices = rng.sample(sorted(stage.frames), len(damages) + 1)
    extra = indices.pop()
    output = rng.choice(("color", "depth"))
    names = {
        index: next(name for name in stage.frames[index] if name.startswith(output)) for index in indices
    }
    names[extra] = next(name for name in stage.frames[extra] if name.startswith(output))
    for index, damage in zip(indices, damages, strict=True):
        damage(folder / names[index], folder / names[extra])
    files = contents(folder)  # two files that were swapped may be the same
    return sum(not is_whole(names, files, stage.undisturbed) for names in stage.frames.values())


def of_damaged_files(stage: Stage, rng: Random, finished: bool = False) -> None:
    """Files of a capture, unfinished or finished, are damaged: just their frames are drawn again."""
    files = stage.undisturbed if finished else stage.unfinished
    folder = stage.put(files)
    damaged = damage_files(stage, folder, rng)
    said = stage.finish(folder)
    whole = len(stage.frames) - damaged
    counts = f"{whole} frame{'s are' if whole != 1 else ' is'} whole already; drawn again: "
    assert any(counts in line and "damaged" in line for line in said), said


def of_damaged_finished(stage: Stage, rng: Random) -> None:
    """As `of_damaged_files`, of a capture that was finished."""
    of_damaged_files(stage, rng, finished=True)


def of_a_journal(stage: Stage, rng: Random, way: str | None = None) -> None:
    """The journal is removed, or its last line cut off, or a line in its midst is nonsense."""
    folder = stage.put(stage.unfinished)
    journal = folder / "journal.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    way = way or rng.choice(("removed", "cut", "nonsense", "empty"))
    lost = 1
    if way == "removed":
        journal.unlink()
        lost = len(stage.frames)
    elif way == "cut":
        size = journal.stat().st_size
        os.truncate(journal, rng.randint(size - len(lines[-1]) + 1, size - 1))
    elif way == "nonsense":
        lines[-2] = b"\xff\0 nonsense }{\n"
        journal.write_bytes(b"".join(lines))
    else:
        journal.write_bytes(b"")
        lost = len(stage.frames)
    said = stage.finish(folder)
    if lost == 1:
        assert any(f"{len(stage.frames) - 1} frames are whole already" in line for line in said), said


def of_a_manifest(stage: Stage, rng: Random) -> None:
    """The manifest is removed: all is drawn again. It is damaged: an error names it and says the way out."""
    folder = stage.put(stage.undisturbed)
    manifest = folder / "manifest.json"
    if rng.random() < 0.5:
        size = manifest.stat().st_size
        os.truncate(manifest, rng.randint(0, size - 3))
        stage.start("--resume", folder).end(1, f"{manifest} is not a manifest.*(remove|overwrite)")
        if rng.random() < 0.5:
            stage.start("--overwrite", folder).end()
            stage.check_whole(folder)
            return
    manifest.unlink()
    stage.finish(folder)


def of_a_clock(stage: Stage, rng: Random) -> None:
    """The clock is set back, or forward, between two runs: everything is still whole."""
    folder = stage.put(stage.unfinished)
    names = rng.sample(stage.frames[0] + stage.frames[3], 2)
    for path in folder.iterdir():
        time = _LONG_AGO if path.name in names else _FAR_OFF
        os.utime(path, (time, time))
    os.utime(folder, (_FAR_OFF, _FAR_OFF))
    said = stage.finish(folder)
    assert any(f"{len(stage.frames)} frames are whole already" in line for line in said), said


def during_a_run(stage: Stage, rng: Random, damages: tuple[Damage, ...] = (truncate, delete)) -> None:
    """Files are changed while others are drawn: the manifest lists none that is not whole."""
    folder = stage.new()
    last = max(stage.frames)
    run = stage.start(folder, at=(rf"os.rename \.depth_{last:06d}", 1), number=signal.SIGSTOP)
    run.wait_until_stopped()
    stage.check_dead(folder, [])
    names = rng.sample([name for index in range(last - 5) for name in stage.frames[index]], len(damages))
    for name, damage in zip(names, damages, strict=True):
        damage(folder / name, folder)
    run.go_on()
    said = run.end()
    assert any("files were changed while others were drawn" in line for line in said), said
    stage.check_whole(folder)


def _stopped(stage: Stage, folder: Path, rng: Random, **options: bool) -> Run:
    at = (r"os.rename \.color", rng.randint(2, max(len(stage.frames) - 4, 2)))
    run = stage.start(folder, at=at, number=signal.SIGSTOP, **options)
    run.wait_until_stopped()
    stage.check_dead(folder, [])
    return run


def of_a_read_only_folder(stage: Stage, rng: Random) -> None:
    """The folder becomes read-only in mid-run."""
    folder = stage.new()
    run = _stopped(stage, folder, rng, obey=True)
    folder.chmod(0o555)
    try:
        run.go_on()
        said = run.end(1, f"cannot write {folder}/.*: Permission denied")
    finally:
        folder.chmod(0o755)
    stage.check_dead(folder, said)
    stage.finish(folder)


def of_a_removed_folder(stage: Stage, rng: Random) -> None:
    """The folder is removed in mid-run."""
    folder = stage.new()
    run = _stopped(stage, folder, rng)
    shutil.rmtree(folder)
    run.go_on()
    run.end(1, f"cannot (write|read) (into )?{folder}.*: No such file")
    assert not folder.exists(), sorted(contents(folder))
    stage.finish(folder)


def of_a_renamed_folder(stage: Stage, rng: Random) -> None:
    """The folder is renamed in mid-run; then it gets its name back."""
    folder = stage.new()
    run = _stopped(stage, folder, rng)
    moved = stage.new("moved")
    folder.rename(moved)
    run.go_on()
    run.end(1, f"cannot (write|read) (into )?{folder}.*: No such file")
    assert not folder.exists(), sorted(contents(folder))
    stage.check_dead(moved, [])
    moved.rename(folder)
    stage.finish(folder)


def of_a_largest_size(stage: Stage, rng: Random, largest: int | None = None) -> None:
    """No file may grow beyond a size, as by a quota: a picture, the journal or the manifest fails."""
    sizes = sorted(len(content) for content in stage.unfinished.values())
    folder = stage.new()
    run = stage.start(folder, largest=largest or rng.randint(60, sizes[-1] - 1))
    stage.check_dead(folder, run.end(1, "cannot write .*: File too large"))
    assert not (folder / "manifest.json").exists()
    assert stage.deaths[-1].parts == 0
    stage.finish(folder)


def of_a_full_disk(stage: Stage, rng: Random, room: int | None = None) -> None:
    """A small disk is full in mid-run; then it has room again. Only where this process can mount one."""
    pages = 2 + sum(-(-len(content) // PAGE) for content in stage.unfinished.values())
    disk = stage.new("disk")
    with small_disk(disk, 3 * pages) as is_small:
        assert is_small, "cannot mount a disk"
        ballast, folder = disk / "ballast", disk / "capture"
        left = (3 * pages - (room if room is not None else rng.randint(1, pages))) * PAGE
        with ballast.open("wb") as file:
            file.write(b"x" * left)
        said = stage.start(folder).end(1, "No space left on device")
        stage.check_dead(folder, said)
        assert not (folder / "manifest.json").exists()
        assert stage.deaths[-1].parts == 0
        ballast.unlink()
        stage.finish(folder)


@contextmanager
def small_disk(path: Path, pages: int) -> Iterator[bool]:
    """Mount a disk of so many pages of 4096 bytes for a while, if that is allowed; gives whether it is."""
    path.mkdir(parents=True)
    options = ["-t", "tmpfs", "-o", f"size={pages * PAGE}", "tmpfs"]
    tool = shutil.which("mount")
    mounted = (
        tool is not None
        and subprocess.run([tool, *options, str(path)], check=False, capture_output=True).returncode == 0
    )
    try:
        yield mounted
    finally:
        if mounted:
            subprocess.run(["umount", str(path)], check=True)
