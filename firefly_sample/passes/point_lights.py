"""Point-light pass: spheres, or full-screen triangles where a sphere would hold the whole view."""

from __future__ import annotations

from firefly_sample.passes.lights import LightPass


class PointLightsPass(LightPass):
    """Adds every point light in view."""

    name = "point_lights"
    kind = "point"
