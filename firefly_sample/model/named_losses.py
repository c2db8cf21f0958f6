"""The losses of a file: properties that are not drawn, collected by kind, with those that have them."""

from __future__ import annotations

_SHOWN = 8
"""The most names in a line."""


class NamedLosses:
    """A file's losses so far."""

    def __init__(self) -> None:
        self._names: dict[str, dict[str, None]] = {}

    def add(self, loss: str, name: str = "") -> None:
        """Note a property that is not drawn, and the name of what has it, if it has one."""
        names = self._names.setdefault(loss, {})
        if name:
            names[name] = None

    def lines(self) -> list[str]:
        """Return one line for each property, with the first names."""
        lines = []
        for loss, names in self._names.items():
            shown = [repr(name) for name in names]
            if len(shown) > _SHOWN:
                shown[_SHOWN:] = [f"and {len(shown) - _SHOWN} more"]
            lines.append(f"{loss}: {', '.join(shown)}" if shown else loss)
        return lines
