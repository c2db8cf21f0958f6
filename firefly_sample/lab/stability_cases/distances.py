"""Near and far: what is left of a distance after the way through the G-buffer.

What is measured is what the shaders of lights make of it. A light at the eye that fades as 1/d says in a
picture how far away each pixel's surface is; on a plane that is known in float64 as well. Distances that are
read back and decoded on the CPU would leave out the arithmetic of the shader, in which the methods differ
most.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import FireflyError
from firefly_sample.lab.reference.rays import pixel_rays
from firefly_sample.lab.stability_cases.bench import SIZE, Bench, Drawn
from firefly_sample.lab.stability_cases.case import ACCURATE, DOUBLES, Case, positioned
from firefly_sample.lab.stability_cases.scenes import WALL, geom_node, wall, wall_scene
from firefly_sample.plan.position_error import HALF_FLOAT_END, codes_shown
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, PointLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene

Float64 = NDArray[np.float64]

NEAR = 0.01
TILT = 15.0
FARTHEST = 1.25
"""Of the distance of the tilted plane's middle: how far away it is seen at most, rounded up."""
BOUND = 1e-6
WIDEST = 179.999
"""Degrees."""


def lit_from_the_eye(
    distance: float, near: float, far: float, fov: float, tilt: float, cells: int = 64
) -> Scene:
    """A white plane, twice as wide as is seen, under a light at the eye that fades as 1/d."""
    scene = Scene()
    width = 4.0 * distance * math.tan(math.radians(fov / 2.0))
    plane = geom_node("plane", wall(width, cells), Material("white", (1.0, 1.0, 1.0, 1.0)))
    scene.root.attach_new_node(plane).set_pos_hpr(0, distance, 0, 0, -tilt, 0)
    light = PointLight("eye")
    light.set_attenuation((0.0, 1.0 / distance, 0.0))
    scene.root.attach_new_node(light)
    scene.camera_node.lens = PerspectiveLens(fov=fov, aspect_ratio=4 / 3, near=near, far=far)
    return scene


def error_of_distance(drawn: Drawn, distance: float, tilt: float) -> float:
    """Largest relative error of y: light is cos / d, and both are y times or over what a ray says.

    Infinite if a pixel is black.
    """
    view = drawn.plan.view
    rays = pixel_rays(view).direction.reshape(view.size[1], view.size[0], 3)
    angle = math.radians(tilt)
    normal = np.array([0.0, -math.cos(angle), math.sin(angle)])
    facing = -rays @ normal
    y = -normal[1] * distance / facing
    expected = facing / np.einsum("...i,...i", rays, rays) * distance / y
    light = drawn["light"][..., 0]
    with np.errstate(divide="ignore", over="ignore"):
        return float(np.abs(expected / light - 1.0).max())


def law_of_distance(method: str, share: float, near: float, distance: float) -> float:
    """The relative error that a method may have at `distance`; `share` is (far - near) / far."""
    magnified = share * distance / near
    laws = {
        "depth24": 4 * 6e-8 * magnified,
        "inverse_matrix": 4 * 6e-8 * magnified,
        "depth16": (2.0**-17 + 4 * 6e-8) * magnified,
        "stored16f": 2.0**-10 if distance < HALF_FLOAT_END else 1.0,
    }
    return BOUND + laws[method]


def bound_of_distance(method: str, share: float, near: float, distance: float) -> float:
    """A method's own law while it does not show; else what the accurate methods hold."""
    if method in ACCURATE:
        return BOUND
    law = law_of_distance(method, share, near, distance)
    return BOUND if codes_shown(law, 1.0) > 1.0 else law


def _plane(ratio: float, far: float | None = None) -> Case:
    """A tilted plane in the middle of a range of `ratio`."""
    distance = 0.5 * NEAR * ratio
    planes = (NEAR, NEAR * ratio if far is None else far)
    name = f"distance, f/n {ratio:g}" if far is None else f"distance, far infinite, y/n {ratio / 2:g}"

    def run(bench: Bench, method: str) -> float:
        scene = lit_from_the_eye(distance, *planes, 40.0, TILT)
        settings = positioned(method, normals="rgba32f", cutoff_budget=0.0)
        return error_of_distance(bench.draw(scene, settings, outputs=("light",)), distance, TILT)

    return Case(name, run, lambda method: bound_of_distance(method, 1.0, NEAR, FARTHEST * distance))


def _lens(fov: float) -> Case:
    """A plane that faces the eye, through a lens that is all but closed or all but flat."""

    def run(bench: Bench, method: str) -> float:
        # a pixel is a square: in the middle of the widest view, places are small beside those of larger ones
        scene = lit_from_the_eye(WALL, 1.0, 100.0, fov, 0.0, 2 * SIZE[0])
        settings = positioned(method, normals="rgba32f", cutoff_budget=0.0)
        return error_of_distance(bench.draw(scene, settings, outputs=("light",)), WALL, 0.0)

    def bound(method: str) -> float:
        if method == "stored32f" and fov == WIDEST:
            # a driver interpolates places over the whole picture: its middle has what its edge rounds
            return BOUND + 2.0**-24 * SIZE[0]
        if method == "stored16f" and WALL * math.tan(math.radians(fov / 2.0)) > HALF_FLOAT_END:
            return BOUND
        return bound_of_distance(method, 0.99, 1.0, WALL)

    return Case(f"distance, fov {fov:g}", run, bound)


def _coverage(ratio: float) -> Case:
    """A wall that fills the view, at `ratio` times the near plane's distance."""

    def run(bench: Bench, method: str) -> float:
        scene = wall_scene(1000.0, 4000.0, near=1000.0 / ratio, far=2000.0)
        scene.root.attach_new_node(AmbientLight("sky"))
        drawn = bench.draw(scene, positioned(method), outputs=("light", "id"))
        missing = (drawn.frame["id"] < 0) | (drawn["light"].min(axis=2) < 1.0)
        return float(missing.mean())

    return Case(f"coverage at y/n {ratio:g}", run, 0.0)


def _refused(bench: Bench, method: str) -> float:
    """How many pairs of planes that make no lens are not refused in one line."""
    wrong = 0
    pairs = [(10.0, 1.0), (5.0, 5.0), (0.0, 10.0), (-1.0, 10.0), (math.nan, 10.0), (math.inf, math.inf)]
    for near, far in pairs:
        for make in (PerspectiveLens, OrthographicLens):
            if make is OrthographicLens and near <= 0.0:
                continue  # parallel rays may begin behind the eye
            wrong += not _refuses(make, near, far)
    wrong += not _refuses(OrthographicLens, 1.0, math.inf)
    return float(wrong)


def _refuses(make: type[PerspectiveLens] | type[OrthographicLens], near: float, far: float) -> bool:
    try:
        make(near=near, far=far)
    except FireflyError as error:
        return "\n" not in str(error)
    return False


CASES = (
    *(_plane(ratio) for ratio in (1e1, 1e3, 1e6, 1e9)),
    *(_plane(ratio, math.inf) for ratio in (1e1, 1e6)),
    *(_lens(fov) for fov in (1e-3, WIDEST)),
    *(_coverage(ratio) for ratio in (1e6, 1e9)),
    Case("planes reversed, equal or no numbers", _refused, 0.0, DOUBLES),
)
