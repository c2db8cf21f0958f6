"""The order in which a capture brings files to the disk, as the system sees it: what a loss of power leaves.

A frame's file is on the disk before it gets its name, its name before the frame is in the journal, and the
manifest with its name before the journal is removed.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path
from random import Random

from tests.capture.launch import PATIENCE
from tests.capture.stage import Stage
from tests.capture.usual_files import named_frame
from tests.cli.command import ROOT, environment

_CALLS = "openat,fsync,fdatasync,rename,renameat,renameat2,write,unlink,unlinkat"
_LINE = re.compile(r"^(?:\d+ +)?(\w+)\((.*)\) += (-?\d+)")
_SPLIT = re.compile(r"^(\d+ +)?(\w+)\((.*) <unfinished \.\.\.>$")
_JOINED = re.compile(r"^(\d+ +)?<\.\.\. (\w+) resumed>(.*)$")


def has_strace() -> bool:
    """Whether calls of the system can be listed here."""
    return shutil.which("strace") is not None


def order_of_writing(stage: Stage, _: Random) -> None:
    """List the calls of the system, and check their order for each frame and for the manifest."""
    folder = stage.new()
    log = stage.new("calls")
    tool = ["strace", "-f", "-y", "-s", "64", "-e", f"trace={_CALLS}", "-o", str(log)]
    words = ["-m", "firefly_sample", "capture", *stage.words, "-q", "-o", str(folder)]
    subprocess.run(
        [*tool, sys.executable, *words],
        cwd=ROOT,
        env=environment(),
        timeout=PATIENCE,
        check=True,
        stderr=subprocess.DEVNULL,
    )
    stage.check_whole(folder)
    check_order(calls(log), folder, stage)


def calls(log: Path) -> list[tuple[str, str]]:
    """The calls that succeeded, with their arguments, in the order in which they ended."""
    found, begun = [], dict[str, str]()
    for text in log.read_text(errors="replace").splitlines():
        if split := _SPLIT.match(text):
            begun[split[1] or ""] = f"{split[2]}({split[3]}"
            continue
        line = text
        if joined := _JOINED.match(text):
            line = begun.pop(joined[1] or "", "") + joined[3]
        if (match := _LINE.match(line)) and int(match[3]) >= 0:
            found.append((match[1], match[2]))
    return found


def check_order(done: list[tuple[str, str]], folder: Path, stage: Stage) -> None:
    """Check that nothing is promised before it is on the disk."""
    synced: set[str] = set()
    named: set[str] = set()
    lasting: set[str] = set()
    promised: set[int] = set()
    for call, text in done:
        if call in ("fsync", "fdatasync"):
            path = _path(text)
            synced.add(path)
            if path == str(folder):
                lasting |= named
        elif call.startswith("rename"):
            old, new = re.findall(r'"([^"]*)"', text)
            if not new.startswith(str(folder)) or "previous" in new:
                continue
            assert old in synced, f"{new} gets its name before its content is on the disk"
            named.add(new)
        elif (
            call == "write" and "journal" in _path(text) and (frame := re.search(r'\\"index\\": (\d+)', text))
        ):
            for name in stage.frames[int(frame[1])]:
                assert str(folder / name) in lasting, (
                    f"{name} is in the journal before its name is on the disk"
                )
            promised.add(int(frame[1]))
        elif call.startswith("unlink") and "journal" in text:
            assert str(folder / "manifest.json") in lasting, (
                "the journal is removed before the manifest lasts"
            )
    assert promised == set(stage.frames)
    assert {Path(path).name for path in named if named_frame(Path(path).name)} == {
        name for names in stage.frames.values() for name in names
    }


def _path(text: str) -> str:
    """The path of the file descriptor that is a call's first argument."""
    match = re.match(r"\d+<([^>]*)>", text)
    return match[1] if match else ""
