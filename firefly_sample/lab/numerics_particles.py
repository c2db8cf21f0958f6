"""Shadows of particles: what each method errs by and costs, and what their order is worth."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.lab.clouds import CLOUDS, blob, shadow_errors
from firefly_sample.lab.measuring import quartile_spread
from firefly_sample.lab.numerics_table import Table, Value
from firefly_sample.renderer import Renderer
from firefly_sample.scenes import build_scene, find_scene
from firefly_sample.settings import Settings

METHODS: dict[str, dict[str, Any]] = {
    "optical_depth": {},
    "optical_depth, float16": {"particle_shadow_format": "float16"},
    "optical_depth, stepped": {"particle_shadow_interpolation": False},
    "blend": {"particle_shadows": "blend"},
    "blend, stepped": {"particle_shadows": "blend", "particle_shadow_interpolation": False},
    "blend, 8 bits": {"particle_shadows": "blend", "particle_shadow_format": "unorm8"},
    "blend, 8 bits, stepped": {
        "particle_shadows": "blend",
        "particle_shadow_format": "unorm8",
        "particle_shadow_interpolation": False,
    },
    "loop, all": {"particle_shadows": "loop"},
    "loop, nearest ten": {"particle_shadows": "loop", "particle_shadow_reads": 10},
}
"""Of particle shadows, by the settings that differ from the defaults."""
SLICES = (16, 32, 64, 128, 256)
COUNTS = (10_000, 100_000)


def particle_shadows(renderer: Renderer) -> Table:
    """Errors of what is left of the light in three clouds, by method."""
    settings = [Settings(**changes) for changes in METHODS.values()]
    errors = [shadow_errors(renderer, make(), settings) for make in CLOUDS.values()]
    rows: list[tuple[Value, ...]] = [
        (name, *(value for cloud in errors for value in cloud[index])) for index, name in enumerate(METHODS)
    ]
    about = (
        "Error of the share of light that particles leave, at 3,000 places evenly along the light, against "
        "the exact product; 64 slices of 128 texels. blob: 20,000 particles, optical depth 2; sheets: three "
        "sheets thinner than a slice, optical depth 3; faint: 20,000 particles of alpha 1e-3."
    )
    columns = tuple(f"{name} {what}" for name in CLOUDS for what in ("max", "rms"))
    return Table("particle_shadows", about, ("method", *columns), rows)


def particle_shadow_slices(renderer: Renderer, count: int = 20_000, slices: Sequence[int] = SLICES) -> Table:
    """The same of the blob by the number of slices, and how much less than with half of them."""
    smooth = [Settings(particle_shadow_slices=number) for number in slices]
    stepped = [settings.with_changes(particle_shadow_interpolation=False) for settings in smooth]
    errors = [error for _, error in shadow_errors(renderer, blob(count), [*stepped, *smooth])]
    columns = errors[: len(slices)], errors[len(slices) :]
    rows: list[tuple[Value, ...]] = []
    for index, number in enumerate(slices):
        values: list[Value] = [f"{number}"]
        for column in columns:
            values += [column[index], column[index] / column[index - 1] if index else None]
        rows.append(tuple(values))
    about = (
        f"Root mean square error of the light in the blob of {count:,} particles by slices, in steps and "
        "interpolated, and its ratio to that of half as many."
    )
    return Table(
        "particle_shadow_slices", about, ("slices", "stepped", "ratio", "interpolated", "ratio"), rows
    )


def particle_shadow_cost(
    renderer: Renderer, counts: Sequence[int] = COUNTS, slices: Sequence[int] = SLICES, rounds: int = 5
) -> Table:
    """Time of a frame of smoke over that of the same without shadows, by method and by slices."""
    ways = {name: changes for name, changes in METHODS.items() if "stepped" not in name}
    ways |= {f"optical_depth, {number} slices": {"particle_shadow_slices": number} for number in slices}
    found: dict[str, list[Value]] = {name: [] for name in ways}
    for count in counts:
        scene = build_scene(find_scene("smoke"), particles=count)
        every = {"": Settings(particle_shadows="none")} | {name: Settings(**ways[name]) for name in ways}
        times: dict[str, list[float]] = {name: [] for name in every}
        for turn in range(rounds + 1):  # the first compiles
            for name, settings in every.items():
                renderer.settings = settings
                frame = renderer.draw(renderer.plan(scene, 0.0), read=False)
                if turn:
                    times[name].append(sum(frame.milliseconds.values()))
        for name in ways:
            ratios = [own / bare for own, bare in zip(times[name], times[""], strict=True)]
            found[name] += [statistics.median(ratios), quartile_spread(ratios)]
    about = (
        f"Time of a frame of the scene smoke at {renderer.size[0]}x{renderer.size[1]} over that of the same "
        f"frame without shadows, by method: median of {rounds} interleaved rounds, and their interquartile "
        "range over it. 64 slices where nothing else is said. They change from run to run."
    )
    columns = tuple(text for count in counts for text in (f"{count:,} particles", "spread"))
    return Table("particle_shadow_cost", about, ("method", *columns), [(name, *found[name]) for name in ways])


def particle_order(renderer: Renderer, count: int = 20_000) -> Table:
    """Codes by which pictures of smoke differ from one in exact order, and what sorting costs."""
    scene = build_scene(find_scene("smoke"), particles=count)
    exact = _codes(renderer, scene, Settings())
    rows: list[tuple[Value, ...]] = []
    others: dict[str, dict[str, Any]] = {
        "view, 4,096 slices": {"particle_order_depths": 4096},
        "view, 64 slices": {"particle_order_depths": 64},
        "half_angle": {"particle_order": "half_angle"},
        "unsorted": {"particle_order": "unsorted"},
    }
    for name, changes in others.items():
        difference = np.abs(_codes(renderer, scene, Settings(**changes)) - exact).max(axis=-1)
        rows.append((name, int(difference.max()), float(difference.mean()), float((difference > 2).mean())))
    about = (
        f"Display codes by which a picture of {count:,} particles in another order differs from the exact "
        "one: the largest, the mean, and the share of pixels that are off by more than 2."
    )
    return Table("particle_order", about, ("order", "max", "mean", "above 2"), rows)


def _codes(renderer: Renderer, scene: Any, settings: Settings) -> NDArray[np.int64]:
    renderer.settings = settings
    return np.asarray(renderer.render(scene, 3.0)["color"], dtype=np.int64)
