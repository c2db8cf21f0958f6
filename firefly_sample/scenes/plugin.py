"""Parts that this package's scenes share: the plugin, its parameters, their live changes, and helpers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firefly_sample.errors import ModelError, ParameterError, SceneError, SettingsError
from firefly_sample.scene.geom import GeomNode
from firefly_sample.scene.lens_base import Lens
from firefly_sample.scene.nodepath import NodePath
from firefly_sample.scene.parameter import KeyStep, Parameter, resolve_parameters
from firefly_sample.scene.scene import START_TIME, Camera, Scene, ScenePlugin
from firefly_sample.settings import SETTINGS, Settings

Float64 = NDArray[np.float64]


@dataclass(frozen=True)
class Plugin:
    """The object that an entry point names: see `firefly_sample.scene.scene.ScenePlugin`."""

    name: str
    summary: str
    parameters: tuple[Parameter, ...]
    build: Callable[..., Scene]
    lights_parameter: str | None = None
    start_time: float = START_TIME
    folder: str | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)


def start_time(plugin: ScenePlugin) -> float:
    """Return the time of a scene's frame 0 in seconds."""
    return float(getattr(plugin, "start_time", START_TIME))


def folder_name(plugin: ScenePlugin) -> str:
    """Return the name of the default folder for what is made of a scene, and the start of names of files."""
    return getattr(plugin, "folder", None) or plugin.name


def scene_settings(plugin: ScenePlugin, given: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return changes of the default settings: a scene's own, and on top of them those that are `given`.

    A setting of the scene gives way to a given one that contradicts it.

    Raises
    ------
    SceneError
        If the plugin's attribute ``settings`` is no mapping, or has a wrong name or value.
    """
    own, changes = getattr(plugin, "settings", {}), dict(given or {})
    if not isinstance(own, Mapping):
        raise SceneError(f"scene {plugin.name!r}: its attribute 'settings' must be a dict, got {own!r}")
    try:
        Settings(**own)
    except (SettingsError, TypeError) as error:  # TypeError: a name that is no text
        raise SceneError(f"scene {plugin.name!r}: in its attribute 'settings', {error}") from error
    fitting = {name: own[name] for name in own if SETTINGS[name].broken_limit(own[name], changes) is None}
    return fitting | changes


def lights_parameter(plugin: ScenePlugin) -> Parameter | None:
    """Return the parameter for the number of lights of a scene.

    It is the one that the plugin's attribute ``lights_parameter`` names, or else a whole number called
    "lights"; None if there is neither.

    Raises
    ------
    SceneError
        If the attribute names no parameter that is a whole number.
    """
    named = getattr(plugin, "lights_parameter", None)
    for parameter in plugin.parameters:
        if parameter.name == (named or "lights") and parameter.type is int:
            return parameter
    if named is None:
        return None
    raise SceneError(
        f"scene {plugin.name!r}: lights_parameter must name a parameter that is a whole number, got {named!r}"
    )


def seed_parameter(text: str, live: bool = True) -> Parameter:
    """Return the parameter for a scene's seed, with this help text."""
    return Parameter("seed", int, 7, text, minimum=0, maximum=2**63 - 1, live=live)


def with_keys(parameter: Parameter, *keys: KeyStep) -> Parameter:
    """Return a parameter that these keys of the window change."""
    return replace(parameter, keys=keys)


def switch(name: str, default: bool, text: str, key: str, key_help: str) -> Parameter:
    """Return a parameter that is on or off, toggled by one key of the window."""
    return Parameter(name, bool, default, text, keys=(KeyStep(key, help=key_help),))


class LiveScene(Scene):
    """A scene with a camera, which checks its parameters and keeps them in `values`.

    Parameters
    ----------
    name : str
        The name of the plugin and of the root.
    declared : tuple of Parameter
    given : dict
        Values of parameters; the others have their defaults.
    lens : Lens
        The camera's.
    look
        `background`, `exposure` and `focus`: see `Scene`.
    """

    def __init__(
        self, name: str, declared: tuple[Parameter, ...], given: dict[str, Any], lens: Lens, **look: Any
    ) -> None:
        root = NodePath(name)
        super().__init__(root, root.attach_new_node(Camera("camera", lens)), **look)
        self.name, self.declared = name, declared
        self.values = resolve_parameters(name, declared, given)

    def apply(self, name: str) -> None:
        """Put the new value of a live parameter into effect, or raise a `SceneError` and change nothing."""
        raise NotImplementedError

    def set(self, name: str, value: Any) -> None:
        """Change a parameter of the running scene.

        Raises
        ------
        ParameterError
            If there is no such parameter, it is not live, or the value is wrong.
        """
        live = {parameter.name: parameter for parameter in self.declared if parameter.live}
        if name not in live:
            all_live = len(live) == len(self.declared)
            kind, rest = ("", "") if all_live else ("live ", "; the others need a new scene")
            raise ParameterError(
                f"scene {self.name!r} has no {kind}parameter {name!r}: it has {', '.join(live)}{rest}"
            )
        before = self.values
        self.values = before | {name: live[name].check(value, self.name)}
        try:
            self.apply(name)
        except BaseException:
            self.values = before
            raise


def find_part(file: NodePath, name: str) -> GeomNode:
    """Return all Geoms at and below the node `name` of a loaded model, as one node to copy.

    Their materials become Phong ones of the same colours and textures.

    Raises
    ------
    ModelError
        If there is no such node; the message names file and node.
    """
    part = file.find(f"**/{name}")
    if part.is_empty():
        raise ModelError(
            f"model {file.get_name()}.glb: has no node {name!r}: make it again with models/make_models.py"
        )
    merged = GeomNode(name)
    for path in [part, *part.find_all_matches("**")]:
        node = path.node()
        if isinstance(node, GeomNode):
            for geom, material in node.geoms:
                if material.metallic is not None:
                    material.set_metallic(None)
                merged.add_geom(geom, material)
    return merged


def set_visible(path: NodePath, visible: bool) -> None:
    """Show or hide `path` and everything below it."""
    if visible:
        path.show()
    else:
        path.hide()


def sphere_directions(u: Float64, v: Float64) -> Float64:
    """Return unit vectors, shape (n, 3), distributed evenly if `u` and `v` are: z is uniform on -1..1."""
    height, angle = 2.0 * u - 1.0, 2.0 * math.pi * v
    flat = np.sqrt(1.0 - height**2)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), height], axis=1)


def hue_colors(hue: Float64, saturation: Float64) -> Float64:
    """Return linear colours, shape (n, 3), whose largest channel is 1, from hue and saturation in 0..1."""
    # the closed form of hue: f(n) = 1 - s max(0, min(q, 4 - q, 1)), q = (n + 6 h) mod 6
    q = (np.array([5.0, 3.0, 1.0]) + 6.0 * hue[:, None]) % 6.0
    fall = np.clip(np.minimum(q, 4.0 - q), 0.0, 1.0)
    return np.asarray(1.0 - saturation[:, None] * fall)
