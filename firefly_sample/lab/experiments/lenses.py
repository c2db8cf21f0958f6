"""Lenses with extreme planes and angles: distances as lighting gets them, coverage, NDC and view rays.

The cases "distance" measure the distance that the shaders of lights find. A light at the eye that fades as
1/d makes the picture show how far away each pixel's surface is; the distance of a plane is known in float64
as well. To read the stored distances back and decode them on the CPU would leave out the arithmetic of the
shader, in which the methods differ most.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import FireflyError
from firefly_sample.gpu.blocks import view_values
from firefly_sample.gpu.device import Device
from firefly_sample.lab.experiments.bench import SIZE, DrawnFrame, ExperimentBench
from firefly_sample.lab.experiments.experiment import EPS, FLOAT64, Experiment
from firefly_sample.lab.experiments.position_bounds import ACCURATE, positioned
from firefly_sample.lab.experiments.scenes import WALL, geom_node, wall, wall_scene
from firefly_sample.lab.probes.probe import evaluate
from firefly_sample.lab.probes.raster import rasterise
from firefly_sample.lab.reference.rays import pixel_rays
from firefly_sample.plan.position_error import HALF_FLOAT_END, codes_shown
from firefly_sample.plan.view import View
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, PointLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.scene import Scene
from firefly_sample.settings import Settings

Size = tuple[int, int]

BOUND = 1e-6
"""Relative error of a distance that accurate methods hold."""
NEAR = 0.01
TILT = 15.0
FARTHEST = 1.25
"""Largest distance on the tilted plane over that of its middle, rounded up."""
WIDEST = 179.999
"""Degrees."""

# --- Distances, by position method ---


def _lit_from_the_eye(distance: float, near: float, far: float, fov: float, tilt: float, cells: int) -> Scene:
    """Return a white plane, twice as wide as the view, under a light at the eye that fades as 1/d."""
    scene = Scene()
    width = 4.0 * distance * math.tan(math.radians(fov / 2.0))
    plane = geom_node("plane", wall(width, cells), Material("white", (1.0, 1.0, 1.0, 1.0)))
    scene.root.attach_new_node(plane).set_pos_hpr(0, distance, 0, 0, -tilt, 0)
    light = PointLight("eye")
    light.set_attenuation((0.0, 1.0 / distance, 0.0))
    scene.root.attach_new_node(light)
    scene.camera_node.lens = PerspectiveLens(fov=fov, aspect_ratio=4 / 3, near=near, far=far)
    return scene


def _error_of_distance(drawn: DrawnFrame, distance: float, tilt: float) -> float:
    """Return the largest relative error of y, infinite if a pixel is black.

    The light is cos / d, and both are y times (or divided by) a number that follows from the view ray.
    """
    view = drawn.plan.view
    rays = pixel_rays(view).direction.reshape(view.size[1], view.size[0], 3)
    angle = math.radians(tilt)
    normal = np.array([0.0, -math.cos(angle), math.sin(angle)])
    facing = -rays @ normal
    y = -normal[1] * distance / facing
    expected = facing / np.einsum("...i,...i", rays, rays) * distance / y
    with np.errstate(divide="ignore", over="ignore"):
        return float(np.abs(expected / drawn["light"][..., 0] - 1.0).max())


def _bound_of_distance(method: str, share: float, near: float, distance: float) -> float:
    """Return the bound of a method's error at `distance`; `share` is (far - near) / far.

    It is the method's own law while that stays below a display code, else that of the accurate methods.
    """
    if method in ACCURATE:
        return BOUND
    magnified = share * distance / near
    law = (
        BOUND
        + {
            "depth24": 4 * 6e-8 * magnified,
            "inverse_matrix": 4 * 6e-8 * magnified,
            "depth16": (2.0**-17 + 4 * 6e-8) * magnified,
            "stored16f": 2.0**-10 if distance < HALF_FLOAT_END else 1.0,
        }[method]
    )
    return BOUND if codes_shown(law, 1.0) > 1.0 else law


def _draw_distance(
    bench: ExperimentBench,
    method: str,
    distance: float,
    planes: tuple[float, float],
    fov: float,
    tilt: float,
    cells: int,
) -> float:
    scene = _lit_from_the_eye(distance, *planes, fov, tilt, cells)
    settings = positioned(method, normal_format="rgba32f", cutoff_budget=0.0)
    return _error_of_distance(bench.draw(scene, settings, outputs=("light",)), distance, tilt)


def _plane(ratio: float, far: float | None = None) -> Experiment:
    """Return the case of a tilted plane in the middle of a range of `ratio`."""
    distance = 0.5 * NEAR * ratio
    planes = (NEAR, NEAR * ratio if far is None else far)
    return Experiment(
        f"distance, f/n {ratio:g}" if far is None else f"distance, far infinite, y/n {ratio / 2:g}",
        lambda bench, method: _draw_distance(bench, method, distance, planes, 40.0, TILT, 64),
        bound=lambda method: _bound_of_distance(method, 1.0, NEAR, FARTHEST * distance),
    )


def _field_of_view(fov: float) -> Experiment:
    """Return the case of a plane that faces the eye, through an extremely narrow or wide lens."""

    def run(bench: ExperimentBench, method: str) -> float:
        # a square per pixel: in the middle of the widest view, positions are small beside those at its edge
        return _draw_distance(bench, method, WALL, (1.0, 100.0), fov, 0.0, 2 * SIZE[0])

    def bound(method: str) -> float:
        if method == "stored32f" and fov == WIDEST:
            # a driver interpolates positions over the whole picture: its edge's rounding counts everywhere
            return BOUND + 2.0**-24 * SIZE[0]
        if method == "stored16f" and WALL * math.tan(math.radians(fov / 2.0)) > HALF_FLOAT_END:
            return BOUND
        return _bound_of_distance(method, 0.99, 1.0, WALL)

    return Experiment(f"distance, fov {fov:g}", run, bound=bound)


# --- Planes ---


def _coverage(ratio: float) -> Experiment:
    """Return the case of a wall that fills the view, at `ratio` times the near plane's distance."""

    def run(bench: ExperimentBench, method: str) -> float:
        scene = wall_scene(1000.0, 4000.0, near=1000.0 / ratio, far=2000.0)
        scene.root.attach_new_node(AmbientLight("sky"))
        drawn = bench.draw(scene, positioned(method), outputs=("light", "id"))
        return float(((drawn.frame["id"] < 0) | (drawn["light"].min(axis=2) < 1.0)).mean())

    return Experiment(f"coverage at y/n {ratio:g}", run, bound=0.0)


