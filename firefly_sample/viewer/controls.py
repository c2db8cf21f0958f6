"""Which key does what: the window's own keys, and those that a scene's parameters declare."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

from firefly_sample.errors import SceneError
from firefly_sample.scene.parameter import KeyStep, Parameter

NAMED_KEYS = {"up": "Up", "down": "Down", "left": "Left", "right": "Right", "escape": "Esc", "f1": "F1"}
"""Keys that have no letter or digit, and what is printed on them."""


@dataclass(frozen=True)
class Binding:
    """A key and what it does.

    Attributes
    ----------
    key : str
        A letter (lower case), a digit, or a name from `NAMED_KEYS`.
    help : str
        A few words.
    act : callable
    repeats : bool
        Whether it goes on acting while the key is held down.
    """

    key: str
    help: str
    act: Callable[[], None]
    repeats: bool = False


def parameter_bindings(
    scene: str,
    parameters: Iterable[Parameter],
    own: Iterable[Binding],
    step: Callable[[Parameter, KeyStep], None],
) -> list[Binding]:
    """A binding for each key that the parameters declare; `step` is called with parameter and key.

    Raises
    ------
    SceneError
        If there is no such key, it is taken by `own` bindings or by another parameter, or the parameter
        is text.
    """
    taken = {binding.key: binding.help for binding in own}
    bindings = []
    for parameter in parameters:
        for key in parameter.keys:
            name = key.key.lower()
            where = f"scene {scene!r}: parameter {parameter.name!r} wants the key {key.key!r}"
            if name not in NAMED_KEYS and not (len(name) == 1 and name.isascii() and name.isalnum()):
                raise SceneError(f"{where}, which must be a letter, a digit, or one of up, down, left, right")
            if parameter.type is str:
                raise SceneError(f"{where}, but it is text: keys change numbers and switches")
            if name in taken:
                raise SceneError(f"{where}, which is taken already ({taken[name]}): choose another")
            taken[name] = key.help or f"change {parameter.name}"
            # a scene that is built anew takes its time: one press, one scene
            repeats = parameter.live and parameter.type is not bool
            bindings.append(Binding(name, taken[name], partial(step, parameter, key), repeats))
    return bindings


def key_label(key: str) -> str:
    """What is printed on a key."""
    return NAMED_KEYS.get(key, key.upper())
