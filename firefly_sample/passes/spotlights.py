"""Spotlight pass: cones, or spheres where those are smaller."""

from __future__ import annotations

from firefly_sample.passes.lights import LightPass


class SpotlightsPass(LightPass):
    """Adds every spotlight in view."""

    name = "spotlights"
    kind = "spot"
