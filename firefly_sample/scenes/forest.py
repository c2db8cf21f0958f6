"""A forest clearing at night with fireflies and, if wanted, a thin mist: the scene plugin "forest"."""

from __future__ import annotations

from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.assets import model_path
from firefly_sample.memo import Memo
from firefly_sample.model.load import load_model
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, PointLights
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.parameter import KeyStep, Parameter
from firefly_sample.scene.particles import ParticleNode
from firefly_sample.scene.points import Sprites
from firefly_sample.scene.random import uniform
from firefly_sample.scene.scene import VerticalGradient
from firefly_sample.scenes.fireflies import Fireflies, FireflyState
from firefly_sample.scenes.forest_layout import CAMERA, SPECIES, ground_height, place_forest
from firefly_sample.scenes.plugin import (
    LiveScene,
    Plugin,
    find_part,
    seed_parameter,
    set_visible,
    switch,
    with_keys,
)

Float64 = NDArray[np.float64]

REACH = 25.0 * 1.1
"""Reach of the light of a firefly of size 1, in scene units, as in the original."""
EXPOSURE = (5.0, 4.1, 2.6)
"""The fireflies' light has the original's colours. Bark, leaves and earth reflect a tenth to a fifth of it:
exposed by about 4, one firefly lights them well, and where a dozen meet the tone curve still has room. Less
in the blue, as a warm white balance has it: else the nearly white lights would look cold."""
MOONLIGHT = (0.02, 0.0329, 0.0808)
"""The ambient light at `ambient` 1: faint and cool, so that a trunk reads against the sky and no more. Sky
and haze are lit by the same moon and go dark with it."""
SKY = VerticalGradient(horizon=(0.011, 0.02, 0.0519), zenith=(0.0008, 0.00195, 0.00923))

_DOT_RADIUS, _DOT_RADIANCE = 0.5, (0.84, 0.78, 0.654)
_GLOW_RADIUS, _GLOW_RADIANCE = 3.4, (0.021, 0.0183, 0.0115)
"""The insect: a small dot that burns out to white, in a wide faint glow as a camera would see it."""

_PARAMETERS = (
    seed_parameter("Which fireflies: every random number about firefly k comes from (seed, k)."),
    with_keys(
        Parameter("fireflies", int, 500, "How many fireflies; more never move the first ones.", 0, 100_000),
        KeyStep("up", 1.111, help="more fireflies"),
        KeyStep("down", 0.9, help="fewer fireflies"),
    ),
    with_keys(
        Parameter(
            "firefly_size",
            float,
            1.0,
            "Size of the fireflies: scales the dot and the reach of the light.",
            minimum=0.01,
            maximum=20.0,
        ),
        KeyStep("right", 1.111, help="bigger fireflies"),
        KeyStep("left", 0.9, help="smaller fireflies"),
    ),
    with_keys(
        Parameter(
            "ambient",
            float,
            1.0,
            "Brightness of the moonlight that comes from everywhere; 0 is black, as in Panda3D's sample.",
            minimum=0.0,
            maximum=20.0,
        ),
        KeyStep("m", 1.25, 0.02, help="more moonlight"),
        KeyStep("n", 0.8, -0.02, help="less moonlight"),
    ),
    switch(
        "mist",
        False,
        "A thin mist over the ground, lit by the fireflies and the moonlight.",
        "f",
        "mist on or off",
    ),
)


class _Swarm:
    """The fireflies as lights and as dots. It is called by nodes and refers to none, so there is no cycle."""

    def __init__(self, fireflies: Fireflies, size: float) -> None:
        self.fireflies, self.size = fireflies, size
        self._state: Memo[FireflyState] = Memo()

    def _at(self, time: float) -> FireflyState:
        """Return the state of the fireflies, which is computed once for lights and dots."""
        return self._state.get((self.fireflies, time), lambda: self.fireflies.at(time))

    def lights(self, time: float) -> tuple[Float64, Float64, Float64]:
        """Return positions, colours and radii of the lights."""
        state = self._at(time)
        return state.positions, state.colors, REACH * self.size * state.sizes

    def dots(self, time: float) -> tuple[Float64, Float64, Float64]:
        """Return positions, colours and radii of the dots: all bodies, then all glows."""
        state = self._at(time)
        sizes = self.size * state.sizes
        # a resting firefly is dim as well as small, or all dots would look the same from a distance
        brightness = state.colors * (0.25 + 0.75 * state.sizes)[:, None]
        return (
            np.concatenate([state.positions, state.positions]),
            np.concatenate([brightness * _DOT_RADIANCE, brightness * _GLOW_RADIANCE]),
            np.concatenate([_DOT_RADIUS * (0.4 * self.size + 0.6 * sizes), _GLOW_RADIUS * sizes]),
        )


