"""Highlights and spotlights: powers of cosines, and the edges of cones."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.experiments.bench import DrawnFrame, ExperimentBench
from firefly_sample.lab.experiments.experiment import EPS, Experiment, Value
from firefly_sample.lab.experiments.gbuffer import normal_bounds
from firefly_sample.lab.experiments.position_bounds import decoded_as, positioned, within_law
from firefly_sample.lab.experiments.scenes import WALL, ball, geom_node, wall
from firefly_sample.lab.experiments.volumes import missed
from firefly_sample.lab.probes.probe import evaluate
from firefly_sample.lab.reference.shade import each_light
from firefly_sample.lab.reference.shading import opening
from firefly_sample.plan.position_error import position_error
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import PointLight, Spotlight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene

# --- Highlights ---

SHININESS = {"32": 32.0, "128": 128.0, "1e3": 1e3, "1e4": 1e4}
EXPONENTS = {"32": 32.0, "128": 128.0, "1e3": 1e3, "1e6": 1e6}
DIRECTION_ERROR = 1.2e-7
"""Of a unit vector in float32: two units in the last place below 1."""
NEAR, FAR, DISTANCE, RADIUS = 4.0, 12.0, 6.0, 1.5
"""The planes of the lens, and the ball that it looks at."""
LAMP = np.array([2.5, 3.0, 2.0])
FROM_LIGHT = 2.5
"""Distance of lamp and ball, rounded down."""


def _powers(bench: ExperimentBench, exponent: float, samples: int) -> tuple[Value, ...]:
    """Measure angles evenly from 0 to where the power has fallen to 1e-7."""
    angle = np.linspace(0.0, np.arccos(np.exp(np.log(1e-7) / exponent)), samples)
    exact = np.exp(0.5 * exponent * np.log1p(-(np.sin(angle) ** 2)))
    inputs = np.stack([np.cos(angle), np.sin(angle) ** 2, np.full_like(angle, exponent), angle], axis=1)
    errors = []
    for includes, body in (
        ([], "result.r = pow(a.x, a.z);"),
        (["phong"], "result.r = power_of_cosine(a.x, a.y, a.z);"),
    ):
        found = evaluate(bench.device, includes, body, inputs, {"SPECULAR_MODEL": 0})[:, 0]
        errors.append(float(np.abs(found - exact).max()))
    # an error e of the logarithm x changes the power by x exp(-x) e, which is e/3 at most: the roundings of
    # the sine's square, of its series and of the product; and those of exp
    return *errors, 8.0 * EPS


def _highlights(bench: ExperimentBench, normals: str, samples: int) -> tuple[Value, ...]:
    """Measure angles between the normal and the half-way vector, in float64."""
    error = normal_bounds()[normals]
    largest = []
    for m in SHININESS.values():
        angle = np.linspace(-error, np.arccos(np.exp(np.log(1e-4) / m)), samples)
        before, after = (np.exp(0.5 * m * np.log1p(-(np.sin(at) ** 2))) for at in (angle, angle + error))
        largest.append(float(np.abs(before - after).max()))
    return tuple(largest)


def _glint(exponent: float) -> Scene:
    """Return a ball whose highlight fills the view of a camera that looks straight at it."""
    scene = Scene()
    tin = Material("tin", (0.1, 0.1, 0.1, 1.0), specular=(0.8, 0.8, 0.8), shininess=exponent)
    center = np.array([0.0, DISTANCE, 0.0])
    scene.root.attach_new_node(geom_node("ball", ball(RADIUS, 48), tin)).set_pos(*center)
    light = scene.root.attach_new_node(PointLight("lamp", (1.0, 0.8, 0.6), radius=12.0))
    light.set_pos(*LAMP)
    middle = center
    for _ in range(60):  # where the normal is halfway between eye and lamp
        to_eye, to_lamp = ((aim - middle) / np.linalg.norm(aim - middle) for aim in (np.zeros(3), LAMP))
        middle = center + RADIUS * (to_eye + to_lamp) / np.linalg.norm(to_eye + to_lamp)
    scene.camera.look_at(*middle)
    slope = min(0.3, 0.5 / math.sqrt(max(exponent, 1.0)))
    fov = 2.0 * math.degrees(math.atan(slope))
    scene.camera_node.lens = PerspectiveLens(fov=fov, aspect_ratio=4 / 3, near=NEAR, far=FAR)
    return scene


def _not_grazing(drawn: DrawnFrame) -> NDArray[np.bool_]:
    """Return pixels whose cosines are at least 1e-5: a highlight's edge is a jump that float32 may move."""
    assert drawn.gbuffer is not None
    known = np.asarray(np.isfinite(drawn.gbuffer.position).all(axis=2))
    for one in each_light(drawn.plan.lights):
        to_light, _ = one.directions(np.where(known[..., None], drawn.gbuffer.position, 0.0).reshape(-1, 3))
        cosine = np.einsum("ij,ij->i", to_light, drawn.gbuffer.normal.reshape(-1, 3))
        known &= np.abs(cosine).reshape(known.shape) > 1e-5
    return known


