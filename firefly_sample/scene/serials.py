"""Serial numbers: what tells an object from every other one, also from those that come after its end.

An object's id does not: Python gives it to the next one. What is kept of an object for longer than the object
itself, as on a GPU, is found by its serial number.
"""

from __future__ import annotations

import itertools

_NUMBERS = itertools.count()


def new_serial() -> int:
    """Return a number that nothing else in this process has had."""
    return next(_NUMBERS)
