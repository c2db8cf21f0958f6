"""The output of commands: results on stdout; errors, warnings and progress on stderr.

The reader of a pipe may exit and a disk may fill up at any time, also while a library or a scene plugin
prints. That must not end the command: `safe_streams` records an error of writing instead of raising it, and
`failure_of` returns it afterwards.
"""

from __future__ import annotations

import io
import os
import select
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TextIO

from firefly_sample.errors import FireflyError


def complain(text: str) -> None:
    """Print `text` on stderr, as one line."""
    # at once, so that lines of several threads do not mix
    sys.stderr.write(f"firefly: {' '.join(text.split())}\n")


@contextmanager
def progress_bar(what: str, show: bool = True, unit: str = "") -> Iterator[Callable[[int, int], None]]:
    """Show a progress bar if stderr is a terminal; give a function of (done, in all) that moves it.

    It shows the time left, and the rate if there is a `unit`, the noun for one step. What is done at its
    first call counts for neither.
    """
    if not (show and sys.stderr.isatty()):
        yield lambda done, total: None
        return

    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn
    from rich.text import Text

    from firefly_sample.commands.pace import Pace

    pace = Pace()

    class PaceColumn(ProgressColumn):
        def render(self, _: Task) -> Text:
            return Text(pace.text(unit), no_wrap=True)

    columns = (TextColumn("{task.description}"), BarColumn(24), MofNCompleteColumn(), PaceColumn())
    # lines printed in the meantime appear above the bar
    with Progress(*columns, console=Console(stderr=True), transient=True, redirect_stdout=False) as bar:
        task = bar.add_task(what, total=None)

        def move(done: int, total: int) -> None:
            pace.advance(done, total)
            bar.update(task, completed=done, total=total)

        yield move


@contextmanager
def messages(show: bool = True) -> Iterator[None]:
    """Print what this package logs on stderr, a line each; without `show` only what is a warning or worse."""
    import logging

    class Lines(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            complain(record.getMessage())

    logger = logging.getLogger("firefly_sample")
    before, lines = logger.level, Lines()
    logger.setLevel(logging.INFO if show else logging.WARNING)
    logger.addHandler(lines)
    try:
        yield
    finally:
        logger.removeHandler(lines)
        logger.setLevel(before)


def print_result(text: str, done: str = "") -> None:
    """Print a command's result, lines of text, on stdout; raise as `check_stdout` does."""
    if _was_closed(sys.stdout):
        raise _lost("it is closed", done)
    print(text.removesuffix("\n"))
    check_stdout(done)


def print_summary(text: str, quiet: bool = False) -> None:
    """Print one line about the files that were written, unless `quiet` or stdout is closed."""
    if not quiet and not _was_closed(sys.stdout):
        print(text)
    check_stdout(text)


def print_json(value: object, done: str = "") -> None:
    """Print `value` as JSON, see `print_result`."""
    print_result(json_text(value), done)


def print_file(path: Path, done: str = "") -> None:
    """Print a file of text line by line, see `print_result`."""
    if _was_closed(sys.stdout):
        raise _lost("it is closed", done)
    with path.open(encoding="utf-8") as file:
        for line in file:
            print(line, end="")
    check_stdout(done)


def json_text(value: object) -> str:
    """Return `value` as lines of JSON, with the keys of objects in their own order."""
    import json

    return json.dumps(value, indent=2, allow_nan=False)


def check_stdout(done: str = "") -> None:
    """Raise a FireflyError if printing on stdout failed, but not if the reader of a pipe has closed it.

    Its message contains `done`, the files that were written, for example "2 frames in out".
    """
    failure = failure_of(sys.stdout)
    if failure is not None and not isinstance(failure, ConnectionError):
        raise _lost(failure.strerror or str(failure), done)


def _lost(reason: str, done: str) -> FireflyError:
    written = f"; written all the same: {done}" if done else ""
    return FireflyError(f"cannot write to stdout: {reason}{written}")


@contextmanager
def safe_streams() -> Iterator[None]:
    """Replace `sys.stdout` and `sys.stderr`, where they are the process's own, by streams that never raise.

    A standard descriptor that was closed when the process began is opened on the null device: otherwise the
    next file, for example a picture, would get its number, and with it the messages of C libraries.
    """
    before = sys.stdout, sys.stderr
    for descriptor in range(3):
        _occupy(descriptor)
    safe = _safe(sys.stdout, sys.__stdout__, 1), _safe(sys.stderr, sys.__stderr__, 2)
    sys.stdout, sys.stderr = safe
    try:
        yield
    finally:
        for stream in safe:
            with suppress(OSError, ValueError):
                stream.flush()
        sys.stdout, sys.stderr = before


def failure_of(stream: TextIO | None) -> OSError | None:
    """Flush `stream` and return the first error of writing to it, or None."""
    if not isinstance(stream, _Stream):
        return None
    stream.flush()
    return stream.sink.failure


def _was_closed(stream: TextIO) -> bool:
    """Return True if `stream` was closed when the process began."""
    return isinstance(stream, _Stream) and stream.was_closed


def _occupy(descriptor: int) -> None:
    """Open the null device as `descriptor`, if that is closed."""
    try:
        os.fstat(descriptor)
    except OSError:
        null = os.open(os.devnull, os.O_RDWR)
        if null != descriptor:
            os.dup2(null, descriptor)
            os.close(null)
        os.set_inheritable(descriptor, True)  # child processes need one as well


def _safe(stream: TextIO | None, own: TextIO | None, descriptor: int) -> TextIO:
    """Return a stream that never raises, if `stream` is the process's `own`; otherwise `stream` itself."""
    if stream is None:
        return _Stream(_Sink(descriptor), was_closed=True, encoding="utf-8", errors="backslashreplace")
    if stream is not own or not isinstance(stream, io.TextIOWrapper):
        return stream  # of a test or a notebook
    with suppress(OSError):
        stream.flush()
    return _Stream(
        _Sink(stream.fileno()),
        encoding=stream.encoding,
        # a character that the encoding lacks must not end the command either
        errors="backslashreplace" if stream.errors == "strict" else stream.errors,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )


class _Sink(io.FileIO):
    """A file on a descriptor, which ignores everything after the first error."""

    def __init__(self, descriptor: int) -> None:
        super().__init__(descriptor, "wb", closefd=False)
        self.failure: OSError | None = None

    def write(self, data: Any, /) -> int:
        """Write all of `data`, or record the error."""
        left = memoryview(data).cast("B")
        size = len(left)
        while left and self.failure is None:
            try:
                written = super().write(left)
            except OSError as error:
                self.failure = error
            else:
                if written is None:  # the pipe is full and does not block
                    select.select((), (self,), ())
                else:
                    left = left[written:]
        return size


class _Stream(io.TextIOWrapper):
    """A text stream into a `_Sink`."""

    def __init__(self, sink: _Sink, was_closed: bool = False, **options: Any) -> None:
        super().__init__(sink if options.get("write_through") else io.BufferedWriter(sink), **options)
        self.sink = sink
        self.was_closed = was_closed
