"""Parameters of scenes; each declaration becomes an option, a configuration key, window keys and help."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from firefly_sample.errors import ParameterError, did_you_mean
from firefly_sample.settings import number_or_none, to_whole


@dataclass(frozen=True)
class KeyStep:
    """The change of a parameter by a key of the window; a bool is toggled.

    Attributes
    ----------
    key : str
        A letter, a digit, or "up", "down", "left" or "right".
    factor, add : float
        The new value is value * factor + add, at least one step away for integers, clamped to the range.
    help : str
        A few words for the help screen, for example "more fireflies".
    """

    key: str
    factor: float = 1.0
    add: float = 0.0
    help: str = ""


@dataclass(frozen=True)
class Parameter:
    """One parameter of a scene.

    Attributes
    ----------
    name : str
        A Python identifier; the command line shows it with dashes.
    type : {int, float, bool, str}
    default : value of that type
    help : str
        One sentence.
    minimum, maximum : float, optional
        Inclusive range of a number.
    choices : tuple of str
        The values of a text that has only a few; empty if it may be any.
    unit : str
        For help texts, for example "units" or "seconds".
    keys : tuple of KeyStep
        Keys of the window that change it.
    live : bool
        True if `Scene.set` changes it in a running scene; False if the scene must be rebuilt.
    """

    name: str
    type: type
    default: Any
    help: str
    minimum: float | None = None
    maximum: float | None = None
    unit: str = ""
    keys: tuple[KeyStep, ...] = ()
    live: bool = True
    choices: tuple[str, ...] = ()

    def check(self, value: Any, scene: str) -> Any:
        """Return `value` as this parameter's type; raise ParameterError if it is not one, or out of range."""
        where = f"scene {scene!r}: {self.name}"
        if self.type is bool:
            if not isinstance(value, bool) and getattr(value, "dtype", None) != "bool":
                raise ParameterError(f"{where} must be true or false, got {value!r}")
            return bool(value)
        if self.type is str:
            if not isinstance(value, str):
                raise ParameterError(f"{where} must be text, got {value!r}")
            if self.choices and value not in self.choices:
                hint = did_you_mean(value, self.choices)
                raise ParameterError(f"{where} must be one of {', '.join(self.choices)}, got {value!r}{hint}")
            return value
        found = number_or_none(value)
        number: float | int | None = found
        if self.type is int:
            number = to_whole(value)
            if number is None and found is not None and found.is_integer():
                number = int(found)
        if number is None:
            kind = "a whole number" if self.type is int else "a number"
            raise ParameterError(f"{where} must be {kind}, got {value!r}")
        if self.type is float and not math.isfinite(number):
            raise ParameterError(f"{where} must be finite, got {value!r}")
        if number != self._clamped(number):
            raise ParameterError(f"{where} must be {self.range_text()}, got {value!r}")
        return number

    def range_text(self) -> str:
        """Return the range in words, for example "between 0 and 20000"."""
        if self.minimum is not None and self.maximum is not None:
            return f"between {_exact(self.minimum)} and {_exact(self.maximum)}"
        if self.minimum is not None:
            return f"{_exact(self.minimum)} or more"
        if self.maximum is not None:
            return f"at most {_exact(self.maximum)}"
        return "any number"

    def step(self, value: Any, key: KeyStep) -> Any:
        """Return the value after one press of `key`, within the range; an integer changes by at least one.

        A text changes to the next of its choices, and from the last one to the first.
        """
        if self.type is bool:
            return not value
        if self.choices:
            return self.choices[(self.choices.index(value) + 1) % len(self.choices)]
        moved = value * key.factor + key.add
        if self.type is int:
            whole = round(moved)
            if whole == value:
                whole += 1 if (key.factor > 1 or key.add > 0) else -1
            moved = whole
        return self.type(self._clamped(moved))

    def _clamped(self, value: float) -> float:
        if self.minimum is not None:
            value = max(value, self.minimum)
        return value if self.maximum is None else min(value, self.maximum)


def _exact(bound: float) -> str:
    """Return a bound as text, whole numbers with all their digits."""
    whole = isinstance(bound, int) or (bound.is_integer() and abs(bound) < 1e15)
    return str(int(bound)) if whole else f"{bound:g}"


def resolve_parameters(scene: str, declared: tuple[Parameter, ...], given: dict[str, Any]) -> dict[str, Any]:
    """Return the value of every declared parameter: the given one, checked, or the default.

    Raise ParameterError if a given name is not declared or a value is wrong.
    """
    known = {parameter.name: parameter for parameter in declared}
    for name in given:
        if name not in known:
            raise ParameterError(
                f"scene {scene!r} has no parameter {name!r}: it has {', '.join(known) or 'none'}"
            )
    return {
        name: parameter.check(given[name], scene) if name in given else parameter.default
        for name, parameter in known.items()
    }
