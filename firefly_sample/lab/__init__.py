"""What pictures cost and how far they are off, measured."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from firefly_sample.lab.choice import choose

__all__ = ["choose"]


def __getattr__(name: str) -> Any:
    """`choose`, imported when it is first asked for, since it brings a renderer."""
    if name == "choose":
        from firefly_sample.lab.choice import choose

        return choose
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
