"""The keys: the window's own, those that a scene's parameters declare, and the help that lists them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

from firefly_sample.errors import SceneError
from firefly_sample.scene.parameter import KeyStep, Parameter
from firefly_sample.viewer.overlay import Pixels, Rows, Section, columns_plate

NAMED_KEYS = {"up": "Up", "down": "Down", "left": "Left", "right": "Right", "escape": "Esc", "f1": "F1"}
"""Keys that have no letter or digit, and their labels."""


@dataclass(frozen=True)
class Binding:
    """A key, help in a few words, and the key's action."""

    key: str
    """A letter (lower case), a digit, or a name from `NAMED_KEYS`."""
    help: str
    act: Callable[[], None]
    repeats: bool = False
    """True if the action repeats while the key is held down."""


def parameter_bindings(
    scene: str,
    parameters: Iterable[Parameter],
    own: Iterable[Binding],
    step: Callable[[Parameter, KeyStep], None],
) -> list[Binding]:
    """Return a binding for each key that the parameters declare; it calls `step` with parameter and key.

    A SceneError names a key that does not exist, that one of the window's own bindings or another parameter
    has taken, or that a parameter of text without choices declares.
    """
    taken = {binding.key: binding.help for binding in own}
    bindings = []
    for parameter in parameters:
        for key in parameter.keys:
            name = key.key.lower()
            where = f"scene {scene!r}: parameter {parameter.name!r} wants the key {key.key!r}"
            if name not in NAMED_KEYS and not (len(name) == 1 and name.isascii() and name.isalnum()):
                raise SceneError(f"{where}, which must be a letter, a digit, or one of up, down, left, right")
            if parameter.type is str and not parameter.choices:
                raise SceneError(f"{where}, but it is text: keys change numbers, switches and choices")
            if name in taken:
                raise SceneError(f"{where}, which is taken already ({taken[name]}): choose a different key")
            taken[name] = key.help or f"change {parameter.name}"
            # building a scene again is slow: one press, one scene
            repeats = parameter.live and parameter.type in (int, float)
            bindings.append(Binding(name, taken[name], partial(step, parameter, key), repeats))
    return bindings


def key_label(key: str) -> str:
    """Return the label of a key."""
    return NAMED_KEYS.get(key, key.upper())


def help_plate(
    scene: str,
    scene_keys: Iterable[Binding],
    own_keys: Iterable[Binding],
    driver: str,
    size: tuple[int, int],
    scale: float,
    drag_help: str = "",
) -> Pixels:
    """Return a plate that lists keys, mouse and driver, scaled down to fit a window of `size`.

    `drag_help` says what a drag with the right button does to the scene; empty if it moves the camera.
    """
    of_scene: Section = (f"Scene {scene}", _key_rows(scene_keys))
    window: Section = ("Window", _key_rows(own_keys))
    drags = ("Left drag", "orbit"), ("Right drag", drag_help or "pan"), ("Middle drag", "pan")
    mouse: Section = ("Mouse", (*drags, ("Wheel", "zoom in or out")))
    columns = ((of_scene,), (window, mouse)) if of_scene[1] else ((window,), (mouse,))
    plate = columns_plate(columns, driver, scale)
    fit = min(size[0] / plate.shape[1], size[1] / plate.shape[0])
    return plate if fit >= 1 else columns_plate(columns, driver, scale * fit)


def _key_rows(bindings: Iterable[Binding]) -> Rows:
    return tuple((key_label(binding.key), binding.help) for binding in bindings)
