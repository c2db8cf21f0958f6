"""Whole pictures: the forest's errors and fragments, backgrounds, extreme sizes, and times far from now."""

from __future__ import annotations

import math
import statistics
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from firefly_sample.lab.experiments.bench import SIZE, DrawnFrame, ExperimentBench
from firefly_sample.lab.experiments.experiment import Experiment, Value, relative_error
from firefly_sample.lab.experiments.position_bounds import decoded_as, positioned, within_law
from firefly_sample.lab.experiments.scenes import GARDEN_FAR, GARDEN_LIGHTS, GARDEN_NEAR, garden, wall_scene
from firefly_sample.lab.reference.shade import count_pairs, nearest_light
from firefly_sample.plan.position_error import position_error
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import DirectionalLight, PointLight, PointLights
from firefly_sample.scene.scene import Scene
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import PositionMethod, Settings

Float64 = NDArray[np.float64]

# --- Tables of the forest ---

APART = 5.0
"""Seconds between moments."""
POSITIONS: tuple[PositionMethod, ...] = ("linear32f", "depth32f", "depth24", "inverse_matrix")


def _scene(bench: ExperimentBench, name: str) -> Scene:
    scene: Scene = bench.once(("scene", name), lambda: build_scene(find_scene(name)))
    return scene


def _frames(
    bench: ExperimentBench, position: PositionMethod, moments: int, size: tuple[int, int]
) -> tuple[Value, ...]:
    """Return the largest and the median of the frames' largest errors, relative to their largest value."""
    errors = []
    for moment in range(moments):
        settings = Settings(position_method=position, light_method="volumes")
        drawn = bench.draw(_scene(bench, "forest"), settings, size, ("light",), APART * moment, gbuffer=True)
        assert drawn.gbuffer is not None
        _, light = drawn.expected_light()
        covered = np.isfinite(drawn.gbuffer.position).all(axis=-1)
        errors.append(relative_error((drawn["light"] - drawn.plan.ambient)[covered], light[covered]))
    return max(errors), statistics.median(errors)


def _fragments(
    bench: ExperimentBench, settings: Settings, moments: int, size: tuple[int, int]
) -> tuple[Value, ...]:
    """Return the fragments (or the lengths of lists), the (pixel, light) pairs in reach, and their ratio."""
    shaded = pairs = 0
    with bench.measured_frames() as renderer:
        renderer.resize(size)
        renderer.settings = settings
        for moment in range(moments):
            plan = renderer.plan(_scene(bench, "forest"), APART * moment, ("light", "position"))
            shaded += renderer.draw(plan, read=False).shaded or 0
            position = renderer.surface(plan).position()
            pairs += bench.once(("pairs", moment, size), partial(count_pairs, position, plan.lights))
    return shaded, pairs, shaded / pairs


# --- Cases ---

BACKGROUND = (0.125, 0.25, 2.0)
EONS = 1e9
"""Seconds."""
LIT = 0.25
"""Smallest share of a picture's pixels that a scene's lights must reach."""
SCENES = {"forest": (50.0, 500.0, 377.0, 1.4), "lightbulbs": (0.5, 400.0, 65.0, 0.75)}
"""Near and far planes, the largest distance of a lit surface, and a quarter of a light's reach."""
FROM_ORIGIN = 220.0
"""Distance of the camera from the world's origin in both, rounded up."""
SHARE = 0.1
"""Of a method's law: only the farthest surface right beside a light could show the whole error."""


def _background(lights: str, far: float) -> Experiment:
    """Return the case of the background: the largest difference to it where nothing is drawn."""

    def run(bench: ExperimentBench, method: str) -> float:
        scene = garden()
        scene.background = BACKGROUND
        endless = PointLight("endless")
        endless.set_attenuation((0.0, 0.0, 1.0))
        endless.set_shadow_caster(True, 64)
        scene.root.attach_new_node(endless).set_pos(0, 6, 3)
        for path in scene.root.find_all_matches("sun"):
            sun = path.node()
            assert isinstance(sun, DirectionalLight)
            sun.set_shadow_caster(True, 64)
        scene.camera_node.lens = PerspectiveLens(vfov=70.0, near=GARDEN_NEAR, far=far)
        settings = positioned(method, light_method=lights)
        drawn = bench.draw(scene, settings, outputs=("radiance", "light", "id"))
        empty = drawn.frame["id"] == -1
        if not 0.1 < empty.mean() < 0.9:
            return 1.0
        off = np.abs(drawn["radiance"][empty] - BACKGROUND).max()
        return float(max(off, np.abs(drawn["light"][empty]).max()))

    return Experiment(f"background, {lights}, far {far:g}", run, bound=0.0)


def _error_of_light(drawn: DrawnFrame) -> float:
    """Return the largest relative difference to float64 on the stored values, except right beside a light."""
    expected = drawn.expected_light()[1] + np.asarray(drawn.plan.ambient)
    assert drawn.gbuffer is not None
    known = np.isfinite(drawn.gbuffer.position).all(axis=2)
    known &= ~(nearest_light(drawn.gbuffer.position, drawn.plan.lights, 3.0) < 0.02)
    return relative_error(drawn["light"][known], expected[known])


