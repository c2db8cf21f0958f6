"""A cloud of smoke over a floor, in a light that swings: the scene plugin "smoke"."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import ParameterError
from firefly_sample.scene.geom import Geom, GeomNode
from firefly_sample.scene.lens import PerspectiveLens
from firefly_sample.scene.lights import AmbientLight, DirectionalLight
from firefly_sample.scene.material import Material
from firefly_sample.scene.parameter import KeyStep, Parameter
from firefly_sample.scene.particles import ParticleNode, ParticleShadow
from firefly_sample.scene.scene import VerticalGradient
from firefly_sample.scenes.plugin import LiveScene, Plugin, seed_parameter, switch, with_keys
from firefly_sample.scenes.smoke_cloud import LARGEST_PUFF, REACH, Cloud

Float64 = NDArray[np.float64]

LIGHT = (2.1, 1.85, 1.5)
AMBIENT = (0.05, 0.065, 0.11)
"""Ambient light at `ambient` 1."""
SKY = VerticalGradient(horizon=(0.0072, 0.0095, 0.016), zenith=(0.0012, 0.0016, 0.004))
FLOOR = (0.30, 0.27, 0.25, 1.0)
FLOOR_HEIGHT, FLOOR_RADIUS = -1.4, 2.6
LIGHT_DISTANCE = 2.3
"""Distance of the light's node from the centre, from where its attenuation counts."""
VIEW = (0.0, -8.4, 2.5)
"""Position of the camera at a ratio of 1."""
FOCUS = (0.0, 0.0, -0.52)
SWING_SECONDS = 16.0

_PARAMETERS = (
    seed_parameter("Which puffs: every random number about puff k comes from (seed, k)."),
    with_keys(
        Parameter(
            "particles",
            int,
            20_000,
            "How many puffs the cloud has; more never move the first ones.",
            minimum=0,
            maximum=1_000_000,
        ),
        KeyStep("up", 1.25, help="more puffs"),
        KeyStep("down", 0.8, help="fewer puffs"),
    ),
    Parameter("particle_size", float, 1.0, "Size of the puffs.", 0.1, 10.0),
    Parameter("particle_alpha", float, 0.12, "Opacity of a puff through its centre.", 0.0, 1.0),
    with_keys(
        Parameter(
            "morph",
            float,
            0.0,
            "Shape of the cloud, from a heap (0) to a knot (1); with morphing, it returns to this shape.",
            0.0,
            1.0,
        ),
        KeyStep("2", 1.0, 0.1, help="more of a knot"),
        KeyStep("1", 1.0, -0.1, help="more of a heap"),
    ),
    switch(
        "morphing",
        True,
        "Let the cloud move on to the knot and back over time; otherwise it stays at morph.",
        "z",
        "morphing on or off",
    ),
    with_keys(
        Parameter(
            "ambient",
            float,
            1.0,
            "Brightness of the sky's light, which reaches all puffs and the floor, in shadow too.",
            minimum=0.0,
            maximum=100.0,
        ),
        KeyStep("l", 1.25, 0.05, help="more ambient light"),
        KeyStep("y", 0.8, -0.05, help="less ambient light"),
    ),
    switch("shadows", True, "Let puffs shadow each other and the floor.", "h", "shadows on or off"),
    with_keys(
        Parameter("shadow_blur", float, 0.0, "Half-width of the shadow's blur.", 0.0, 32.0, "texels"),
        KeyStep("b", 1.25, 0.5, help="more blur"),
        KeyStep("g", 0.8, -0.5, help="less blur"),
    ),
    Parameter("shadow_kernel", str, "box", "The blur's weights: box or gaussian."),
    with_keys(
        Parameter("shadow_darkness", float, 1.0, "Factor of the light that each puff absorbs.", 0.0, 100.0),
        KeyStep("d", 1.25, help="darker shadows"),
        KeyStep("f", 0.8, help="lighter shadows"),
    ),
    with_keys(
        Parameter(
            "shadow_tint", float, 0.0, "Fraction of the puffs' colour that is left in their shadow.", 0.0, 1.0
        ),
        KeyStep("c", 1.0, 0.1, help="more tint"),
        KeyStep("x", 1.0, -0.1, help="less tint"),
    ),
    with_keys(
        Parameter(
            "light_angle",
            float,
            32.0,
            "Angle between the light's direction and straight down.",
            minimum=0.0,
            maximum=85.0,
            unit="degrees",
        ),
        KeyStep("right", 1.0, 2.0, help="light lower"),
        KeyStep("left", 1.0, -2.0, help="light higher"),
    ),
    with_keys(
        Parameter(
            "light_heading",
            float,
            50.0,
            "Which side the light comes from, seen from above; 0 is behind the cloud.",
            minimum=-180.0,
            maximum=180.0,
            unit="degrees",
        ),
        KeyStep("m", 1.0, 5.0, help="light around"),
        KeyStep("n", 1.0, -5.0, help="light back around"),
    ),
    with_keys(
        Parameter("swing", float, 60.0, "How far the light swings to both sides.", 0.0, 180.0, "degrees"),
        KeyStep("w", 1.0, 10.0, help="wider swing"),
        KeyStep("q", 1.0, -10.0, help="narrower swing"),
    ),
    with_keys(
        Parameter("camera_ratio", float, 1.0, "How far away the camera is: a factor.", 0.3, 10.0),
        KeyStep("k", 0.9, help="nearer"),
        KeyStep("j", 1.111, help="farther"),
    ),
    switch(
        "use_attenuation",
        False,
        "Let the light fade on puffs by their distance from it.",
        "a",
        "attenuation on or off",
    ),
    Parameter(
        "attenuation",
        str,
        "plane",
        "The distance by which the light fades is that from the light's plane, or its point: plane or point.",
    ),
    Parameter("attenuation_power", float, 2.0, "Power of that distance by which the light fades.", 0.0, 16.0),
    switch(
        "use_interpolation",
        True,
        "Interpolate shadows between two slices by depth.",
        "i",
        "interpolation on or off",
    ),
    with_keys(
        Parameter(
            "bounding_radius",
            float,
            REACH,
            "Radius of a sphere around the centres of all puffs, which slices divide; "
            "0 computes it per frame.",
            minimum=0.0,
            maximum=20.0,
        ),
        KeyStep("o", 1.25, help="larger bounding sphere"),
        KeyStep("u", 0.8, help="smaller one"),
    ),
    switch(
        "show_texture",
        False,
        "Show the shadow's slices in a corner: the nearest to the light lower left, the last upper right.",
        "e",
        "show the slices",
    ),
)
_CHOICES = {"shadow_kernel": ("box", "gaussian"), "attenuation": ("plane", "point")}


