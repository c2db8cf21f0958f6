"""What float32 leaves of powers of a cosine, of a pixel's NDC, and of a short way far from the origin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.blocks import view_values
from firefly_sample.gpu.device import Device
from firefly_sample.lab.numerics_table import EPS, Table, Value
from firefly_sample.lab.probes.probe import evaluate
from firefly_sample.lab.probes.raster import rasterise
from firefly_sample.plan.view import View
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.transform_state import TransformState

Float64 = NDArray[np.float64]

EXPONENTS = {"32": 32.0, "128": 128.0, "1e3": 1e3, "1e6": 1e6}
SIZES = ((800, 600), (1920, 1080), (1366, 768))
FOVS = (60.0, 1e-3, 179.999)
OFFSETS = {"0": 0.0, "1e6": 1e6, "1e7": 1e7, "1e9": 1e9}


def powers(device: Device, samples: int = 100_000) -> Table:
    """Largest error of cos^m, by GLSL's pow of a float32 cosine, and by the shaders' own function.

    Parameters
    ----------
    samples : int
        Angles, evenly from 0 to where the power has fallen to 1e-7.
    """
    rows: list[tuple[Value, ...]] = []
    for name, m in EXPONENTS.items():
        angle = np.linspace(0.0, np.arccos(np.exp(np.log(1e-7) / m)), samples)
        exact = np.exp(0.5 * m * np.log1p(-(np.sin(angle) ** 2)))
        inputs = np.stack([np.cos(angle), np.sin(angle) ** 2, np.full_like(angle, m), angle], axis=1)
        errors = []
        for includes, body in (
            ([], "result.r = pow(a.x, a.z);"),
            (["phong"], "result.r = power_of_cosine(a.x, a.y, a.z);"),
        ):
            found = evaluate(device, includes, body, inputs, {"SPECULAR_MODEL": 0})[:, 0]
            errors.append(float(np.abs(found - exact).max()))
        # an error e of the logarithm x counts x exp(-x) e, which is e/3 at most: the roundings of the sine's
        # square, of its series and of the product; and what exp adds
        rows.append((name, *errors, 8.0 * EPS))
    about = "Largest absolute error of a cosine's power: GLSL's pow, and our function of cosine and sine."
    return Table("powers", about, ("exponent", "pow", "power_of_cosine", "power_of_cosine bound"), rows)


def ndc(device: Device) -> Table:
    """Largest error of NDC at pixel centres, computed from the pixel or interpolated as a clip position."""
    # In the first, the difference is exact, and the division of what is below 1 rounds once, or twice where a
    # driver multiplies by a reciprocal. In the second, two numbers of up to 2 are rounded before they cancel.
    bounds = {"(p - size/2)/(size/2)": 1.5 * EPS, "p*2/size - 1": 3.0 * EPS}
    rows: list[tuple[Value, ...]] = []
    for formula, bound in bounds.items():
        rows.append((formula, *(_by_formula(device, formula, size) for size in SIZES), bound))
    for fov in FOVS:
        errors = (_interpolated(device, fov, size) for size in SIZES)
        rows.append((f"interpolated, {fov:g} degrees", *errors, None))
    errors = (_interpolated(device, FOVS[0], size, 1000.0, 1e5) for size in SIZES)
    rows.append((f"interpolated, {FOVS[0]:g} degrees, wide and deep", *errors, None))
    about = "Largest error of NDC at the centres of all pixels, by the size of the picture."
    return Table("ndc", about, ("way", *(f"{w}x{h}" for w, h in SIZES), "bound"), rows)


def _by_formula(device: Device, formula: str, size: tuple[int, int]) -> float:
    pixel = np.arange(size[0]) + 0.5
    inputs = np.stack([pixel, np.minimum(pixel, size[1] - 0.5), pixel, pixel], axis=1)
    blocks = {"View": _view_of(60.0, size)}
    by_include = "result.xy = ndc_from_pixel(a.xy);"
    body = by_include if formula.startswith("(") else "result.xy = a.xy * 2.0 / u_size.xy - 1.0;"
    found = evaluate(device, ["lens"], body, inputs, {"ORTHOGRAPHIC": 0}, blocks)[:, :2]
    return float(np.abs(found - (inputs[:, :2] * 2.0 / size - 1.0)).max())


def _interpolated(
    device: Device, fov: float, size: tuple[int, int], wide: float = 1.25, deep: float = 10.0
) -> float:
    """Of two triangles `wide` pictures wide, and at least two units; 1 unit away below and `deep` on top."""
    lens = _lens(fov, size).constants()
    y = np.array([1.0, 1.0, deep, deep])
    quad = np.stack([np.array([-1.0, 1.0, 1.0, -1.0]), y, np.array([-1.0, -1.0, 1.0, 1.0])], axis=1)
    quad[:, 0] *= np.maximum(wide * y / lens.a, 1.0)
    quad[:, 2] *= np.maximum(wide * y / lens.c, 1.0)
    body = "result.xy = v_clip.xy / v_clip.w; result.z = 1.0;"
    image = rasterise(device, quad[[(0, 1, 2), (0, 2, 3)]], _view_of(fov, size), size, body)
    x, z = (np.arange(side) * 2.0 / side + (1.0 / side - 1.0) for side in size)
    off = np.maximum(np.abs(image[..., 0] - x[None, :]), np.abs(image[..., 1] - z[:, None]))
    return float(off[image[..., 2] == 1.0].max())


def _lens(fov: float, size: tuple[int, int]) -> PerspectiveLens:
    return PerspectiveLens(fov=fov, aspect_ratio=size[0] / size[1], near=0.1, far=100.0)


def _view_of(fov: float, size: tuple[int, int]) -> NDArray[np.void]:
    constants = _lens(fov, size).constants()
    return view_values(View(size, constants, False, 0.1, 100.0, np.eye(4), np.eye(4)))


def far_from_origin(device: Device, samples: int = 200_000) -> Table:
    """Largest error of the distance of a light from a surface, by how far off the world's origin.

    Parameters
    ----------
    samples : int
        Surfaces 5 to 100 units before the camera, each with a light.
    """

    def bound(reach: float) -> float:
        """Of the distance of two places whose coordinates are each off by half a unit in the last place."""
        return float(np.sqrt(3.0) * np.spacing(np.float32(reach)))

    rows: list[tuple[Value, ...]] = []
    for name, offset in OFFSETS.items():
        by_world, by_view, by_pixel = _distance_errors(device, offset, samples)
        rows.append((name, by_world, bound(offset + 100.0), by_view, bound(100.0), by_pixel))
    about = (
        "Largest error of the distance of a light one unit from a surface, scene and camera being so far "
        "from the world's origin along each axis: places in world space as float32; in view space, formed in "
        "float64; and the way from pixels, as shaders find it."
    )
    columns = ("offset", "world", "world bound", "view", "view bound", "from pixels")
    return Table("far_from_origin", about, columns, rows)


def _distance_errors(device: Device, offset: float, samples: int) -> tuple[float, float, float]:
    size = (1024, 768)
    lens = _lens(60.0, size).constants()
    camera = TransformState.make_pos_hpr_scale_shear((offset, offset, offset), (30.0, -7.5, 2.4)).get_mat()
    back = np.linalg.inv(camera[:3, :3])
    view = View(size, lens, False, 0.1, 100.0, np.eye(4), camera)
    rng = np.random.Generator(np.random.PCG64(7))
    pixel = np.floor(rng.uniform(size=(samples, 2)) * size) + 0.5
    ndc_x, ndc_z = (pixel * 2.0 / size - 1.0).T
    surface = lens.view_from_distance(ndc_x, ndc_z, rng.uniform(5.0, 100.0, samples))
    way = rng.normal(size=(samples, 3))
    light = surface + way / np.linalg.norm(way, axis=1, keepdims=True)
    light[:, 1] = light[:, 1].astype(np.float32)  # of which a light's record keeps the rest as well
    exact = np.linalg.norm(light - surface, axis=1)

    def largest(found: NDArray[np.float32]) -> float:
        return float(np.abs(found.astype(np.float64) - exact).max())

    def four(places: Float64) -> Float64:
        return np.pad(places, ((0, 0), (0, 1)))

    apart = "result.r = distance(a.xyz, b.xyz);"
    world = [places @ camera[:3, :3] + camera[3, :3] for places in (surface, light)]
    seen = [(places - camera[3, :3]) @ back for places in world]
    by_world = evaluate(device, [], apart, four(world[0]), more=four(world[1]))[:, 0]
    by_view = evaluate(device, [], apart, four(seen[0]), more=four(seen[1]))[:, 0]
    at = (seen[1][:, [0, 2]] / seen[1][:, 1:2] * (lens.a, lens.c) + 1.0) * (0.5 * np.array(size))
    near = at.astype(np.float32).astype(np.float64)
    without = (
        "ORTHOGRAPHIC",
        "RADIANCE",
        "LIGHT_RESOLUTION",
        "SPECULAR_MODEL",
        "POSITION_METHOD",
        "NORMAL_FORMAT",
        "ALBEDO_FORMAT",
    )
    defines = dict.fromkeys(without, 0)
    by_pixel = evaluate(
        device,
        ["surface"],
        "Surface s; s.pixel = a.xy; s.y = a.z; s.ray = (ndc_from_pixel(a.xy) - u_film.xy) * u_film.zw;"
        " result.r = length(way_to_light(s, vec4(0.0, a.w, 0.0, 0.0), b, 0.0));",
        np.concatenate([pixel, seen[0][:, 1:2], seen[1][:, 1:2]], axis=1),
        defines | {"PLACED": 1},
        {"View": view_values(view)},
        more=np.concatenate([near, at - near], axis=1),
    )[:, 0]
    return largest(by_world), largest(by_view), largest(by_pixel)
