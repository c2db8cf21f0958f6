"""How Hypothesis searches here: the same examples each run, and no clock, since machines differ."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.load_profile("repeatable")