class ForestScene(LiveScene):
    """The clearing, its trees and its fireflies; all parameters are live.

    Raises
    ------
    ModelError
        If a file in models/ is missing or damaged.
    """

    def __init__(self, **parameters: Any) -> None:
        # The original's lens, to its rounding at 4:3, and point of view; at other shapes its height stays.
        lens = PerspectiveLens(fov=(39.32, 30.0), near=50.0, far=500.0)
        lens.set_vfov(30.0)
        lens.set_aspect_ratio(None)
        super().__init__("forest", _PARAMETERS, parameters, lens, exposure=EXPOSURE)
        self.camera.set_pos_hpr(*CAMERA, 0.0, -7.5, 2.4)
        _plant(self.root)
        values = self.values
        self._swarm = _Swarm(Fireflies(values["seed"], values["fireflies"]), values["firefly_size"])
        self.root.attach_new_node(PointLights("fireflies", function=self._swarm.lights))
        self.root.attach_new_node(Sprites("insects", function=self._swarm.dots))
        self._haze = Sprites("haze")
        self._haze_path = self.root.attach_new_node(self._haze)
        self._mist_path = self.root.attach_new_node(ParticleNode("mist", function=mist_at, seed=MIST_SEED))
        self._moonlight = AmbientLight("moonlight")
        self.root.attach_new_node(self._moonlight)
        self.apply("mist")
        self.apply("ambient")

    @property
    def fireflies(self) -> Fireflies:
        """The fireflies of the current seed and number."""
        return self._swarm.fireflies

    def apply(self, name: str) -> None:
        """Put the new value of a parameter into effect."""
        if name == "ambient":
            self._set_ambient(self.values["ambient"])
        elif name == "mist":
            set_visible(self._mist_path, self.values["mist"])
        elif name == "firefly_size":
            self._swarm.size = self.values["firefly_size"]
        else:
            self._swarm.fireflies = Fireflies(self.values["seed"], self.values["fireflies"])

    def _set_ambient(self, ambient: float) -> None:
        positions, colors, radii = _haze()
        self._haze.set_arrays(positions, ambient * colors, radii)
        self._moonlight.set_color(_scaled(MOONLIGHT, ambient))
        self.background = VerticalGradient(_scaled(SKY.horizon, ambient), _scaled(SKY.zenith, ambient))
        set_visible(self._haze_path, ambient > 0.0)


scene = Plugin(
    "forest", "A forest clearing at night, lit by fireflies.", _PARAMETERS, ForestScene, "fireflies"
)


def _scaled(color: tuple[float, float, float], factor: float) -> tuple[float, float, float]:
    return (color[0] * factor, color[1] * factor, color[2] * factor)


def _plant(root: NodePath) -> None:
    """Add the terrain and every placement to `root`, as one node each that shares its model's Geoms."""
    load, find = cache(lambda file: load_model(model_path(f"{file}.glb"))), cache(find_part)
    root.attach_new_node(find(load("terrain"), "terrain"))
    groups = {kind: root.attach_new_node(kind) for kind in ("tree", "bush", "prop", "grass")}
    for placement in place_forest():
        species = SPECIES[placement.species]
        model = find(load(species.file), placement.species)
        path = groups[species.kind].attach_new_node(model.make_copy())
        path.set_pos_hpr_scale(
            *(placement.x, placement.y, placement.z),
            *(placement.heading, placement.pitch, placement.roll),
            *(placement.scale,) * 3,
        )


@cache
def _haze() -> tuple[Float64, Float64, Float64]:
    """Return soft balls of haze between the trees at the back."""
    count = 44
    u = uniform(1911, np.arange(4)[:, None], np.arange(count)[None, :])
    y = 60.0 + 190.0 * u[1]
    x = CAMERA[0] + (0.8 * u[0] - 0.4) * (y - CAMERA[1])
    radius = 22.0 + 22.0 * u[2]
    z = ground_height(x, y) + radius * (0.75 + 0.5 * u[3])
    return np.stack([x, y, z], axis=1), np.array((0.001, 0.00183, 0.00462)), radius


MIST_SEED = 1923
_MIST_COUNT = 800
_MIST_NEAR, _MIST_FAR = 70.0, 420.0
"""Distances from the camera at which the mist begins and ends."""
_MIST_ALPHA = 0.038
_MIST_COLOR = (0.42, 0.46, 0.5)


def mist_at(seed: int, time: float) -> tuple[Float64, Float64, float, tuple[float, float, float]]:
    """Return positions, radii, alpha and colour of the mist at `time` (seconds)."""
    x, y, height, radii, phase = _mist_banks(seed)
    x = x + 2.5 * np.sin(0.11 * time + phase)
    y = y + 1.5 * np.cos(0.083 * time + 2.0 * phase)
    height = height + 0.35 * np.sin(0.19 * time + 3.0 * phase)
    return np.stack([x, y, ground_height(x, y) + height], axis=1), radii, _MIST_ALPHA, _MIST_COLOR


@lru_cache(maxsize=1)
def _mist_banks(seed: int) -> tuple[Float64, ...]:
    u = uniform(seed, np.arange(5)[:, None], np.arange(_MIST_COUNT)[None, :])
    # equally dense in the picture at each distance: nearer banks are smaller
    away = _MIST_NEAR * (_MIST_FAR / _MIST_NEAR) ** u[1]
    y = CAMERA[1] + away
    x = CAMERA[0] + (0.84 * u[0] - 0.42) * away
    radii = (0.030 + 0.030 * u[3]) * away + 1.5
    return x, y, 0.32 * radii * u[2] + 0.3, radii, 2.0 * np.pi * u[4]
