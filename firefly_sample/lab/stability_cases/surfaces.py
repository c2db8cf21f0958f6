"""Normals of every direction and of none, triangles without an area, and highlights of every size."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.numerics_gbuffer import degrees_between, stored_normals
from firefly_sample.lab.reference.shade import each_light
from firefly_sample.lab.reference.surfaces import see_surfaces
from firefly_sample.lab.stability_cases.bench import Bench, Drawn
from firefly_sample.lab.stability_cases.case import Case, positioned, within_law
from firefly_sample.lab.stability_cases.scenes import WALL, ball, geom_node, wall, wall_scene
from firefly_sample.plan.position_error import position_error
from firefly_sample.plan.targets import NORMAL_FORMATS, UNSIGNED
from firefly_sample.scene.geom import Geom
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import PointLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

Float64 = NDArray[np.float64]

LARGEST_ANGLES = {
    "oct16": 0.0037,
    "rgb10a2": 0.096,
    "rgba8": 0.387,
    "oct8": 0.95,
    "rgba16f": 0.0262,  # 0.023 where a driver rounds half floats, and does not cut them off
    "rgba32f": 2.8e-6,
}
"""Degrees, by setting `normals`."""
SLACK = 1.05
COUNT = 1_000_000
DIRECTION_ERROR = 1.2e-7
"""Of a unit vector in float32: two ulp below 1."""


def directions() -> Float64:
    """A million unit vectors: random ones, the axes, and both sides of the seams of the octahedron."""
    rng = np.random.default_rng(13)
    random = rng.normal(size=(COUNT - 30_000, 3))
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    near_axes = axes[rng.integers(0, 6, 10_000)] + rng.normal(size=(10_000, 3)) * 1e-4
    seams = rng.normal(size=(20_000 - len(axes), 3))
    seams[np.arange(len(seams)), rng.integers(0, 3, len(seams))] = rng.choice([0.0, 1e-7, -1e-7], len(seams))
    every = np.concatenate([random, axes, near_axes, seams])
    return np.asarray(every / np.linalg.norm(every, axis=1, keepdims=True))


def _normals(bench: Bench, method: str) -> float:
    """Largest angle in degrees between what is stored and what is read, through the format itself."""
    if "directions" not in bench.kept:
        bench.kept["directions"] = directions().astype(np.float32)
    given = bench.kept["directions"]
    format_name, packing = NORMAL_FORMATS[method]
    if format_name == "rg16_snorm" and not bench.capabilities.snorm_targets:
        format_name, packing = UNSIGNED
    back = stored_normals(bench.device, given, packing, format_name).astype(np.float64)
    return float(degrees_between(back, given.astype(np.float64)).max()) if np.isfinite(back).all() else 180.0


def _wall_with(geom: Geom) -> Scene:
    scene = wall_scene()
    scene.root.find("wall").detach_node()
    scene.root.attach_new_node(geom_node("wall", geom, Material("grey", (0.5, 0.5, 0.5, 1.0)))).set_y(WALL)
    scene.camera_node.lens = OrthographicLens(film_size=(16, 12), near=1, far=100)
    scene.root.attach_new_node(PointLight("light", radius=12.0)).set_pos(1, 6, 1)
    return scene


def _same(bench: Bench, method: str, one: Geom, other: Geom) -> float:
    settings = positioned(method)
    pictures = [bench.draw(_wall_with(geom), settings)["radiance"] for geom in (one, other)]
    if not pictures[0].any():
        return math.inf
    return float(np.abs(pictures[0] - pictures[1]).max())


def _no_normals(bench: Bench, method: str) -> float:
    """Normals without a length face the eye: along the view axis of parallel rays, as the wall does."""
    plain = wall(20.0, 4)
    return _same(bench, method, plain, wall(20.0, 4, np.zeros_like(plain.vertices)))


def _no_area(bench: Bench, method: str) -> float:
    """Triangles of one point, of two, of three in a line, and smaller than float32 tells, change nothing."""
    plain = wall(20.0, 4)
    n = len(plain.vertices)
    more = np.array(
        [(0, -1, 0), (1, -1, 0), (2, -1, 0), (1e-30, -1, 1e-30), (0, -1, 1e-30)], dtype=np.float64
    )
    flat = [(n, n, n), (n, n + 1, n + 1), (n, n + 1, n + 2), (n, n + 3, n + 4)]
    normals = np.concatenate([plain.normals, np.zeros((len(more), 3))])
    holed = Geom(np.concatenate([plain.vertices, more]), np.concatenate([flat, plain.triangles]), normals)
    return _same(bench, method, plain, holed)


NEEDLES = 1000


def _needles() -> Scene:
    """Triangles from a pixel to a ten-thousandth of one high, each corner with another normal."""
    rng = np.random.default_rng(17)
    angle = rng.uniform(0.0, 2.0 * np.pi, NEEDLES)
    along = np.stack([np.cos(angle), rng.uniform(-0.5, 0.5, NEEDLES), np.sin(angle)], axis=1)
    aside = np.stack([-np.sin(angle), rng.uniform(-1.0, 1.0, NEEDLES), np.cos(angle)], axis=1)
    start = rng.uniform((-7, 0, -5), (7, 4, 5), (NEEDLES, 3))
    height = 10.0 ** rng.uniform(-5.0, -1.0, (NEEDLES, 1))
    corners = np.stack([start, start + 5.0 * along, start + 2.5 * along + height * aside], axis=1)
    normals = rng.normal(size=(3 * NEEDLES, 3)) - (0.0, 2.0, 0.0)
    geom = Geom(corners.reshape(-1, 3), np.arange(3 * NEEDLES).reshape(-1, 3), normals, name="needles")
    scene = Scene()
    steel = Material("steel", (0.5, 0.5, 0.5, 1.0), double_sided=True)
    scene.root.attach_new_node(geom_node("needles", geom, steel)).set_pos_hpr(0, 12, 0, 3, 2, 1)
    scene.camera_node.lens = PerspectiveLens(vfov=50.0, near=0.5, far=100.0)
    return scene


def _thin_triangles(bench: Bench, method: str) -> float:
    """Normals, and distances in parts of themselves, against the float64 reference of the same triangles."""
    settings = Settings(interpolation=method, normals="rgba32f")  # type: ignore[arg-type]
    drawn = bench.draw(_needles(), settings, outputs=("visibility", "normal", "depth"))
    found = see_surfaces(drawn.plan, np.asarray(drawn.frame["visibility"], dtype=np.int32))
    normal = np.abs(drawn["normal"] - found.gbuffer.normal).max(axis=-1)
    distance = np.abs(drawn["depth"] / found.gbuffer.position[..., 1] - 1.0)
    if np.count_nonzero(found.covered) < NEEDLES // 4:
        return math.inf  # too little to measure
    return float(np.maximum(normal, distance)[found.covered].max())


NEAR, FAR, PLACE, RADIUS = 4.0, 12.0, 6.0, 1.5
LAMP = np.array([2.5, 3.0, 2.0])
FROM_LIGHT = 2.5
"""How near the lamp comes to the ball, rounded down."""


def _glint(exponent: float) -> Scene:
    """A ball whose highlight fills the view of a camera that looks straight at it."""
    scene = Scene()
    tin = Material("tin", (0.1, 0.1, 0.1, 1.0), specular=(0.8, 0.8, 0.8), shininess=exponent)
    center = np.array([0.0, PLACE, 0.0])
    scene.root.attach_new_node(geom_node("ball", ball(RADIUS, 48), tin)).set_pos(*center)
    light = scene.root.attach_new_node(PointLight("lamp", (1.0, 0.8, 0.6), radius=12.0))
    light.set_pos(*LAMP)
    middle = center
    for _ in range(60):  # where the normal is halfway between eye and lamp
        ways = [(aim - middle) / np.linalg.norm(aim - middle) for aim in (np.zeros(3), LAMP)]
        middle = center + RADIUS * (ways[0] + ways[1]) / np.linalg.norm(ways[0] + ways[1])
    scene.camera.look_at(*middle)
    slope = min(0.3, 0.5 / math.sqrt(max(exponent, 1.0)))
    fov = 2.0 * math.degrees(math.atan(slope))
    scene.camera_node.lens = PerspectiveLens(fov=fov, aspect_ratio=4 / 3, near=NEAR, far=FAR)
    return scene


def _far_from_dusk(drawn: Drawn) -> NDArray[np.bool_]:
    """Where no cosine is below 1e-5: a highlight begins there with a jump, which float32 may move."""
    assert drawn.gbuffer is not None
    known = np.asarray(np.isfinite(drawn.gbuffer.position).all(axis=2))
    for one in each_light(drawn.plan.lights):
        to_light, _ = one.directions(np.where(known[..., None], drawn.gbuffer.position, 0.0).reshape(-1, 3))
        cosine = np.einsum("ij,ij->i", to_light, drawn.gbuffer.normal.reshape(-1, 3))
        known &= np.abs(cosine).reshape(known.shape) > 1e-5
    return known


def _shininess(exponent: float) -> Case:
    """Highlights in both models, against float64 on what is stored, over the largest value."""

    def run(bench: Bench, method: str) -> float:
        worst = 0.0
        for model in ("phong", "blinn_phong"):
            settings = positioned(method, specular=model, normals="rgba32f")
            drawn = bench.draw(_glint(exponent), settings, outputs=("radiance",), gbuffer=True)
            expected, _ = drawn.expected_light()
            chosen = _far_from_dusk(drawn)
            if expected[chosen].max() < 0.25:
                return math.inf  # no highlight to measure
            off = np.abs(drawn["radiance"] - expected)[chosen]
            worst = max(worst, float(off.max() / expected[chosen].max()))
        return worst

    def bound(method: str) -> float:
        # twice 0.6 * sqrt(m) * the error of a direction, which a position that is off by e turns by e / d
        own = 4e-6 + 1.2 * math.sqrt(exponent) * DIRECTION_ERROR
        # of what is stored, 16 bits are computed with as 24 are
        name = {"depth16": "depth24"}.get(method, method)
        if name not in ("depth32f", "depth24", "inverse_matrix"):
            return own  # what is stored is the place itself
        error = position_error(name, NEAR, FAR, True, PLACE)
        return within_law(own + 1.2 * math.sqrt(exponent) * error / FROM_LIGHT, error, FROM_LIGHT)

    return Case(f"shininess {exponent:g}", run, bound)


CASES = (
    Case(
        "normals, a million",
        _normals,
        lambda method: SLACK * LARGEST_ANGLES[method],
        tuple(LARGEST_ANGLES),
    ),
    Case("normals without length", _no_normals, 0.0),
    Case("triangles without area", _no_area, 0.0),
    Case("thin triangles", _thin_triangles, 1e-6, ("float64",), needs="float64"),
    *(_shininess(exponent) for exponent in (0.0, 1.0, 32.0, 1e3, 1e4, 1e6)),
)
