"""The accuracy of a pixel's distance and position after they were stored, up to 1e9 times the near plane.

The table "depth": small triangles, each over one pixel's centre only, are drawn through a lens by the
arithmetic of the geometry pass. Their depth goes through a real depth buffer and is decoded by the shader's
own ``distance_from_depth``; a distance or a position goes through a real target. Corners lie on the
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
from firefly_sample.lab.experiments.bench import ExperimentBench
from firefly_sample.lab.experiments.experiment import EPS, Experiment, Value
from firefly_sample.lab.probes.probe import kept_until, row_texture, run
from firefly_sample.lab.probes.raster import rasterise
from firefly_sample.plan.view import View
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lens_constants import Clip, LensConstants
from firefly_sample.scene.transform_state import TransformState

Float64 = NDArray[np.float64]

RATIOS = {"10": 1e1, "1e3": 1e3, "1e6": 1e6, "1e9": 1e9}
"""Far plane over near plane."""
WIDTH = 1024
FOV = (60.0, 40.0)
LARGEST_HALF = 65504.0
_STEP16, _STEP24 = 1 / 65535, 1 / (2**24 - 1)
_FROM_DEPTH = "result.r = distance_from_depth(depth);"
_NOT_FOLDED = "result.r = 0.5 * u_projection.w / (depth - 0.5 - 0.5 * u_projection.y);"
_FROM_INVERSE = "result.r = view_from_inverse(ndc_from_pixel(gl_FragCoord.xy), depth).y;"
_DISTANCE = "result.r = v_view.y;"
_POSITION = "result.xyz = v_view;"
_TO_HALF = """#version 330 core
uniform sampler2D u_inputs;
out vec4 o_result;
void main() { o_result = texelFetch(u_inputs, ivec2(gl_FragCoord.xy), 0); }
"""


@dataclass(frozen=True)
class Stored:
    """A value that is stored per pixel, and how it is read.

    Attributes
    ----------
    target : str
        Format of a depth buffer, or of a target that keeps the distance or the position.
    body : str
        GLSL that computes the distance or the position.
    clip, reverse, infinite
        The clip range, whether depth falls with the distance, and whether the far plane is infinite.
    step : float
        Largest rounding error that the format adds to a depth: a step of whole numbers, or 0 for float32.
    tilted : bool
        Turn the triangles by up to 45 degrees.
    offset : float
        The camera's distance from the world's origin along each axis, which matters to the matrix only.
    """

    target: str
    body: str = _FROM_DEPTH
    clip: Clip = "gl"
    reverse: bool = False
    infinite: bool = False
    step: float = 0.0
    tilted: bool = False
    offset: float = 1.0

    @property
    def in_depth(self) -> bool:
        """Return whether it goes through a depth buffer."""
        return self.target.startswith("depth")

    @property
    def half(self) -> bool:
        """Return whether half floats are stored."""
        return self.target in ("r16f", "rgba16f")


STORED: dict[str, Stored] = {
    "depth16": Stored("depth16", step=_STEP16),
    "depth24": Stored("depth24", step=_STEP24),
    "standard, D32F": Stored("depth32f"),
    "depth16, not folded": Stored("depth16", _NOT_FOLDED, step=_STEP16),
    "depth24, not folded": Stored("depth24", _NOT_FOLDED, step=_STEP24),
    "standard, D32F, not folded": Stored("depth32f", _NOT_FOLDED),
    "inverse_matrix": Stored("depth24", _FROM_INVERSE, step=_STEP24),
    "inverse_matrix, 1e4 off": Stored("depth24", _FROM_INVERSE, step=_STEP24, offset=1e4),
    "reversed in -1..1, D32F": Stored("depth32f", reverse=True),
    "reversed in 0..1, D24": Stored("depth24", clip="zero_to_one", reverse=True, step=_STEP24),
    "depth32f": Stored("depth32f", clip="zero_to_one", reverse=True),
    "depth32f, infinite far": Stored("depth32f", clip="zero_to_one", reverse=True, infinite=True),
    "linear32f": Stored("r32f", _DISTANCE),
    "linear in R16F": Stored("r16f", _DISTANCE),
    "stored32f": Stored("rgba32f", _POSITION),
    "stored16f": Stored("rgba16f", _POSITION),
    "depth24, tilted": Stored("depth24", step=_STEP24, tilted=True),
    "depth32f, tilted": Stored("depth32f", clip="zero_to_one", reverse=True, tilted=True),
    "linear32f, tilted": Stored("r32f", _DISTANCE, tilted=True),
}
"""Choices of `Settings.position_method`, and others. Not folded: the shader computes
y = 0.5 D / (depth - 0.5 - 0.5 B) in place of two constants that are folded in float64."""


def _errors(bench: ExperimentBench, stored: Stored, samples: int) -> list[Value] | None:
    """Return the largest error and its bound for each of `RATIOS`."""
    if stored.clip != "gl" and not bench.capabilities.clip_control:
        return None
    return [figure for ratio in RATIOS.values() for figure in _error(bench.device, stored, ratio, samples)]


def _error(device: Device, stored: Stored, ratio: float, samples: int) -> tuple[Value, Value]:
    """Return the largest relative error of distances (or positions) from 1 to `ratio`, and its bound."""
    size = (WIDTH, -(-samples // WIDTH))
    lens = PerspectiveLens(fov=FOV, near=1.0, far=math.inf if stored.infinite else ratio)
    constants = lens.constants(stored.clip, stored.reverse)
    y, tilt = distances(ratio, size, stored.tilted)
    corners, exact = _triangles(constants, y, tilt, size)
    camera = TransformState.make_pos_hpr_scale_shear((stored.offset,) * 3, (30.0, -7.5, 2.4)).get_mat()
    world_to_view = np.asarray(np.linalg.inv(camera), dtype=np.float64)
    view = View(size, constants, stored.reverse, 1.0, ratio, world_to_view, camera)
    image = rasterise(
        device,
        corners,
        view_values(view),
        size,
        stored.body,
        target="r32f" if stored.in_depth or stored.target == "r16f" else stored.target,
        depth=stored.target if stored.in_depth else None,
        reverse=stored.reverse,
        zero_to_one=stored.clip == "zero_to_one",
    ).reshape(-1, 4)
    if stored.target == "r16f":
        image = _in_half_floats(device, image)
    if stored.body == _POSITION:
        found, true = image[:, :3].astype(np.float64), view_positions(constants, exact, size)
    else:
        found, true = image[:, :1].astype(np.float64), exact[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.linalg.norm(found - true, axis=1) / np.linalg.norm(true, axis=1)
    largest = float(np.where(np.isfinite(error), error, np.inf).max())
    return largest, _bound(stored, constants, exact)


def distances(ratio: float, size: tuple[int, int], tilted: bool = False) -> tuple[Float64, Float64]:
    """Return a distance per pixel, log-uniform from 1 to `ratio`, and the tilt of its triangle, -1..1.

    The distances end short of the planes, so that no corner is clipped.
    """
    rng = np.random.Generator(np.random.PCG64(1))
    y = np.exp(rng.uniform(math.log(1.003), math.log(0.997 * ratio), size[0] * size[1]))
    return y, rng.uniform(-1.0, 1.0, len(y)) if tilted else np.zeros(len(y))


def _in_half_floats(device: Device, rows: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return rows (n, 4) as a target of one channel keeps the first of each."""
    with device, ExitStack() as held:
        given = row_texture(device, rows, held)
        target = kept_until(held, device.ctx.texture(given.size, 1, dtype="f2"))
        run(device, held, _TO_HALF, target, {"u_inputs": given})
        result = np.frombuffer(target.read(), dtype=np.float16)[: len(rows), None].astype(np.float32)
        device.unbind()
    device.check("a probe")
    return result


