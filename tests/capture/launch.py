"""Captures in processes of their own, which die at a moment that is chosen: at one of their file operations.

One process imports everything once, and forks for each capture, so that a capture costs no imports. It has
no OpenGL context, which would not survive a fork. Each capture runs `firefly_sample.cli.main` as the command
does.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import io
import json
import os
import re
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from tests.cli.command import ROOT, environment
from tests.cli.permissions import obeyed_permissions

PATIENCE = 300.0
"""Seconds after which a condition that was waited for is an error."""
ENDINGS = {
    signal.SIGKILL: (-9, ""),
    signal.SIGINT: (130, "firefly: interrupted"),
    signal.SIGTERM: (143, "firefly: terminated"),
    signal.SIGHUP: (129, "firefly: hung up"),
}
"""The exit code of a process that a signal ends, and its last line on stderr."""
_WATCHED = ("open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.listdir", "os.scandir")


def wait_for(condition: Callable[[], Any], what: str, patience: float = PATIENCE) -> Any:
    """Return what a condition gives as soon as it is true."""
    deadline = time.monotonic() + patience
    while not (result := condition()):
        assert time.monotonic() < deadline, f"{what} did not come about within {patience} s"
        time.sleep(0.01)
    return result


class Run:
    """A capture in a process of its own."""

    def __init__(self, pid: int, poll: Callable[[], int | None], errors: Path) -> None:
        self.pid = pid
        self._poll = poll
        self._errors = errors

    def poll(self) -> int | None:
        """The exit code, negative for a signal; None if it goes on."""
        return self._poll()

    def lines(self) -> list[str]:
        """The lines on stderr, each checked to be one of the command's own."""
        text = self._errors.read_text()
        lines = text.splitlines()
        wrong = [line for line in lines if not line.startswith("firefly: ")]
        assert not wrong, f"not one clear line each on stderr:\n{text}"
        return lines

    def end(self, code: int = 0, last: str = "") -> list[str]:
        """Wait for its end, check exit code and last line (a pattern), and return the lines on stderr."""
        wait_for(lambda: self.poll() is not None, f"the end of process {self.pid}")
        lines = self.lines()
        assert self.poll() == code, f"exit code {self.poll()}, expected {code}: {lines}"
        if last:
            assert lines, f"nothing on stderr, expected {last!r}"
            assert re.search(last, lines[-1]), f"{lines[-1]!r} is not {last!r}"
        return lines

    def die(self, number: int) -> list[str]:
        """Wait for the death by a signal; see `end`."""
        code, word = ENDINGS[signal.Signals(number)]
        lines = self.end(code, f"^{word}$" if word else "")
        assert bool(word) or "firefly: interrupted" not in lines
        return lines

    def wait_until_stopped(self) -> None:
        """Wait until it has stopped itself: see `Launcher.start`."""

        def stopped() -> bool:
            assert self.poll() is None, f"it ended with {self.poll()} before it stopped: {self.lines()}"
            return _state(self.pid) == "T"

        wait_for(stopped, f"the stop of process {self.pid}")

    def kill(self, number: int = signal.SIGKILL) -> None:
        """Send a signal."""
        os.kill(self.pid, number)

    def go_on(self) -> None:
        """Let a stopped process go on."""
        self.kill(signal.SIGCONT)

    def children(self) -> list[int]:
        """The processes that it has started and that live."""
        return [pid for pid in _processes() if _parent(pid) == self.pid and _state(pid) != "Z"]


