"""What small errors of angles come to: at a spotlight's edge, and in highlights."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.device import Device
from firefly_sample.lab.numerics_gbuffer import normal_bounds
from firefly_sample.lab.numerics_table import Table, Value
from firefly_sample.lab.probes.probe import evaluate
from firefly_sample.lab.reference.shading import opening

Float64 = NDArray[np.float64]

HALF_ANGLES = (60.0, 10.0, 1.0, 0.1, 0.01)
SHININESS = {"32": 32.0, "128": 128.0, "1e3": 1e3, "1e4": 1e4}


def cones(device: Device, samples: int = 50_000) -> Table:
    """Largest relative error of 1 - cos at a spotlight's edge, by the cosine and by the shaders' function.

    Parameters
    ----------
    samples : int
        Directions, all at the half-angle from the axis, as float32 has them.
    """
    axis = np.array([0.36, 0.48, 0.8], dtype=np.float32).astype(np.float64)
    axis_text = f"const vec3 axis = vec3({', '.join(repr(float(value)) for value in axis)});"
    rng = np.random.Generator(np.random.PCG64(10))
    side = np.cross(axis, rng.normal(size=(samples, 3)))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    rows: list[tuple[Value, ...]] = []
    for degrees in HALF_ANGLES:
        angle = np.radians(degrees)
        way = (np.cos(angle) * axis + np.sin(angle) * side).astype(np.float32).astype(np.float64)
        # of the directions as float32 has them, as unit vectors
        exact = opening(-way / np.linalg.norm(way, axis=1, keepdims=True), axis / np.linalg.norm(axis))
        errors = []
        for body in (
            "result.r = 1.0 - dot(a.xyz, axis);",
            "vec3 across = cross(a.xyz, axis); result.r = opening(dot(a.xyz, axis), dot(across, across));",
        ):
            inputs = np.pad(way, ((0, 0), (0, 1)))
            found = evaluate(device, ["cone"], f"{axis_text} {body}", inputs, {"SPECULAR_MODEL": 0})[:, 0]
            errors.append(float(np.abs(found / exact - 1.0).max()))
        rows.append((f"{degrees:g} degrees", *errors))
    about = (
        "Largest relative error of 1 - cos at the edge of a cone, in float32, by its half-angle: from the "
        "cosine, and by our function of cosine and sine."
    )
    return Table("cones", about, ("half-angle", "1 - cosine", "opening"), rows)


def highlights(device: Device | None = None, samples: int = 20_000) -> Table:
    """Largest error of a Blinn-Phong highlight, by how normals are stored and by the exponent; in float64.

    Parameters
    ----------
    samples : int
        Angles between the normal and the half-way vector.
    """
    rows: list[tuple[Value, ...]] = []
    for name, off in normal_bounds().items():
        errors = []
        for m in SHININESS.values():
            angle = np.linspace(-off, np.arccos(np.exp(np.log(1e-4) / m)), samples)
            before, after = (np.exp(0.5 * m * np.log1p(-(np.sin(at) ** 2))) for at in (angle, angle + off))
            errors.append(float(np.abs(before - after).max()))
        rows.append((name, *errors))
    about = (
        "Largest error of a Blinn-Phong highlight whose normal is off by as much as its format allows, by "
        "the exponent. Of Phong's, twice as much."
    )
    return Table("highlights", about, ("normals", *SHININESS), rows)
