"""Cases of numbers that float32 does not hold: each is refused, warned about or drawn right."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from firefly_sample.errors import FireflyError
from firefly_sample.lab.stability_cases.bench import Bench
from firefly_sample.lab.stability_cases.case import DOUBLES, Case, positioned
from firefly_sample.lab.stability_cases.scenes import geom_node, wall
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene, VerticalGradient
from firefly_sample.settings import Settings

BEYOND = 1e39
"""More than float32's largest number, 3.4e38."""
ORDINARY = 1.0
SIZE = (64, 48)


def _lit(scale: float, width: float = 20.0, light: float | None = None) -> Scene:
    """A wall, `scale` times as large as one of 20 units ten units away, under a light at the eye."""
    scene = Scene()
    scene.root.attach_new_node(geom_node("wall", wall(width * scale), Material("grey"))).set_y(10.0 * scale)
    scene.root.attach_new_node(PointLight("lamp", radius=light))
    scene.camera_node.lens = PerspectiveLens(fov=60.0, near=scale, far=100.0 * scale)
    return scene


def _planned(**changes: Any) -> None:
    scene = _lit(1.0)
    for name, value in changes.items():
        setattr(scene, name, value)
    build_plan(scene, size=SIZE)


def _seen_through(lens: PerspectiveLens | OrthographicLens) -> None:
    scene = _lit(1.0)
    scene.camera_node.lens = lens
    build_plan(scene, size=SIZE)


def _grown(factor: float) -> None:
    """Two nodes, one in the other, of scales whose product float64 does not hold."""
    scene = _lit(1.0)
    path = scene.root.attach_new_node("outer")
    path.set_scale(factor)
    scene.root.find("wall").reparent_to(path)
    path.find("wall").set_scale(factor)
    build_plan(scene, size=SIZE)


_CORNERS = np.eye(3)
_ONE = [(0, 1, 2)]
_GIVEN: tuple[Callable[[float], Any], ...] = (
    lambda n: Geom(n * _CORNERS, _ONE),
    lambda n: Geom(_CORNERS, _ONE, normals=n * _CORNERS),
    lambda n: Geom(_CORNERS, _ONE, texcoords=n * _CORNERS[:, :2]),
    lambda n: Geom(_CORNERS, _ONE, colors=n * _CORNERS),
    lambda n: Geom(_CORNERS, np.array([(0, 1, 2 if n == ORDINARY else 2**32 + 2)])),
    lambda n: Material("m", (n, 0, 0, 1)),
    lambda n: Material("m", emission=(n, 0, 0)),
    lambda n: Material("m", specular=(n, 0, 0)),
    lambda n: Material("m", shininess=n),
    lambda n: PointLight("l", (n, 0, 0)),
    lambda n: Spotlight("l").set_attenuation((0, 0, n)),
    lambda n: Spotlight("l").set_attenuation((0, 0, 1 / n)),
    lambda n: Spotlight("l").set_specular_color((n, 0, 0)),
    lambda n: DirectionalLight("l", (n, 0, 0)),
    lambda n: AmbientLight("l", (n, 0, 0)),
    lambda n: PointLights("l", n * _CORNERS),
    lambda n: PointLights("l", _CORNERS, n),
    lambda n: Sprites("s", n * _CORNERS),
    lambda n: Sprites("s", _CORNERS, n),
    lambda n: ParticleNode("p", n * _CORNERS),
    lambda n: ParticleNode("p", _CORNERS, n),
    lambda n: ParticleNode("p").set_bounding_sphere(n),
    lambda n: Settings(exposure=n),
    lambda n: _planned(background=(0, n, 0)),
    lambda n: _planned(background=VerticalGradient((0, 0, 0), (n, 0, 0))),
    lambda n: _planned(exposure=n),
    lambda n: _seen_through(PerspectiveLens(near=n, far=2 * n)),
    lambda n: _seen_through(PerspectiveLens(near=1e-7 / n, far=1)),
    lambda n: _seen_through(OrthographicLens(near=-n, far=n)),
    lambda n: _grown(n**4),
)


def _taken(bench: Bench, method: str) -> float:
    """Return how many numbers beyond float32 are accepted, where an ordinary one is."""
    taken = 0
    for give in _GIVEN:
        give(ORDINARY)  # if this is refused, the next says nothing of the number
        try:
            give(BEYOND)
            taken += 1
        except FireflyError:
            pass
    return float(taken)


def _scaled(factor: float) -> Scene:
    scene = _lit(1.0)
    scene.root.find("wall").set_scale(factor)
    return scene


def _flat(width: float) -> Scene:
    scene = _lit(1.0, width)
    scene.camera_node.lens = OrthographicLens(film_size=(16, 12), near=1.0, far=100.0)
    return scene


_ENDS: tuple[tuple[str, Callable[[], Scene]], ...] = (
    ("", lambda: _lit(1.0)),
    ("", lambda: _lit(2.0**-50)),
    ("light on it is wrong", lambda: _lit(1e-17)),
    ("light on it is wrong", lambda: _lit(1e-30, light=1.0)),
    ("", lambda: _lit(2.0**50)),
    ("do not light it there", lambda: _lit(1e20)),
    ("", lambda: _lit(1e20, light=10.0)),
    ("parts of it are not drawn", lambda: _scaled(1e37)),
    ("", lambda: _lit(1.0, 2e5)),
    ("lose pixels", lambda: _lit(1.0, 1e8)),
    ("", lambda: _flat(2e5)),
    ("lose pixels", lambda: _flat(1e8)),
)
"""Cases of scenes that a plan must warn about, and of scenes that it must not."""


def _unsaid(bench: Bench, method: str) -> float:
    """Return how many scenes have a needless warning or lack a needed one."""
    wrong = 0
    for expected, make in _ENDS:
        said = build_plan(make(), size=SIZE).warnings
        wrong += not any(expected in line for line in said) if expected else bool(said)
    return float(wrong)


def _wide(bench: Bench, method: str) -> float:
    """Share of pixels that a wall of 1e4 views does not cover, turned and moved in many ways."""
    rng = np.random.default_rng(5)
    lost = 0.0
    for _ in range(8):
        width, turn = 1e4 * 11.5, rng.uniform(0.0, 360.0)
        scene = _lit(1.0, width)
        path = scene.root.find("wall")
        path.set_r(turn)
        x, z = rng.uniform(-0.45, 0.45, 2) * width
        path.set_pos(path, -x, 0.0, -z)
        drawn = bench.draw(scene, positioned(method), SIZE, ("id", "radiance"))
        lost = max(lost, float((drawn.frame["id"] < 0).mean()))
    return lost


CASES = (
    Case("coverage, a wall of 1e4 views", _wide, 0.0),
    Case("numbers beyond float32", _taken, 0.0, DOUBLES),
    Case("scenes beyond float32", _unsaid, 0.0, DOUBLES),
)
