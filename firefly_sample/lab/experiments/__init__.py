"""The experiments of ``firefly measure numerics`` and ``firefly measure stability``, in modules by subject.

A module has a tuple `EXPERIMENTS`, and is named here.
"""

from __future__ import annotations

from firefly_sample.lab.experiments import (
    coordinates,
    depth,
    driver,
    gbuffer,
    lenses,
    lights,
    limits,
    particles,
    pictures,
    proxies,
    reach,
    shading,
    times,
    volumes,
)

_MODULES = (
    depth,
    lenses,
    coordinates,
    proxies,
    volumes,
    reach,
    lights,
    gbuffer,
    shading,
    driver,
    times,
    particles,
    pictures,
    limits,
)
_EXPERIMENTS = [experiment for module in _MODULES for experiment in module.EXPERIMENTS]

CASES = tuple(experiment for experiment in _EXPERIMENTS if experiment.bound is not None)
"""Experiments with a bound, in the order in which they are measured and shown."""
_TABLES = {experiment.name: experiment for experiment in _EXPERIMENTS if experiment.bound is None}
_ORDER = """
    depth normals highlights albedo conversions accumulation piles cutoff reach proxies depth_tests
    depth_clamp cones powers ndc far_from_origin filtering cost rates frames fragments
    particle_shadows particle_shadow_slices particle_shadow_cost particle_order
"""
TABLES = {name: _TABLES[name] for name in _ORDER.split()}
"""Experiments that are shown as tables, by name, in the order of docs/numerics.md."""
