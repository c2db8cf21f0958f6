"""Panda3D's other spellings of methods.

Each public method ``set_pos`` of a class is also called ``setPos``; some pairs of methods are an attribute as
well: ``light.color = 1, 0, 0`` calls ``set_color``.
"""

from __future__ import annotations

from collections.abc import Iterable
from types import FunctionType
from typing import Any


class CamelCase:
    """Base of classes whose methods have Panda3D's camelCase names as well.

    The second name is the same function, put into the class when it is made, so that neither spelling costs
    anything. A subclass that overrides either overrides both. `dir` of an object lists the first spelling
    only. Attributes and properties have one spelling, as in Panda3D.
    """

    __slots__ = ()

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        bases = [vars(base) for base in reversed(cls.__mro__)]
        firsts = {name for base in bases for name in base if camel_case(name) != name}
        present: dict[str, Any] = {}
        wanted: dict[str, Any] = {}
        for base in bases:
            present.update(base)
            wanted.update(base)
            for first in firsts:
                second = camel_case(first)
                if (first in base) != (second in base):  # what overrides one spelling overrides both
                    wanted[first] = wanted[second] = base[first if first in base else second]
        for name, value in wanted.items():
            is_method = isinstance(value, FunctionType | classmethod | staticmethod)
            if is_method and present.get(name) is not value:
                setattr(cls, name, value)

    def __dir__(self) -> Iterable[str]:
        names = set(super().__dir__())
        return names - {camel_case(name) for name in names if camel_case(name) != name}


def camel_case(name: str) -> str:
    """Return Panda3D's second spelling of a method's name: "set_pos_hpr" is "setPosHpr".

    Names of one word, and those that begin with an underscore, have none, and are returned as they are.
    """
    if name.startswith("_"):
        return name
    first, *others = name.split("_")
    return first + "".join(part[:1].upper() + part[1:] for part in others)


def attribute(name: str, *, numbers: bool = False) -> Any:
    """Return the attribute of a class that reads by its method ``get_name`` and is set by ``set_name``.

    With `numbers`, a sequence is given to the method number by number.
    """

    def read(self: Any) -> Any:
        return getattr(self, f"get_{name}")()

    def write(self: Any, value: Any) -> None:
        several = numbers and hasattr(value, "__len__")
        getattr(self, f"set_{name}")(*(value if several else (value,)))

    return property(read, write, doc=f"The value of `get_{name}`; setting it calls `set_{name}`.")
