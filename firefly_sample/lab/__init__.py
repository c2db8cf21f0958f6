"""Measurements: the cost and the error of pictures, and the float64 reference.

Each name below is imported when it is first used: most of them need a renderer.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from firefly_sample.lab.captures import measure_captures
    from firefly_sample.lab.captures_growth import measure_growth
    from firefly_sample.lab.choice import choose
    from firefly_sample.lab.experiments import measure_numerics
    from firefly_sample.lab.fireflies import measure_fireflies
    from firefly_sample.lab.panda3d_speed import measure_panda3d
    from firefly_sample.lab.pyrender_speed import measure_pyrender
    from firefly_sample.lab.reference.cache import reference_frame
    from firefly_sample.lab.reference.frame import render_classic, render_reference
    from firefly_sample.lab.reference.raycast import cast_visibility
    from firefly_sample.lab.speed import measure_speed
    from firefly_sample.lab.stability import measure_stability
    from firefly_sample.lab.start import measure_start
    from firefly_sample.lab.trade import measure_trade

__all__ = [
    "cast_visibility",
    "choose",
    "measure_captures",
    "measure_fireflies",
    "measure_growth",
    "measure_numerics",
    "measure_panda3d",
    "measure_pyrender",
    "measure_speed",
    "measure_stability",
    "measure_start",
    "measure_trade",
    "reference_frame",
    "render_classic",
    "render_reference",
]

_MODULES = {
    "cast_visibility": "reference.raycast",
    "choose": "choice",
    "measure_captures": "captures",
    "measure_fireflies": "fireflies",
    "measure_growth": "captures_growth",
    "measure_numerics": "experiments",
    "measure_panda3d": "panda3d_speed",
    "measure_pyrender": "pyrender_speed",
    "measure_speed": "speed",
    "measure_stability": "stability",
    "measure_start": "start",
    "measure_trade": "trade",
    "reference_frame": "reference.cache",
    "render_classic": "reference.frame",
    "render_reference": "reference.frame",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, and keep it."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
