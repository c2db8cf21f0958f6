"""Directional-light pass: one full-screen triangle a light, for they reach everything."""

from __future__ import annotations

from firefly_sample.passes.lights import LightPass


class DirectionalLightsPass(LightPass):
    """Adds every directional light."""

    name = "directional_lights"
    kind = "directional"