def _shininess(exponent: float) -> Experiment:
    """Return the case of highlights of both models, against float64 on the stored values."""

    def run(bench: ExperimentBench, method: str) -> float:
        worst = 0.0
        for model in ("phong", "blinn_phong"):
            settings = positioned(method, specular_model=model, normal_format="rgba32f")
            drawn = bench.draw(_glint(exponent), settings, outputs=("radiance",), gbuffer=True)
            expected, _ = drawn.expected_light()
            chosen = _not_grazing(drawn)
            if expected[chosen].max() < 0.25:
                return math.inf  # no highlight to measure
            error = np.abs(drawn["radiance"] - expected)[chosen]
            worst = max(worst, float(error.max() / expected[chosen].max()))
        return worst

    def bound(method: str) -> float:
        # twice 0.6 * sqrt(m) * the error of a direction, which an error e of the position turns by e / d
        own = 4e-6 + 1.2 * math.sqrt(exponent) * DIRECTION_ERROR
        name = decoded_as(method)
        if name not in ("depth32f", "depth24", "inverse_matrix"):
            return own  # the position itself is stored
        error = position_error(name, NEAR, FAR, True, DISTANCE)
        return within_law(own + 1.2 * math.sqrt(exponent) * error / FROM_LIGHT, error, FROM_LIGHT)

    return Experiment(f"shininess {exponent:g}", run, bound=bound)


# --- Spotlights ---


def _cone_edges(bench: ExperimentBench, degrees: float, samples: int) -> tuple[Value, ...]:
    """Measure directions, in float32, at the half-angle from the axis."""
    axis = np.array([0.36, 0.48, 0.8], dtype=np.float32).astype(np.float64)
    axis_text = f"const vec3 axis = vec3({', '.join(repr(float(value)) for value in axis)});"
    rng = np.random.Generator(np.random.PCG64(10))
    side = np.cross(axis, rng.normal(size=(samples, 3)))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    angle = np.radians(degrees)
    edge = (np.cos(angle) * axis + np.sin(angle) * side).astype(np.float32).astype(np.float64)
    exact = opening(-edge / np.linalg.norm(edge, axis=1, keepdims=True), axis / np.linalg.norm(axis))
    inputs = np.pad(edge, ((0, 0), (0, 1)))
    errors = []
    for body in (
        "result.r = 1.0 - dot(a.xyz, axis);",
        "vec3 across = cross(a.xyz, axis); result.r = opening(dot(a.xyz, axis), dot(across, across));",
    ):
        found = evaluate(bench.device, ["cone"], f"{axis_text} {body}", inputs, {"SPECULAR_MODEL": 0})[:, 0]
        errors.append(float(np.abs(found / exact - 1.0).max()))
    return tuple(errors)


def _spot_scene(half: float, soft: float) -> Scene:
    scene = Scene()
    fov = min(4.0 * half, 80.0)
    scene.camera_node.lens = PerspectiveLens(vfov=fov, near=0.5, far=100.0)
    scene.root.attach_new_node(geom_node("wall", wall(60.0, 8))).set_pos_hpr(0, WALL, 0, 20, -15, 0)
    light = Spotlight("light")
    light.set_cone(soft * half if soft else half, half)
    path = scene.root.attach_new_node(light)
    path.set_pos(0.3 * math.tan(math.radians(fov / 2.0)), 4.0, 0.0)
    path.look_at(0.0, WALL, 0.0)
    return scene


def _on_the_edge(drawn: DrawnFrame) -> NDArray[np.bool_]:
    """Return the pixels where a hard cone ends: float32 may find them on the other side."""
    assert drawn.gbuffer is not None
    position = drawn.gbuffer.position.reshape(-1, 3)
    edge = np.zeros(len(position), dtype=bool)
    for one in each_light(drawn.plan.lights):
        inner, outer, _ = one.lights.cones[one.row]
        if inner == outer:
            to_light, _ = one.directions(position)
            direction = one.lights.directions[one.row]
            across = np.linalg.norm(np.cross(to_light, direction), axis=1)
            angle = np.arctan2(across, -(to_light @ direction))
            half = 2.0 * np.arcsin(np.sqrt(outer / 2.0))
            edge |= np.abs(angle - half) < 1e-6 + 1e-5 * half
    return edge.reshape(drawn.gbuffer.position.shape[:-1])


def _spot(half: float) -> Experiment:
    """Return the case of a hard and a soft spotlight, against float64 on the stored values."""

    def run(bench: ExperimentBench, method: str) -> float:
        worst = 0.0
        settings = positioned(method)
        for soft in (0.0, 0.7):
            scene = _spot_scene(half, soft)
            drawn = bench.draw(scene, settings, outputs=("light",), gbuffer=True)
            _, expected = drawn.expected_light()
            if not expected.any():
                return math.inf
            error = np.abs(drawn["light"] - expected)[~_on_the_edge(drawn)]
            worst = max(worst, float(error.max() / np.percentile(expected, 99.9)))
            if missed(bench, scene, settings):
                return math.inf
        return worst

    return Experiment(f"spot of {half:g} degrees", run, bound=1e-5)


EXPERIMENTS = (
    Experiment(
        "highlights",
        _highlights,
        tuple(normal_bounds()),
        ("normals", *SHININESS),
        "Largest error of a Blinn-Phong highlight whose normal is off by as much as its format allows, by "
        "the exponent. Of Phong's, twice as much.",
        {"samples": 20_000},
    ),
    Experiment(
        "cones",
        _cone_edges,
        {f"{degrees:g} degrees": degrees for degrees in (60.0, 10.0, 1.0, 0.1, 0.01)},
        ("half-angle", "1 - cosine", "opening"),
        "Largest relative error of 1 - cos at the edge of a cone, in float32, by its half-angle: from the "
        "cosine, and by our function of cosine and sine.",
        {"samples": 50_000},
    ),
    Experiment(
        "powers",
        _powers,
        EXPONENTS,
        ("exponent", "pow", "power_of_cosine", "power_of_cosine bound"),
        "Largest absolute error of a cosine's power: GLSL's pow, and our function of cosine and sine.",
        {"samples": 100_000},
    ),
    *(_shininess(exponent) for exponent in (0.0, 1.0, 32.0, 1e3, 1e4, 1e6)),
    *(_spot(half) for half in (180.0, 120.0, 89.9, 60.0, 53.0, 52.9, 1.0, 0.1, 0.01)),
)