class SmokeScene(LiveScene):
    """The cloud, its floor and its light; all parameters are live."""

    drag_help = "turn the light"

    def __init__(self, **parameters: Any) -> None:
        lens = PerspectiveLens(vfov=30.0, near=0.1, far=200.0)
        super().__init__("smoke", _PARAMETERS, parameters, lens, background=SKY, exposure=1.15, focus=FOCUS)
        self.root.attach_new_node(_floor())
        self._sky = AmbientLight("sky", AMBIENT)
        self.root.attach_new_node(self._sky)
        self._light = DirectionalLight("light", LIGHT)
        self._light_path = self.root.attach_new_node(self._light)
        self._particles = ParticleNode("cloud")
        self.root.attach_new_node(self._particles)
        self._updated: float | None = None
        for name in ("particles", "ambient", "camera_ratio"):
            self.apply(name)

    def apply(self, name: str) -> None:
        """Put the new value of a parameter into effect."""
        values = self.values
        if name in ("seed", "particles", "particle_size", "particle_alpha"):
            self._cloud = Cloud(
                values["seed"], values["particles"], values["particle_size"], values["particle_alpha"]
            )
            self._set_function()
            self._set_shadow()
        elif name in ("morph", "morphing"):
            self._set_function()
        elif name == "ambient":
            self._sky.set_color(values["ambient"] * np.array(AMBIENT))
        elif name == "camera_ratio":
            middle = np.array(FOCUS)
            self.camera.set_pos(*(middle + values["camera_ratio"] * (np.array(VIEW) - middle)))
            self.camera.look_at(*FOCUS)
        elif name in ("light_angle", "light_heading", "swing"):
            self._updated = None
        else:
            self._set_shadow()

    def drag(self, right: float, down: float) -> dict[str, Any]:
        """Turn the light by a drag of the mouse, in window heights, and return the changed parameters."""
        heading = self.values["light_heading"] + 180.0 * right
        angle = self.values["light_angle"] + 90.0 * down
        turned = {
            "light_heading": (heading + 180.0) % 360.0 - 180.0,
            "light_angle": min(max(angle, 0.0), 85.0),
        }
        for name, value in turned.items():
            self.set(name, value)
        return turned

    def update(self, time: float) -> None:
        """Set the light's direction at `time`."""
        if time == self._updated:
            return
        values = self.values
        turned = values["light_heading"] + values["swing"] * math.sin(2.0 * math.pi * time / SWING_SECONDS)
        angle, heading = math.radians(values["light_angle"]), math.radians(turned)
        # from the centre to the light
        side = math.sin(angle)
        direction = np.array([side * math.sin(heading), side * math.cos(heading), math.cos(angle)])
        self._light_path.set_pos(*(LIGHT_DISTANCE * direction))
        self._light.set_direction(-direction)
        self._updated = time

    def _set_function(self) -> None:
        self._particles.function = partial(_puffs, self._cloud, self.values["morph"], self.values["morphing"])
        self._particles.mark_changed()

    def _set_shadow(self) -> None:
        values = self.values
        for name, choices in _CHOICES.items():
            if values[name] not in choices:
                raise ParameterError(
                    f"scene 'smoke': {name} must be {' or '.join(choices)}, got {values[name]!r}"
                )
        self._particles.set_shadow(
            ParticleShadow(
                self._light,
                blur=values["shadow_blur"],
                kernel=values["shadow_kernel"],
                darkness=values["shadow_darkness"],
                tint=values["shadow_tint"],
                attenuation=values["attenuation"] if values["use_attenuation"] else "none",
                power=values["attenuation_power"],
                interpolate=values["use_interpolation"],
                show_texture=values["show_texture"],
                enabled=values["shadows"],
            )
        )
        radius = values["bounding_radius"]
        whole = radius + LARGEST_PUFF * values["particle_size"]
        self._particles.set_bounding_sphere(whole if radius else None)


