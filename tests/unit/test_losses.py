"""The warnings of losses in a program that runs on."""

from __future__ import annotations

import warnings

from firefly_sample.losses import Losses


def told(losses: Losses) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        losses.warn_new(stacklevel=1)
    return [str(warning.message) for warning in caught]


def test_new_names_are_told_and_old_ones_are_not():
    losses = Losses()
    losses.add("fog is not drawn", "one")
    assert told(losses) == ["fog is not drawn: 'one'"]
    losses.add("fog is not drawn", "one")
    assert told(losses) == []
    losses.add("fog is not drawn", "two")
    assert told(losses) == ["fog is not drawn: 'two'"]


def test_names_that_never_end_are_told_eight_times():
    losses, said = Losses(), []
    for number in range(100):
        losses.add("fog is not drawn", f"bullet {number}")
        said += told(losses)
    assert len(said) == 8
    assert said[6] == "fog is not drawn: 'bullet 6'"
    assert said[7] == "fog is not drawn: 'bullet 7' (later names are not told)"
    losses.add("stencil tests are not made", "bullet")
    assert told(losses) == ["stencil tests are not made: 'bullet'"]