class Launcher:
    """Starts captures. A context manager; at its end it kills those that are left.

    `folder` is for stdout and stderr of captures.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._stack = ExitStack()
        self._runs: list[Run] = []
        self._codes: dict[int, int] = {}

    def __enter__(self) -> Launcher:
        self._server = subprocess.Popen(
            [sys.executable, "-m", "tests.capture.launch"],
            cwd=ROOT,
            env=environment(),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        return self

    def __exit__(self, *_: object) -> None:
        for run in self._runs:
            if run.poll() is None:
                run.kill()
                wait_for(lambda run=run: run.poll() is not None, "the end of a capture")
        assert self._server.stdin is not None
        self._server.stdin.close()
        self._server.wait(PATIENCE)
        assert self._server.stdout is not None
        self._server.stdout.close()

    def start(
        self,
        *arguments: object,
        at: tuple[str, int] | None = None,
        number: int = signal.SIGKILL,
        obey: bool = False,
        largest: int | None = None,
        log: Path | None = None,
        watched: Path | None = None,
    ) -> Run:
        """``firefly capture ... -o FOLDER``, the folder being the last argument.

        Parameters
        ----------
        at : (str, int)
            A pattern and a count: the process sends itself the signal `number` before the count-th, from 1,
            of its operations in the folder that match. An operation is for example
            "os.rename .color_000002.png.77-1.part", with the path relative to the folder.
        obey : bool
            Obey the modes of files, also as root.
        largest : int
            No file can have more bytes.
        log : Path
            Where to list all operations.
        watched : Path
            The folder whose operations count, if it is not the last argument.
        """
        errors = self._folder / f"{len(self._runs)}.err"
        request = {
            "words": ["capture", *map(str, arguments[:-1]), "-o", str(arguments[-1])],
            "folder": str(arguments[-1] if watched is None else watched),
            "errors": str(errors),
            "at": at,
            "number": int(number),
            "obey": obey,
            "largest": largest,
            "log": None if log is None else str(log),
        }
        pid = self._ask({"start": request})
        run = Run(pid, lambda: self._code(pid), errors)
        self._runs.append(run)
        return run

    def start_command(self, *arguments: object) -> Run:
        """``python -m firefly_sample capture ... -o FOLDER``, from its first moment on."""
        errors = self._folder / f"{len(self._runs)}.err"
        words = ["capture", *map(str, arguments[:-1]), "-o", str(arguments[-1])]
        with errors.open("w") as file:
            process = subprocess.Popen(
                [sys.executable, "-m", "firefly_sample", *words],
                cwd=ROOT,
                env=environment(),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=file,
                preexec_fn=_default_signals,
            )
        run = Run(process.pid, process.poll, errors)
        self._runs.append(run)
        return run

    def _code(self, pid: int) -> int | None:
        if pid not in self._codes and (code := self._ask({"poll": pid})) is not None:
            self._codes[pid] = code
        return self._codes.get(pid)

    def _ask(self, request: object) -> Any:
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        print(json.dumps(request), file=self._server.stdin, flush=True)
        return json.loads(self._server.stdout.readline())


def handles(pid: int, number: int) -> bool:
    """Whether a process has its own handler of a signal."""
    status = Path(f"/proc/{pid}/status").read_text()
    caught = re.search(r"^SigCgt:\s*([0-9a-f]+)$", status, re.MULTILINE)
    return caught is not None and bool(int(caught[1], 16) >> (number - 1) & 1)


def is_running(pid: int) -> bool:
    """Whether there is such a process and it can still do something."""
    return _state(pid) not in ("", "Z", "X")


def _processes() -> list[int]:
    return [int(name) for name in os.listdir("/proc") if name.isdigit()]


def _stat(pid: int) -> list[str]:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        return ["", "0"]


def _state(pid: int) -> str:
    return _stat(pid)[0]


def _parent(pid: int) -> int:
    return int(_stat(pid)[1])


def _default_signals() -> None:
    # whoever runs the tests in the background may have had signals ignored, which children inherit
    for number in ENDINGS.keys() - {signal.SIGKILL}:
        signal.signal(number, signal.SIG_DFL)


def _serve() -> None:
    """Fork a process for each request, and say how it ended when asked."""
    import firefly_sample.commands.capture
    import firefly_sample.renderer  # noqa: F401
    import tests.capture.scenes
    import tests.cli.glade  # noqa: F401
    from firefly_sample.cli import main

    with contextlib.redirect_stdout(io.StringIO()):
        main(["plan", "tests.capture.scenes:rolling"])  # which imports much, and uses no OpenGL
    gc.freeze()
    for text in sys.stdin:
        request = json.loads(text)
        if "poll" in request:
            pid, status = os.waitpid(request["poll"], os.WNOHANG)
            print(json.dumps(os.waitstatus_to_exitcode(status) if pid else None), flush=True)
        elif (pid := os.fork()) == 0:
            code = 99
            try:
                code = _run(request["start"])
                threading._shutdown()  # what the end of a process does that is no fork
                atexit._run_exitfuncs()
            finally:
                os._exit(code)
        else:
            print(json.dumps(pid), flush=True)


def _run(request: dict[str, Any]) -> int:
    """Run a command in this process, which was forked for it."""
    from firefly_sample.cli import main

    _default_signals()
    os.close(0)
    os.open(os.devnull, os.O_RDONLY)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(os.open(request["errors"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
    sys.argv = ["firefly", *request["words"]]
    if request["largest"] is not None:
        if (child := _fork_behind_a_pipe()) is not None:
            return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        resource.setrlimit(resource.RLIMIT_FSIZE, (request["largest"], resource.RLIM_INFINITY))
    sys.addaudithook(_hook(request))
    with obeyed_permissions() if request["obey"] else contextlib.nullcontext():
        return main()


def _fork_behind_a_pipe() -> int | None:
    """Fork a process whose stderr is no file that may not grow; return its number in this one, at its end."""
    readable, writable = os.pipe()
    if (child := os.fork()) == 0:
        os.dup2(writable, 2)
        os.close(readable)
        os.close(writable)
        return None
    os.close(writable)
    while data := os.read(readable, 4096):
        os.write(2, data)
    return child


def _hook(request: dict[str, Any]) -> Callable[[str, tuple[Any, ...]], None]:
    """Return an audit hook that sends this process a signal before one of its file operations."""
    folder, at, number = request["folder"], request["at"], request["number"]
    log = None if request["log"] is None else os.open(request["log"], os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    count = 0

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal count
        if event not in _WATCHED or not isinstance(arguments[0], str | os.PathLike):
            return
        path = os.path.abspath(os.fspath(arguments[0]))
        if path != folder and not path.startswith(f"{folder}/"):
            return
        operation = f"{event} {os.path.relpath(path, folder)}"
        if log is not None:
            os.write(log, f"{operation}\n".encode())
        if at is not None and re.search(at[0], operation):
            count += 1
            if count == at[1]:
                os.kill(os.getpid(), number)

    return hook


if __name__ == "__main__":
    _serve()