def _size(size: tuple[int, int]) -> Experiment:
    """Return the case of a picture's size, against float64 on the stored values."""

    def run(bench: ExperimentBench, method: str) -> float:
        drawn = bench.draw(garden(), positioned(method), size, ("light", "color"), gbuffer=True)
        return _error_of_light(drawn)

    def bound(method: str) -> float:
        name = {"depth16": "depth24", "stored16f": "stored32f"}.get(method, method)
        if name not in ("depth24", "inverse_matrix"):
            return 1e-5
        error = position_error(name, GARDEN_NEAR, GARDEN_FAR, True, 16.0, 4.0)
        return within_law(1e-5, error, GARDEN_LIGHTS)

    return Experiment(f"picture of {size[0]}x{size[1]}", run, bound=bound)


AROUND = np.linspace(0.0, 2.0 * math.pi, 8, endpoint=False)
REACH = 4.0


def _on_ellipse(cosine: Float64, sine: Float64) -> Float64:
    return np.stack([3.0 * cosine, np.full(len(AROUND), 8.0), 2.0 * sine], axis=1)


def _circling(time: float) -> tuple[ArrayLike, ArrayLike, ArrayLike]:
    """Return lights on an ellipse: a plain function of time, as scenes have them."""
    return _on_ellipse(np.cos(time + AROUND), np.sin(time + AROUND)), (1, 1, 1), REACH


def _positions_at(time: float) -> Float64:
    """Return the positions of `_circling` to float64's own accuracy: no sum rounds `time`."""
    cosine, sine = math.cos(time), math.sin(time)
    return _on_ellipse(
        cosine * np.cos(AROUND) - sine * np.sin(AROUND), sine * np.cos(AROUND) + cosine * np.sin(AROUND)
    )


def _time_of_circling(bench: ExperimentBench, method: str) -> float:
    """Compare moving lights with fixed ones a billion seconds before and after now."""
    worst = 0.0
    for time in (-EONS, EONS):
        moving, standing = wall_scene(), wall_scene()
        moving.root.attach_new_node(PointLights("circle", function=_circling))
        standing.root.attach_new_node(PointLights("circle", _positions_at(time), (1, 1, 1), REACH))
        given = bench.draw(moving, positioned(method), time=time)["radiance"]
        expected = bench.draw(standing, positioned(method))["radiance"]
        worst = max(worst, relative_error(given, expected))
    return worst


def _time_of_scene(name: str) -> Experiment:
    """Return the case of a scene a billion seconds from now, against float64 on the stored values."""

    def run(bench: ExperimentBench, method: str) -> float:
        worst = 0.0
        for time in (-EONS, EONS):
            drawn = bench.draw(_scene(bench, name), positioned(method), SIZE, ("light", "color"), time, True)
            if (drawn["light"] > 1.01 * drawn.plan.ambient + 1e-3).any(axis=2).mean() < LIT:
                return math.inf
            worst = max(worst, _error_of_light(drawn))
        return worst

    def bound(method: str) -> float:
        if method in ("linear32f", "stored32f"):
            return 1e-5
        near, far, farthest, beside = SCENES[name]
        error = position_error(decoded_as(method), near, far, True, farthest, FROM_ORIGIN)
        return within_law(1e-5, error, beside, SHARE)

    return Experiment(f"time of 1e9 s either way, {name}", run, bound=bound)


EXPERIMENTS = (
    Experiment(
        "frames",
        _frames,
        POSITIONS,
        ("position", "largest", "median"),
        "The light of 500 fireflies in the forest at {moments} moments: a frame's largest error over its "
        "largest value, of the worst frame and of the median one.",
        {"moments": 24, "size": (80, 60)},
    ),
    Experiment(
        "fragments",
        _fragments,
        {
            "volumes, depth test": Settings(light_method="volumes"),
            "volumes without": Settings(light_method="volumes", volume_depth_test=False),
            "clusters": Settings(light_method="clustered"),
        },
        ("lights", "shaded", "pairs", "per pair"),
        "How often 500 fireflies shade a pixel in {moments} frames of the forest, over the pairs of a pixel "
        "and a light that reaches it: fragments of volumes with a depth test and without, and the lights in "
        "the lists of the pixels' cells.",
        {"moments": 4, "size": (320, 240)},
    ),
    *(_background(lights, 100.0) for lights in ("volumes", "clustered", "fullscreen", "loop")),
    _background("volumes", math.inf),
    *(_size(size) for size in ((1, 1), (33, 17), (1, 4096), (4096, 1))),
    Experiment("time of 1e9 s either way, circling lights", _time_of_circling, bound=1e-6),
    *(_time_of_scene(name) for name in SCENES),
)
