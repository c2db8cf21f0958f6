"""How well the meshes that are drawn for lights fit them: what their flat faces miss, or cover in vain."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.device import Device
from firefly_sample.gpu.proxies import circumscribed_cone, circumscribed_cube, circumscribed_icosphere
from firefly_sample.lab.experiments.table import Table, Value

Float64 = NDArray[np.float64]

HALF_ANGLES = (10.0, 30.0, 45.0, 53.0, 60.0)
SIDES = 16


def proxies(device: Device | None = None, views: int = 20_000) -> Table:
    """Triangles of each proxy, and its silhouette against that of its sphere or cone; in float64.

    Parameters
    ----------
    views : int
        Directions that they are looked at from, spread evenly.
    """
    seen_from = _even_directions(views)
    rows: list[tuple[Value, ...]] = []
    meshes = {"cube": circumscribed_cube()} | {
        f"icosphere{level}": circumscribed_icosphere(level) for level in range(4)
    }
    for name, mesh in meshes.items():
        scale = float(np.linalg.norm(mesh, axis=2).max()) / _inradius(mesh)
        rows.append(_row(name, mesh, mesh / np.linalg.norm(mesh, axis=2).max(), scale, math.pi, seen_from))
    for degrees in HALF_ANGLES:
        tangent = math.tan(math.radians(degrees))
        wide = np.array([tangent, 1.0, tangent])
        outside = circumscribed_cone(SIDES) * wide
        scale = float(np.hypot(outside[:, :, 0], outside[:, :, 2]).max()) / tangent
        inside = outside / (scale, 1.0, scale)
        # of a convex body, the silhouette is a quarter of the surface on average (Cauchy)
        exact = 0.25 * math.pi * tangent * (tangent + math.hypot(1.0, tangent))
        rows.append(_row(f"cone, {degrees:g} degrees", outside, inside, scale, exact, seen_from))
    about = (
        "Meshes for lights: triangles; how much an inscribed one must grow to hold its sphere or cone; the "
        "share of the silhouette that it misses if it does not; what it covers in vain if it does; and all "
        "that it covers, over the silhouette of a sphere of the same reach."
    )
    columns = ("proxy", "triangles", "scale", "missed inscribed", "extra circumscribed", "of a sphere's")
    return Table("proxies", about, columns, rows)


def _row(
    name: str, outside: Float64, inside: Float64, scale: float, exact: float, seen_from: Float64
) -> tuple[Value, ...]:
    covered, reached = (_silhouette(mesh, seen_from) for mesh in (outside, inside))
    return (name, len(outside), scale, 1.0 - reached / exact, covered / exact - 1.0, covered / math.pi)


def _silhouette(mesh: Float64, seen_from: Float64) -> float:
    """Mean projected area of a convex mesh: half of what its faces cover, since a line meets two of them."""
    faces = 0.5 * np.cross(mesh[:, 1] - mesh[:, 0], mesh[:, 2] - mesh[:, 0])
    return float(
        np.mean([0.5 * np.abs(part @ faces.T).sum(axis=1).mean() for part in np.split(seen_from, 20)])
    )


def _inradius(mesh: Float64) -> float:
    """Distance of the nearest face from the origin."""
    faces = np.cross(mesh[:, 1] - mesh[:, 0], mesh[:, 2] - mesh[:, 0])
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    return float((faces * mesh[:, 0]).sum(axis=1).min())


def _even_directions(count: int) -> Float64:
    """Unit vectors (count, 3) on a spiral whose turns are the golden angle apart, evenly in height."""
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    turn = np.pi * (3.0 - math.sqrt(5.0)) * np.arange(count)
    ring = np.sqrt(1.0 - height**2)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
