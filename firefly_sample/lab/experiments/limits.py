"""Limits of accuracy and of float32: warnings and errors come when they must, and only then.

The cases "warnings late or early" compare a surface near a light, under each lens, with float64. The warning
of inaccurate positions must be there if a pixel is off by more than a display code, and must not be there if
none is off by a tenth of one. In between the law, which knows neither how the light fades nor where rounding
falls, decides either way.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import FireflyError
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.cases import cases, error_warning, positioned
from firefly_sample.lab.experiments.experiment import FLOAT64, Experiment
from firefly_sample.lab.experiments.scenes import WHITE, wall_scene
from firefly_sample.lab.reference.frame import render_reference
from firefly_sample.lab.reference.shading import tone_curve
from firefly_sample.pipeline import build_plan
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight, PointLight, PointLights, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.scene import Scene, VerticalGradient
from firefly_sample.settings import Settings
from firefly_sample.srgb import linear_to_srgb

# --- Warnings of inaccurate positions ---

DISTANCE, FAR, TILT = 50.0, 400.0, 10.0
RATIOS = [10.0 ** (0.5 * power) for power in range(1, 12)]
"""The wall's distance over the near plane's."""
LATE, EARLY = 1.0, 0.1
"""Display codes: above the first the warning must be there, below the second it must not."""


def _beside_a_light(near: float, reach: float, fades: bool, from_origin: float) -> Scene:
    """Return a wall a quarter of a light's reach behind it, as bright there as a display can show."""
    fov = 2.0 * math.degrees(math.atan(reach / DISTANCE))
    lens = PerspectiveLens(fov=fov, aspect_ratio=4 / 3, near=near, far=FAR)
    scene = wall_scene(DISTANCE, 2.5 * reach, 8, WHITE, hpr=(0.0, -TILT, 0.0), lens=lens)
    scene.root.find("wall").set_x(from_origin)
    beside = 0.25 * reach
    light = PointLight("light", radius=reach)
    strength = 0.95 / 0.75**2
    if fades:
        light.set_attenuation((1.0, 0.0, 1.0 / beside**2))
        strength = 0.95 * 2.0
    light.set_color((strength,) * 3)
    scene.root.attach_new_node(light).set_pos(from_origin, DISTANCE - beside, 0.0)
    scene.camera.set_pos(from_origin, 0.0, 0.0)
    return scene


def _codes(radiance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return display codes, not rounded."""
    return np.asarray(255.0 * linear_to_srgb(tone_curve(np.minimum(radiance, 1.0), "none")))


def _codes_off(bench: ExperimentBench, scene: Scene, settings: Settings) -> float:
    """Return the largest error of a pixel, in display codes."""
    drawn = bench.draw(scene, settings, (64, 48), ("radiance", "visibility", "albedo"))
    visibility, albedo = drawn.visibility(), drawn["albedo"]

    def expected() -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
        radiance = render_reference(drawn.plan, visibility, albedo=albedo, threads=1).radiance
        seen = (visibility[..., :1] >= 0) & (radiance <= 1.0)  # a clipped value hides an error
        return seen, _codes(radiance)

    # position methods that show the same triangles have one reference
    seen, codes = bench.once((scene, visibility.tobytes(), albedo.tobytes()), expected)
    return float(np.where(seen, np.abs(_codes(drawn["radiance"]) - codes), 0.0).max())


_BESIDE = {
    "lights with a radius": (False, 0.0),
    "attenuated lights": (True, 0.0),
    "far from the origin": (False, 1e4),
}
"""True for an attenuated light, and the distance of scene and camera from the world's origin, by name."""


def _warnings(bench: ExperimentBench, method: str, name: str) -> float:
    """Return how many warnings are late or early, for many near planes and reaches."""
    settings = positioned(
        method, normal_format="rgba32f", albedo_format="rgba32f", cutoff_budget=0.0, tone="none"
    )
    wrong = 0
    for reach, ratio in product((1.0, 8.0, 64.0), RATIOS):
        bench.warnings.clear()
        make = partial(_beside_a_light, DISTANCE / ratio, reach, *_BESIDE[name])
        scene = bench.once((name, reach, ratio), make)
        codes = _codes_off(bench, scene, settings)
        warned = error_warning(bench.warnings, method) != ""
        wrong += codes < EARLY if warned else codes > LATE
    bench.warnings.clear()
    return float(wrong)


# --- Numbers and scenes beyond float32 ---

BEYOND = 1e39
"""More than float32's largest number, 3.4e38."""
ORDINARY = 1.0
SIZE = (64, 48)


def _lit(scale: float, width: float = 20.0, light: float | None = None, lens: Lens | None = None) -> Scene:
    """Return a wall of 20 units ten units away, `scale` times as large and far, under a light at the eye."""
    lens = lens or PerspectiveLens(fov=60.0, near=scale, far=100.0 * scale)
    scene = wall_scene(10.0 * scale, width * scale, material=Material("grey"), lens=lens)
    scene.root.attach_new_node(PointLight("lamp", radius=light))
    return scene


def _flat(width: float) -> Scene:
    return _lit(1.0, width, lens=OrthographicLens(film_size=(16, 12), near=1.0, far=100.0))


def _planned(lens: Lens | None = None, **changes: Any) -> None:
    scene = _lit(1.0, lens=lens)
    for name, value in changes.items():
        setattr(scene, name, value)
    build_plan(scene, size=SIZE)


def _grown(factor: float) -> None:
    """Plan two nested nodes of scales whose product float64 cannot represent."""
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
    lambda n: _planned(PerspectiveLens(near=n, far=2 * n)),
    lambda n: _planned(PerspectiveLens(near=1e-7 / n, far=1)),
    lambda n: _planned(OrthographicLens(near=-n, far=n)),
    lambda n: _grown(n**4),
)


def _accepted(bench: ExperimentBench, method: str) -> float:
    """Return how many numbers beyond float32 are accepted where an ordinary one is."""
    accepted = 0
    for give in _GIVEN:
        give(ORDINARY)  # if this were refused, the next refusal would prove nothing
        try:
            give(BEYOND)
            accepted += 1
        except FireflyError:
            pass
    return float(accepted)


def _scaled(factor: float) -> Scene:
    scene = _lit(1.0)
    scene.root.find("wall").set_scale(factor)
    return scene


_SCENES: tuple[tuple[str, Callable[[], Scene]], ...] = (
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
"""A part of the warning that a scene must have, or "" if it must have none; and the scene."""


def _wrong_warnings(bench: ExperimentBench, method: str) -> float:
    """Return how many scenes have a needless warning or lack a needed one."""
    wrong = 0
    for expected, make in _SCENES:
        lines = build_plan(make(), size=SIZE).warnings
        wrong += not any(expected in line for line in lines) if expected else bool(lines)
    return float(wrong)


def _wide(bench: ExperimentBench, method: str) -> float:
    """Return the largest share of pixels that a wall of 1e4 views does not cover, turned and moved."""
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


EXPERIMENTS = (
    *cases("warnings late or early, {name}", _warnings, 0.0, name=_BESIDE),
    Experiment("coverage, a wall of 1e4 views", _wide, bound=0.0),
    Experiment("numbers beyond float32", _accepted, FLOAT64, bound=0.0),
    Experiment("scenes beyond float32", _wrong_warnings, FLOAT64, bound=0.0),
)
