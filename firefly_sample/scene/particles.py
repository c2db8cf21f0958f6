"""Particles: smoke, dust and mist as many small clouds that absorb light, scatter it and cast shadows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from firefly_sample.errors import SceneError, did_you_mean
from firefly_sample.scene.arrays import (
    Column,
    Float64,
    ReadOnlyArrays,
    as_numbers,
    checked_rows,
    outside,
    read_only,
)
from firefly_sample.scene.lights import DirectionalLight, Spotlight
from firefly_sample.scene.node import PandaNode
from firefly_sample.scene.random import check_seed
from firefly_sample.settings import to_number

ShadowLight = DirectionalLight | Spotlight
BlurKernel = Literal["box", "gaussian"]
Fading = Literal["none", "point", "plane"]

ParticleFunction = Callable[[int, float], tuple[ArrayLike, ArrayLike, ArrayLike, ArrayLike]]
"""``function(seed, time)``, time in seconds, returns (positions, radii, alphas, colors)."""

WIDEST_BLUR = 32.0
"""Largest blur in texels; a tile keeps a margin of this width around a cloud."""


@dataclass(frozen=True, eq=False)
class ParticleArrays(ReadOnlyArrays):
    """The state of n particles at one time.

    Positions are in the node's space. Radii are in scene units, 0 or more; the node's scale does not change
    them. Alphas are the opacity through the centre, 0 to 1. Colours are linear: the fraction of light that is
    scattered, 0 to 1.
    """

    positions: Float64  # shape (n, 3)
    radii: Float64  # shape (n,)
    alphas: Float64  # shape (n,)
    colors: Float64  # shape (n, 3)

    def __len__(self) -> int:
        return len(self.positions)


@dataclass(frozen=True)
class ParticleShadow:
    """The shadows that particles cast on each other, and on surfaces, in one light.

    Attributes
    ----------
    light : DirectionalLight or Spotlight
        Must be in the scene. Particle nodes with the same light shadow each other.
    blur : float
        Half-width of a blur across the light direction, in texels of a slice, 0 to 32. It makes shadows
        softer and less exact.
    kernel : {"box", "gaussian"}
        The blur's weights: equal ones, or those of a normal distribution that ends at twice its deviation.
    darkness : float
        Factor of each particle's optical depth, 0 or more; 1 is what its alpha says. If the setting
        `particle_shadows` adds alphas, it is a factor of the alpha.
    tint : float
        Fraction of a particle's colour left in its shadow, 0 to 1; at 1, a red particle absorbs no red.
    attenuation : {"none", "point", "plane"}
        Fade the light on particles, but not on surfaces, with their distance from the light, or from the
        plane through it across its direction: 1 / max(distance^power, 1), in addition to the light's own
        fading.
    power : float
        Power of that distance, 0 to 16.
    interpolate : bool
        Interpolate shadows between two slices by depth; otherwise they change in steps.
    show_texture : bool
        Draw the texture of slices into a corner of the picture: the slice nearest to the light is at the
        lower left, the farthest one in the top row.
    enabled : bool
        False turns the shadows off; the attenuation stays.

    Raises
    ------
    SceneError
        If a value is out of its range.
    """

    light: ShadowLight
    blur: float = 0.0
    kernel: BlurKernel = "box"
    darkness: float = 1.0
    tint: float = 0.0
    attenuation: Fading = "none"
    power: float = 2.0
    interpolate: bool = True
    show_texture: bool = False
    enabled: bool = True

    def __post_init__(self) -> None:
        if not isinstance(self.light, DirectionalLight | Spotlight):
            raise SceneError(
                "a particle shadow's light must be a DirectionalLight or a Spotlight, got "
                f"{type(self.light).__name__}"
            )
        where = f"particle shadow of light {self.light.name!r}"
        for name, high in (("blur", WIDEST_BLUR), ("darkness", 1e6), ("tint", 1.0), ("power", 16.0)):
            value = to_number(getattr(self, name))
            if not 0.0 <= value <= high:
                given = getattr(self, name)
                raise SceneError(f"{where}: {name} must be a number of 0 to {high:g}, got {given!r}")
            object.__setattr__(self, name, value)
        choices: dict[str, tuple[Any, ...]] = {
            "kernel": get_args(BlurKernel),
            "attenuation": get_args(Fading),
            **dict.fromkeys(("interpolate", "show_texture", "enabled"), (True, False)),
        }
        for name, allowed in choices.items():
            value = getattr(self, name)
            if value not in allowed or type(value) is not type(allowed[0]):
                shown = ", ".join(map(str, allowed))
                raise SceneError(f"{where}: {name} must be one of {shown}, got {value!r}")


class ParticleNode(PandaNode):
    """Any number of particles: small round clouds that always face the camera, or the light for shadows.

    A particle of opacity alpha has the optical depth t = -ln(1 - alpha) through its centre, and
    t (1 - (r/radius)^2)^2 at the distance r from it. It scatters light evenly in all directions: its radiance
    is its colour times the light that arrives at its centre. It has neither a normal nor highlights.

    Parameters
    ----------
    name : str
    positions, radii, alphas, colors : array_like
        Shapes (n, 3), (n,) or (), (n,) or (), and (n, 3) or (3,); a single value is used for every particle.
        Copied.
    function : callable, optional
        See `ParticleFunction`; it replaces the arrays. It is evaluated for each frame, and its result is not
        written back.
    seed : int
        The first argument of the function.

    Raises
    ------
    SceneError
        Also by the setters, if shapes disagree or a number is out of range; the message names the node and
        the index of the first bad entry.
    """

    def __init__(
        self,
        name: str,
        positions: ArrayLike = (),
        radii: ArrayLike = 1.0,
        alphas: ArrayLike = 0.1,
        colors: ArrayLike = (0.8, 0.8, 0.8),
        function: ParticleFunction | None = None,
        seed: int = 0,
    ) -> None:
        super().__init__(name)
        if function is not None and not callable(function):
            raise self._error(f"function must be callable, got {function!r}")
        self.function, self.seed = function, check_seed(seed)
        self.arrays = self._checked(positions, radii, alphas, colors)
        self._shadow: ParticleShadow | None = None
        self._sphere: tuple[tuple[float, float, float], float] | None = None

    def set_arrays(
        self, positions: ArrayLike, radii: ArrayLike, alphas: ArrayLike, colors: ArrayLike
    ) -> None:
        """Replace all particles; their number may change."""
        self.arrays = self._checked(positions, radii, alphas, colors)
        self.mark_changed()

    def evaluate(self, time: float) -> ParticleArrays:
        """Return the particles at `time` (seconds)."""
        if self.function is None:
            return self.arrays
        given = self.function(self.seed, time)
        if not (isinstance(given, tuple) and len(given) == 4):
            raise self._error(
                f"its function must return (positions, radii, alphas, colors), got {type(given).__name__}"
            )
        return self._checked(*given)

    def set_shadow(self, shadow: ParticleShadow | None) -> None:
        """Set the shadows of the particles; None turns them off."""
        if shadow is not None and not isinstance(shadow, ParticleShadow):
            raise self._error(f"a shadow is a ParticleShadow or None, got {shadow!r}")
        self._shadow = shadow
        self.mark_changed()

    def get_shadow(self) -> ParticleShadow | None:
        """Return the shadows of the particles, None if there are none."""
        return self._shadow

    def change_shadow(self, **changes: Any) -> None:
        """Change some of the shadow's attributes; there must be a shadow."""
        if self._shadow is None:
            raise SceneError(f"particles {self.name!r} cast no shadows: give them some with set_shadow")
        known = [field.name for field in fields(ParticleShadow)]
        for name in changes:
            if name not in known:
                hint = did_you_mean(name, known)
                raise self._error(f"a particle shadow has no {name!r}{hint}: it has {', '.join(known)}")
        self.set_shadow(replace(self._shadow, **changes))

    def set_bounding_sphere(self, radius: float | None, center: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        """Set a sphere that contains all particles; None computes one for each frame.

        The slices of the shadow divide this sphere, so a fixed one keeps them in place while particles move.
        A sphere that is too large wastes slices; particles outside it are shadowed as if they were on its
        surface, with a warning. The radius is above 0, in scene units, as the particles' radii; `center`,
        shape (3,), is in the node's space.
        """
        if radius is None:
            self._sphere = None
        else:
            what = f"particles {self.name!r}: the bounding sphere's center"
            expected = "three numbers up to 1e18"
            middle = as_numbers(what, center, SceneError, expected)
            size = to_number(radius)
            if not 0.0 < size <= 1e18:
                raise self._error(f"bounding radius must be a number above 0, at most 1e18, got {radius!r}")
            if middle.shape != (3,) or not (np.abs(middle) <= 1e18).all():
                raise SceneError(f"{what} must be {expected}, got {center!r}")
            x, y, z = middle.tolist()
            self._sphere = (x, y, z), size
        self.mark_changed()

    def get_bounding_sphere(self) -> tuple[tuple[float, float, float], float] | None:
        """Return the center and radius of the sphere that was set, None if it is computed for each frame."""
        return self._sphere

    def _error(self, message: str) -> SceneError:
        return SceneError(f"particles {self.name!r}: {message}")

    def _checked(
        self, positions: ArrayLike, radii: ArrayLike, alphas: ArrayLike, colors: ArrayLike
    ) -> ParticleArrays:
        columns: tuple[Column, ...] = (
            ("radii", radii, 0, (("radius is not 0 to 1e18", lambda r: ~((r >= 0.0) & (r <= 1e18))),)),
            ("alphas", alphas, 0, (("alpha is not 0 to 1", outside),)),
            ("colors", colors, 3, (("color is not 0 to 1", outside),)),
        )
        places, sizes, *shares = checked_rows(f"particles {self.name!r}", SceneError, positions, columns)
        return ParticleArrays(places, sizes, *(read_only(np.clip(share, 0.0, 1.0)) for share in shares))
