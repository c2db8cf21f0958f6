"""What a driver's texture filtering errs by, apart from all that shaders do: white noise against float64."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from firefly_sample.gpu.device import Device
from firefly_sample.lab.experiments.table import Table, Value
from firefly_sample.lab.probes.probe import WIDTH, evaluate
from firefly_sample.lab.reference.texture import Sampler
from firefly_sample.mipmaps import mip_chain

Float64 = NDArray[np.float64]

SIDE = 256


def filtering(device: Device, lines: int = 128) -> Table:
    """Errors of sampled white noise, in textures of 8 and of 16 bits, by how it is filtered.

    Parameters
    ----------
    lines : int
        Lines of 1024 samples, of each level of detail that is asked for.
    """
    rng = np.random.Generator(np.random.PCG64(8))
    noise = mip_chain(rng.uniform(0.0, 1.0, (SIDE, SIDE, 4)).astype(np.float32), None)
    rows: list[tuple[Value, ...]] = []
    for bits, dtype in ((8, np.uint8), (16, np.uint16)):
        levels = [np.round(level * (2**bits - 1)).astype(dtype) for level in noise]
        # 255 is 65535/257: eight bits are sixteen without rounding
        exact = Sampler.of_levels(
            [level.astype(np.uint16) * np.uint16(257 if bits == 8 else 1) for level in levels]
        )
        at = rng.uniform(0.0, 1.0, (lines * WIDTH, 2)).astype(np.float32).astype(np.float64)
        detail = rng.uniform(0.0, 4.0, len(at)).astype(np.float32).astype(np.float64)
        for name, level in (("bilinear", np.zeros(len(at))), ("trilinear", detail)):
            inputs = np.concatenate([at, level[:, None], level[:, None]], axis=1)
            found = evaluate(device, [], "result = textureLod(u_texture, a.xy, a.z);", inputs, levels=levels)
            rows.append((f"{bits} bits, {name}", *_errors(found, exact.sample(at, level))))
        rows.append(
            (f"{bits} bits, trilinear, level by the driver", *_by_driver(device, levels, exact, lines))
        )
    about = (
        "Filtering of white noise of 0..1 by the driver, against float64 on the same texels: with a level of "
        "detail that is given, and with the driver's own from differences between neighbours."
    )
    return Table("filtering", about, ("texture", "largest", "mean"), rows)


def _by_driver(
    device: Device, levels: list[NDArray[np.uint8]] | list[NDArray[np.uint16]], exact: Sampler, lines: int
) -> tuple[float, float]:
    """Samples on a grid, whose neighbours are as far apart as the level of detail asks for."""
    found, true = [], []
    for detail in (0.25, 0.75, 1.5, 2.3, 3.6):
        step = np.float64(np.float32(2.0**detail / SIDE))
        x, y = np.meshgrid(np.arange(WIDTH), np.arange(lines))
        at = np.stack([x.ravel(), y.ravel()], axis=1) * step + 0.3 * step
        at = at.astype(np.float32).astype(np.float64)
        inputs = np.concatenate([at, at], axis=1)
        found.append(evaluate(device, [], "result = texture(u_texture, a.xy);", inputs, levels=levels))
        true.append(exact.sample(at, np.full(len(at), np.log2(step * SIDE))))
    return _errors(np.concatenate(found), np.concatenate(true))


def _errors(found: NDArray[np.float32], exact: Float64) -> tuple[float, float]:
    off = np.abs(found.astype(np.float64) - exact)
    return float(off.max()), float(off.mean())