def _refused(bench: ExperimentBench, method: str) -> float:
    """Return how many invalid pairs of planes are not refused in one line."""
    wrong = 0
    pairs = [(10.0, 1.0), (5.0, 5.0), (0.0, 10.0), (-1.0, 10.0), (math.nan, 10.0), (math.inf, math.inf)]
    for near, far in pairs:
        wrong += not _refuses(PerspectiveLens, near, far)
        if not near <= 0.0:  # parallel rays may begin behind the eye
            wrong += not _refuses(OrthographicLens, near, far)
    wrong += not _refuses(OrthographicLens, 1.0, math.inf)
    return float(wrong)


def _refuses(make: type[PerspectiveLens] | type[OrthographicLens], near: float, far: float) -> bool:
    try:
        make(near=near, far=far)
    except FireflyError as error:
        return "\n" not in str(error)
    return False


# --- NDC and view rays in the shader ---

PROBED = (1001, 701)
SIZES = ((800, 600), (1920, 1080), (1366, 768))


def _shader_rays(device: Device, view: View) -> NDArray[np.float64]:
    """Return what shaders compute at each pixel's centre, shape (height, width, 4), first row on top.

    NDC, right and up; then x and z at y = 1 of the view ray (orthographic: of its start).
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
    return rays.reshape(height, width, 4).astype(np.float64)


def _probed_view(bench: ExperimentBench, fov: float) -> View:
    scene = wall_scene()
    lens = PerspectiveLens(vfov=fov, near=1.0, far=100.0) if fov else OrthographicLens(film_height=16.0)
    scene.camera_node.lens = lens
    return bench.plan(scene, Settings(), PROBED).view


def _ndc_error(bench: ExperimentBench, fov: float) -> float:
    width, height = PROBED
    x = (np.arange(width) + 0.5) / (width / 2) - 1.0
    z = 1.0 - (np.arange(height) + 0.5) / (height / 2)
    found = _shader_rays(bench.device, _probed_view(bench, fov))[..., :2]
    return float(np.abs(found - np.stack(np.meshgrid(x, z), axis=-1)).max())


def _ray_error(bench: ExperimentBench, fov: float) -> float:
    """Return the largest error of a ray's x and z, relative to their length."""
    view = _probed_view(bench, fov)
    rays = pixel_rays(view)
    exact = (rays.direction if view.lens.perspective else rays.origin)[:, [0, 2]]
    error = np.linalg.norm(_shader_rays(bench.device, view)[..., 2:].reshape(-1, 2) - exact, axis=1)
    length = np.linalg.norm(exact, axis=1)
    if error[length == 0.0].any():
        return math.inf
    return float((error[length > 0.0] / length[length > 0.0]).max())


