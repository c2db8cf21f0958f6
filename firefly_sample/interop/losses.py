"""The losses of a conversion: collected by kind, and reported in one warning per kind."""

from __future__ import annotations

import warnings

_SHOWN = 8
"""The most names in a warning."""


class ConversionWarning(UserWarning):
    """A part of a scene has no equal in the other library; the message names it and its owners."""


class Losses:
    """A conversion's losses so far."""

    def __init__(self) -> None:
        self._names: dict[str, dict[str, None]] = {}

    def add(self, loss: str, name: str) -> None:
        """Note a loss of the object called `name`."""
        self._names.setdefault(loss, {})[name] = None

    def warn(self, stacklevel: int) -> None:
        """Issue one `ConversionWarning` for each kind of loss; `stacklevel` 1 is the caller."""
        for loss, names in self._names.items():
            shown = [repr(name) for name in names]
            if len(shown) > _SHOWN:
                shown[_SHOWN:] = [f"and {len(shown) - _SHOWN} more"]
            warnings.warn(f"{loss}: {', '.join(shown)}", ConversionWarning, stacklevel=stacklevel + 1)
