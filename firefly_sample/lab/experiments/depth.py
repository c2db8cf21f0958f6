"""How well a pixel's distance comes back from what was stored for it, at far planes up to 1e9 times the near.

Small triangles, one over each pixel's centre and over no other, are drawn through a lens by the arithmetic of
the geometry pass. Their depth goes through a real depth buffer and comes back by the shader's own
``distance_from_depth``; a distance, or a whole place, goes through a real target. Corners lie on the
rasteriser's grid, so that the distance at the pixel's centre is known in float64.
"""

from __future__ import annotations

import math
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.blocks import view_values
from firefly_sample.gpu.device import Device
from firefly_sample.lab.experiments.table import EPS, Table, Value
from firefly_sample.lab.probes.probe import row_texture, run
from firefly_sample.lab.probes.raster import rasterise
from firefly_sample.plan.view import View
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lens_constants import Clip, LensConstants
from firefly_sample.scene.transform_state import TransformState

Float64 = NDArray[np.float64]

RATIOS = {"10": 1e1, "1e3": 1e3, "1e6": 1e6, "1e9": 1e9}
"""Far over near."""
WIDTH = 1024
FOV = (60.0, 40.0)
FROM_DEPTH = "result.r = distance_from_depth(depth);"
NOT_FOLDED = "result.r = 0.5 * u_projection.w / (depth - 0.5 - 0.5 * u_projection.y);"
FROM_INVERSE = "result.r = view_from_inverse(ndc_from_pixel(gl_FragCoord.xy), depth).y;"
DISTANCE = "result.r = v_view.y;"
PLACE = "result.xyz = v_view;"
LARGEST_HALF = 65504.0
_TO_HALF = """#version 330 core
uniform sampler2D u_inputs;
out vec4 o_result;
void main() { o_result = texelFetch(u_inputs, ivec2(gl_FragCoord.xy), 0); }
"""


@dataclass(frozen=True)
class Way:
    """What is stored for a pixel, and how it is read.

    Attributes
    ----------
    target : str
        Format of a depth buffer, or of a target that keeps the distance or the place.
    step : float
        What the format adds to a depth at most: a step of whole numbers, or 0 for float32.
    away : float
        How far the camera is from the world's origin along each axis, which only the matrix cares for.
    """

    target: str
    body: str = FROM_DEPTH
    clip: Clip = "gl"
    reverse: bool = False
    infinite: bool = False
    step: float = 0.0
    tilted: bool = False
    away: float = 1.0

    @property
    def in_depth(self) -> bool:
        """Whether it goes through a depth buffer."""
        return self.target.startswith("depth")

    @property
    def half(self) -> bool:
        """Whether half floats are stored."""
        return self.target in ("r16f", "rgba16f")


WAYS: dict[str, Way] = {
    "depth16": Way("depth16", step=1 / 65535),
    "depth24": Way("depth24", step=1 / (2**24 - 1)),
    "standard, D32F": Way("depth32f"),
    "depth16, not folded": Way("depth16", NOT_FOLDED, step=1 / 65535),
    "depth24, not folded": Way("depth24", NOT_FOLDED, step=1 / (2**24 - 1)),
    "standard, D32F, not folded": Way("depth32f", NOT_FOLDED),
    "inverse_matrix": Way("depth24", FROM_INVERSE, step=1 / (2**24 - 1)),
    "inverse_matrix, 1e4 off": Way("depth24", FROM_INVERSE, step=1 / (2**24 - 1), away=1e4),
    "reversed in -1..1, D32F": Way("depth32f", reverse=True),
    "reversed in 0..1, D24": Way("depth24", clip="zero_to_one", reverse=True, step=1 / (2**24 - 1)),
    "depth32f": Way("depth32f", clip="zero_to_one", reverse=True),
    "depth32f, infinite far": Way("depth32f", clip="zero_to_one", reverse=True, infinite=True),
    "linear32f": Way("r32f", DISTANCE),
    "linear in R16F": Way("r16f", DISTANCE),
    "stored32f": Way("rgba32f", PLACE),
    "stored16f": Way("rgba16f", PLACE),
    "depth24, tilted": Way("depth24", step=1 / (2**24 - 1), tilted=True),
    "depth32f, tilted": Way("depth32f", clip="zero_to_one", reverse=True, tilted=True),
    "linear32f, tilted": Way("r32f", DISTANCE, tilted=True),
}
"""Settings `position` by their names, and others. Tilted: triangles turned by up to 45 degrees. Not folded:
y = 0.5 D / (depth - 0.5 - 0.5 B) in the shader, in place of two constants that are folded in float64."""


def depth(device: Device, samples: int = 400_000) -> Table:
    """Largest relative error of the distance y, by what is stored and far over near.

    Parameters
    ----------
    samples : int
        Distances, log-uniform from near to far.
    """
    columns = ["stored"]
    for name in RATIOS:
        columns += [name, f"{name} bound"]
    rows: list[tuple[Value, ...]] = []
    for name, way in WAYS.items():
        if way.clip != "gl" and not device.capabilities.clip_control:
            continue
        row: list[Value] = [name]
        for ratio in RATIOS.values():
            row += measured_error(device, way, ratio, samples)
        rows.append(tuple(row))
    about = (
        "Largest relative error of a pixel's distance (of its place where that is stored), by what is stored "
        "for it and by far/near. The bound is the law of depth; none for the matrix, whose error depends on "
        "where the camera is, nor where a driver interpolates."
    )
    return Table("depth", about, tuple(columns), rows)


