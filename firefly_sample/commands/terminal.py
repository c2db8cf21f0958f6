"""What people see while a command works, all of it on stderr: stdout is for results."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from firefly_sample.commands.streams import failure_of, was_closed
from firefly_sample.errors import FireflyError


def complain(text: str) -> None:
    """Print one line on stderr, whatever line breaks `text` has."""
    print("firefly:", " ".join(text.split()), file=sys.stderr)


@contextmanager
def progress_bar(what: str, show: bool = True) -> Iterator[Callable[[int, int], None]]:
    """A progress bar on a terminal, nothing elsewhere; gives a function of (done, in all)."""
    if not (show and sys.stderr.isatty()):
        yield lambda done, total: None
        return

    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    # lines that are printed meanwhile appear above the bar
    with Progress(*columns, console=Console(stderr=True), transient=True, redirect_stdout=False) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def print_result(text: str, done: str = "") -> None:
    """Print a command's result on stdout; nothing if its reader has seen enough and gone.

    Parameters
    ----------
    text : str
        Lines; the last line's end is added.
    done : str
        What is written even where the result cannot be printed, for example "2 frames in out".

    Raises
    ------
    FireflyError
        If stdout is closed or full; the message says what is done.
    """
    if was_closed(sys.stdout):
        raise _lost("it is closed", done)
    print(text.removesuffix("\n"))
    check_stdout(done)


def print_summary(text: str, quiet: bool = False) -> None:
    """Print one line on the files that were written, unless `quiet` or stdout is closed.

    Raises
    ------
    FireflyError
        If stdout is full; the message says what was done.
    """
    if not quiet and not was_closed(sys.stdout):
        print(text)
    check_stdout(text)


def print_json(value: object, done: str = "") -> None:
    """Print `value` as JSON, see `print_result`."""
    print_result(json_text(value), done)


def json_text(value: object) -> str:
    """`value` as lines of JSON; keys of objects stay in their own order."""
    import json

    return json.dumps(value, indent=2, allow_nan=False)


def check_stdout(done: str = "") -> None:
    """Raise a FireflyError if something printed on stdout is lost and its reader has not simply gone."""
    failure = failure_of(sys.stdout)
    if failure is not None and not isinstance(failure, ConnectionError):
        raise _lost(failure.strerror or str(failure), done)


def _lost(reason: str, done: str) -> FireflyError:
    written = f"; written all the same: {done}" if done else ""
    return FireflyError(f"cannot write to stdout: {reason}{written}")
