"""Numbers inside shaders, made visible: a picture shows only what is left of them at the end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.blocks import view_values
from firefly_sample.gpu.device import Device
from firefly_sample.lab.probes.probe import evaluate
from firefly_sample.plan.view import View

Float32 = NDArray[np.float32]


def probe_rays(device: Device, view: View) -> Float32:
    """What shaders know of each pixel of a view.

    Returns
    -------
    ndarray of float32, shape (height, width, 4)
        NDC, right and up, and x and z of the way through the pixel's centre at y = 1 (orthographic: of the
        place); the first row on top.
    """
    width, height = view.size
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height)[::-1] + 0.5)
    centres = np.zeros((width * height, 4))
    centres[:, 0], centres[:, 1] = x.ravel(), y.ravel()
    rays = evaluate(
        device,
        ["lens"],
        "vec2 ndc = ndc_from_pixel(a.xy); result = vec4(ndc, view_from_distance(ndc, 1.0).xz);",
        centres,
        {"ORTHOGRAPHIC": int(not view.lens.perspective)},
        {"View": view_values(view)},
    )
    return rays.reshape(height, width, 4)