def _in_the_shader(fov: float, of_rays: bool) -> Experiment:
    lens = f"fov {fov:g}" if fov else "orthographic"
    measured, bound = (_ray_error, 1e-6) if of_rays else (_ndc_error, 1e-7)
    name = f"{'view ray' if of_rays else 'NDC'}, {lens}"
    return Experiment(name, lambda bench, method: measured(bench, fov), ("shader",), bound=bound)


def _by_formula(bench: ExperimentBench, body: str, size: Size) -> float:
    pixel = np.arange(size[0]) + 0.5
    inputs = np.stack([pixel, np.minimum(pixel, size[1] - 0.5), pixel, pixel], axis=1)
    blocks = {"View": _view_block(60.0, size)}
    found = evaluate(bench.device, ["lens"], body, inputs, {"ORTHOGRAPHIC": 0}, blocks)[:, :2]
    return float(np.abs(found - (inputs[:, :2] * 2.0 / size - 1.0)).max())


def _interpolated(bench: ExperimentBench, fov: float, wide: float, deep: float, size: Size) -> float:
    """Return the error on triangles `wide` pictures (at least two units) wide, 1 to `deep` units away."""
    lens = _lens(fov, size).constants()
    y = np.array([1.0, 1.0, deep, deep])
    quad = np.stack([np.array([-1.0, 1.0, 1.0, -1.0]), y, np.array([-1.0, -1.0, 1.0, 1.0])], axis=1)
    quad[:, 0] *= np.maximum(wide * y / lens.a, 1.0)
    quad[:, 2] *= np.maximum(wide * y / lens.c, 1.0)
    body = "result.xy = v_clip.xy / v_clip.w; result.z = 1.0;"
    image = rasterise(bench.device, quad[[(0, 1, 2), (0, 2, 3)]], _view_block(fov, size), size, body)
    x, z = (np.arange(side) * 2.0 / side + (1.0 / side - 1.0) for side in size)
    error = np.maximum(np.abs(image[..., 0] - x[None, :]), np.abs(image[..., 1] - z[:, None]))
    return float(error[image[..., 2] == 1.0].max())


def _lens(fov: float, size: Size) -> PerspectiveLens:
    return PerspectiveLens(fov=fov, aspect_ratio=size[0] / size[1], near=0.1, far=100.0)


def _view_block(fov: float, size: Size) -> NDArray[np.void]:
    return view_values(View(size, _lens(fov, size).constants(), False, 0.1, 100.0, np.eye(4), np.eye(4)))


def _ndc(
    bench: ExperimentBench, row: tuple[str | tuple[float, float, float], float | None]
) -> tuple[float | None, ...]:
    method, bound = row
    if isinstance(method, str):
        return (*(_by_formula(bench, method, size) for size in SIZES), bound)
    return (*(_interpolated(bench, *method, size) for size in SIZES), bound)


_NDC_ROWS = {
    # the difference is exact, and the division of a number below 1 rounds once, or twice where a driver
    # multiplies by a reciprocal
    "(p - size/2)/(size/2)": ("result.xy = ndc_from_pixel(a.xy);", 1.5 * EPS),
    # two numbers of up to 2 are rounded before they cancel
    "p*2/size - 1": ("result.xy = a.xy * 2.0 / u_size.xy - 1.0;", 3.0 * EPS),
    **{f"interpolated, {fov:g} degrees": ((fov, 1.25, 10.0), None) for fov in (60.0, 1e-3, WIDEST)},
    "interpolated, 60 degrees, wide and deep": ((60.0, 1000.0, 1e5), None),
}

EXPERIMENTS = (
    *(_plane(ratio) for ratio in (1e1, 1e3, 1e6, 1e9)),
    *(_plane(ratio, math.inf) for ratio in (1e1, 1e6)),
    *(_field_of_view(fov) for fov in (1e-3, WIDEST)),
    *(_coverage(ratio) for ratio in (1e6, 1e9)),
    Experiment("planes reversed, equal or no numbers", _refused, FLOAT64, bound=0.0),
    *(_in_the_shader(fov, of_rays) for of_rays in (False, True) for fov in (1e-3, 90.0, WIDEST, 0.0)),
    Experiment(
        "ndc",
        _ndc,
        _NDC_ROWS,
        ("method", *(f"{width}x{height}" for width, height in SIZES), "bound"),
        "Largest error of NDC at the centres of all pixels, by the size of the picture.",
    ),
)
