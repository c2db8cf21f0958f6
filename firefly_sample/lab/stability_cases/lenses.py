"""The narrowest and the widest lens: what shaders make of a pixel."""

from __future__ import annotations

import math

import numpy as np

from firefly_sample.lab.reference.rays import pixel_rays
from firefly_sample.lab.stability_cases.bench import Bench
from firefly_sample.lab.stability_cases.case import Case
from firefly_sample.lab.stability_cases.probes import probe_rays
from firefly_sample.lab.stability_cases.scenes import wall_scene
from firefly_sample.scene.lens import OrthographicLens, PerspectiveLens
from firefly_sample.settings import Settings

SHADER = ("shader",)
SIZE = (1001, 701)


def _case(fov: float, of_rays: bool) -> Case:
    """NDC, or how far aside the way through each pixel leads, over just that."""

    def run(bench: Bench, method: str) -> float:
        scene = wall_scene()
        lens = PerspectiveLens(vfov=fov, near=1.0, far=100.0) if fov else OrthographicLens(film_height=16.0)
        scene.camera_node.lens = lens
        view = bench.plan(scene, Settings(), SIZE).view
        given = probe_rays(bench.device, view).astype(np.float64)
        width, height = SIZE
        if of_rays:
            rays = pixel_rays(view)
            way = rays.direction if view.lens.perspective else rays.origin
            exact = way[:, [0, 2]].reshape(height, width, 2)
            off = np.linalg.norm(given[..., 2:] - exact, axis=2)
            aside = np.linalg.norm(exact, axis=2)
            if off[aside == 0.0].any():
                return math.inf
            return float((off[aside > 0.0] / aside[aside > 0.0]).max())
        ndc = np.stack(
            np.meshgrid(
                (np.arange(width) + 0.5) / (width / 2) - 1.0, 1.0 - (np.arange(height) + 0.5) / (height / 2)
            ),
            axis=-1,
        )
        return float(np.abs(given[..., :2] - ndc).max())

    name = f"fov {fov:g}" if fov else "orthographic"
    return Case(f"{'view ray' if of_rays else 'NDC'}, {name}", run, 1e-6 if of_rays else 1e-7, SHADER)


CASES = tuple(_case(fov, of_rays) for of_rays in (False, True) for fov in (1e-3, 90.0, 179.999, 0.0))
