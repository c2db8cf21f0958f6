"""The output of commands: results on stdout; errors, warnings and progress on stderr."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from firefly_sample.commands.streams import failure_of, was_closed
from firefly_sample.errors import FireflyError


def complain(text: str) -> None:
    """Print `text` on stderr, as one line."""
    print("firefly:", " ".join(text.split()), file=sys.stderr)


@contextmanager
def progress_bar(what: str, show: bool = True) -> Iterator[Callable[[int, int], None]]:
    """Show a progress bar if stderr is a terminal; give a function of (done, in all) that moves it."""
    if not (show and sys.stderr.isatty()):
        yield lambda done, total: None
        return

    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    # lines printed in the meantime appear above the bar
    with Progress(*columns, console=Console(stderr=True), transient=True, redirect_stdout=False) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def print_result(text: str, done: str = "") -> None:
    """Print a command's result on stdout; it is no error if the reader of a pipe has closed it.

    Parameters
    ----------
    text : str
        Lines; the last one needs no line break.
    done : str
        For the error message: what was written to files, for example "2 frames in out".

    Raises
    ------
    FireflyError
        If stdout is closed or full.
    """
    if was_closed(sys.stdout):
        raise _lost("it is closed", done)
    print(text.removesuffix("\n"))
    check_stdout(done)


def print_summary(text: str, quiet: bool = False) -> None:
    """Print one line about the files that were written, unless `quiet` or stdout is closed.

    Raises
    ------
    FireflyError
        If stdout is full.
    """
    if not quiet and not was_closed(sys.stdout):
        print(text)
    check_stdout(text)


def print_json(value: object, done: str = "") -> None:
    """Print `value` as JSON, see `print_result`."""
    print_result(json_text(value), done)


def json_text(value: object) -> str:
    """Return `value` as lines of JSON, with the keys of objects in their own order."""
    import json

    return json.dumps(value, indent=2, allow_nan=False)


def check_stdout(done: str = "") -> None:
    """Raise a FireflyError if printing on stdout failed, but not if the reader of a pipe has closed it."""
    failure = failure_of(sys.stdout)
    if failure is not None and not isinstance(failure, ConnectionError):
        raise _lost(failure.strerror or str(failure), done)


def _lost(reason: str, done: str) -> FireflyError:
    written = f"; written all the same: {done}" if done else ""
    return FireflyError(f"cannot write to stdout: {reason}{written}")
