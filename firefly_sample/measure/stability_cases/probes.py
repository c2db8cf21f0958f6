"""Numbers inside shaders, made visible: a picture shows only what is left of them at the end."""

from __future__ import annotations

from typing import get_args

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.blocks import view_values
from firefly_sample.gpu.device import Device
from firefly_sample.gpu.probe import evaluate
from firefly_sample.plan.frame_plan import View
from firefly_sample.plan.variants import NormalPacking

__all__ = ["probe_normals", "probe_rays"]

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


def probe_normals(device: Device, normals: Float32, packing: NormalPacking, format_name: str) -> Float32:
    """Normals as they come back from a target that they were stored in.

    Parameters
    ----------
    normals : ndarray of float32, shape (n, 3)
        Unit vectors.
    packing, format_name : str
        As `firefly_sample.plan.targets.NORMAL_FORMATS` has them.

    Returns
    -------
    ndarray of float32, shape (n, 3)
    """
    back = evaluate(
        device,
        ["gbuffer"],
        "result = encode_normal(a.xyz);",
        np.pad(normals, ((0, 0), (0, 1))),
        {"NORMALS": get_args(NormalPacking).index(packing), "COLORS": 0},
        target=format_name,
        then="result = vec4(decode_normal(a), 0.0);",
    )
    return back[:, :3]