def _puffs(
    cloud: Cloud, morph: float, morphing: bool, _: int, time: float
) -> tuple[Float64, Float64, float, Float64]:
    """Return the particles at `time`. It refers to no node, so there is no cycle."""
    return cloud.at(time, morph, morphing)


scene = Plugin(
    "smoke",
    "A cloud of smoke that shadows itself and the floor, in a light that swings.",
    _PARAMETERS,
    SmokeScene,
)


def _floor() -> GeomNode:
    """Return a round slab."""
    sides = 128
    angle = 2.0 * math.pi * np.arange(sides) / sides
    rim = np.stack([FLOOR_RADIUS * np.cos(angle), FLOOR_RADIUS * np.sin(angle)], axis=1)
    index = np.arange(sides)
    following = (index + 1) % sides
    top = np.column_stack([rim, np.full(sides, FLOOR_HEIGHT)])
    low = np.column_stack([rim, np.full(sides, FLOOR_HEIGHT - 0.16)])
    vertices = np.concatenate([[(0.0, 0.0, FLOOR_HEIGHT)], top, top, low])
    up, out = np.array([(0.0, 0.0, 1.0)]), np.column_stack([np.cos(angle), np.sin(angle), np.zeros(sides)])
    normals = np.concatenate([up, np.repeat(up, sides, axis=0), out, out])
    upper, lower = 1 + sides + index, 1 + 2 * sides + index
    next_upper, next_lower = 1 + sides + following, 1 + 2 * sides + following
    triangles = np.concatenate(
        [
            np.column_stack([np.zeros(sides, dtype=int), 1 + index, 1 + following]),
            np.column_stack([lower, next_lower, next_upper]),
            np.column_stack([lower, next_upper, upper]),
        ]
    )
    node = GeomNode("floor")
    node.add_geom(Geom(vertices, triangles, normals, name="floor"), Material("floor", FLOOR))
    return node
