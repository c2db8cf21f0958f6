"""What a conversion leaves out or changes: gathered by kind, and said in one warning each."""

from __future__ import annotations

import warnings

_SHOWN = 8


class ConversionWarning(UserWarning):
    """Something of a scene has no equal in the other library; the message names what, and whose it is."""


class Losses:
    """A conversion's losses so far."""

    def __init__(self) -> None:
        self._names: dict[str, dict[str, None]] = {}

    def add(self, what: str, name: str) -> None:
        """Note that `what` happened to the thing called `name`."""
        self._names.setdefault(what, {})[name] = None

    def warn(self, stacklevel: int) -> None:
        """Raise one `ConversionWarning` for each kind of loss; `stacklevel` counts from the caller, 1."""
        for what, names in self._names.items():
            shown = [repr(name) for name in names]
            if len(shown) > _SHOWN:
                shown[_SHOWN:] = [f"and {len(shown) - _SHOWN} more"]
            warnings.warn(f"{what}: {', '.join(shown)}", ConversionWarning, stacklevel=stacklevel + 1)
