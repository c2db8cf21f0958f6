"""The report of a comparison of captures: problems and notes."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from typing import Any

from firefly_sample.capture.checking.comparing import Limits
from firefly_sample.errors import printable


@dataclass(frozen=True)
class Problem:
    """Something that is not as it should be.

    Attributes
    ----------
    kind : str
        "missing", "damaged" or "changed": a file of a capture. "unknown": an output that this version has
        not. "failed": a frame that could not be drawn. "manifest": a damaged part of one. "unfinished" or
        "empty": a capture. "only": frames or outputs of one of two captures. "size" or "different": images.
    text : str
        One line.
    file : str or None
        Its path.
    capture : str
        The folder of the capture in a sweep; "" otherwise.
    frame : int or None
    output : str or None
    figures : dict or None
        Of images that differ: pixels (over the limits), of, largest, mean, scale. See
        `firefly_sample.capture.checking.comparing.Difference`.
    picture : str or None
        The path of the difference picture.
    """

    kind: str
    text: str
    file: str | None = None
    capture: str = ""
    frame: int | None = None
    output: str | None = None
    figures: dict[str, Any] | None = None
    picture: str | None = None


@dataclass(frozen=True)
class Note:
    """Something worth knowing that is no error.

    `kind` is "stale", "rewritten", "within" or "description"; `files` are all files that `text` is about.
    """

    kind: str
    text: str
    files: tuple[str, ...] = ()


@dataclass
class Report:
    """The result of a comparison.

    Attributes
    ----------
    folder, other : str or None
        As given; `other` is None if a capture was compared with its manifest.
    frames, files : int
        How many were compared.
    limits : Limits or None
        None for one capture.
    problems : list of Problem
        In the order of frames.
    notes : list of Note
    """

    folder: str
    other: str | None = None
    limits: Limits | None = None
    frames: int = 0
    files: int = 0
    problems: list[Problem] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)

    @property
    def ok(self) -> bool:
        """True if there is no problem."""
        return not self.problems

    def as_dict(self) -> dict[str, Any]:
        """Return all of it as plain JSON values; a difference that is infinite is the text "inf"."""
        return {"ok": self.ok, **_plain(asdict(self))}

    def add(self, kind: str, text: str, **more: Any) -> None:
        """Add a problem; characters of names that cannot be printed become escapes."""
        self.problems.append(Problem(kind, printable(text), **more))

    def note(self, kind: str, text: str, files: Iterable[str] = ()) -> None:
        """Add a note."""
        self.notes.append(Note(kind, printable(text), tuple(files)))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value