def measured_error(device: Device, way: Way, ratio: float, samples: int) -> tuple[Value, Value]:
    """Largest relative error of y, or of the place, for distances 1 to `ratio`, and its bound."""
    size = (WIDTH, -(-samples // WIDTH))
    lens = PerspectiveLens(fov=FOV, near=1.0, far=math.inf if way.infinite else ratio)
    constants = lens.constants(way.clip, way.reverse)
    y, tilt = distances(ratio, size, way.tilted)
    corners, exact = _triangles(constants, y, tilt, size)
    away = (way.away,) * 3
    camera = TransformState.make_pos_hpr_scale_shear(away, (30.0, -7.5, 2.4)).get_mat()
    world_to_view = np.asarray(np.linalg.inv(camera), dtype=np.float64)
    view = View(size, constants, way.reverse, 1.0, ratio, world_to_view, camera)
    image = rasterise(
        device,
        corners,
        view_values(view),
        size,
        way.body,
        target="r32f" if way.in_depth or way.target == "r16f" else way.target,
        depth=way.target if way.in_depth else None,
        reverse=way.reverse,
        zero_to_one=way.clip == "zero_to_one",
    ).reshape(-1, 4)
    if way.target == "r16f":
        image = _in_half_floats(device, image)
    found = image[:, : 3 if way.body == PLACE else 1].astype(np.float64)
    true = _places(constants, exact, size) if way.body == PLACE else exact[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.linalg.norm(found - true, axis=1) / np.linalg.norm(true, axis=1)
    largest = float(np.where(np.isfinite(error), error, np.inf).max())
    return largest, _bound(way, constants, exact)


def distances(ratio: float, size: tuple[int, int], tilted: bool = False) -> tuple[Float64, Float64]:
    """A distance for each pixel, log-uniform from 1 to `ratio`, and how its triangle is tilted, -1..1.

    They end short of the planes, so that no corner is clipped.
    """
    rng = np.random.Generator(np.random.PCG64(1))
    y = np.exp(rng.uniform(math.log(1.003), math.log(0.997 * ratio), size[0] * size[1]))
    return y, rng.uniform(-1.0, 1.0, len(y)) if tilted else np.zeros(len(y))


def _in_half_floats(device: Device, rows: NDArray[np.float32]) -> NDArray[np.float32]:
    """Rows (n, 4) as a target of one channel keeps the first of each."""
    with device, ExitStack() as held:
        given = row_texture(device, rows, held)
        kept = device.ctx.texture(given.size, 1, dtype="f2")
        held.callback(kept.release)
        run(device, held, _TO_HALF, kept, {"u_inputs": given})
        result = np.frombuffer(kept.read(), dtype=np.float16)[: len(rows), None].astype(np.float32)
        device.unbind()
    device.check("a probe")
    return result


def _places(constants: LensConstants, y: Float64, size: tuple[int, int]) -> Float64:
    """View-space places (n, 3) at the pixels' centres."""
    index = np.arange(len(y))
    pixel = np.stack([index % size[0], index // size[0]], axis=1) + 0.5
    x, z = (2.0 * pixel / size - 1.0).T
    return constants.view_from_distance(x, z, y)


def law(constants: LensConstants, y: Float64, step: float, folded: bool = True) -> Float64:
    """What the law of docs/unprojection.md allows at distances y: (d_depth + d_w) * y / |E|.

    d_depth is what float32 loses on the way into the buffer (the products and the sum of B*y + D, the
    division by w, the scale and offset of the depth range) and the buffer's step; d_w is the rounding of the
    constant, and of B before it if it is not folded in float64. An error r of depth + w turns into
    r / (1 - r) of its inverse; the rest is the division's own rounding.
    """
    z = np.abs(constants.b + constants.d / y)
    into = constants.depth_scale * (2.0 * abs(constants.b) + abs(constants.d) / y + 3.0 * z)
    stored = np.abs(constants.depth_from_distance(y))
    into += 2.0 * stored if constants.depth_offset else stored
    constant = abs(constants.w_fold) + (0.0 if folded else constants.depth_scale * abs(constants.b))
    off = EPS * (into + constant) + step
    relative = off * y / abs(constants.y_fold)
    return np.where(relative < 1.0, relative / np.maximum(1.0 - relative, 1e-300), np.inf) + 3.0 * EPS


def _bound(way: Way, constants: LensConstants, y: Float64) -> float | None:
    if way.body == FROM_INVERSE or way.tilted:
        return None  # of the camera's place; of a driver's interpolation
    if way.in_depth:
        return float(law(constants, y, way.step, way.body == FROM_DEPTH).max())
    if way.half and y.max() > LARGEST_HALF:
        return None  # it ends there
    # interpolated over w, and divided by 1/w: four roundings, since corners that lie so near each other
    # differ too little for their weights to matter; a half float may be cut off
    return 4.0 * EPS + (2.0**-10 if way.half else 0.0)


def _triangles(
    constants: LensConstants, y: Float64, tilt: Float64, size: tuple[int, int]
) -> tuple[Float64, Float64]:
    """Corners (n, 3, 3) in view space of a triangle a pixel, as float32 has them, and y at the centres."""
    index = np.arange(len(y))
    around = np.array([(-0.75, -0.75), (0.75, -0.75), (0.0, 0.75)])
    weights = np.array([0.25, 0.25, 0.5])  # of the corners, at the pixel's centre
    pixel = np.stack([index % size[0], index // size[0]], axis=1)[:, None] + 0.5 + around
    half = 0.5 * np.array(size)
    slope = (pixel - half) / half / (constants.a, constants.c)
    across = around[:, 0] / half[0] / constants.a  # units a unit of distance: at 45 degrees, as many ahead
    distance = (y[:, None] * (1.0 + tilt[:, None] * across)).astype(np.float32).astype(np.float64)
    corners = np.stack([slope[..., 0] * distance, distance, slope[..., 1] * distance], axis=-1)
    return corners, 1.0 / (weights / distance).sum(axis=1)
