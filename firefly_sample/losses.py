"""The losses of a conversion or of a file: collected by kind, with the names of what loses something."""

from __future__ import annotations

import warnings

_SHOWN = 8
"""The most names in a warning."""


class ConversionWarning(UserWarning):
    """A part of a scene has no equal in the other library; the message names it and its owners."""


class Losses:
    """The losses so far."""

    def __init__(self) -> None:
        self._names: dict[str, dict[str, None]] = {}

    def add(self, loss: str, name: str = "") -> None:
        """Note a loss, and the name of what has it, if it has one."""
        names = self._names.setdefault(loss, {})
        if name:
            names[name] = None

    def lines(self) -> list[str]:
        """Return one line for each kind of loss, with the first names."""
        lines = []
        for loss, names in self._names.items():
            shown = [repr(name) for name in names]
            if len(shown) > _SHOWN:
                shown[_SHOWN:] = [f"and {len(shown) - _SHOWN} more"]
            lines.append(f"{loss}: {', '.join(shown)}" if shown else loss)
        return lines

    def warn(self, stacklevel: int) -> None:
        """Issue one `ConversionWarning` for each kind of loss; `stacklevel` 1 is the caller."""
        for line in self.lines():
            warnings.warn(line, ConversionWarning, stacklevel=stacklevel + 1)