def view_positions(constants: LensConstants, y: Float64, size: tuple[int, int]) -> Float64:
    """Return view-space positions (n, 3) at the pixels' centres."""
    index = np.arange(len(y))
    pixel = np.stack([index % size[0], index // size[0]], axis=1) + 0.5
    x, z = (2.0 * pixel / size - 1.0).T
    return constants.view_from_distance(x, z, y)


def law(constants: LensConstants, y: Float64, step: float, folded: bool = True) -> Float64:
    """Return the bound of docs/unprojection.md at distances y: (d_depth + d_w) * y / |E|.

    d_depth is float32's rounding on the way into the buffer (the products and the sum of B*y + D, the
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


def _bound(stored: Stored, constants: LensConstants, y: Float64) -> float | None:
    if stored.body == _FROM_INVERSE or stored.tilted:
        return None  # the error depends on the camera's position, or on the driver's interpolation
    if stored.in_depth:
        return float(law(constants, y, stored.step, stored.body == _FROM_DEPTH).max())
    if stored.half and y.max() > LARGEST_HALF:
        return None
    # interpolated over w, and divided by 1/w: four roundings, since corners that lie so near each other
    # differ too little for their weights to matter; a half float may be cut off
    return 4.0 * EPS + (2.0**-10 if stored.half else 0.0)


def _triangles(
    constants: LensConstants, y: Float64, tilt: Float64, size: tuple[int, int]
) -> tuple[Float64, Float64]:
    """Return a triangle per pixel, (n, 3, 3) in view space and float32, and y at the pixels' centres."""
    index = np.arange(len(y))
    around = np.array([(-0.75, -0.75), (0.75, -0.75), (0.0, 0.75)])
    weights = np.array([0.25, 0.25, 0.5])  # of the corners, at the pixel's centre
    pixel = np.stack([index % size[0], index // size[0]], axis=1)[:, None] + 0.5 + around
    half = 0.5 * np.array(size)
    slope = (pixel - half) / half / (constants.a, constants.c)
    across = around[:, 0] / half[0] / constants.a  # in units of the distance
    distance = (y[:, None] * (1.0 + tilt[:, None] * across)).astype(np.float32).astype(np.float64)
    corners = np.stack([slope[..., 0] * distance, distance, slope[..., 1] * distance], axis=-1)
    return corners, 1.0 / (weights / distance).sum(axis=1)


EXPERIMENTS = (
    Experiment(
        "depth",
        _errors,
        STORED,
        ("stored", *(column for name in RATIOS for column in (name, f"{name} bound"))),
        "Largest relative error of a pixel's distance (of its position where that is stored), by what is "
        "stored for it and by far/near. The bound is the law of depth; none for the matrix, whose error "
        "depends on where the camera is, nor where a driver interpolates.",
        {"samples": 400_000},
    ),
)
