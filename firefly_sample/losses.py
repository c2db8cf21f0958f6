"""The losses of a conversion or of a file: collected by kind, with the names of what loses something."""

from __future__ import annotations

import warnings

_SHOWN = 8
"""The most names in a warning."""
_MOST_TIMES = 8
"""The most warnings of a kind in a running program."""


class ConversionWarning(UserWarning):
    """A part of a scene has no equal in the other library; the message names it and its owners."""


class Losses:
    """The losses so far."""

    def __init__(self) -> None:
        self._names: dict[str, dict[str, None]] = {}
        self._told: dict[str, int] = {}  # the names of each that `warn_new` has told
        self._times: dict[str, int] = {}  # how often it has told each

    def add(self, loss: str, name: str = "") -> None:
        """Note a loss, and the name of what has it, if it has one."""
        names = self._names.setdefault(loss, {})
        if name:
            names[name] = None

    def lines(self) -> list[str]:
        """Return one line for each kind of loss, with the first names."""
        return [_line(loss, list(names)) for loss, names in self._names.items()]

    def warn(self, stacklevel: int) -> None:
        """Issue one `ConversionWarning` for each kind of loss; `stacklevel` 1 is the caller."""
        for line in self.lines():
            warnings.warn(line, ConversionWarning, stacklevel=stacklevel + 1)

    def warn_new(self, stacklevel: int) -> None:
        """Issue a `ConversionWarning` for each kind of loss that is new or has new names.

        A program may make new names for ever: the eighth warning of a kind is the last one, and says so.
        """
        for loss, names in self._names.items():
            told, times = self._told.get(loss), self._times.get(loss, 0) + 1
            if told == len(names) or times > _MOST_TIMES:
                continue
            self._told[loss], self._times[loss] = len(names), times
            line = _line(loss, list(names)[told or 0 :])
            if times == _MOST_TIMES:
                line += " (later names are not told)"
            warnings.warn(line, ConversionWarning, stacklevel=stacklevel + 1)


def _line(loss: str, names: list[str]) -> str:
    shown = [repr(name) for name in names]
    if len(shown) > _SHOWN:
        shown[_SHOWN:] = [f"and {len(shown) - _SHOWN} more"]
    return f"{loss}: {', '.join(shown)}" if shown else loss
