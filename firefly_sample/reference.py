"""The old name of `firefly_sample.lab.reference`: importing it raises an error that says so."""

from firefly_sample.errors import RENAMED

raise ImportError(f"{__name__} is now called {RENAMED[__name__][0]}")
