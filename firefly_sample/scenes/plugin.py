"""What the scenes of this package share: the plugin, its parameters, parts of model files, round meshes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import ModelError, ParameterError, SceneError
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.parameter import Parameter
from firefly_sample.scene.scene import Scene, ScenePlugin


@dataclass(frozen=True)
class Plugin:
    """The object that an entry point names: see `firefly_sample.scene.scene.ScenePlugin`.

    Attributes
    ----------
    lights_parameter : str, optional
        The name of the parameter for the number of lights, if it is not "lights"; any plugin may have this
        attribute. See the function of the same name.
    """

    name: str
    summary: str
    parameters: tuple[Parameter, ...]
    build: Callable[..., Scene]
    lights_parameter: str | None = None


def seed_parameter(text: str, live: bool = True) -> Parameter:
    """Return the parameter for a scene's seed, with this help text."""
    return Parameter("seed", int, 7, text, minimum=0, maximum=2**63 - 1, live=live)


def lights_parameter(plugin: ScenePlugin) -> Parameter | None:
    """Return the parameter for the number of lights of a scene.

    It is the one that the plugin's attribute ``lights_parameter`` names, or else a whole number called
    "lights"; None if there is neither.

    Raises
    ------
    SceneError
        If the attribute names no parameter that is a whole number.
    """
    named = getattr(plugin, "lights_parameter", None)
    for parameter in plugin.parameters:
        if parameter.name == (named or "lights") and parameter.type is int:
            return parameter
    if named is None:
        return None
    raise SceneError(
        f"scene {plugin.name!r}: lights_parameter must name a parameter that is a whole number, got {named!r}"
    )


def check_live(scene: str, parameters: tuple[Parameter, ...], name: str, value: Any) -> Any:
    """Return the checked new value of a live parameter of a running scene.

    Raises
    ------
    ParameterError
        If there is no such parameter, it is not live, or the value is wrong.
    """
    live = {parameter.name: parameter for parameter in parameters if parameter.live}
    if name not in live:
        all_live = len(live) == len(parameters)
        kind, others = ("parameter", "") if all_live else ("live parameter", "; the others need a new scene")
        raise ParameterError(f"scene {scene!r} has no {kind} {name!r}: it has {', '.join(live)}{others}")
    return live[name].check(value, scene)


def find_part(file: NodePath, name: str) -> GeomNode:
    """Return all Geoms at and below the node `name` of a loaded model, as one node to copy.

    Raises
    ------
    ModelError
        If there is no such node; the message names file and node.
    """
    part = file.find(f"**/{name}")
    if part.is_empty():
        raise ModelError(
            f"model {file.get_name()}.glb: has no node {name!r}: make it again with models/make_models.py"
        )
    merged = GeomNode(name)
    for path in [part, *part.find_all_matches("**")]:
        node = path.node()
        if isinstance(node, GeomNode):
            for geom, material in node.geoms:
                merged.add_geom(geom, material)
    return merged


def set_visible(path: NodePath, visible: bool) -> None:
    """Show or hide `path` and everything below it."""
    if visible:
        path.show()
    else:
        path.hide()


def icosphere(subdivisions: int) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return a unit sphere: an icosahedron whose triangles are divided into four repeatedly.

    Returns
    -------
    corners : ndarray of float64, shape (10 * 4**subdivisions + 2, 3)
        Also the sphere's normals.
    triangles : ndarray of int32, shape (20 * 4**subdivisions, 3)
        Counter-clockwise from outside; neighbours share corners.
    """
    golden = (1.0 + 5.0**0.5) / 2.0
    flat = np.array([(a, b * golden, 0.0) for a in (-1.0, 1.0) for b in (-1.0, 1.0)])
    corners = np.concatenate([np.roll(flat, shift, axis=1) for shift in range(3)])
    # an edge has length 2; a face is three corners at that distance, ordered so that it faces outwards
    near = np.abs(np.linalg.norm(corners[:, None] - corners, axis=2) - 2.0) < 1e-9
    triangles = [
        (a, b, c) if np.linalg.det(corners[[a, b, c]]) > 0.0 else (a, c, b)
        for a, b, c in itertools.combinations(range(12), 3)
        if near[a, b] and near[b, c] and near[c, a]
    ]
    points = [corner / np.linalg.norm(corner) for corner in corners]
    for _ in range(subdivisions):
        middles: dict[tuple[int, int], int] = {}
        quarters = []
        for a, b, c in triangles:
            found = []
            for one, other in ((a, b), (b, c), (c, a)):
                edge = min(one, other), max(one, other)
                if edge not in middles:
                    middles[edge] = len(points)
                    middle = points[one] + points[other]
                    points.append(middle / np.linalg.norm(middle))
                found.append(middles[edge])
            ab, bc, ca = found
            quarters += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = quarters
    return np.array(points), np.array(triangles, dtype=np.int32)


def sphere_directions(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return unit vectors, shape (n, 3), distributed evenly if `u` and `v` are: z is uniform on -1..1."""
    height, angle = 2.0 * u - 1.0, 2.0 * math.pi * v
    flat = np.sqrt(1.0 - height**2)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), height], axis=1)


def hue_colors(hue: NDArray[np.float64], saturation: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return linear colours, shape (n, 3), whose largest channel is 1, from hue and saturation in 0..1."""
    # the closed form of hue: f(n) = 1 - s max(0, min(q, 4 - q, 1)), q = (n + 6 h) mod 6
    q = (np.array([5.0, 3.0, 1.0]) + 6.0 * hue[:, None]) % 6.0
    fall = np.clip(np.minimum(q, 4.0 - q), 0.0, 1.0)
    return np.asarray(1.0 - saturation[:, None] * fall)
