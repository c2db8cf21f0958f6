"""What people see while a command works, all of it on stderr: stdout is for results."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

__all__ = ["complain", "print_json", "progress_bar"]


def complain(text: str) -> None:
    """One line on stderr, whatever line breaks `text` has."""
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


def print_json(value: object) -> None:
    """`value` as JSON on stdout; keys of objects in their own order."""
    import json

    print(json.dumps(value, indent=2, allow_nan=False))
