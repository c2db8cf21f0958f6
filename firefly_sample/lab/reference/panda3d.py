"""The formula of Panda3D's shader generator in float64: the twin of PANDA3D in the shaders.

The light that a surface emits and reflects diffusely is at most 1 in each channel. Then the tint multiplies
it, which is the texture times the colour scale, and highlights are added:

    min(emission + ambient light * ambient + sum of lights * base colour * max(N.L, 0), 1) * tint + highlights

Highlights are Blinn-Phong ones, (N.H)^shininess, on surfaces that face away from a light as well. The eye is
infinitely far behind the camera, or where it is for materials with a local viewer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float64 = NDArray[np.float64]

HIGHLIGHTS = "blinn_phong"
"""The formula of highlights: a value of the setting `specular_model`."""
BEHIND = (0.0, -1.0, 0.0)
"""The direction to the eye of materials without a local viewer, in view space."""


def shown(matt: Float64, tint: Float64, gloss: Float64) -> Float64:
    """Return display values of emitted and diffuse light, a tint and highlights, shapes (..., 3)."""
    return np.asarray(np.minimum(np.minimum(matt, 1.0) * tint + gloss, 1.0))
